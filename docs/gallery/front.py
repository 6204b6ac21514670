r"""# A travelling front: which of two states wins

A nerve fibre at rest and one that is excited, two phases of an alloy, two species: a front between two stable states of

$$u_t = u_{xx} + u (1 - u)(u - a)$$

moves with a speed that depends on the threshold $a$. In a moving frame the front is an orbit that connects two saddles. The
speed is found with it, and followed.

**Check:** $c = (1 - 2a)/\sqrt 2$ exactly (Huxley; McKean 1970).
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import contin


def guess(t):
    s = 1 / (1 + math.exp(25 * (0.5 - t)))
    return s, s * (1 - s) / 2


front = contin.ConnectionProblem(
    lambda u, p: (u.v, p.c * u.v - u.u * (1 - u.u) * (u.u - p.a)),
    states=["u", "v"],
    parameters={"a": 0.25, "c": 0.3},
    unstable=1,
    stable=1,
)
wave = contin.solve(front, guess, {"time": 40, "to_u": 1}, free=["c"])
slower = contin.trace(wave, free=["a", "c"], direction=1, limits={"a": (0.1, 0.9)})
faster = contin.trace(wave, free=["a", "c"], direction=-1, limits={"a": (0.1, 0.9)})
worst = max(abs(point["c"] - (1 - 2 * point["a"]) / math.sqrt(2)) for point in [*slower, *faster])
print(f"speed at a = 0.25: {wave['c']:.12f}; largest error on the branch {worst:.0e}")
assert worst < 1e-8

_, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for branch in (slower, faster):
    branch.plot("a", "c", axes=left)
a = np.linspace(0.1, 0.9, 9)
left.plot(a, (1 - 2 * a) / math.sqrt(2), "o", mfc="none", color="C1", label="exact")
left.legend()
left.set(xlabel="threshold a", ylabel="speed c")
t = np.linspace(0, 1, 400)
u = wave.system.evaluate(wave.x, t)[:, 0]
for time in (0, 20, 40):
    right.plot(40 * (t - 0.5) - wave["c"] * time, u, color="C0", alpha=1 - time / 55, label=f"time {time}")
right.legend()
right.set(xlabel="place x", ylabel="u", title="a = 0.25")
plt.show()
