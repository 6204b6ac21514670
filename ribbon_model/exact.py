"""The exact (quadrature) solution of the primary branches: a yardstick, independent of any collocation.

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

Units: bending modulus B = 1, length L = 2 pi. Source of every number: quadrature of the R = 0 equilibrium.
"""

from dataclasses import dataclass

import numpy as np

# Trapezoidal rule in v = log(tan(theta)). The integrands decay like exp(-|v|), and their poles stay at |Im v| = pi/2
# (above 1 where d_2 is used) however small q is: the period may diverge, the accuracy does not.
_SPACING, _TAIL = 1 / 6, 38.0
_IMAGINARY_STEP = 1e-30
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


def bifurcation(m, n, nu):
    """kappa_n = m K^{m,n} at which the branch leaves the m-covered circle, eq. (27), regular at nu = 0.

    Raises ValueError if (m, n) is no buckling mode or nu is outside (-1, 1), and ZeroDivisionError if the branch starts
    at infinite kappa_n (some nu < 0).
    """
    _check_mode(m, n, nu)
    return m * (2 * n**2 - m**2) / (m**2 + 2 * nu * (n**2 - m**2))  # (27) with the common factor nu cancelled


def residuals(c, A, kappa_n, m, n, nu):
    """Defects of closure of a quarter wave: shape (2,), length minus pi/2n, azimuth minus pi m/2n in [-pi/2, pi/2].

    Raises ValueError as `bifurcation`, if m is a multiple of 2n (the centreline would stay open), and if A < 0,
    c = nu kappa_n or q <= 0 (eta would not oscillate through zero).
    """
    _check(m, n, nu)
    azimuth, mean, mean_squared, _ = _quadratures(np.float64(A), _q(c, A, kappa_n, nu))
    return np.pi * np.array([(mean + mean_squared) / c - 1 / (2 * n), _defect(azimuth, m, n)])


def solve(m, n, nu, guess, *, kappa_n=None, eta_max_squared=None):
    """The point of the branch with given kappa_n, or given amplitude, nearest a guess in the sense of Newton's method.

    Parameters
    ----------
    guess : ExactPoint or (c, A, kappa_n)
    kappa_n, eta_max_squared : float
        Exactly one of the two: what the point must have.

    Raises
    ------
    ValueError
        On both or neither target, or where `residuals` raises it.
    RuntimeError
        If Newton does not converge. Near a fold of kappa_n prescribe the amplitude, and conversely.
    """
    _check(m, n, nu)
    if (kappa_n is None) == (eta_max_squared is None):
        raise ValueError("give exactly one of kappa_n and eta_max_squared")
    known = isinstance(guess, ExactPoint)
    A, q = (guess.eta_max_squared, guess.q) if known else (guess[1], _q(*guess, nu))
    z = np.array([np.log1p(A), np.log(q) / 2])
    for _ in range(30):
        defect, numerator, denominator = _along(z, m, n, nu)
        if kappa_n is None:
            target = np.expm1(z[0]) - eta_max_squared, np.array([np.exp(z[0]), 0.0])
        else:
            target = tuple(numerator[i] - kappa_n * denominator[i] for i in (0, 1))
        update = np.linalg.solve([defect[1], target[1]], [-defect[0], -target[0]])
        size = np.abs(update).max()
        z = z + update * min(1, 0.5 / max(size, 1e-300))  # logarithms: half a unit is already far
        if size < 1e-11:
            return _point(z, m, n, nu)
    raise RuntimeError(f"no convergence on branch ({m}, {n}): start nearer, or prescribe the other quantity")


