"""Complex numbers in users' functions: values and two derivatives against mpmath with 40 digits."""

import cmath
import warnings

import mpmath
import numpy as np
import pytest
import scipy.sparse

import contin
from contin.errors import InterpretedWarning
from contin.lowlevel import Batch

NONE = np.empty((0, 1))

#: (the function in Python of the complex number z = x + i (1 - x / 2), the same with mpmath); a real result.
CASES = {
    "exp": (lambda z: np.exp(z).imag, lambda z: mpmath.exp(z).imag),
    "log": (lambda z: np.log(z).imag + np.log(z).real, lambda z: mpmath.log(z).imag + mpmath.log(z).real),
    "sqrt": (lambda z: np.sqrt(z).imag, lambda z: mpmath.sqrt(z).imag),
    "sqrt below the axis": (lambda z: cmath.sqrt(z.conjugate()).imag, lambda z: mpmath.sqrt(mpmath.conj(z)).imag),
    "sqrt, left": (lambda z: cmath.sqrt(1j * z - 2).imag, lambda z: mpmath.sqrt(1j * z - 2).imag),
    "sin": (lambda z: cmath.sin(z).real, lambda z: mpmath.sin(z).real),
    "cos": (lambda z: np.cos(z).imag, lambda z: mpmath.cos(z).imag),
    "sinh": (lambda z: np.sinh(z).imag, lambda z: mpmath.sinh(z).imag),
    "cosh": (lambda z: cmath.cosh(z).real, lambda z: mpmath.cosh(z).real),
    "tan": (lambda z: np.tan(z).real, lambda z: mpmath.tan(z).real),
    "tanh": (lambda z: cmath.tanh(z).imag, lambda z: mpmath.tanh(z).imag),
    "abs": (lambda z: abs(z) + np.abs(z - 2), lambda z: abs(z) + abs(z - 2)),
    "phase": (lambda z: cmath.phase(z) + np.angle(z * z), lambda z: mpmath.arg(z) + mpmath.arg(z * z)),
    "quotient": (lambda z: ((2 - 1j) / z + z / (1 + 3j) - z / 2).imag, lambda z: ((2 - 1j) / z + z / (1 + 3j) - z / 2).imag),
    "powers": (lambda z: (z**3 + z**-2 + z**0.5 + 2**z).real, lambda z: (z**3 + z**-2 + z**0.5 + 2**z).real),
    "complex": (lambda z: complex(z.imag, z.real**2).conjugate().imag * 2, lambda z: -2 * z.real**2),
    "rect": (lambda z: cmath.rect(z.real, z.imag).imag, lambda z: z.real * mpmath.sin(z.imag)),
    "where": (lambda z: np.where(z.real > 1, z * z, 1j * z).imag, lambda z: ((z * z) if z.real > 1 else 1j * z).imag),
    "equal": (lambda z: (z * z).real if z == z + 0j else 0.0, lambda z: (z * z).real),
}  # fmt: skip


@pytest.mark.sample(20)
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("x", [0.7, 3.1, -1.3])
def test_values_and_derivatives(name, x):
    own, exact = CASES[name]
    batch = Batch([lambda u, p: own(u.x + 1j * (1 - u.x / 2))], [0], ["x"], [], times=False)
    assert batch.interpreted is None, batch.describe()
    given = np.zeros(1), np.array([[x]]), NONE, np.empty(0)
    values, slopes = batch.jacobian(*given, batch.columns([]))
    second = batch.along(*given, [np.ones((1, 1)), np.ones((1, 1))])
    with mpmath.workdps(40):

        def of(t):
            return mpmath.mpf(exact(mpmath.mpc(t, 1 - t / 2)))

        known = [float(mpmath.diff(of, mpmath.mpf(x), order)) for order in range(3)]
    found = [values[0, 0], slopes[0, 0, 0], second[0, 0]]
    assert found == pytest.approx(known, rel=1e-12, abs=1e-13)


def test_arrays_matrices_and_norms():
    """Every way to write it is evaluated with NumPy on plain numbers too."""
    rng = np.random.default_rng(3)
    A = rng.normal(size=(3, 3)) + 1j * rng.normal(size=(3, 3))
    S = scipy.sparse.csr_array(A * (np.abs(A) > 1))
    real = scipy.sparse.csr_array(A.real)

    def function(u, p):
        v = u[:3] + 1j * u[3:]
        held = np.zeros(3, dtype=complex)
        held[1:] = v[:2]
        power = v * np.conj(A @ v) + S @ v + real @ v + held.conj()
        return np.concatenate(
            [power.real, np.imag(power), [np.linalg.norm(v), np.vdot(v, power).real, np.sum(v).imag, np.mean(v**2).real]]
        )

    names = [f"u{i}" for i in range(6)]
    with warnings.catch_warnings():
        warnings.simplefilter("error", InterpretedWarning)
        batch = Batch([function], [10], names, [], times=False)
        u = rng.normal(size=(4, 6))
        values = batch.values(np.zeros(4), u, np.empty((0, 4)), np.empty(0))
    assert batch.interpreted is None, batch.describe()
    assert values == pytest.approx(np.array([function(each, None) for each in u]), rel=1e-13)


def test_functions_made_by_exec_and_methods_of_their_classes():
    """Such a scope has no name, and the module of its classes is that of built-in ones."""
    scope = {}
    exec(
        "import math\n"
        "class Truss:\n"
        "    span = 1.0\n"
        "    def force(self, w):\n"
        "        return math.sqrt(self.span**2 + w**2)\n"
        "truss = Truss()\n"
        "residual = lambda u, p: (truss.force(u.w) - p.a,)\n",
        scope,
    )
    problem = contin.AlgebraicProblem(scope["residual"], ["w"], {"a": 2.0})
    assert "Python" not in str(problem.describe())
    assert contin.solve(problem, [1.0]).x[0] == pytest.approx(3**0.5, rel=1e-14)


def test_a_complex_result_is_refused_in_a_sentence():
    problem = contin.AlgebraicProblem(lambda u, p: (u.x + 1j * p.a,), ["x"], {"a": 2.0})
    with pytest.raises(contin.ProblemError, match="complex"):
        contin.solve(problem, [1.0])
