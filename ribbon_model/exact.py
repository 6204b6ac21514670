"""The exact (quadrature) solution of the primary branches, independent of any collocation.

Audoly & Seffen (2015) follow these branches numerically; they are integrable. On the branch born from the m-covered
circle with wavenumber n the internal force vanishes, and |M| = |mu| and the ribbon's complementary energy c**2/2 are
constant along the strip. With eta = omega_3/omega_1 = sqrt(A) sin(theta), A = max(eta**2), and

    a = c - nu kappa_n,   b = c - kappa_n,   beta = b/a,   q = A + 4 - 2 beta,   (mu/a)**2 = beta**2 + A q,

the law (9) reads M_1 = b - a eta**2, M_3 = 2 a eta, omega_1 = c/(1 + eta**2). A quarter wave, 0 < theta < pi/2, has

    length              int 2 (1 + eta**2) / (c sqrt(eta**2 + q)) dtheta
    precession of d_3   int 2 (mu/a) (beta - eta**2) / (((beta - A)**2 + 4 A cos(theta)**2) sqrt(eta**2 + q)) dtheta
    precession of d_2   int 2 (mu/a) (beta + eta**2) / (((beta - eta**2)**2 + 4 eta**2) sqrt(eta**2 + q)) dtheta

about M, and the loop closes if the length is pi/2n and either azimuth pi m/2n modulo pi. The azimuth of d_3 jumps by pi
where d_3 passes through the axis (beta = A at theta = pi/2), that of d_2 where beta = 0.

The precession depends on (A, q) only. So a branch is ONE plane curve, the same for every nu; nu enters afterwards,
through kappa_n = c (1 - beta)/(1 - nu beta). The follower walks that curve, in z = (log(1 + A), log(q)/2): both circles
are ordinary points of it, A = 0 being crossed transversally.

The rods' quadratures are in `ribbon_model.exact_rods`; the follower and the functions here are common to the three laws.

Units: bending modulus B = 1, length L = 2 pi. Source of every number: quadrature of the R = 0 equilibrium.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from contin.lowlevel import Label
from ribbon_model import exact_finite_width
from ribbon_model.exact_rods import FLOAT, RODS, Numerics
from ribbon_model.laws import LAWS
from ribbon_model.older import takes_parameters

_HOMOCLINIC = -300.0  # log(q)/2 at which the follower stops, before q underflows
_SHORTEST_STEP = 1e-7


@dataclass(frozen=True)
class ExactPoint:
    """One equilibrium on the primary branch (m, n) (B = 1, L = 2 pi).

    `kappa_star` is (28), `c` = omega_1 (1 + eta**2), `eta_max_squared` and `q` are A and q above (q is kept because the
    subtraction would lose a small one), the moment is `mu` e_z with e_z the axis about which the centreline turns m
    times, `energy` is (7) divided by L. `label` is 'BP' on a circle, 'LP' at a fold of kappa_n, 'EP' at a limit of
    kappa_n, 'MX' where the branch is too close to a homoclinic orbit to go on, '' elsewhere.
    """

    m: int
    n: int
    nu: float
    kappa_n: float
    kappa_star: float
    c: float
    eta_max_squared: float
    q: float
    mu: float
    energy: float
    label: str = ""
    law: ClassVar[str] = "ribbon"
    root: ClassVar[int] = 0

    @property
    def parameters(self) -> dict[str, float]:
        """Those of the law, by name."""
        return {"nu": self.nu}

    @property
    def amplitude(self) -> float:
        """max(eta**2)."""
        return self.eta_max_squared

    @property
    def coordinates(self) -> np.ndarray:
        """The point in the plane of the unknowns, shape (2,), in which the branch is a smooth curve."""
        return np.array([np.log1p(self.eta_max_squared), np.log(self.q) / 2])


def bifurcation(m, n, nu):
    """Return kappa_n = m K^{m,n} at which the branch leaves the m-covered circle, eq. (27), regular at nu = 0.

    Raises ValueError if (m, n) is not a buckling mode or nu is outside (-1, 1), and ZeroDivisionError if the branch starts
    at infinite kappa_n (some nu < 0).

    Examples
    --------
    >>> bifurcation(1, 2, 0.3)
    2.5
    """
    _check_mode(m, n, nu)
    return m * (2 * n**2 - m**2) / (m**2 + 2 * nu * (n**2 - m**2))  # (27) with the common factor nu cancelled


def residuals(c, A, kappa_n, m, n, nu):
    """Return the defects of closure of a quarter wave of the ribbon: (length minus pi/2n, azimuth minus pi m/2n (mod pi)).

    Raises ValueError as `bifurcation`, if m is a multiple of 2n (the centreline would not close), and if A < 0,
    c = nu kappa_n or q <= 0 (eta would not oscillate through zero).
    """
    _check(m, n, nu)
    azimuth, mean, mean_squared, _ = _quadratures(np.float64(A), _q(c, A, kappa_n, nu))
    return np.pi * np.array([(mean + mean_squared) / c - 1 / (2 * n), _defect(azimuth, m, n)])


@takes_parameters
def solve(m, n, parameters, guess, *, kappa_n=None, amplitude=None, law="ribbon", root=0):
    """Return the point of the branch with given kappa_n, or given amplitude, nearest a guess in the sense of Newton's method.

    Parameters
    ----------
    guess : ExactPoint, RodPoint, FiniteWidthPoint, or for the ribbon (c, A, kappa_n)
    kappa_n, amplitude : float
        The given value, exactly one of the two. The amplitude is A: max(eta**2) for the ribbon.
    law, root :
        As for `curve`.

    Raises
    ------
    ValueError
        None or both are given, or `residuals` raises it.
    RuntimeError
        If Newton does not converge. Near a fold of kappa_n prescribe the amplitude, and conversely.

    Examples
    --------
    >>> point = solve(1, 2, 0.3, curve(1, 2, 0.3)[5], kappa_n=3.0)
    >>> round(point.kappa_n, 12)
    3.0
    """
    if (kappa_n is None) == (amplitude is None):
        raise ValueError("give exactly one of kappa_n and amplitude")
    if _law(law) not in _FAMILIES:
        return exact_finite_width.solve(guess, kappa_n=kappa_n, amplitude=amplitude)
    family = _family(law, m, n, parameters, root)
    z = getattr(guess, "coordinates", None)
    if z is None:
        z = np.array([np.log1p(guess[1]), np.log(_q(*guess, family.nu)) / 2])
    for _ in range(30):
        defect, numerator, denominator = FLOAT.gradients(family.parts, z)
        if kappa_n is None:
            target = np.expm1(z[0]) - amplitude, np.array([np.exp(z[0]), 0.0])
        else:
            target = tuple(numerator[i] - kappa_n * denominator[i] for i in (0, 1))
        update = np.linalg.solve([defect[1], target[1]], [-defect[0], -target[0]])
        size = np.abs(update).max()
        z = z + update * min(1, 0.5 / max(size, 1e-300))  # logarithms: half a unit is already far
        if size < 1e-11:
            return family.point(z)
    raise RuntimeError(f"no convergence on branch ({m}, {n}): start nearer, or prescribe the other quantity")


@takes_parameters
def curve(m, n, parameters=0.3, kappa_limits=(-100.0, 100.0), step=0.05, law="ribbon", root=0):
    """Return the branch from the m-covered circle to the one where it ends, or to a limit of kappa_n.

    Parameters
    ----------
    parameters : float, or mapping of str to float
        Those of the law by name; a number is nu.
    kappa_limits : (float, float)
        The curve stops where kappa_n leaves this interval.
    step : float
        Largest arclength between points in the plane of the unknowns: (log(1 + A), log(q)/2) of the ribbon.
    law : str or Law
        Of the paper, by name; for 'finite width', and for any other law, see `ribbon_model.exact_finite_width`.
    root : int
        Number of the threshold on the m-covered circle: 0, or for the isotropic rod also 1.

    Returns
    -------
    list of ExactPoint, or of RodPoint
        In order, folds included; the last label says why the curve ends.

    Raises
    ------
    ValueError
        As `bifurcation`, if m is a multiple of 2n, or if the branch starts outside `kappa_limits`.
    RuntimeError
        If the follower cannot proceed.

    Examples
    --------
    >>> branch = curve(1, 2, 0.3)
    >>> [point.label for point in branch if point.label]
    ['BP', 'LP', 'BP']
    """
    if _law(law) not in _FAMILIES:
        return exact_finite_width.curve(m, n, parameters, kappa_limits, step, _law(law))
    family, (lowest, highest) = _family(law, m, n, parameters, root), kappa_limits
    start, begin = family.threshold(m), family.circle(m)
    if not lowest <= start <= highest:
        raise ValueError(f"branch ({m}, {n}) starts at kappa_n = {start:.6g}, outside {tuple(kappa_limits)}")
    sign = np.sign(FLOAT.gradients(family.parts, begin)[2][0])

    def room(z):  # > 0 inside the limits; continuous where kappa_n passes through infinity
        _, (numerator, _), (denominator, _) = FLOAT.gradients(family.parts, z)
        return sign * min(highest * denominator - numerator, numerator - lowest * denominator)

    def turning(z):
        return _turning(family, z)[1]

    points, before = [family.point(begin, Label.BRANCH_POINT)], turning(begin)
    for line, length, ahead in _segments(family, step):
        stops = [(length, ahead, Label.FAILED if _homoclinic(ahead) else "")]
        after = turning(ahead)
        if before * after < 0:
            fold = _root(turning, line, 0.0, length)
            stops.insert(0, (fold, line(fold), Label.FOLD))
        before, last = after, 0.0
        for s, z, label in stops:
            if z[0] < 0 and room(family.circle(family.finish)) >= 0:
                return [*points, family.point(family.circle(family.finish), Label.BRANCH_POINT)]
            if room(z) < 0:
                return [*points, family.point(line(_root(room, line, last, s)), Label.END)]
            points.append(family.point(z, label))
            last = s
    return points


@takes_parameters
def initial_slope(m, n, parameters, law="ribbon", root=0):
    """Return d kappa_n / dA at the start of the branch, with the squared amplitude A: its sign is the pitchfork's sense.

    It is zero if a fold is born from the pitchfork. Raises as `curve` does.

    Examples
    --------
    >>> initial_slope(1, 2, 0.3) > 0  # kappa_n grows: the pitchfork is supercritical
    True
    """
    family = _family(law, m, n, parameters, root)
    defect, numerator, denominator = FLOAT.gradients(family.parts, family.circle(m))
    gradient = (numerator[1] * denominator[0] - numerator[0] * denominator[1]) / denominator[0] ** 2
    return float(gradient[0] - gradient[1] * defect[1][0] / defect[1][1])  # along the branch, log(1 + A) being A to first order


@takes_parameters
def folds(m, n, parameters=0.3, kappa_limits=(-100.0, 100.0), law="ribbon", root=0):
    """Return the points of `curve` at which kappa_n is stationary, in order. Raises as `curve` does.

    Examples
    --------
    >>> [round(point.kappa_n, 6) for point in folds(1, 2, 0.3)]
    [4.075668]
    """
    return [point for point in curve(m, n, parameters, kappa_limits, law=law, root=root) if point.label == Label.FOLD]


@takes_parameters
def end(m, n, parameters, law="ribbon", root=0):
    """Return (covering index, kappa_n) of the circle where the branch ends, or None. Raises as `curve`.

    None if the branch never returns to a circle (2n < m, except for the isotropic rod), or has infinite kappa_n somewhere on
    the way. The index is kappa_star there: negative, on some branches of the isotropic rod, if omega_1 is.

    Examples
    --------
    >>> end(1, 2, 0.3)
    (3, -0.5)
    """
    family = _family(law, m, n, parameters, root)
    if family.finish is None:
        return None
    signs = set()
    for _, _, ahead in _segments(family, 0.05):
        if _homoclinic(ahead):
            return None
        signs.add(np.sign(FLOAT.gradients(family.parts, ahead)[2][0]))
    return (family.finish, family.threshold(family.finish)) if len(signs) == 1 else None


def refine(point, digits):
    """Return kappa_n and kappa_star of a point of `curve`, to many digits.

    A fold is located again, and a circle stays a circle; every other point keeps its kappa_n. nu, and that kappa_n, are taken
    as the decimal numbers that Python prints (0.3 is 3/10).

    Parameters
    ----------
    point : ExactPoint or RodPoint
    digits : int
        Significant decimal digits. The time is a few seconds for 30, and grows with the cube.

    Returns
    -------
    kappa_n, kappa_star : mpmath.mpf

    Raises
    ------
    RuntimeError
        If the iteration does not converge.

    Examples
    --------
    >>> (fold,) = folds(1, 2, 0.3)
    >>> [str(value)[:10] for value in refine(fold, 20)]
    ['4.07566753', '1.51966095']
    """
    import mpmath  # only this function needs it

    coarse = _family(point.law, point.m, point.n, point.nu, point.root)

    def conditions(family, z, kappa_n, numerics):
        defect, turning = _turning(family, z, numerics)
        if point.label == Label.FOLD:
            return np.array([defect, turning])
        if point.label == Label.BRANCH_POINT:
            return np.array([defect, z[0]])
        return np.array([defect, family.values(z, numerics)[0] - kappa_n])

    z = point.coordinates
    steps = 1e-5 * np.eye(2)
    ahead, behind = (np.array([conditions(coarse, z + e, point.kappa_n, FLOAT) for e in sign * steps]) for sign in (1, -1))
    inverse = np.linalg.inv((ahead - behind).T / 2e-5)
    with mpmath.workdps(digits + 10):
        numerics = Numerics(digits + 4)
        fine = type(coarse)(point.m, point.n, mpmath.mpf(repr(point.nu)), point.root)
        z, kappa_n = numerics.array(z), mpmath.mpf(repr(point.kappa_n))
        for _ in range(digits):  # a chord: some six digits each time
            update = numerics.array(inverse @ conditions(fine, z, kappa_n, numerics).astype(float))
            z = z - update
            if max(abs(update)) < mpmath.mpf(10) ** (-digits - 2):
                return tuple(+value for value in fine.values(z, numerics)[:2])
    raise RuntimeError(f"no convergence to {digits} digits on branch ({point.m}, {point.n})")


def _law(law):
    """Return a law that is given by its name, or as it is."""
    found = LAWS.get(law, law)
    if type(found) is str:
        raise ValueError(f"law = {law!r} is none of {', '.join(map(repr, LAWS))}")
    return found


def _family(law, m, n, parameters, root):
    law = _law(law)
    if law not in _FAMILIES:
        raise ValueError(f"law = {law.name!r} is none of {', '.join(repr(known.name) for known in _FAMILIES)}")
    if root not in range(_FAMILIES[law].roots):
        raise ValueError(f"root = {root}: the {law.name} has no such threshold")
    (nu,) = law.named(parameters).values()
    _check(m, n, nu, root)
    return _FAMILIES[law](m, n, nu, root)


def _check(m, n, nu, root=0):
    _check_mode(m, n, nu, root)
    if m % (2 * n) == 0:  # every two-fold axis then lies in the mirror plane: the mean of d_3 normal to it is free
        raise ValueError(f"branch ({m}, {n}) does not close with R = 0, because m is a multiple of 2n")


def _check_mode(m, n, nu, root=0):
    if min(m, n) < 1 or (m == n and root == 0):  # K = 1 is the motion; K = -1/(1 + nu), the isotropic rod's other root, is not
        raise ValueError(f"(m, n) = ({m}, {n}) is not a buckling mode: need m, n >= 1 and n != m (a rigid motion)")
    if not -1 < nu < 1:
        raise ValueError(f"nu = {nu} is outside (-1, 1)")


def _q(c, A, kappa_n, nu):
    if A < 0 or c == nu * kappa_n:
        raise ValueError("need A >= 0 and c != nu kappa_n")
    q = A + 4 - 2 * (c - kappa_n) / (c - nu * kappa_n)
    if q <= 0:
        raise ValueError(f"q = {q:.3g} <= 0: eta does not oscillate through zero")
    return np.float64(q)


def _quadratures(A, q, numerics=FLOAT):
    """Return means over theta of |azimuth|/pi, 1/sqrt(eta^2 + q), eta^2/sqrt(eta^2 + q); and |mu/a|. A, q of one shape."""
    A, q = A[..., None], q[..., None]
    amplitude, size = (float(numerics.real(value).flat[0]) for value in (A, q))
    v = numerics.nodes(0.5 * np.log(size / amplitude) if amplitude > max(size, 0.0) else 0.0, 0.0)
    eta_squared, beta = A / (1 + numerics.exp(-2 * v)), (A + 4 - q) / 2
    mu = numerics.sqrt(beta**2 + A * q)
    weight = numerics.spacing / (numerics.pi * numerics.cosh(v) * numerics.sqrt(eta_squared + q))
    if abs(beta - A).flat[0] < 0.2 * np.sqrt(max(amplitude, 0.0)):  # d_3 passes close to the axis
        azimuth = mu * (beta + eta_squared) / ((beta - eta_squared) ** 2 + 4 * eta_squared)
    else:
        azimuth = mu * (beta - eta_squared) / ((beta - A) ** 2 + 4 * A / (1 + numerics.exp(2 * v)))
    return (azimuth * weight).sum(-1), weight.sum(-1), (eta_squared * weight).sum(-1), mu[..., 0]


def _defect(azimuth, m, n, numerics=FLOAT):
    """Return the azimuth of a quarter wave minus that of a closed loop, both over pi, modulo 1. sign(mu/a) = sign(m - n)."""
    defect = ((1 if m > n else -1) * azimuth * 2 * n - m) / (2 * n)
    return defect - np.round(np.asarray(numerics.real(defect)).astype(float))


class _Ribbon:
    """The ribbon's branch in z = (log(1 + A), log(q)/2); the same interface as `ribbon_model.exact_rods.Rod`."""

    roots = 1

    def __init__(self, m, n, nu, root=0):
        self.m, self.n, self.nu = m, n, nu
        self.finish = 2 * n - m if 2 * n > m else None

    def threshold(self, index):
        return bifurcation(index, self.n, self.nu)

    def circle(self, index):
        return np.array([0.0, np.log(2 * self.n / index)])

    def parts(self, x, y, numerics=FLOAT):
        """Return the defect of the azimuth over pi, c (1 - beta) and 1 - nu beta, shaped like x, y; kappa_n is their ratio."""
        A, q = numerics.expm1(x), numerics.exp(2 * y)
        azimuth, mean, mean_squared, _ = _quadratures(A, q, numerics)
        beta = (A + 4 - q) / 2
        return _defect(azimuth, self.m, self.n, numerics), 2 * self.n * (mean + mean_squared) * (1 - beta), 1 - self.nu * beta

    def values(self, z, numerics=FLOAT):
        """Return kappa_n, kappa_star, c, mu at z."""
        n, nu = self.n, self.nu
        A, q = numerics.expm1(z[:1]), numerics.exp(2 * z[1:])
        _, mean, mean_squared, mu = _quadratures(A, q, numerics)
        c, kappa_star, beta = 2 * n * (mean + mean_squared), 2 * n * (mean + nu * mean_squared), (A + 4 - q) / 2
        mu = mu * c * (1 - nu) / (1 - nu * beta)  # the last factors are a, without cancellation
        values = c * (1 - beta) / (1 - nu * beta), kappa_star, c, mu if self.m > n else -mu
        return tuple(value[0] for value in values)

    def point(self, z, label=""):
        kappa_n, kappa_star, c, mu = self.values(z)
        values = kappa_n, kappa_star, c, np.expm1(z[0]), np.exp(2 * z[1]), mu, c**2 / 2 - kappa_n * kappa_star
        return ExactPoint(self.m, self.n, float(self.nu), *map(float, values), label)

    def coordinates(self, point):
        return point.coordinates