def curve(m, n, nu=0.3, kappa_limits=(-100.0, 100.0), step=0.05):
    """The branch from the m-covered circle to the (2n-m)-covered one, or to a limit of kappa_n.

    Parameters
    ----------
    kappa_limits : (float, float)
        The curve stops where kappa_n leaves this interval.
    step : float
        Largest arclength between points in the plane (log(1 + A), log(q)/2).

    Returns
    -------
    list of ExactPoint
        In order, folds included; the last label says why the curve ends.

    Raises
    ------
    ValueError
        As `bifurcation`, if m is a multiple of 2n, or if the branch starts outside `kappa_limits`.
    RuntimeError
        If the follower cannot proceed.
    """
    _check(m, n, nu)
    start, (lowest, highest) = bifurcation(m, n, nu), kappa_limits
    if not lowest <= start <= highest:
        raise ValueError(f"branch ({m}, {n}) starts at kappa_n = {start:.6g}, outside {tuple(kappa_limits)}")
    sign = np.sign(_along(_circle(m, n), m, n, nu)[2][0])

    def room(z):  # > 0 inside the limits; continuous where kappa_n passes through infinity
        _, (numerator, _), (denominator, _) = _along(z, m, n, nu)
        return sign * min(highest * denominator - numerator, numerator - lowest * denominator)

    def turning(z):
        return _turning(z, m, n, nu)

    points = [_point(_circle(m, n), m, n, nu, "BP")]
    for line, length, ahead in _segments(m, n, step):
        stops = [(length, ahead, "MX" if ahead[1] < _HOMOCLINIC else "")]
        if turning(line(0.0)) * turning(ahead) < 0:
            fold = _root(turning, line, 0.0, length)
            stops.insert(0, (fold, line(fold), "LP"))
        last = 0.0
        for s, z, label in stops:
            if z[0] < 0 and room(_circle(2 * n - m, n)) >= 0:
                return [*points, _point(_circle(2 * n - m, n), m, n, nu, "BP")]
            if room(z) < 0:
                return [*points, _point(line(_root(room, line, last, s)), m, n, nu, "EP")]
            points.append(_point(z, m, n, nu, label))
            last = s
    return points


def folds(m, n, nu=0.3, kappa_limits=(-100.0, 100.0)):
    """The points of `curve` at which kappa_n is stationary, in order. Raises as `curve` does."""
    return [point for point in curve(m, n, nu, kappa_limits) if point.label == "LP"]


def end(m, n, nu):
    """(covering index, kappa_n) of the circle where the branch ends, or None. Raises as `curve`.

    None if the branch never returns to a circle (2n < m), or has infinite kappa_n somewhere on the way.
    """
    _check(m, n, nu)
    if 2 * n < m:
        return None
    signs = {np.sign(_along(ahead, m, n, nu)[2][0]) for _, _, ahead in _segments(m, n, 0.05)}
    return (2 * n - m, bifurcation(2 * n - m, n, nu)) if len(signs) == 1 else None


def _check(m, n, nu):
    _check_mode(m, n, nu)
    if m % (2 * n) == 0:  # every two-fold axis then lies in the mirror plane: the mean of d_3 normal to it is free
        raise ValueError(f"branch ({m}, {n}) does not close with R = 0, because m is a multiple of 2n")


def _check_mode(m, n, nu):
    if min(m, n) < 1 or m == n:
        raise ValueError(f"(m, n) = ({m}, {n}) is no buckling mode: need m, n >= 1 and n != m (a rigid motion)")
    if not -1 < nu < 1:
        raise ValueError(f"nu = {nu} is outside (-1, 1)")


def _q(c, A, kappa_n, nu):
    if A < 0 or c == nu * kappa_n:
        raise ValueError("need A >= 0 and c != nu kappa_n")
    q = A + 4 - 2 * (c - kappa_n) / (c - nu * kappa_n)
    if q <= 0:
        raise ValueError(f"q = {q:.3g} <= 0: eta does not oscillate through zero")
    return np.float64(q)


