!  The whole loop in all thirteen components, as in section 6 of Audoly & Seffen (2015), with gauge and phase fixed.
!  PAR(1) = kappa_n, PAR(2) = nu, PAR(3) = M2(0), which vanishes on planar circles.
      SUBROUTINE FUNC(NDIM, U, ICP, PAR, IJAC, F, DFDU, DFDP)
      USE RIBBON
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), IJAC
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM, NDIM), DFDP(NDIM, *)
      DOUBLE PRECISION :: FK(13)
      CALL RATES(U, PAR(1), PAR(2), 2 * PI, IJAC, F, DFDU, FK)
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
      U(7) = COS(2 * PI * T / 2)
      U(8) = SIN(2 * PI * T / 2)
      U(12) = COS(2 * PI * T) - 1
      U(13) = SIN(2 * PI * T)
      END SUBROUTINE STPNT

!     Gauge (frame and position at S = 0), phase (M3 = 0 at S = 0), closure of position and frame; M and R then close as well.
!     The rotation about d3 is left out: H(M) + R3 is conserved, so it closes with the others wherever M3' is not zero there.
      SUBROUTINE BCND(NDIM, PAR, ICP, NBC, U0, U1, FB, IJAC, DBC)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), NBC, IJAC
      DOUBLE PRECISION, INTENT(IN) :: PAR(*), U0(NDIM), U1(NDIM)
      DOUBLE PRECISION, INTENT(OUT) :: FB(NBC)
      DOUBLE PRECISION, INTENT(INOUT) :: DBC(NBC, *)
      INTEGER :: I
      FB(1) = U0(3)
      FB(2:8) = U0(7:13)
      FB(2) = U0(7) - 1
      FB(9:10) = U1(8:9)
      FB(11:13) = U1(11:13)
      IF (IJAC == 0) RETURN
      DBC(:, 1:2 * NDIM + 3) = 0
      DBC(1, 3) = 1
      DO I = 2, 8
         DBC(I, 5 + I) = 1
      END DO
      DO I = 9, 10
         DBC(I, NDIM + I - 1) = 1
      END DO
      DO I = 11, 13
         DBC(I, NDIM + I) = 1
      END DO
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
