r"""# A chemical oscillator: colours that come and go

Chlorine dioxide, iodine and malonic acid react in a stirred beaker, and the colour changes to and fro. The model of
Lengyel, Rábai and Epstein (1990) has two concentrations, iodide $x$ and chlorite $y$:

$$\dot x = a - x - \frac{4 x y}{1 + x^2}, \qquad \dot y = b\, x \left(1 - \frac{y}{1 + x^2}\right).$$

The steady state loses its stability at a Hopf point when $b$ falls. The bifurcation is supercritical: the oscillation
begins small.

**Check:** the Hopf point lies at $b = 3a/5 - 25/a$ (Strogatz, *Nonlinear Dynamics and Chaos*, section 8.3), 3.5 for $a =
10$.
"""

import matplotlib.pyplot as plt

import contin


def beaker(u, p):
    return p.a - u.x - 4 * u.x * u.y / (1 + u.x**2), p.b * u.x * (1 - u.y / (1 + u.x**2))


steady = contin.solve(contin.AlgebraicProblem(beaker, ["x", "y"], {"a": 10.0, "b": 5.0}), [2.0, 5.0])
found = contin.diagram(steady, free=["b"], depth=1, limits={"b": (0.3, 5)}, max_step=0.5)
(hopf,) = [junction.point for junction in found.junctions]
print(f"{hopf.name} at b = {hopf['b']:.12f}, frequency {hopf.details['frequency']:.6f}")
assert abs(hopf["b"] - 3.5) < 1e-10

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
found.plot("b", "x", axes=left)
left.set(xlabel="b", ylabel="iodide x: steady, and extremes of cycles")
for point in found.branches[-1].points[2::4]:
    point.plot("portrait", states=["x", "y"], axes=right)
plt.show()
