!  The half loop [0, L/2] between two mirrors in all thirteen components; PAR(1) = kappa_n, PAR(2) = nu, PAR(3) = M2(0), which
!  vanishes on planar circles.
      SUBROUTINE FUNC(NDIM, U, ICP, PAR, IJAC, F, DFDU, DFDP)
      USE RIBBON
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), IJAC
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM, NDIM), DFDP(NDIM, *)
      DOUBLE PRECISION :: FK(13)
      CALL RATES(U, PAR(1), PAR(2), PI, IJAC, F, DFDU, FK)
      IF (IJAC < 2) RETURN
      DFDP(:, 1) = FK
      END SUBROUTINE FUNC

!     The planar circle at kappa_n = 2.3.
      SUBROUTINE STPNT(NDIM, U, PAR, T)
      USE RIBBON
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(IN) :: T
      PAR(1:3) = (/ 2.3D0, 0.3D0, 0D0 /)
      U = 0
      U(1) = 1 - PAR(1)
      U(7) = COS(PI * T / 2)
      U(8) = SIN(PI * T / 2)
      U(12) = COS(PI * T) - 1
      U(13) = SIN(PI * T)
      END SUBROUTINE STPNT

!     At the first mirror M3 = R1 = R2 = 0, frame and position fixed; at the other d3 is parallel to d3(0), x in its plane.
      SUBROUTINE BCND(NDIM, PAR, ICP, NBC, U0, U1, FB, IJAC, DBC)
      USE RIBBON
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), NBC, IJAC
      DOUBLE PRECISION, INTENT(IN) :: PAR(*), U0(NDIM), U1(NDIM)
      DOUBLE PRECISION, INTENT(OUT) :: FB(NBC)
      DOUBLE PRECISION, INTENT(INOUT) :: DBC(NBC, *)
      DOUBLE PRECISION :: D(3, 3), DD(3, 3, 4)
      INTEGER :: I
      CALL DIRECTORS(U1(7:10), D, DD)
      FB(1:3) = U0(3:5)
      FB(4:10) = U0(7:13)
      FB(4) = U0(7) - 1
      FB(11:12) = D(1:2, 3)
      FB(13) = U1(13)
      IF (IJAC == 0) RETURN
      DBC(:, 1:2 * NDIM + 3) = 0
      DO I = 1, 3
         DBC(I, 2 + I) = 1
      END DO
      DO I = 4, 10
         DBC(I, 3 + I) = 1
      END DO
      DBC(11:12, NDIM + 7:NDIM + 10) = DD(1:2, 3, :)
      DBC(13, NDIM + 13) = 1
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
      DOUBLE PRECISION, EXTERNAL :: GETP
      PAR(3) = GETP('BV0', 2, U)
      WRITE(97, '(2ES25.16)') PAR(1), PAR(3)
      END SUBROUTINE PVLS
