"""A strip of finite width, between the flat rod and the ribbon: the law "finite width", given by its strain energy.

The paper (Audoly & Seffen 2015) compares two limits. With Gamma = w**2/(h L/2pi), w the width and h the thickness, one law
joins them. A strip that is bent to omega_1 and twisted by omega_3 chooses the profile zeta(y) of its cross-section: plate
bending with the curvatures omega_1 - kappa_n, zeta'' and omega_3, and stretching by epsilon_0 + omega_3**2 y**2/2 - omega_1
zeta along the strip. (Audoly & Neukirch 2021, "A one-dimensional model for elastic ribbons: a little stretching makes a big
difference", here with kappa_n.) The best profile is a beam on an elastic foundation, and leaves, in units of the plate
modulus times w,

    U = (1 - nu**2) (omega_1 - kappa_n)**2 / 2 + (1 - nu) omega_3**2 + C g(C omega_1**2) Q**2 / 2 - kappa_n**2 / 2,
    Q = omega_3**2 + nu omega_1 (omega_1 - kappa_n),    C = 3 (1 - nu**2) Gamma**2,    omega_2 = 0,
    g(x**4) = (1 - G)/x**4,    G = 2 (cosh x - cos x) / (x (sinh x + sin x)):

the flat rod, and a penalty on Q, the Gaussian curvature of the section. U is even in omega_3 and smooth
for every omega_1, zero included. g falls from 1/180 to 1/x**4.

Normalisation: B is the modulus of the PLATE times w, for every Gamma. Then Gamma -> infinity is the ribbon (7) as it stands,
and Gamma = 0 is the flat rod (11) with all moments and energies times 1 - nu**2, the ratio of a beam's to a plate's modulus.
This factor does not change equilibria: kappa_n and the strains are the same. kappa* = -dU/dkappa_n is (1 - nu**2) times the
flat rod's, plus nu**2 kappa_n.

H is the Legendre transform of U. Where D2U is not positive definite it has several values or none: the law ends there, and
`response` is not a number.
"""

from __future__ import annotations

import math
from fractions import Fraction

#: Below this x**4 the series of g is used: the closed form cancels. (Its radius of convergence is 4.730**4/4 = 125.)
SERIES_LIMIT = 16.0
_STEPS = 80
#: Relative size of the last Newton step in real numbers: the error left is about its square, and one more step follows.
_TOLERANCE = 1e-6


def _series(terms: int) -> tuple[float, ...]:
    """Return the coefficients of g(z) about z = 0: 1 - G by division of power series in z = x**4, exact until rounded."""
    numerator = [Fraction(4, math.factorial(4 * k + 2)) for k in range(terms + 1)]
    denominator = [Fraction(2, math.factorial(4 * k + 1)) for k in range(terms + 1)]
    quotient = []
    for k in range(terms + 1):
        quotient.append((numerator[k] - sum(quotient[j] * denominator[k - j] for j in range(k))) / denominator[0])
    return tuple(-float(value) for value in quotient[1:])


_COEFFICIENTS = _series(20)
_TERMS = len(_COEFFICIENTS)


def membrane(z):
    """g, g' and g'' at z = x**4 >= 0; free of overflow and of cancellation in g.

    Examples
    --------
    >>> round(float(membrane(0.0)[0]) * 180, 12)
    1.0
    """
    if z < SERIES_LIMIT:
        g, slope, half_curvature = 0.0, 0.0, 0.0
        for i in range(_TERMS):
            half_curvature = half_curvature * z + slope
            slope = slope * z + g
            g = g * z + _COEFFICIENTS[_TERMS - 1 - i]
        return g, slope, 2 * half_curvature
    G, first, second = foundation(math.sqrt(math.sqrt(z)))
    g = (1 - G) / z
    a = -g - first / (4 * z)  # z d/dz g, as x d/dx = 4 z d/dz
    b = -a - (second / 16 - first / 4) / z  # once more
    return g, a / z, (b - a) / (z * z)


