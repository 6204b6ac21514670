"""The unfolding arc of section 5 of Audoly & Seffen (2015): two forms of one determinant, and the roots the paper quotes."""

import math

import numpy as np
import pytest

import contin
from ribbon_model.laws import FLAT_ROD, ISOTROPIC_ROD, RIBBON
from ribbon_model.unfolding import CLAMPED, HINGED, factors, first_root, shooting_determinant, system_matrix

TABLE_2_LAWS = (RIBBON, FLAT_ROD, ISOTROPIC_ROD)


@pytest.mark.parametrize("theta_n", (1.0, math.pi, 5.0))
@pytest.mark.parametrize("law", TABLE_2_LAWS, ids=lambda law: law.name)
def test_closed_form_is_the_shooting_determinant(law, theta_n):
    """det S = -8 (1 - xi)^4 / t, times even, times odd: identically, derived by hand from (20)."""
    random = np.random.default_rng(5)
    nu = random.uniform(-0.3, 0.49, 60)
    xi = np.concatenate([random.uniform(0.02, 0.45, 30), random.uniform(1.6, 4, 30)])
    even, odd = factors(law, nu, xi, theta_n)
    _, t = law.tangent_moduli(1 / (1 - xi), nu)
    closed = -8 * (1 - xi) ** 4 / t * even * odd
    direct = shooting_determinant(law, nu, xi, theta_n)
    assert np.max(np.abs(direct - closed) / (np.abs(direct) + 1e-3)) < 1e-8


@pytest.mark.sample(4)
@pytest.mark.parametrize("law", TABLE_2_LAWS, ids=lambda law: law.name)
@pytest.mark.parametrize("nu", (0.01, 0.1, 0.3, 0.49))
def test_two_routes_to_the_first_root(law, nu):
    closed, shot = first_root(law, nu), first_root(law, nu, method="shooting")
    assert closed == shot if closed is None else abs(closed - shot) < 1e-10


def test_roots_that_the_paper_quotes():
    """Section 5.3, nu = .3: ribbon .004 below 1 - nu. For the rods it says 'not before about 2'; (20g) gives 1.72 and 4.05."""
    gap = 0.7 - first_root(RIBBON, 0.3)
    assert round(gap, 3) == 0.004
    assert round(first_root(ISOTROPIC_ROD, 0.3), 2) == 1.72
    assert round(first_root(FLAT_ROD, 0.3), 2) == 4.05


@pytest.mark.parametrize("law", (FLAT_ROD, ISOTROPIC_ROD), ids=lambda law: law.name)
def test_with_free_ends_a_rod_turns_about_its_chord(law):
    """M_2 = 0 instead of psi_2 = 0: at xi = 2 the strip is the mirror image of its natural shape; rotation costs nothing."""
    assert first_root(law, 0.3, ends=HINGED, method="shooting") == pytest.approx(2.0, abs=1e-10)


def test_the_flat_state_is_no_root():
    """Both factors keep their sign, relative to a power of 1 - xi, across xi = 1: divided by it they have a limit, not zero."""
    for law, powers in ((FLAT_ROD, (3, 2)), (ISOTROPIC_ROD, (1, 0))):
        for side in (-1, 1):
            near, nearer = (factors(law, 0.3, 1 + side * d) for d in (2e-3, 1e-3))
            for i, power in enumerate(powers):
                assert nearer[i] * (side * 1e-3) ** -power == pytest.approx(near[i] * (side * 2e-3) ** -power, rel=0.05)
                assert abs(nearer[i]) * 1e-3**-power > 0.1


def test_limits_in_the_poisson_ratio():
    """nu -> 0: the gap closes like nu^2. nu = 0: the ribbon is the flat rod. nu < 0: t > 0 up to flat, and no root."""
    gaps = [1 - nu - first_root(RIBBON, nu) for nu in (0.02, 0.01)]
    assert gaps[0] / gaps[1] == pytest.approx(4, rel=0.02)
    assert first_root(RIBBON, 0.0, largest=8.0) == first_root(FLAT_ROD, 0.0, largest=8.0)
    assert first_root(RIBBON, -0.3) is None


@pytest.mark.full
@pytest.mark.parametrize("law", TABLE_2_LAWS, ids=lambda law: law.name)
def test_the_root_as_an_eigenvalue_of_a_boundary_value_problem(law):
    """A third route: (20) with xi unknown and the mode normalised, by collocation."""
    nu, root = 0.3, first_root(law, 0.3)
    transfer_start = _null_vector(law, nu, root)

    def rhs(s, y, p):
        kappa = 1 - p.xi
        moment = 1 - 1 / kappa
        twist = 2 * (1 - p.nu / kappa) * p.ribbon + p.t * (1 - p.ribbon)
        length = p.theta * kappa
        return (
            length * y.psi2,
            length * (y.psi3 + p.softness * (y.m2 - moment * y.psi3)),
            length * ((moment - twist) * y.psi2 + y.m3) / twist,
            length * (y.m3 - y.r1),
            -length * y.m2,
            0.0 * y.r1,
        )

    g, t = law.tangent_moduli(1 / (1 - root), nu)
    problem = contin.BoundaryValueProblem(
        rhs,
        lambda a, b, p: (a.x1, a.psi2, a.psi3, b.x1, b.psi2, b.psi3),
        ["x1", "psi2", "psi3", "m2", "m3", "r1"],
        {"xi": root + 1e-4, "nu": nu, "theta": math.pi, "t": t, "softness": 1 / g, "ribbon": 1.0 if law is RIBBON else 0.0},
        integrals=lambda s, y, p: (y.psi3**2 - 0.5,),
    )
    mode = contin.solve(problem, transfer_start, free=["xi"], degree=6)
    assert abs(mode["xi"] - root) < 1e-9


def _null_vector(law, nu, root):
    """The mode at a root, as a function of s in [0, 1], normalised to a mean square of psi_3 of 1/2."""
    from scipy.linalg import expm

    matrix = system_matrix(law, nu, root) * math.pi * (1 - root)
    first = np.zeros(6)
    first[3:] = np.linalg.svd(expm(matrix)[:3, 3:])[2][-1]
    values = np.array([expm(matrix * s) @ first for s in np.linspace(0, 1, 201)])
    scale = math.sqrt(0.5 / np.mean(values[:, 2] ** 2))
    return lambda s: tuple(expm(matrix * s) @ first * scale)


def test_what_is_refused():
    for attempt, words in (
        (lambda: shooting_determinant(FLAT_ROD, 0.3, 1.0), "flat strip"),
        (lambda: shooting_determinant(RIBBON, 0.25, 0.75), "twisting modulus vanishes"),
        (lambda: factors(RIBBON, 0.3, 0.0), "natural state"),
        (lambda: first_root(RIBBON, 1.5), "must be greater than -1 and at most 0.5"),
        (lambda: first_root(RIBBON, 0.3, method="magic"), "closed form"),
        (lambda: first_root(RIBBON, 0.3, ends=HINGED), "shooting"),
        (lambda: first_root(ISOTROPIC_ROD, 0.0, ends=HINGED, method="shooting"), "mechanism"),
    ):
        with pytest.raises(ValueError, match=words):
            attempt()
    assert CLAMPED == (0, 1, 2)
