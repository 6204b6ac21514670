"""The quadratures of the primary branches of the two rods, for `ribbon_model.exact`, which follows them.

Both rods have H = (M_1 + kappa_n)**2/2 + alpha M_2**2/2 + beta M_3**2/2 with (alpha, beta) = (0, (1 + nu)/2) for the flat one
and (1, 1 + nu) for the isotropic one. With R = 0, M' = M x omega keeps |M| and H: M runs along the intersection of a sphere
and a quadric, and a quarter wave runs from M_3 = 0 (mirror) to M_2 = 0 (two-fold axis d_2). Both intersections take an angle
0 < theta < pi/2 in which, with s = sin(theta)**2, p and q > 0 constants and C a constant scale,

    dtheta/dS = C sqrt(p (1 - s) + q s),      M_2**2 : M_3**2 = (1 - s) (p (1 - s) + q s) : s.

The length gives C. The precession about M is that of d_1: its azimuth, at the rate

    |M| (alpha M_2**2 + beta M_3**2)/(M_2**2 + M_3**2) = |M| (alpha + (beta - alpha) s/(s + (1 - s) (p (1 - s) + q s))),

is never singular, since M_2 and M_3 do not vanish together; on a circle their ratio stays finite. So there is no jump to
correct. d_1 is normal to d_3 at the mirror and to d_2 at the axis; so, d_2 being turned by pi m/2n, d_1 is by
pi m/2n - pi/2, up to the sense, and the loop closes if

    C = n mean(1/sqrt(p (1 - s) + q s)),      |M|/C mean((alpha + (beta - alpha) s/(...))/sqrt(...)) = |m -+ n|/n,

means being over theta, with the lower sign on root 1 of the isotropic rod, where kappa_n < 0.

Flat rod: M_3 = 0 where omega_1 = C > 0, and omega_1 = C cos(phi), M_3 = C sin(phi)/sqrt(beta), tan(phi/2) = sqrt(A) sin(theta),

    p = (q + (1 - beta) A/(1 + A))/(1 + A),      (|M|/C)**2 = (1 - k)**2 + 4 A p/beta,
    kappa_n/C = k = (q - (1 - beta) (1 - A)/(1 + A))/beta.

A = tan(phi_max/2)**2 and q are the unknowns. p, q -> 0 are homoclinic.

Isotropic rod: M_3 = sqrt(A) kappa_n sin(theta), M_1 = kappa_n (U - nu A s/2), C = |kappa_n| (M_3 is a Duffing oscillator),

    p = 1 - nu U + nu**2 A/4,      q = p + nu**2 A/4,      (|M|/C)**2 = U**2 + A p.

A and U are the unknowns. kappa_n never changes sign. All these branches end on a circle: A and U are bounded because
the precession is, and p = 0 would need an infinite one.

Source of the quadratures: M' = M x omega and the two invariants, as above. Units: B = 1, L = 2 pi.
"""

from dataclasses import dataclass

import numpy as np


