"""Half a closed strip, stated by its energy alone: `contin.VariationalProblem` derives equations, multipliers and index.

The state is the quaternion of the frame and the centreline, the Hamiltonian that of the law, H(M), plus n . d3 for the growth
of the centreline: the multipliers of the quaternion carry the moment, 2 M_i = lambda_q . (q e_i), and those of the centreline
are the force. `ribbon_model.domains` uses that moment and force are constant in space and keeps half as many unknowns; this is
the same mechanics without that knowledge, for comparison, with the index of perturbations that keep the half loop's symmetry.
"""

from __future__ import annotations

import functools

from contin import VariationalProblem
from ribbon_model.domains import Domain
from ribbon_model.equilibrium import CENTRELINE, FRAME, LENGTH, directors, spin
from ribbon_model.law import Law


@functools.cache
def variational_problem(law: Law, domain: Domain) -> VariationalProblem:
    """Return the half loop as a variational problem, on S in (0, L/2); its parameters are kappa_n and the law's own.

    Parameters
    ----------
    law : Law
        A law whose H is a closed expression.
    domain : Domain
        `domains.HALF_LOOP` or `domains.HALF_LOOP_BETWEEN_AXES`.

    Raises
    ------
    ValueError
        Another domain.
    ProblemError
        A law whose H cannot be differentiated symbolically.
    """
    if not domain.reversal:
        raise ValueError(f"domain {domain.name!r}: the energy is stated on half loops")
    complementary = law.hamiltonian

    def hamiltonian(t, x, lam, p):
        q, l0, l1, l2, l3, n1, n2, n3 = x[:4], *lam
        rates = spin(*q, 1, 0, 0, 1), spin(*q, 0, 1, 0, 1), spin(*q, 0, 0, 1, 1)  # q e_i / 2
        M1, M2, M3 = [l0 * r0 + l1 * r1 + l2 * r2 + l3 * r3 for r0, r1, r2, r3 in rates]
        d11, d12, d13, d21, d22, d23, d31, d32, d33 = directors(*q)
        return complementary(M1, M2, M3, *p) + n1 * d31 + n2 * d32 + n3 * d33

    return VariationalProblem(
        None, (*FRAME, *CENTRELINE), {"kappa_n": 0.0, **law.defaults}, hamiltonian=hamiltonian,
        ends=domain.boundary, domain=(0.0, LENGTH / 2),
    )  # fmt: skip
