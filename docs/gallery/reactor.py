r"""# A stirred reactor: ignition, extinction, oscillation

In a tank that is stirred, A becomes B and sets heat free; the rate grows with the temperature. With the conversion $x$, the
temperature $y$ and the Damköhler number $D$ (Uppal, Ray & Poore 1974)

$$\dot x = -x + D (1 - x) e^y, \qquad \dot y = -y + B D (1 - x) e^y - 3 y .$$

The curve of steady states is an S: the reactor ignites at one fold and goes out at the other. The burning state is
unstable, too, up to a Hopf point. The oscillations that begin there become large within a narrow range of $D$.

**Check:** with $4y = Bx$ at steady states, the folds have $x (1 - x) = 4/B$, and the Hopf point $Bx - 5 = x/(1 - x)$; here
$B = 22$.
"""

import math

import matplotlib.pyplot as plt

import contin


def tank(u, p):
    rate = p.D * (1 - u.x) * math.exp(u.y)
    return rate - u.x, 22 * rate - 4 * u.y


cold = contin.solve(contin.AlgebraicProblem(tank, ["x", "y"], {"D": 0.0}), [0.0, 0.0])
limits = {"D": (0, 0.12), "period": (0, 8)}
found = contin.diagram(cold, free=["D"], depth=1, limits=limits, max_step=0.2)
steady, cycles = found.branches[0], found.branches[-1]
(hopf,) = [junction.point for junction in found.junctions]
folds = steady.labelled("LP")
print("ignition and extinction at D =", [round(fold["D"], 9) for fold in folds], "Hopf point at D =", round(hopf["D"], 9))
roots = [(1 + sign * math.sqrt(1 - 16 / 22)) / 2 for sign in (-1, 1)]
burning = (26 + math.sqrt(26**2 - 4 * 22 * 5)) / 44  # the root of 22 x - 5 = x / (1 - x) at the hot end
for point, x in zip([*folds, hopf], [*roots, burning]):
    assert abs(point["D"] - x * math.exp(-22 * x / 4) / (1 - x)) < 1e-9

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
found.plot("D", "x", axes=left)
left.set(xlabel="Damköhler number D", ylabel="conversion x: steady, and extremes of cycles")
for point in cycles.points[2::12]:
    point.plot("portrait", states=["x", "y"], axes=right)
plt.show()