class Numerics:
    """Elementary functions on arrays, and a trapezoidal rule in v = log(tan(theta)): double precision, or mpmath's.

    The integrands decay like exp(-|v|), and their poles stay at |Im v| = pi/2 (above 1 for some azimuths) however near a
    homoclinic orbit is: the period may diverge, the accuracy does not. The caller sets mpmath's precision.
    """

    def __init__(self, digits=None):
        if digits is None:
            self.pi, self.spacing, self.tail, self.tiny = np.pi, 1 / 6, 38.0, 1e-30
            self.array, self.real, self.imag = np.asarray, np.real, np.imag
            functions, wrap = np, lambda function: function
        else:
            import mpmath

            scale = (digits + 4) * mpmath.log(10)
            self.pi, self.spacing, self.tail = mpmath.pi, 2 * mpmath.pi / scale, float(scale)
            self.tiny = mpmath.mpf(10) ** (-2 * digits)  # the imaginary step
            self.real, self.imag = np.frompyfunc(mpmath.re, 1, 1), np.frompyfunc(mpmath.im, 1, 1)
            self.array = np.frompyfunc(mpmath.mpf, 1, 1)
            functions, wrap = mpmath, lambda function: np.frompyfunc(function, 1, 1)
        for name in ("exp", "expm1", "log", "sqrt", "sinh", "cosh"):
            setattr(self, name, wrap(getattr(functions, name)))

    def nodes(self, lower, upper):
        """Return the nodes v, for integrands that have decayed a tail's length outside [lower, upper], shape (nodes,)."""
        spacing = float(self.spacing)
        return self.spacing * self.array(np.arange((lower - self.tail) // spacing, (upper + self.tail) // spacing))

    def gradients(self, function, z):
        """Return (value, gradient (2,)) of every result of function(x, y, numerics), by complex steps: exact to round-off."""
        steps = self.array(np.eye(2)) * (1j * self.tiny)
        results = function(*(z[:, None] + steps), self)
        return [(self.real(result)[0], self.imag(result) / self.tiny) for result in results]


FLOAT = Numerics()


@dataclass(frozen=True)
class RodPoint:
    """One equilibrium of a rod on the primary branch (m, n) (B = 1, L = 2 pi).

    `kappa_star` is the mean of omega_1, `H` the complementary energy per length, `amplitude` A above, `constant` is q (flat
    rod) or U (isotropic rod), the moment is `mu` e_z with e_z the axis about which the centreline turns m times, `energy` is
    the strain energy divided by L, without kappa_n**2/2. `label` is as for `ribbon_model.exact.ExactPoint`.
    """

    law: str
    root: int
    m: int
    n: int
    nu: float
    kappa_n: float
    kappa_star: float
    H: float
    amplitude: float
    constant: float
    mu: float
    energy: float
    label: str = ""

    @property
    def parameters(self) -> dict[str, float]:
        """Those of the law, by name."""
        return {"nu": self.nu}

    @property
    def coordinates(self) -> np.ndarray:
        """The point in the plane of the unknowns, shape (2,), in which the branch is a smooth curve."""
        return RODS[self.law](self.m, self.n, self.nu, self.root).coordinates(self)


class Rod:
    """One branch: unknowns z = (log(1 + A), a function of the other constant), one equation.

    Attributes
    ----------
    finish : int or None
        The covering index of the circle where the branch may end, negative if omega_1 < 0 there.
    roots : int
        Number of thresholds on a circle.
    """

    roots = 1

    name: str
    alpha: int
    beta: float

    def __init__(self, m, n, nu, root=0):
        self.m, self.n, self.nu, self.root = m, n, nu, root
        self.finish = self.covering()

    def parts(self, x, y, numerics=FLOAT):
        """Return the defect of the azimuth over pi, numerator and denominator of kappa_n, all shaped like x, y."""
        A, p, q, moment, k = self.constants(x, y, numerics)
        inverse, ratio, _ = self._means(A, p, q, y, numerics)
        turn = self.n * moment * (self.alpha * inverse + (self.beta - self.alpha) * ratio)
        return (turn - abs(self.sense * self.m - self.n)) / (2 * self.n), self.n * inverse * k, 1 + 0 * x

    def values(self, z, numerics=FLOAT):
        """Return kappa_n, kappa_star, H, mu at z."""
        x, y = z[:, None]
        A, p, q, moment, k = self.constants(x, y, numerics)
        inverse, _, strain = self._means(A, p, q, y, numerics)
        C = self.n * inverse
        H = C**2 * (self.omega_1(A, y, 0, numerics) ** 2 + self.alpha * A * p) / 2  # at theta = 0
        mu = C * moment if self.root or self.m > self.n else -C * moment
        return tuple(value[0] for value in (C * k, self.n * strain, H, mu))

    def point(self, z, label=""):
        kappa_n, kappa_star, H, mu = self.values(z)
        values = kappa_n, kappa_star, H, np.expm1(z[0]), self.constant(np.expm1(z[0]), z[1]), mu, H - kappa_n * kappa_star
        return RodPoint(self.name, self.root, self.m, self.n, float(self.nu), *map(float, values), label)

    def coordinates(self, point):
        return self.locate(point.amplitude, point.constant)

    @property
    def sense(self):
        """Sign of kappa_n for the isotropic rod."""
        return -1 if self.root else 1

    def _means(self, A, p, q, y, numerics):
        """Means over theta of 1/sqrt, s/(...)/sqrt, omega_1/C/sqrt, of the arguments' shape."""
        A, p, q, y = A[..., None], p[..., None], q[..., None], y[..., None]
        low, high = (float(numerics.real(value).flat[0]) for value in (p, q))
        if not min(low, high) > 0:  # a trial step out of the domain: the corrector rejects it
            return ((A + np.nan).sum(-1),) * 3
        middle = 0.5 * np.log(low / high)
        v = numerics.nodes(min(middle, 0.0), max(middle, 0.0))
        s, c = 1 / (1 + numerics.exp(-2 * v)), 1 / (1 + numerics.exp(2 * v))
        rate = p * c + q * s
        weight = numerics.spacing / (numerics.pi * numerics.cosh(v) * numerics.sqrt(rate))
        strain = self.omega_1(A, y, s, numerics)
        return weight.sum(-1), (weight * s / (s + c * rate)).sum(-1), (weight * strain).sum(-1)


class FlatRod(Rod):
    """z = (log(1 + A), log(q)/2)."""

    name, alpha = "flat rod", 0
    beta = property(lambda self: (1 + self.nu) / 2)

    def covering(self):
        return 2 * self.n - self.m if 2 * self.n > self.m else None

    def threshold(self, index):
        """kappa_n on the circle where omega_1 = index."""
        return index * (1 + ((self.n / index) ** 2 - 1) / self.beta)

    def circle(self, index):
        return self.locate(0.0, (self.n / index) ** 2)

    def locate(self, A, q):
        return np.array([np.log1p(A), np.log(q) / 2])

    def constant(self, A, y):
        """q."""
        return np.exp(2 * y)

    def constants(self, x, y, numerics):
        """A, p, q, |M|/C, kappa_n/C."""
        A, q, beta = numerics.expm1(x), numerics.exp(2 * y), self.beta
        p = (q + (1 - beta) * A / (1 + A)) / (1 + A)
        k = (q - (1 - beta) * (1 - A) / (1 + A)) / beta
        remainder = (1 - q - 2 * (1 - beta) * A / (1 + A)) / beta  # 1 - k
        return A, p, q, numerics.sqrt(remainder**2 + 4 * A * p / beta), k

    def omega_1(self, A, y, s, numerics):
        """omega_1/C = cos(phi)."""
        return (1 - A * s) / (1 + A * s)


class IsotropicRod(Rod):
    """z = (log(1 + A), -log(p)/nu), whose limit at nu = 0 is U."""

    name, alpha, roots = "isotropic rod", 1, 2
    beta = property(lambda self: 1 + self.nu)

    def covering(self):
        return self.sense * 2 * self.n - self.m

    def threshold(self, index):
        """kappa_n on the circle where omega_1 = index: there p = (n/kappa_n)**2, a quadratic equation."""
        half = self.nu * index / 2
        return float((half + self.sense * np.hypot(half, np.sqrt(self.beta) * self.n)) / self.beta)

    def circle(self, index):
        kappa_n = self.threshold(index)
        return self.locate(0.0, (index - kappa_n) / kappa_n)

    def locate(self, A, U):
        return np.array([np.log1p(A), -np.log1p(self.nu * (self.nu * A / 4 - U)) / self.nu if self.nu else U])

    def constant(self, A, y, numerics=FLOAT):
        """U."""
        return (-numerics.expm1(-self.nu * y) / self.nu if self.nu else y) + self.nu * A / 4

    def constants(self, x, y, numerics):
        """A, p, q, |M|/C, kappa_n/C."""
        A, p = numerics.expm1(x), numerics.exp(-self.nu * y)
        return A, p, p + self.nu**2 * A / 4, numerics.sqrt(self.constant(A, y, numerics) ** 2 + A * p), self.sense

    def omega_1(self, A, y, s, numerics):
        """omega_1/C."""
        return self.sense * (1 + self.constant(A, y, numerics) - self.nu * A * s / 2)


RODS = {rod.name: rod for rod in (FlatRod, IsotropicRod)}
