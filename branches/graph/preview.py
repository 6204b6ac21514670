"""The preview of a diagram: from the exact quadrature (`ribbon_model.exact`), without continuation.

It has the form of a computed diagram (`branches.graph.closed`); ``graph.graph["source"]`` names its source. It is never
mixed with computed branches.
"""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np

from branches.graph import closed as diagram
from branches.graph.parts import Part, add
from branches.graph.stored import new_graph
from branches.scene.closed import and_nu
from branches.scene.fields import Scene
from branches.scene.labels import START, kind_of
from branches.scene.sweep import Sweep
from contin.lowlevel import Label
from ribbon_model import exact

SOURCE = "preview: exact quadrature"


def preview(scene: Scene | Sweep, step: float = 0.2):
    """Return the diagram of a scene.

    Parameters
    ----------
    scene : Scene or Sweep
        Of closed strips.
    step : float
        Largest distance between points, as for `ribbon_model.exact.curve`.

    Returns
    -------
    networkx.MultiGraph
        As from `branches.run.many.run_many`. The arclength of its edges is that in the plane of the quadrature's unknowns;
        ``exact`` holds the points of the quadrature. A branch whose quadrature fails is listed, with the reason, in
        ``graph.graph["failed"]``.
    """
    graph, failed = new_graph(scene.title), {}
    for one in sorted(scene.scenes.values(), key=lambda one: one.n * one.m):
        family = {"law": one.material, "nu": one.nu, "m": one.m, "n": one.n}
        if diagram.holds_circle(graph, one.material, one.nu, one.m, one.n):
            continue  # a duplicate, from its other end
        try:
            points = exact.curve(one.m, one.n, one.law_parameters, one.limits.get("kappa_n", (-100.0, 100.0)), step, one.law)
        except (ValueError, RuntimeError) as error:
            failed[f"{one.material}{and_nu(one.material, one.nu)}, ({one.m}, {one.n})"] = str(error)
            continue
        _add(graph, family, points)
    graph.graph |= {"source": SOURCE, "failed": json.dumps(failed), "absent": json.dumps(scene.absent)}
    return graph


def _add(graph, family, points):
    place = np.array([point.coordinates for point in points])
    columns = {"arclength": np.append(0, np.cumsum(np.linalg.norm(np.diff(place, axis=0), axis=1)))}
    columns |= {name: np.array([getattr(point, name) for point in points]) for name in ("kappa_n", "kappa_star", "energy")}
    special = [i for i, point in enumerate(points) if point.label]
    nodes = [_node(family, points[i], i) for i in special]
    edges = []
    for (a, b), ((first, _), (last, _)) in zip(pairwise(special), pairwise(nodes)):
        piece = {name: values[a : b + 1].tolist() for name, values in columns.items()}
        edges.append((first, last, {**family, **piece, "exact": points[a : b + 1]}))
    add(graph, Part(nodes, edges))


def _node(family, point, number):
    start = START if point.label == Label.BRANCH_POINT else ""  # ends are circles or limits
    kind = kind_of(point.label, start, "limit", False)
    values = {"kappa_n": point.kappa_n, "kappa_star": point.kappa_star, "energy": point.energy}
    return diagram.node(family, kind, values, number)
