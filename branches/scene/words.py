"""Words of the columns of open strips and networks, and of axes of pictures."""

from __future__ import annotations

import re

from branches.scene.open_strip import StagedScene
from ribbon_model.ends import ANGLES, DIRECTIONS
from ribbon_model.network import ASSEMBLY, AXES, FOLLOWER, MOVES, column

#: Words of the columns, and those of axes. Lengths are over that of the strip, unless the scene has dimensions.
_OF_STRIPS = {
    "distance": ("place of the last end along the tangent of the first one", "distance of the ends"),
    "rise": ("place of the last end along the normal of the first one", "displacement along the normal"),
    "shear": ("place of the last end along the width of the first one", "displacement along the width"),
    "turn": ("angle of the last end about the tangent of the first one", "turn of the end"),
    "bend": ("angle of the last end about the width of the first one", "bend of the end"),
    "swing": ("angle of the last end about the normal of the first one", "swing of the end"),
    "stroke": ("further displacement of the last end", "displacement of the end"),
    "roller": ("place of the strip at the roller, along the direction in which it holds", "place at the roller"),
    "force_width": ("dead force at the last end along the width", "force along the width"),
    "force_normal": ("dead force at the last end along the normal", "force along the normal"),
    "force_tangent": ("dead force at the last end along the tangent; negative compresses", "force along the tangent"),
    "moment": ("dead moment about the hinge of the last end", "moment at the hinge"),
    "weight": ("weight per length", "weight per length"),
    "foundation": ("stiffness per length of the foundation", "stiffness of the foundation"),
    "kappa_n": ("natural curvature about the width", "natural curvature"),
    "kappa_2": ("natural curvature about the normal", "natural curvature in the plane"),
    "tau_n": ("natural twist", "natural twist"),
    "D11": ("bending stiffness of the plate along the strip, times the width", "bending stiffness along"),
    "D12": ("coupling of the bendings along and across the strip", "coupling of bendings"),
    "D22": ("bending stiffness across the strip", "bending stiffness across"),
    "D66": ("twisting stiffness", "twisting stiffness"),
    "nu": ("Poisson's ratio", "Poisson's ratio"),
    "Gamma": ("w^2/(h L) of the law finite width", "Γ"),
    "softness": ("compliance about the normal", "softness in the plane"),
    "energy": ("elastic energy, zero in the natural state, and potential of weight and foundation", "energy"),
    "potential": ("energy and the potential of dead loads at the last end: the one of which the index is", "potential"),
    "F_roller": ("force of the roller on the strip", "force of the roller"),
    "F_stroke": ("force on the strip at its last end, along the direction of the stroke", "force along the stroke"),
}  # fmt: skip
_OF_STRIPS |= {
    f"{start}{kind}_{along}": (
        f"{what} on the strip at its {end} end, along the {along} of the first one",
        f"{what} {'along' if kind == 'F' else 'about'} the {along}{' at the first end' if start else ''}",
    )
    for start, end in (("", "last"), ("start_", "first"))
    for kind, what in (("F", "force"), ("M", "moment"))
    for along in DIRECTIONS
}
#: Those of networks.
_OF_NETWORKS = {
    FOLLOWER: ("pressure that stays normal to the strips, per length", "pressure that follows"),
    ASSEMBLY: ("part of natural strains, loads, gaps and turns of joints that acts", "assembly"),
    "floating": ("largest reaction to what holds the network that floats: an error", "reaction of what floats"),
    "potential": ("energy and the potential of all loads: the one of which the index is", "potential"),
    "energy": ("elastic energy, zero in the natural state, and potential of weight, pressure and field", "energy"),
}


def words_of(scene: StagedScene, name: str) -> tuple[str, str]:
    """Return the words of a column, and those of its axis."""
    own, network = _OF_STRIPS.get(name, (name, name)), scene.strip()
    if scene.KIND == "open strip":
        return own
    joint, _, last = name.rpartition("_")
    replaced = None if name in scene.loads else re.fullmatch(r"(\w+)_(force_([xyz])|moment)", name)
    if replaced and replaced[1] in network.joints:
        place, _, axis = replaced.groups()
        what = f"dead force at {place} along {axis}" if axis else f"dead moment at the hinge {place}"
        return f"{what}, once its support has changed", what.removeprefix("dead ")
    if name in network.loads:
        return f"number of the load {name}", name
    if name in _OF_NETWORKS:
        return _OF_NETWORKS[name]
    if found := re.fullmatch(r"([FM])_(\w+)_([xyz])", name):
        kind = "force" if found[1] == "F" else "moment"
        return f"{kind} on the network at {found[2]}, along {found[3]}", f"{kind} at {found[2]} along {found[3]}"
    place = {column(one): one for one in network.joints}.get(joint)
    if place and last in AXES:
        return f"place of {place} along {last}", f"{last} of {place}"
    if joint in network.joints and last in MOVES:
        return f"prescribed displacement of {joint} along {last[1]}", f"displacement of {joint} along {last[1]}"
    if joint in network.joints and last in ANGLES:
        return f"prescribed rotation of {joint}: {last}", f"{last} of {joint}"
    number, _, section = name.rpartition("_")
    if section in network.sections:
        words, axis = _OF_STRIPS.get(number, (number, number))
        return f"{words}, of {section}", f"{axis}, {section}"
    return own