def foundation(x):
    """G and its first two derivatives by log x, for x of at least about 1; hyperbolic functions divided by exp(x)."""
    e = math.exp(-x)
    sine, cosine = 2 * math.sin(x) * e, 2 * math.cos(x) * e
    below = 1 - e * e + sine
    F = (1 + e * e - cosine) / below  # (cosh x - cos x) / (sinh x + sin x)
    E = (1 + e * e + cosine) / below
    J = (1 - e * e - sine) / below
    slope = 1 - F * E
    curvature = -E + 2 * F * E * E - F * J
    G = 2 * F / x
    first = 2 * slope - G
    return G, first, 2 * x * curvature - first


def on_circle(ratio, nu, width) -> tuple:
    """Moment M, torsional modulus t and tangent bending modulus of a planar circle, lengths in units of its radius r0.

    ``ratio`` is kappa_n r0, ``width`` is w**2/(h r0); floats or arrays. With y = 1 - ratio and G' = dG/dlog x,

        M = (1 - nu**2 G) y - nu**2 G' y**2 / 4,    t = 2 (1 - nu) + 2 nu (1 - G) y.

    The term with G in t is the membrane stress of the anticlastic profile, Wagner's effect.
    """
    y = 1 - ratio
    G, first, second = _foundation_by_series(3 * (1 - nu * nu) * width * width)
    moment = (1 - nu * nu * G) * y - nu * nu * first * y * y / 4
    bending = 1 - nu * nu * G - nu * nu * first * y - nu * nu * y * y * (second / 8 - first / 4)
    return moment, 2 * (1 - nu) + 2 * nu * (1 - G) * y, bending


def convex_limits(nu, width) -> list[float]:
    """Return the kappa_n r0 where the torsional or the tangent bending modulus of a planar circle vanishes, in any order.

    Examples
    --------
    >>> convex_limits(0.3, 0.0)  # without width it is the flat rod, which is convex
    []
    """
    t0, slope = on_circle(1.0, nu, width)[1], on_circle(0.0, nu, width)[1] - on_circle(1.0, nu, width)[1]
    zeros = [-float(t0 / slope)] if slope else []
    b0, b1, b2 = (on_circle(1 - y, nu, width)[2] for y in (0.0, 1.0, -1.0))
    A, B = (b1 + b2) / 2 - b0, (b1 - b2) / 2
    radicand = B * B - 4 * A * b0
    if A and radicand >= 0:
        zeros += [float(2 * b0 / (-B - math.sqrt(radicand))), float(2 * b0 / (-B + math.sqrt(radicand)))]
    return [1 - y for y in zeros]


def _foundation_by_series(z):
    """`foundation` for every x**4 = z >= 0, numbers or arrays: from g where x is small."""
    import numpy as np

    g, slope, curvature = np.vectorize(membrane, otypes=[float] * 3)(z)
    first = -4 * z * (g + z * slope)
    return 1 - z * g, first, -16 * z * (g + 3 * z * slope + z * z * curvature)


def isotropic(nu, Gamma):
    """Return the section of an isotropic strip: the numbers on which U depends, over the modulus D22 of its plate across.

    They are nu = D12/D22, plane = D11/D22 - nu**2, twist = 2 D66/D22, stiff = sqrt(D11/D22), C, and the |omega_1| up to which
    the strip is like a flat rod, x < 1 (zero stands for an inextensible ribbon, of any width). See `ribbon_model.plate`.
    """
    plane = 1 - nu * nu
    return nu, plane, 1 - nu, 1.0, 3 * plane * Gamma * Gamma, 1 / (math.sqrt(3 * plane.real) * Gamma.real + 1e-100)


def strain_energy(w1, w3, kappa_n, nu, Gamma):
    """U and its derivatives: (U, U_1, U_3, U_11, U_13, U_33, U_k, U_1k, U_3k), k for kappa_n; without the term -kappa_n**2/2.

    Arguments may be complex, for complex steps: first derivatives of U, U_1, U_3 and U_k then are exact. (Only the membrane
    function of real numbers is called; what the imaginary parts add is its linear term.)
    """
    return section_energy(w1, w3, kappa_n, isotropic(nu, Gamma))


def section_energy(w1, w3, kappa_n, section):
    """Return `strain_energy` of a section; see `isotropic`."""
    return _strain_energy(w1, w3, kappa_n, section, _profile(w1, section))


