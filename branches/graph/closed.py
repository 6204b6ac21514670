"""The bifurcation diagram as a graph: special points, the pieces of branches between them, and queries.

Nodes are circle bifurcations, folds, branch points and other ends; edges are the pieces of branches between them and carry
their columns. The command is ``python -m branches.graph DIR`` (`branches.graph`).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from branches.graph.interpolation import places
from branches.graph.parts import Part, add, edges_of, special
from branches.graph.stored import CLOSED_FORMAT, COLUMNS, new_graph
from branches.scene.closed import ClosedScene, and_nu, law_of
from branches.scene.fields import Scene
from branches.scene.labels import PRIMARY, START, kind_of
from branches.scene.sweep import Sweep
from branches.store.branch import Piece
from contin.lowlevel import Label, exact_text, levels
from ribbon_model import exact
from ribbon_model.linear import circle, covering

#: The format of diagrams of closed strips, the title of one without, and whether there is an exact solution.
FORMAT, TITLE, EXACT = CLOSED_FORMAT, "diagram", True
#: The kinds of special points that a summary counts, in words.
COUNTED = {
    "circle": "bifurcations of circles", "fold": "folds", "leaves": "branches that end at the scene's own limits",
}  # fmt: skip
#: Kinds of points where a secondary branch meets a primary one; the second kind if that point is not in the diagram.
_MEETINGS = ("secondary bifurcation", PRIMARY)
#: The source of a preview, as ``graph.graph["source"]`` names it.
SOURCE = "preview: exact quadrature"


def part(branch, file: str, numbers: object = None) -> Part:
    """Return the part of a diagram that the result of a primary branch is."""
    family = _family(branch.scene)
    nodes = [_node_of(event, family, branch) for event in special(branch)]
    words = f"{branch.scene.name}: {describe([attributes for _, attributes in nodes])}"
    return Part(nodes, _edges(branch, nodes, family, file), (words,))


def add_branch(graph, branch, name: str) -> bool:
    """Add a stored branch to the diagram.

    Parameters
    ----------
    graph : networkx.MultiGraph
    branch : branches.store.branch.StoredBranch
    name : str
        Its file; every edge carries it.

    Returns
    -------
    bool
        False if the diagram has it already, computed from its other end. (One branch leaves a bifurcation on each
        domain, and its images under the symmetries of the primary branch.)
    """
    if not branch.config["origin"]:
        return add(graph, part(branch, name))
    family = _family(branch.scene)
    nodes = _nodes_of_secondary(graph, family, branch)
    start = graph.edges(nodes[0][0], data=True) if nodes[0][0] in graph else ()
    if any(data.get("domain") == family["domain"] for _, _, data in start):
        return False
    return add(graph, Part(nodes, _edges(branch, nodes, family, name)))


def _family(scene: ClosedScene) -> dict:
    """Return what the edges of a branch have in common."""
    family = {"law": scene.material, "nu": scene.nu, "m": scene.m, "n": scene.n}
    if scene.origin:
        family |= {"origin": scene.origin.kappa_n, "mode": scene.origin.mode, "domain": scene.domain}
    return family


def _edges(branch, nodes: list[tuple[str, dict]], family: dict, file: str) -> list[tuple[str, str, dict]]:
    """Return the pieces between consecutive special points."""

    def about(piece: Piece) -> dict:
        own, rows = family | {"file": file}, branch.points[piece.rows]
        if branch.config["origin"]:
            own |= {"force": np.sqrt(rows["R1"] ** 2 + rows["R2"] ** 2 + rows["R3"] ** 2).tolist()}
        return own | ({"index": branch.index_on(piece.rows)} if "index" in rows.dtype.names else {})

    names = {int(event["point"]): name for event, (name, _) in zip(special(branch), nodes)}
    return edges_of(branch, names, branch.columns.mapped("kappa_n"), about)


def _nodes_of_secondary(graph, family: dict, branch) -> list[tuple[str, dict]]:
    """Return the nodes of a secondary branch, or those of the diagram; with the exact origin if nine digits are not unique."""
    origin = branch.config["origin"]
    exact = f"{exact_text(origin['kappa_n'])}, {exact_text(origin['kappa_star'])}"
    for place in (f"{origin['kappa_n']:.9g}", exact):
        own = [_node_of(event, family, branch, place) for event in special(branch)]
        nodes = [_known(graph, node) or node for node in own]
        if not any(node is new and node[0] in graph for node, new in zip(nodes, own)):
            break
    return nodes


def _known(graph, node):
    """Return the node of a diagram at a point where a secondary branch meets a primary one, or None."""
    _, values = node
    if values["kind"] not in _MEETINGS:
        return None
    for name, other in graph.nodes(data=True):
        same_strip = (other["law"], other["nu"]) == (values["law"], values["nu"])
        if other["kind"] in _MEETINGS and same_strip and same_place(other, values):
            return name, other
    return None


def same_place(a: dict, b: dict) -> bool:
    """Return whether two special points agree in quantities that rigid motions and the starting point do not change."""
    columns = [column for column in COLUMNS[1:] if column in a and column in b]
    return all(abs(a[column] - b[column]) < levels.APART * (1 + abs(b[column])) for column in columns)


def holds(graph, scene: ClosedScene) -> bool:
    """Return whether a diagram has the branch of a scene, from its other end."""
    return holds_circle(graph, scene.material, scene.nu, scene.m, scene.n)


def holds_circle(graph, law: str, nu: float, covering: int, mode: int) -> bool:
    """Return whether a branch of the diagram begins or ends on the circle of this covering index with this wavenumber."""
    return _circle({"law": law, "nu": nu, "n": mode}, covering) in graph


def _circle(family, covering: int) -> str:
    return f"{_strip(family)} circle {covering} mode {family['n']}"


def _strip(family) -> str:
    """Return the law and nu of a branch for identifiers of nodes; exact, so that nodes can be found by them."""
    return f"{family['law']} nu={exact_text(family['nu'])}"


def node(family: dict, kind: str, values: dict, number: int, origin: str = "") -> tuple[str, dict]:
    """Return identifier and attributes of a special point, the ``number``-th point of its branch.

    The identifier of a circle does not depend on the branch: it is the covering index (negative if it is curled against its
    natural curvature) and the wavenumber. Identifiers of other points contain the branch (m, n) and, on a secondary
    branch, its ``origin``.
    """
    attributes = {name: family[name] for name in ("law", "nu")} | values | {"kind": kind}
    if kind == "circle":
        index = covering(*law_of(family["law"], family["nu"]), *(attributes[name] for name in COLUMNS[1:]))
        return _circle(family, index), attributes | {"covering": index, "mode": family["n"]}
    branch = f"({family['m']},{family['n']})"
    if origin:
        branch += f" from {origin} on the {family['domain']}"
    return f"{_strip(family)} {branch} {kind} {number}", attributes | {"m": family["m"], "n": family["n"]}


def _node_of(event, family, branch, origin: str = ""):
    values = {column: float(event[column]) for column in branch.columns.mapped("kappa_n")}
    values |= {"error": float(event["error_kappa_n"]), "what": event["name"].decode()}
    kind = kind_of(event["label"].decode(), values["what"], branch.reason, "origin" in family)
    return node(family, kind, values, int(event["point"]), origin)


# --- queries ------------------------------------------------------------------------------------------------------


def families(graph) -> list[tuple]:
    """Return the (law, nu, m, n) of all primary branches, in order; (m, n) is that of the end where the run started."""
    return sorted({family_of(data) for _, _, data in graph.edges(data=True) if "origin" not in data})


def pieces(graph, family: tuple) -> list[tuple]:
    """Return the edges (a, b, columns) of the primary branch (law, nu, m, n), from end to end."""
    return _by_family(graph).get(family, [])


def _by_family(graph) -> dict[tuple, list[tuple]]:
    """Return the edges of every primary branch, from end to end, in one pass over the diagram."""
    found: dict[tuple, list[tuple]] = {}
    for edge in graph.edges(data=True):
        if "origin" not in edge[2]:
            found.setdefault(family_of(edge[2]), []).append(edge)
    for edges in found.values():
        edges.sort(key=lambda edge: edge[2]["arclength"][0])
    return found


def secondaries(graph, law: str | None = None, nu: float | None = None) -> list[dict]:
    """Return the secondary branches: their origin (family, origin, mode, domain, file), edges from end to end, and nodes."""
    found = {}
    for edge in graph.edges(data=True):
        data = edge[2]
        if "origin" in data and _is_of(data, law, nu):
            found.setdefault(data["file"], []).append(edge)
    result = []
    for edges in found.values():
        edges.sort(key=lambda edge: edge[2]["arclength"][0])
        first = edges[0][2]
        about = {name: first[name] for name in ("origin", "mode", "domain", "file")}
        result.append({"family": family_of(first), **about, "edges": edges, "nodes": _in_order(graph, edges)})
    return sorted(result, key=lambda branch: (branch["family"], -branch["origin"], branch["domain"]))


def course(graph, m: int, n: int, law: str | None = None, nu: float | None = None) -> list[dict]:
    """Return the special points along the branch (m, n), in order from the m-covered circle, for the given law and nu or all.

    Raises
    ------
    KeyError
        The diagram has no such branch.
    """
    result = []
    for (law_, nu_, _, n_), nodes in courses(graph):
        if n_ != n or law not in (None, law_) or nu not in (None, nu_):
            continue
        if nodes[-1].get("covering") == m:
            nodes.reverse()
        if nodes[0].get("covering") == m:
            result.append({"law": law_, "nu": nu_, "nodes": nodes})
    if not result:
        raise KeyError(f"the diagram has no branch (m, n) = ({m}, {n})")
    return result


def courses(graph) -> Iterator[tuple[tuple, list[dict]]]:
    """Yield (law, nu, m, n) and the special points, from end to end, of every primary branch, in order."""
    for family, edges in sorted(_by_family(graph).items(), key=lambda item: item[0]):
        yield family, _in_order(graph, edges)


def _is_of(data, law: str | None, nu: float | None) -> bool:
    return law in (None, data["law"]) and nu in (None, data["nu"])


def family_of(data) -> tuple:
    return data["law"], data["nu"], data["m"], data["n"]


def _in_order(graph, edges) -> list[dict]:
    """Return the nodes along consecutive edges, whose ends networkx may give in either order."""
    nodes = []
    for a, b, data in edges:
        ends = sorted((a, b), key=lambda node: abs(graph.nodes[node]["kappa_star"] - data["kappa_star"][0]))
        nodes = nodes or [graph.nodes[ends[0]]]
        nodes.append(graph.nodes[ends[1]])
    return nodes


def states_at(graph, kappa_n: float, law: str | None = None, nu: float | None = None) -> list[dict]:
    """Return all equilibria of the diagram at a natural curvature: planar circles and points on branches, by energy.

    Values between computed points come from a cubic spline over arclength; `branches.graph.at_value` solves them. States on
    branches have the number of their ``edge`` and their ``arclength`` on it.
    """
    found = []
    materials = {family[:2] for family in families(graph) if law in (None, family[0]) and nu in (None, family[1])}
    nodes = (data for _, data in graph.nodes(data=True) if data["kind"] == "circle")
    for law_, nu_, m in sorted({(data["law"], data["nu"], data["covering"]) for data in nodes}):
        if (law_, nu_) in materials:
            material, parameters = law_of(law_, nu_)
            values = circle(material, m, kappa_n, parameters)
            place = {"kappa_star": float(values["kappa_star"]), "energy": values["energy"]}
            found.append({"law": law_, "nu": nu_, "circle": m, **place})
    edges = [(edge, data) for edge, (*_, data) in enumerate(graph.edges(data=True)) if _is_of(data, law, nu)]
    for number, place in places([data for _, data in edges], "kappa_n", kappa_n, ("arclength", *COLUMNS[2:])):
        edge, data = edges[number]
        left = {"origin": data["origin"]} if "origin" in data else {}
        about = {"law": data["law"], "nu": data["nu"], "branch": (data["m"], data["n"]), **left}
        found.append({**about, "kappa_n": kappa_n, "edge": edge, **place})
    return sorted(found, key=lambda state: (state["law"], state["nu"], state["energy"]))


def folds(graph, low: float, high: float, law: str | None = None, nu: float | None = None) -> list[dict]:
    """Return the folds with low <= kappa_n <= high, in order of kappa_n; ``secondary`` says of what kind the branch is."""
    nodes = [
        data | {"secondary": any("origin" in edge for *_, edge in graph.edges(name, data=True))}
        for name, data in graph.nodes(data=True)
        if data["kind"] == "fold" and low <= data["kappa_n"] <= high and _is_of(data, law, nu)
    ]
    return sorted(nodes, key=lambda data: data["kappa_n"])


# --- in words ------------------------------------------------------------------------------------------------------


def describe(nodes) -> str:
    """Return the special points of one branch in one line."""
    return " -> ".join(map(describe_node, nodes))


def describe_node(node) -> str:
    """Return a special point in words."""
    if node["kind"] == "circle":
        return f"circle {node['covering']} at {node['kappa_n']:.6f}"
    if node["kind"] == "leaves":
        return f"stops at {node['kappa_n']:.10g}, the scene's own limit"
    what = f" ({node['what']})" if node["kind"] == "end" and node["what"] else ""
    return f"{node['kind']} at {node['kappa_n']:.6f}{what}"


# --- the preview: from the exact quadrature, without continuation ----------------------------------------------------


def preview(scene: Scene | Sweep, step: float = 0.2):
    """Return the preview of the diagram of a scene, which is never mixed with computed branches.

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
        if holds_circle(graph, one.material, one.nu, one.m, one.n):
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
    return node(family, kind, values, number)
