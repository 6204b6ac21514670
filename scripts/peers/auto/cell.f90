!  The cell [0, L/8] of the branch (1, 2): a quarter wave with R = 0, frame only. PAR(1) = kappa_n, PAR(2) = nu, PAR(3) = M2(0),
!  PAR(4) = M1(0): the moment at S = 0, constant in space.
      SUBROUTINE FUNC(NDIM, U, ICP, PAR, IJAC, F, DFDU, DFDP)
      USE RIBBON
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), IJAC
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM, NDIM), DFDP(NDIM, *)
      DOUBLE PRECISION :: D(3, 3), DD(3, 3, 4), W1, W3, DW(2, 3), F1(4), F3(4), S(4, 4), M1, M3, G1(4), G3(4)
      INTEGER :: J
      CALL DIRECTORS(U, D, DD)
      M1 = D(1, 1) * PAR(4) + D(2, 1) * PAR(3)
      M3 = D(1, 3) * PAR(4) + D(2, 3) * PAR(3)
      CALL STRAINS(M1, M3, PAR(1), PAR(2), W1, W3, DW)
      CALL SPIN(U, W1, W3, PI / 4, F1, F3, S)
      F = F1 * W1 + F3 * W3
      IF (IJAC == 0) RETURN
      G1 = F1 * DW(1, 1) + F3 * DW(2, 1)
      G3 = F1 * DW(1, 2) + F3 * DW(2, 2)
      DO J = 1, 4
         DFDU(:, J) = S(:, J) + G1 * (DD(1, 1, J) * PAR(4) + DD(2, 1, J) * PAR(3)) &
                    + G3 * (DD(1, 3, J) * PAR(4) + DD(2, 3, J) * PAR(3))
      END DO
      IF (IJAC < 2) RETURN
      DFDP(:, 1) = F1 * DW(1, 3) + F3 * DW(2, 3)
      DFDP(:, 4) = G1 * D(1, 1) + G3 * D(1, 3)
      DFDP(:, 3) = G1 * D(2, 1) + G3 * D(2, 3)
      END SUBROUTINE FUNC

!     The planar circle at kappa_n = 2.3.
      SUBROUTINE STPNT(NDIM, U, PAR, T)
      USE RIBBON
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(IN) :: T
      PAR(1:4) = (/ 2.3D0, 0.3D0, 0D0, -1.3D0 /)
      U = (/ COS(PI * T / 8), SIN(PI * T / 8), 0D0, 0D0 /)
      END SUBROUTINE STPNT

!     The frame at S = 0; at the other end d2 is normal to the moment, and has turned about it by pi/4.
      SUBROUTINE BCND(NDIM, PAR, ICP, NBC, U0, U1, FB, IJAC, DBC)
      USE RIBBON
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), NBC, IJAC
      DOUBLE PRECISION, INTENT(IN) :: PAR(*), U0(NDIM), U1(NDIM)
      DOUBLE PRECISION, INTENT(OUT) :: FB(NBC)
      DOUBLE PRECISION, INTENT(INOUT) :: DBC(NBC, *)
      DOUBLE PRECISION :: D(3, 3), DD(3, 3, 4), MU, C
      INTEGER :: I
      CALL DIRECTORS(U1, D, DD)
      C = SQRT(0.5D0)
      MU = -SQRT(PAR(4)**2 + PAR(3)**2)
      FB(1:4) = U0
      FB(1) = U0(1) - 1
      FB(5) = D(1, 2) * PAR(4) + D(2, 2) * PAR(3)
      FB(6) = C * D(3, 2) * MU - C * (D(2, 2) * PAR(4) - D(1, 2) * PAR(3))
      IF (IJAC == 0) RETURN
      DBC(:, 1:2 * NDIM + 4) = 0
      DO I = 1, 4
         DBC(I, I) = 1
      END DO
      DBC(5, NDIM + 1:NDIM + 4) = DD(1, 2, :) * PAR(4) + DD(2, 2, :) * PAR(3)
      DBC(6, NDIM + 1:NDIM + 4) = C * DD(3, 2, :) * MU - C * (DD(2, 2, :) * PAR(4) - DD(1, 2, :) * PAR(3))
      DBC(5, 2 * NDIM + 4) = D(1, 2)
      DBC(5, 2 * NDIM + 3) = D(2, 2)
      DBC(6, 2 * NDIM + 4) = C * D(3, 2) * PAR(4) / MU - C * D(2, 2)
      DBC(6, 2 * NDIM + 3) = C * D(3, 2) * PAR(3) / MU + C * D(1, 2)
      END SUBROUTINE BCND

      SUBROUTINE ICND
      END SUBROUTINE ICND

      SUBROUTINE FOPT
      END SUBROUTINE FOPT

!     Every point in full precision to unit 97 (AUTO's own files keep eleven digits).
      SUBROUTINE PVLS(NDIM, U, PAR)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: PAR(*)
      WRITE(97, '(2ES25.16)') PAR(1), PAR(3)
      END SUBROUTINE PVLS
