"""Demos that are not compared, each with its reason."""

from __future__ import annotations

from side_by_side.record import Demo

#: Not compared: name, title, reason.
OTHERS = (
    (
        "bru", "a parabolic partial differential equation",
        "It is integrated in time. contin follows solutions, and does not integrate partial differential equations. "
        "Steady states of its reaction are in the bank (`bank/bru.py`).",
    ),
    (
        "ivp", "an initial value problem",
        "It is integrated in time; contin integrates only to find a first cycle.",
    ),
    (
        "pd1", "a parabolic equation",
        "Its first run is an integration in time; the second, of steady states, labels nothing.",
    ),
    (
        "tim", "a timing of ten equations",
        "It is Bratu's problem five times over, and labels nothing.",
    ),
    (
        "ph1", "the phase of a cycle",
        "Its first three runs are those of `plp`. The fourth shifts one cycle in time; contin fixes the phase of "
        "cycles by an integral condition.",
    ),
    (
        "she", "heteroclinic orbits of a convection model",
        "It labels nothing but the ends of its runs. Its orbits can be stated.",
    ),
    (
        "python", "AUTO's own scripting",
        "It holds scripts for AUTO's front end, on equations of other demos.",
    ),
    (
        "c2c", "a connection of cycles in a food chain",
        "contin's connections join equilibria, not cycles. The boundary value problem, with the cycles and their "
        "eigenfunctions as further states, has to be written by hand, as it is in AUTO's demo.",
    ),
    (
        "p2c", "a connection of a point and a cycle",
        "contin's connections join equilibria, not cycles (as `c2c`).",
    ),
    (
        "pcl", "a connection of a point and a cycle by Lin's method",
        "contin's connections join equilibria, not cycles (as `c2c`).",
    ),
    (
        "snh", "connections near a saddle-node Hopf bifurcation",
        "contin's connections join equilibria, not cycles (as `c2c`); one of the states is an angle.",
    ),
    (
        "rev", "homoclinic orbits of a reversible system",
        "The runs follow half an orbit, up to a plane of symmetry. `ConnectionProblem` has no symmetries.",
    ),
    (
        "kdv", "solitary waves",
        "The orbits of a Hamiltonian system need no second parameter; the runs switch between them by Lin's method, "
        "which contin does not have.",
    ),
    (
        "sib", "homoclinic orbits of several rounds",
        "They are found by Lin's method from orbits of one round, which contin does not have.",
    ),
    (
        "fnb", "pulses of several rounds",
        "Lin's method again (as `sib`). Pulses of one round are compared under `fhh`.",
    ),
    (
        "mtn", "homoclinic orbits to a saddle-node",
        "contin's curves of homoclinic orbits end where the equilibrium becomes a saddle-node (NCH). The centre "
        "manifold has no projection condition.",
    ),
    (
        "cir", "homoclinic orbits of a circuit",
        "Not done: its equations are those of `tor`, its first orbit comes from a file, and most of its given values "
        "are AUTO's own test functions.",
    ),
    (
        "fsh", "Fisher's fronts",
        "Not done: the front is made from a short piece, whose distance from the equilibrium is prescribed.",
    ),
    (
        "man", "a stable manifold of Lorenz's equations",
        "Not done: a family of orbits as in `um3`.",
    ),
    (
        "fnc", "canard orbits from slow manifolds",
        "Not done: boundary value problems whose first solutions are put together from two others.",
    ),
    (
        "r3b", "the restricted problem of three bodies",
        "Not done: conservative families, which contin follows "
        "([Cycles](cycles.md#families-of-conservative-systems)), in 24 scripts.",
    ),
)  # fmt: skip


def demos() -> list[Demo]:
    """Return the demos."""
    return [Demo(name, title, note=reason) for name, title, reason in OTHERS]