#: The branches that the follower below follows, by their laws.
_FAMILIES = {LAWS[name]: family for name, family in {ExactPoint.law: _Ribbon, **RODS}.items()}


def _homoclinic(z):
    return z[1] < _HOMOCLINIC or z[0] > -2 * _HOMOCLINIC


def _tangent(family, z):
    gradient = FLOAT.gradients(family.parts, z)[0][1]
    return np.array([gradient[1], -gradient[0]]) / np.hypot(*gradient)


def _turning(family, z, numerics=FLOAT):
    """Return the defect, and d kappa_n/ds times denominator^2 and a factor of constant sign: zero at a fold, always finite."""
    (defect, across), numerator, denominator = numerics.gradients(family.parts, z)
    gradient = numerator[1] * denominator[0] - numerator[0] * denominator[1]
    return defect, gradient[0] * across[1] - gradient[1] * across[0]


def _correct(family, z, tangent):
    """Return the curve's point on the normal to `tangent` through z (Newton), or None if there is none nearby."""
    normal = np.array([-tangent[1], tangent[0]])
    for _ in range(7):
        value, gradient = FLOAT.gradients(family.parts, z)[0]
        update = -value / (gradient @ normal)
        if not abs(update) < 0.5:
            return None
        z = z + update * normal
        if abs(update) < 1e-10:  # convergence is quadratic: the remaining error is round-off
            return z
    return None