def _profile(w1, section):
    """Return g, g' and g'' where the section is bent by w1, all real: `membrane`, or 1/z for a ribbon."""
    z = (section[4] * w1 * w1).real
    if section[5] > 0:
        return membrane(z)
    z = z + 1e-300
    return 1 / z, -1 / (z * z), 2 / (z * z * z)


def _strain_energy(w1, w3, kappa_n, section, profile):
    """Return `section_energy`, with the values of `_profile`."""
    nu, plane, twist, _, C, _ = section
    z = C * w1 * w1
    g, slope, curvature = profile
    dz = z - z.real
    P = C * (g + slope * dz)
    P1 = 2 * C * C * w1 * (slope + curvature * dz)
    P11 = 2 * C * C * (slope + 2 * z * curvature)
    bent = w1 - kappa_n
    Q, Q1, Q3, Qk = w3 * w3 + nu * w1 * bent, nu * (w1 + bent), 2 * w3, -nu * w1
    PQ, slope1 = P * Q, P1 * Q + P * Q1
    return (
        plane * bent * bent / 2 + twist * w3 * w3 + PQ * Q / 2,
        plane * bent + P1 * Q * Q / 2 + PQ * Q1,
        2 * twist * w3 + PQ * Q3,
        plane + P11 * Q * Q / 2 + 2 * P1 * Q * Q1 + P * Q1 * Q1 + 2 * nu * PQ,
        slope1 * Q3,
        2 * twist + P * Q3 * Q3 + 2 * PQ,
        -plane * bent + PQ * Qk,
        -plane + slope1 * Qk - nu * PQ,
        P * Q3 * Qk,
    )


def first_zero_of_t(nu: float, width: float) -> float | None:
    """Return the smallest xi in (0, 1) where the modulus t of the unfolding arc vanishes, or None; width is w**2/(R h)."""
    import numpy as np
    from scipy.optimize import brentq

    def t(xi):
        return strain_energy(1 - xi, 0.0, 1.0, nu, width)[5]

    grid = 1 - np.geomspace(1.0, 1e-3 / (1 + width), 2000)
    below = np.flatnonzero([t(xi) < 0 for xi in grid])
    return float(brentq(t, grid[below[0] - 1], grid[below[0]], xtol=1e-15)) if below.size else None


def _start(M1, M3, kappa_n, section):
    """Return the strains to start from: the ribbon's or the flat rod's closed form, whichever makes U - M.omega smaller.

    The ribbon's is exact where D12 + 2 D66 = sqrt(D11 D22), as for isotropic plates: scaled by stiff, U then has its form.
    The flat rod's is not taken if it lies beyond the concave region along omega_1 = 0, where there is another minimum. A start
    inside that region is moved towards omega_1 > 0, the side on which branches begin.
    """
    nu, plane, twist, stiff, _, region = section
    flat1, flat3 = kappa_n + M1 / plane, M3 / (2 * twist)
    m3 = M3 / math.sqrt(stiff)
    p = M1 / stiff + (stiff - nu) * kappa_n
    root = math.sqrt(p * p + m3 * m3)
    a = (p + root) / 2 if p > 0 else m3 * m3 / (2 * (root - p) + 1e-300)
    if a < 1e-12 * root or nu * kappa_n + a <= 0:
        return flat1, flat3
    eta = m3 / (2 * a)
    w1 = (nu * kappa_n + a) / (1 + eta * eta)
    w3 = eta * w1 / math.sqrt(stiff)
    w1 = w1 / stiff
    if p > 0 and w1 > 10 * region:  # x > 3: like a ribbon
        return w1, w3
    if flat1 > -region:
        ribbon = section_energy(w1, w3, kappa_n, section)[0] - M1 * w1 - M3 * w3
        flat = section_energy(flat1, flat3, kappa_n, section)[0] - M1 * flat1 - M3 * flat3
        if flat < ribbon:
            return flat1, flat3
    for _ in range(20):
        _, _, _, U11, U13, U33, _, _, _ = section_energy(w1, w3, kappa_n, section)
        if U11 > 0 and U11 * U33 > U13 * U13:
            break
        w1 = 1.2 * w1 + region
    return w1, w3


