r"""# Predator and prey: the paradox of enrichment

Prey $x$ grows towards the capacity $K$ of its meadow, and predators $y$ eat it, but never more than they can digest
(Rosenzweig & MacArthur 1963):

$$\dot x = x \left(1 - \frac{x}{K}\right) - \frac{x y}{1 + x}, \qquad \dot y = \frac{x y}{1 + x} - \frac{y}{2} .$$

A poor meadow feeds no predators. A better one feeds both. In a rich one, they live in cycles that come ever closer to
extinction: Rosenzweig's paradox (1971).

**Check:** predators survive from $K = 1$ on, where their growth $K/(1 + K)$ outweighs their death rate ½. The Hopf point
lies at $K = 3$, where the hump of the prey's isocline stands over the predators' $x = 1$.
"""

import matplotlib.pyplot as plt

import contin


def meadow(u, p):
    eaten = u.x * u.y / (1 + u.x)
    return u.x * (1 - u.x / p.K) - eaten, eaten - u.y / 2


alone = contin.solve(contin.AlgebraicProblem(meadow, ["x", "y"], {"K": 0.5}), [0.5, 0.0])
found = contin.diagram(alone, free=["K"], depth=2, limits={"K": (0.5, 6), "max_y": (0, 10)}, max_step=0.3)
special = {junction.point.label: junction.point["K"] for junction in found.junctions}
print("predators live from K =", round(special["BP"], 12), "on, and in cycles from K =", round(special["HB"], 12), "on")
assert abs(special["BP"] - 1) < 1e-10 and abs(special["HB"] - 3) < 1e-10

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
found.plot("K", "y", axes=left)
left.set(xlabel="capacity K", ylabel="predators y: at rest, and extremes of cycles", ylim=(-0.3, 4.7))
for point in found.branches[-1].points[2::4]:
    point.plot("portrait", states=["x", "y"], axes=right)
plt.show()
