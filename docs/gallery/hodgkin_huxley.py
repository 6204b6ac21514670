r"""# Hodgkin and Huxley: a nerve begins to fire

The membrane of the giant axon of the squid, by Hodgkin and Huxley (1952): its voltage $v$, and three gates that open and
close,

$$\dot v = I - 120\, m^3 h\, (v - 115) - 36\, n^4 (v + 12) - 0.3\, (v - 10.599), \qquad
\dot g = \alpha_g(v) (1 - g) - \beta_g(v)\, g .$$

With a current $I$ the nerve at rest loses its stability at a Hopf point, and fires again and again. The bifurcation is
subcritical: between the fold of the cycles and the Hopf point, rest and firing are both stable, and the nerve remembers
what it did.

**Check:** Hopf points at $I = 9.78$ and $154.5$ µA/cm² (Rinzel & Miller 1980).
"""

import math

import matplotlib.pyplot as plt

import contin


def nerve(u, p):
    m = 0.1 * (25 - u.v) / (math.exp((25 - u.v) / 10) - 1), 4 * math.exp(-u.v / 18)  # rates of opening and closing
    h = 0.07 * math.exp(-u.v / 20), 1 / (math.exp((30 - u.v) / 10) + 1)
    n = 0.01 * (10 - u.v) / (math.exp((10 - u.v) / 10) - 1), 0.125 * math.exp(-u.v / 80)
    return (
        p.current - 120 * u.m**3 * u.h * (u.v - 115) - 36 * u.n**4 * (u.v + 12) - 0.3 * (u.v - 10.599),
        m[0] * (1 - u.m) - m[1] * u.m,
        h[0] * (1 - u.h) - h[1] * u.h,
        n[0] * (1 - u.n) - n[1] * u.n,
    )


rest = contin.solve(contin.AlgebraicProblem(nerve, ["v", "m", "h", "n"], {"current": 0.0}), [0.0, 0.05, 0.6, 0.3])
resting = contin.diagram(rest, free=["current"], depth=0, limits={"current": (-1, 180)})
first, last = [point for branch in resting.branches for point in branch.labelled("HB")]
mesh = contin.MeshControl(tolerance=1e-7)
firing = contin.trace(last, branch=1, limits={"current": (0, 180)}, mesh=mesh, errors=False)
print(f"Hopf points at {first['current']:.4f} and {last['current']:.4f}; {firing.stop}")
print("on the cycles:", [(point.label, round(point["current"], 4)) for point in firing if point.label])
assert abs(first["current"] - 9.78) < 0.005 and abs(last["current"] - 154.5) < 0.05

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for axes in (left, right):
    resting.plot("current", "v", axes=axes)
    firing.plot("current", "v", axes=axes)
left.set(xlabel="current / (µA/cm²)", ylabel="voltage / mV: at rest, and extremes when firing")
right.set(xlabel="current / (µA/cm²)", ylabel="", xlim=(5.5, 11), title="where both are stable")
right.get_legend().remove()
plt.show()
