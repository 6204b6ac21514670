r"""# Lorenz: from rest to the homoclinic orbit

Lorenz' model of convection,

$$\dot x = 10 (y - x), \qquad \dot y = r x - y - x z, \qquad \dot z = x y - \tfrac83 z ,$$

has three states of rest. The fluid turns, to the left or to the right, until a Hopf bifurcation at $r = 24.74$. It is
subcritical: the cycles that begin there are unstable, and reach back to $r = 13.93$, where they become homoclinic orbits of
the fluid at rest. The complicated motions of these equations begin there.

**Check:** the Hopf point is $r = 470/19 = 24.7368421$, and the homoclinic orbit lies at $r = 13.926$ (Sparrow 1982).
"""

import matplotlib.pyplot as plt

import contin


def lorenz(u, p):
    return 10 * (u.y - u.x), p.r * u.x - u.y - u.x * u.z, u.x * u.y - 8 / 3 * u.z


rest = contin.solve(contin.AlgebraicProblem(lorenz, ["x", "y", "z"], {"r": 0.5}), [0.0, 0.0, 0.0])
limits = {"r": (0, 30), "period": (0, 6)}
found = contin.diagram(rest, free=["r"], depth=2, limits=limits, symmetries=[lambda t, u: u * [-1, -1, 1]])
(hopf,) = [junction.point for junction in found.junctions if junction.point.label == "HB"]
cycles = contin.trace(hopf, branch=1, limits=limits)
print(f"{hopf.name} at r = {hopf['r']:.10f}")
assert abs(hopf["r"] - 470 / 19) < 1e-9
orbit = contin.homoclinic(cycles.points[-1], free=["r"])
longer = contin.trace(orbit, free=["r", "time"], primary="time", limits={"time": (5, 12)}).points[-1]
print(f"homoclinic orbit at r = {longer['r']:.6f}")
assert abs(longer["r"] - 13.926557) < 1e-6

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
found.plot("r", "x", axes=left)
left.legend(loc="upper left", fontsize=9)
left.set(xlabel="heating r", ylabel="x: rest, and extremes of cycles")
for point in cycles.points[2:-1:3]:
    point.plot("portrait", states=["x", "z"], axes=right)
plt.show()