def _quadratures(A, q):
    """Means over theta of |azimuth|/pi, 1/sqrt(eta^2 + q), eta^2/sqrt(eta^2 + q); and |mu/a|. A, q of one shape."""
    A, q = A[..., None], q[..., None]
    amplitude, size = max(A.real.flat[0], 0.0), q.real.flat[0]
    lower = 0.5 * np.log(size / amplitude) if amplitude > size else 0.0
    v = _SPACING * np.arange((lower - _TAIL) // _SPACING, _TAIL // _SPACING)
    eta_squared, beta = A / (1 + np.exp(-2 * v)), (A + 4 - q) / 2
    mu = np.sqrt(beta**2 + A * q)
    weight = _SPACING / (np.pi * np.cosh(v) * np.sqrt(eta_squared + q))
    if abs(beta - A).flat[0] < 0.2 * np.sqrt(amplitude):  # d_3 passes close to the axis
        azimuth = mu * (beta + eta_squared) / ((beta - eta_squared) ** 2 + 4 * eta_squared)
    else:
        azimuth = mu * (beta - eta_squared) / ((beta - A) ** 2 + 4 * A / (1 + np.exp(2 * v)))
    return (azimuth * weight).sum(-1), weight.sum(-1), (eta_squared * weight).sum(-1), mu[..., 0]


def _defect(azimuth, m, n):
    """Azimuth of a quarter wave minus that of a closed loop, both over pi, modulo 1. sign(mu/a) = sign(m - n)."""
    defect = np.sign(m - n) * azimuth - m / (2 * n)
    return defect - np.round(np.real(defect))


def _along(z, m, n, nu):
    """(value, gradient (2,)) of the azimuth's defect, of c (1 - beta) and of 1 - nu beta; kappa_n is their ratio."""
    x, rho = z[:, None] + 1j * _IMAGINARY_STEP * np.eye(2)  # complex step: gradients exact to round-off
    A, q = np.expm1(x), np.exp(2 * rho)
    azimuth, mean, mean_squared, _ = _quadratures(A, q)
    beta = (A + 4 - q) / 2
    results = _defect(azimuth, m, n), 2 * n * (mean + mean_squared) * (1 - beta), 1 - nu * beta
    return [(result[0].real, result.imag / _IMAGINARY_STEP) for result in results]


def _point(z, m, n, nu, label=""):
    A, q = np.expm1(z[0]), np.exp(2 * z[1])
    _, mean, mean_squared, mu = _quadratures(A, q)
    c, kappa_star, beta = 2 * n * (mean + mean_squared), 2 * n * (mean + nu * mean_squared), (A + 4 - q) / 2
    kappa_n = c * (1 - beta) / (1 - nu * beta)
    mu = np.sign(m - n) * mu * c * (1 - nu) / (1 - nu * beta)  # the last factors are a, without cancellation
    values = kappa_n, kappa_star, c, A, q, mu, c**2 / 2 - kappa_n * kappa_star
    return ExactPoint(m, n, float(nu), *map(float, values), label)


def _circle(m, n):
    return np.array([0.0, np.log(2 * n / m)])


def _tangent(z, m, n):
    gradient = _along(z, m, n, 0.0)[0][1]
    return np.array([gradient[1], -gradient[0]]) / np.hypot(*gradient)


def _turning(z, m, n, nu):
    """d kappa_n/ds times (1 - nu beta)^2 and a factor of constant sign: zero at a fold, finite where kappa_n is not."""
    (_, across), numerator, denominator = _along(z, m, n, nu)
    gradient = numerator[1] * denominator[0] - numerator[0] * denominator[1]
    return gradient[0] * across[1] - gradient[1] * across[0]


def _correct(z, tangent, m, n):
    """The curve's point on the normal to `tangent` through z (Newton), or None if there is none nearby."""
    normal = np.array([-tangent[1], tangent[0]])
    for _ in range(7):
        value, gradient = _along(z, m, n, 0.0)[0]
        update = -value / (gradient @ normal)
        if not abs(update) < 0.5:
            return None
        z = z + update * normal
        if abs(update) < 1e-10:  # convergence is quadratic: what is left is round-off
            return z
    return None


def _segments(m, n, step):
    """Walk from the m-covered circle: yield (line, length, ahead), with line(s) the curve at 0 <= s <= length.

    Ends with the first `ahead` at negative A, or nearly homoclinic.
    """
    z = _circle(m, n)
    tangent = _tangent(z, m, n)
    tangent, length = tangent * np.sign(tangent[0]), step / 10  # A grows from 0
    while length > _SHORTEST_STEP:
        ahead = _correct(z + length * tangent, tangent, m, n)
        turned = tangent if ahead is None else _tangent(ahead, m, n)
        cosine = turned @ tangent
        if ahead is None or abs(cosine) < 0.985:
            length /= 2
            continue
        yield lambda s, z=z, tangent=tangent: _correct(z + s * tangent, tangent, m, n), length, ahead
        if ahead[0] < 0 or ahead[1] < _HOMOCLINIC:
            return
        z, tangent, length = ahead, turned * np.sign(cosine), min(1.5 * length, step)
    raise RuntimeError(f"branch ({m}, {n}) lost near A = {np.expm1(z[0]):.6g}, q = {np.exp(2 * z[1]):.6g}")


def _root(function, line, lower, upper):
    """s in [lower, upper] at which function(line(s)) changes sign (Illinois false position)."""
    ends = [lower, upper]
    values = [function(line(s)) for s in ends]
    last = None
    for _ in range(80):
        s = (ends[0] * values[1] - ends[1] * values[0]) / (values[1] - values[0])
        value = function(line(s))
        if value == 0 or min(abs(s - end) for end in ends) < 1e-14:
            break
        side = int(value * values[1] > 0)
        ends[side], values[side] = s, value
        if side == last:  # the other end has stayed twice: halve its weight, or convergence is linear
            values[1 - side] /= 2
        last = side
    return s
