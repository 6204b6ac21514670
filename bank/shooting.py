"""Values of radial problems by shooting: ``python -m bank.shooting`` (half a minute) prints them.

v'' + k v' / x = -f(v) with v(0) = top and v'(0) = 0 reaches its boundary value at x = X(top), so lam = X^2 on the unit
interval. Folds are where dv/dtop vanishes as well. Integrated by scipy's DOP853 with tolerances of 1e-13 together with the
equation of dv/dtop; values are good to 1e-11.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from bank.known import slope, zeros

#: From the centre to here, divided by the root of f and its slope, the first terms of the power series do: the next one is of
#: the order of the sixth power.
NEAR = 1e-3


@dataclass(frozen=True)
class Radial:
    """v'' + k v' / x = -f(v), v(X) = wall."""

    f: object
    slope: object
    k: int
    wall: float = 0.0

    def reach(self, top: float) -> tuple[float, float]:
        """Return lam and dv/dtop at the wall."""
        f, df = self.f(top), self.slope(top)
        near = NEAR / np.sqrt(1 + abs(f) + abs(df))
        a, b = -f / (2 * (self.k + 1)), f * df / (8 * (self.k + 1) * (self.k + 3))
        value, speed = top + a * near**2 + b * near**4, 2 * a * near + 4 * b * near**3
        c = -df / (2 * (self.k + 1))
        d = (df**2 + f * slope(self.slope)(top)) / (8 * (self.k + 1) * (self.k + 3))
        w, dw = 1 + c * near**2 + d * near**4, 2 * c * near + 4 * d * near**3

        def field(x, y):
            v, u, w, z = y
            return [u, -self.f(v) - self.k * u / x, z, -self.slope(v) * w - self.k * z / x]

        def at_wall(x, y):
            return y[0] - self.wall

        at_wall.terminal = True
        tight = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}
        first = [value, speed, w, dw]
        end = solve_ivp(field, (near, 1e4), first, events=at_wall, **tight).t_events[0][0]
        value, speed, w, dw = solve_ivp(field, (near, end), first, **tight).y[:, -1]
        beyond = (self.wall - value) / speed  # the event is interpolated
        return float(end + beyond) ** 2, float(w + beyond * dw)

    def folds(self, low: float, high: float, grid=60):
        """Return (top, lam) of the folds between two values of top."""
        tops = zeros(lambda top: self.reach(top)[1], low, high, grid)
        return [(top, self.reach(top)[0]) for top in tops]


def arrhenius(u):
    return np.exp(u / (1 + 0.2 * u))


def effective(c):
    """First-order reaction with heat: gamma = 20, beta = 0.6 (Weisz & Hicks 1962)."""
    return c * np.exp(12 * (1 - c) / (1 + 0.6 * (1 - c)))


PROBLEMS = {
    "ball": Radial(np.exp, np.exp, 2),
    "heat": Radial(arrhenius, lambda u: arrhenius(u) / (1 + 0.2 * u) ** 2, 0),
    "strip": Radial(lambda u: 1 / (1 - u) ** 2, lambda u: 2 / (1 - u) ** 3, 0),
    "membrane": Radial(lambda u: 1 / (1 - u) ** 2, lambda u: 2 / (1 - u) ** 3, 1),
    "pellet": Radial(lambda c: -effective(c), lambda c: -effective(c) * (1 / c - 12 / (1 + 0.6 * (1 - c)) ** 2), 2, 1.0),
}
WINDOWS = {"ball": (0.2, 10.0), "heat": (0.2, 40.0), "strip": (0.02, 0.9), "membrane": (0.02, 0.95), "pellet": (0.999, 0.001)}


def main():
    for name, problem in PROBLEMS.items():
        low, high = WINDOWS[name]
        for top, lam in problem.folds(low, high):
            print(f"{name:10} fold  top = {top!r}, lam = {lam!r}")
        print(f"{name:10} end   top = {high!r}, lam = {problem.reach(high)[0]!r}")


if __name__ == "__main__":
    main()