def _segments(family, step):
    """Yield (line, length, ahead) along the curve line(s) from the circle; the last ``ahead`` is homoclinic or has A < 0."""
    z = family.circle(family.m)
    tangent = _tangent(family, z)
    tangent, length = tangent * np.sign(tangent[0]), step / 10  # A grows from 0
    while length > _SHORTEST_STEP:
        ahead = _correct(family, z + length * tangent, tangent)
        turned = tangent if ahead is None else _tangent(family, ahead)
        cosine = turned @ tangent
        if ahead is None or abs(cosine) < 0.985:
            length /= 2
            continue
        yield lambda s, z=z, tangent=tangent: _correct(family, z + s * tangent, tangent), length, ahead
        if ahead[0] < 0 or _homoclinic(ahead):
            return
        z, tangent, length = ahead, turned * np.sign(cosine), min(1.5 * length, step)
    raise RuntimeError(f"branch ({family.m}, {family.n}) lost near A = {np.expm1(z[0]):.6g}, second unknown {z[1]:.6g}")


def _root(function, line, lower, upper):
    """Return s in [lower, upper] at which function(line(s)) changes sign."""
    from scipy.optimize import brentq  # .1 s, which a branch without a fold or a limit does not need

    return brentq(lambda s: function(line(s)), lower, upper, xtol=1e-14)
