!  The inextensible ribbon, equations (7) and (9) of Audoly & Seffen (2015), in closed form: H = c^2 / 2 with
!  c = nu kappa_n + a, a = (p + r) / 2, p = M1 + (1 - nu) kappa_n, r = sqrt(p^2 + M3^2). Units: B = 1, L = 2 pi.
MODULE RIBBON
  IMPLICIT NONE
  DOUBLE PRECISION, PARAMETER :: PI = 3.14159265358979323846264338327950288D0
CONTAINS

  !  Strains w1 = dH/dM1 and w3 = dH/dM3 (w2 = 0), and their derivatives dw(strain, [M1, M3, kappa_n]).
  SUBROUTINE STRAINS(M1, M3, KAPPA, NU, W1, W3, DW)
    DOUBLE PRECISION, INTENT(IN) :: M1, M3, KAPPA, NU
    DOUBLE PRECISION, INTENT(OUT) :: W1, W3, DW(2, 3)
    DOUBLE PRECISION :: P, R, A, C, AP, A3, APP, AP3, A33, CK
    P = M1 + (1 - NU) * KAPPA
    R = SQRT(P * P + M3 * M3)
    A = (P + R) / 2
    C = NU * KAPPA + A
    AP = A / R
    A3 = M3 / (2 * R)
    APP = M3 * M3 / (2 * R**3)
    AP3 = -P * M3 / (2 * R**3)
    A33 = P * P / (2 * R**3)
    CK = NU + AP * (1 - NU)
    W1 = C * AP
    W3 = C * A3
    DW(1, 1) = AP * AP + C * APP
    DW(1, 2) = A3 * AP + C * AP3
    DW(2, 1) = DW(1, 2)
    DW(2, 2) = A3 * A3 + C * A33
    DW(1, 3) = CK * AP + C * APP * (1 - NU)
    DW(2, 3) = CK * A3 + C * AP3 * (1 - NU)
  END SUBROUTINE STRAINS

  !  Directors: D(:, i) holds the lab components of d_i for the quaternion Q, and DD(:, i, j) their derivatives by q_j.
  SUBROUTINE DIRECTORS(Q, D, DD)
    DOUBLE PRECISION, INTENT(IN) :: Q(0:3)
    DOUBLE PRECISION, INTENT(OUT) :: D(3, 3), DD(3, 3, 0:3)
    D(:, 1) = (/ Q(0)**2 + Q(1)**2 - Q(2)**2 - Q(3)**2, 2 * (Q(1)*Q(2) + Q(0)*Q(3)), 2 * (Q(1)*Q(3) - Q(0)*Q(2)) /)
    D(:, 2) = (/ 2 * (Q(1)*Q(2) - Q(0)*Q(3)), Q(0)**2 - Q(1)**2 + Q(2)**2 - Q(3)**2, 2 * (Q(2)*Q(3) + Q(0)*Q(1)) /)
    D(:, 3) = (/ 2 * (Q(1)*Q(3) + Q(0)*Q(2)), 2 * (Q(2)*Q(3) - Q(0)*Q(1)), Q(0)**2 - Q(1)**2 - Q(2)**2 + Q(3)**2 /)
    DD(:, 1, 0) = 2 * (/ Q(0), Q(3), -Q(2) /)
    DD(:, 1, 1) = 2 * (/ Q(1), Q(2), Q(3) /)
    DD(:, 1, 2) = 2 * (/ -Q(2), Q(1), -Q(0) /)
    DD(:, 1, 3) = 2 * (/ -Q(3), Q(0), Q(1) /)
    DD(:, 2, 0) = 2 * (/ -Q(3), Q(0), Q(1) /)
    DD(:, 2, 1) = 2 * (/ Q(2), -Q(1), Q(0) /)
    DD(:, 2, 2) = 2 * (/ Q(1), Q(2), Q(3) /)
    DD(:, 2, 3) = 2 * (/ -Q(0), -Q(3), Q(2) /)
    DD(:, 3, 0) = 2 * (/ Q(2), -Q(1), Q(0) /)
    DD(:, 3, 1) = 2 * (/ Q(3), -Q(0), -Q(1) /)
    DD(:, 3, 2) = 2 * (/ Q(0), Q(3), -Q(2) /)
    DD(:, 3, 3) = 2 * (/ Q(1), Q(2), Q(3) /)
  END SUBROUTINE DIRECTORS

  !  Rates of the quaternion by the strains, F1 = dq'/dw1 and F3 = dq'/dw3 (w2 = 0), and S = dq'/dq at these strains.
  SUBROUTINE SPIN(Q, W1, W3, LENGTH, F1, F3, S)
    DOUBLE PRECISION, INTENT(IN) :: Q(0:3), W1, W3, LENGTH
    DOUBLE PRECISION, INTENT(OUT) :: F1(0:3), F3(0:3), S(0:3, 0:3)
    DOUBLE PRECISION :: H
    H = LENGTH / 2
    F1 = H * (/ -Q(1), Q(0), Q(3), -Q(2) /)
    F3 = H * (/ -Q(3), Q(2), -Q(1), Q(0) /)
    S(0, :) = H * (/ 0D0, -W1, 0D0, -W3 /)
    S(1, :) = H * (/ W1, 0D0, W3, 0D0 /)
    S(2, :) = H * (/ 0D0, -W3, 0D0, W1 /)
    S(3, :) = H * (/ W3, 0D0, -W1, 0D0 /)
  END SUBROUTINE SPIN

  !  The full description, equations (1)-(4): u = (M1 M2 M3 R1 R2 R3 q0 q1 q2 q3 x1 x2 x3), u' = F; with IJAC > 0 also
  !  FU = dF/du and FK = dF/dkappa_n.
  SUBROUTINE RATES(U, KAPPA, NU, LENGTH, IJAC, F, FU, FK)
    DOUBLE PRECISION, INTENT(IN) :: U(13), KAPPA, NU, LENGTH
    INTEGER, INTENT(IN) :: IJAC
    DOUBLE PRECISION, INTENT(OUT) :: F(13)
    DOUBLE PRECISION, INTENT(INOUT) :: FU(13, 13), FK(13)
    DOUBLE PRECISION :: W1, W3, DW(2, 3), D(3, 3), DD(3, 3, 4), F1(13), F3(13), S(4, 4)
    INTEGER :: J
    CALL STRAINS(U(1), U(3), KAPPA, NU, W1, W3, DW)
    CALL DIRECTORS(U(7:10), D, DD)
    CALL SPIN(U(7:10), W1, W3, LENGTH, F1(7:10), F3(7:10), S)
    F1(1:6) = LENGTH * (/ 0D0, U(3), -U(2), 0D0, U(6), -U(5) /)
    F3(1:6) = LENGTH * (/ U(2), -U(1), 0D0, U(5), -U(4), 0D0 /)
    F1(11:13) = 0
    F3(11:13) = 0
    F = F1 * W1 + F3 * W3
    F(1) = F(1) + LENGTH * U(5)
    F(2) = F(2) - LENGTH * U(4)
    F(11:13) = LENGTH * D(:, 3)
    IF (IJAC == 0) RETURN
    FU = 0
    FU(1, 2) = LENGTH * W3
    FU(2, 1) = -LENGTH * W3
    FU(2, 3) = LENGTH * W1
    FU(3, 2) = -LENGTH * W1
    FU(4:6, 4:6) = FU(1:3, 1:3)
    FU(1, 5) = LENGTH
    FU(2, 4) = -LENGTH
    FU(7:10, 7:10) = S
    DO J = 1, 4
      FU(11:13, 6 + J) = LENGTH * DD(:, 3, J)
    END DO
    FU(:, 1) = FU(:, 1) + F1 * DW(1, 1) + F3 * DW(2, 1)
    FU(:, 3) = FU(:, 3) + F1 * DW(1, 2) + F3 * DW(2, 2)
    FK = F1 * DW(1, 3) + F3 * DW(2, 3)
  END SUBROUTINE RATES

END MODULE RIBBON
