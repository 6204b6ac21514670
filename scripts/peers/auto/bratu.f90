!  Bratu's problem u'' + lambda exp(u) = 0, u(0) = u(1) = 0, from u = 0 at PAR(1) = lambda = 0.
      SUBROUTINE FUNC(NDIM, U, ICP, PAR, IJAC, F, DFDU, DFDP)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), IJAC
      DOUBLE PRECISION, INTENT(IN) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(OUT) :: F(NDIM)
      DOUBLE PRECISION, INTENT(INOUT) :: DFDU(NDIM, NDIM), DFDP(NDIM, *)
      DOUBLE PRECISION :: E
      E = EXP(U(1))
      F(1) = U(2)
      F(2) = -PAR(1) * E
      IF (IJAC == 0) RETURN
      DFDU = 0
      DFDU(1, 2) = 1
      DFDU(2, 1) = -PAR(1) * E
      IF (IJAC < 2) RETURN
      DFDP(1, 1) = 0
      DFDP(2, 1) = -E
      END SUBROUTINE FUNC

      SUBROUTINE STPNT(NDIM, U, PAR, T)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM
      DOUBLE PRECISION, INTENT(INOUT) :: U(NDIM), PAR(*)
      DOUBLE PRECISION, INTENT(IN) :: T
      PAR(1) = 0
      U = 0
      END SUBROUTINE STPNT

      SUBROUTINE BCND(NDIM, PAR, ICP, NBC, U0, U1, FB, IJAC, DBC)
      IMPLICIT NONE
      INTEGER, INTENT(IN) :: NDIM, ICP(*), NBC, IJAC
      DOUBLE PRECISION, INTENT(IN) :: PAR(*), U0(NDIM), U1(NDIM)
      DOUBLE PRECISION, INTENT(OUT) :: FB(NBC)
      DOUBLE PRECISION, INTENT(INOUT) :: DBC(NBC, *)
      FB(1) = U0(1)
      FB(2) = U1(1)
      IF (IJAC == 0) RETURN
      DBC(:, 1:2 * NDIM + 1) = 0
      DBC(1, 1) = 1
      DBC(2, NDIM + 1) = 1
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
      WRITE(97, '(ES25.16)') PAR(1)
      END SUBROUTINE PVLS