def _strains(M1, M3, kappa_n, section):
    """omega_1 and omega_3 at a moment, all real: a minimum of U - M.omega, by Newton's method; nan where none is found.

    Steps are halved until U - M.omega decreases, and they do not leave the convex region again (a concave one lies along
    omega_1 = 0 at large twist, and another minimum beyond). Where D2U is indefinite, it is shifted.
    """
    w1, w3 = _start(M1, M3, kappa_n, section)
    region = section[5]
    best, d1, d3, convex = math.inf, 0.0, 0.0, False
    for _ in range(_STEPS):
        U, U1, U3, U11, U13, U33, _, _, _ = section_energy(w1 + d1, w3 + d3, kappa_n, section)
        value = U - M1 * (w1 + d1) - M3 * (w3 + d3)
        mean, spread = (U11 + U33) / 2, math.sqrt((U11 - U33) * (U11 - U33) / 4 + U13 * U13)
        was_convex, convex = convex, mean - spread > 1e-9 * (mean + spread)
        if value > best + 1e-11 * (abs(U) + abs(best)) or (was_convex and not convex):
            d1, d3, convex = d1 / 2, d3 / 2, was_convex
            continue
        w1, w3, best = w1 + d1, w3 + d3, value
        shift = 0.0 if convex else 1.2 * spread - mean + 0.1
        A, B = U11 + shift, U33 + shift
        determinant = A * B - U13 * U13
        d1 = (B * (M1 - U1) - U13 * (M3 - U3)) / determinant
        d3 = (A * (M3 - U3) - U13 * (M1 - U1)) / determinant
        if convex and abs(d1) + abs(d3) < _TOLERANCE * (1e-3 + abs(w1) + abs(w3)):
            return w1 + d1, w3 + d3
        largest = 0.7 * abs(w1) + region
        if abs(d1) > largest:
            d1, d3 = d1 * largest / abs(d1), d3 * largest / abs(d1)
    return math.nan, math.nan


def search(M1, M3, kappa_n, nu, Gamma):
    """Return omega_1, omega_3 and the three values of `membrane` there, for real numbers."""
    return section_search(M1, M3, kappa_n, isotropic(nu, Gamma))


def section_search(M1, M3, kappa_n, section):
    """Return `search` of a section."""
    w1, w3 = _strains(M1, M3, kappa_n, section)
    g, slope, curvature = _profile(w1, section)
    return w1, w3, g, slope, curvature


def response(M1, M2, M3, kappa_n, nu, Gamma):
    """H, omega_1, omega_2, omega_3, dH/dkappa_n: the Legendre transform of U."""
    return response_from(M1, M2, M3, kappa_n, nu, Gamma, search(M1.real, M3.real, kappa_n.real, nu.real, Gamma.real))


def response_from(M1, M2, M3, kappa_n, nu, Gamma, found):
    """Return the response from what `search` has found for the real parts of the arguments.

    The same as `section_response`.
    """
    return section_response(M1, M2, M3, kappa_n, isotropic(nu, Gamma), found)


def section_response(M1, M2, M3, kappa_n, section, found):
    """Return the response of a section from what `section_search` has found for the real parts of the arguments.

    One more step of Newton's method, on the numbers as they come, carries imaginary parts along: by the theorem on implicit
    functions that is the exact derivative.
    """
    w1, w3, g, slope, curvature = found
    U, U1, U3, U11, U13, U33, Uk, U1k, U3k = _strain_energy(w1, w3, kappa_n, section, (g, slope, curvature))
    determinant = U11 * U33 - U13 * U13
    d1 = (U33 * (M1 - U1) - U13 * (M3 - U3)) / determinant
    d3 = (U11 * (M3 - U3) - U13 * (M1 - U1)) / determinant
    H = M1 * w1 + M3 * w3 - U + kappa_n * kappa_n / 2  # stationary in the strains: d1, d3 add nothing
    return H, w1 + d1, 0.0 * M2, w3 + d3, kappa_n - Uk - U1k * d1 - U3k * d3


def hamiltonian(M1, M2, M3, kappa_n, nu, Gamma):
    """Return H alone."""
    return response(M1, M2, M3, kappa_n, nu, Gamma)[0]


hamiltonian.gradient = response
