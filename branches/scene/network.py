"""Scenes of networks: strips as they are drawn, joints, what is held and what acts, and stages that are followed.

A scene with ``strips`` is one. With ``dimensions`` (SI units) its numbers are in m, rad, N, N m and N/m; without, in any unit
of length and, for stiffnesses, a bending modulus (`ribbon_model.network`).
"""

from __future__ import annotations

import functools
import keyword
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from branches.scene.columns import OWN
from branches.scene.copies import copied
from branches.scene.fields import ConfigError, StepConfig, Strict
from branches.scene.open_strip import (
    Along,
    Axis,
    DimensionsConfig,
    EndWords,
    FollowConfig,
    Material,
    OpenMesh,
    OwnDirection,
    Phases,
    StagedScene,
)
from contin.lowlevel import meant, one_of
from ribbon_model.changed_supports import replacing
from ribbon_model.ends import DIRECTIONS, FREE_END, LOOSE, End
from ribbon_model.equilibrium import directors
from ribbon_model.members import BALL, FINISH, HINGE, RIGID, START, Joint, JointEnd, Load, Member, frame_along, straight
from ribbon_model.network import FOLLOWER, POTENTIALS, Network
from ribbon_model.section import Section

#: An end of a strip, or a place along it, in words.
_PLACE = re.compile(r"(\w+) (?:(start|finish)|at (0?\.\d+))")
#: What a place may be called, for messages.
_PLACES = "a strip and start, finish or a part of its length, as in 'beam start' or 'beam at 0.3'"


def _vector(value: object) -> tuple[float, float, float]:
    if not isinstance(value, (list, tuple)) or len(value) != 3 or any(type(part) not in (int, float) for part in value):
        raise ValueError(f"must be three numbers, not {value!r}")
    return _over(value, 1.0)


def _over(vector: Sequence[float], unit: float) -> tuple[float, float, float]:
    x, y, z = vector
    return x / unit, y / unit, z / unit


Vector = Annotated[tuple[float, float, float], BeforeValidator(_vector)]


class StripConfig(Strict):
    """A strip as it is drawn: straight between two places, or from a place or another strip on, straight or bent."""

    section: str | None = Field(None, description="one of the sections (the only one)")
    begin: Vector | None = Field(None, description="where it begins")
    end: Vector | None = Field(None, description="where it ends")
    after: str | None = Field(None, description="the strip that it goes on from, in the same direction")
    along: Axis | None = Field(None, description="direction in which it begins")
    normal: Axis | None = Field(None, description="direction of its normal where it begins, as near as it can be")
    length: float | None = Field(None, gt=0, description="its length, without an end")
    copies: None = Field(None, description="so many, by turns about an axis: 6 about z (see `branches.scene.copies`)")
    bend: float = Field(0.0, ge=-1000, le=1000, description="angle by which the drawing bends about its width, in radians")
    twist: float = Field(0.0, ge=-1000, le=1000, description="angle by which the drawing is twisted")

    @model_validator(mode="after")
    def _fits(self):
        if (self.begin is None) == (self.after is None):
            raise ValueError("begin, after: give one of them")
        if self.end is not None:
            given = [name for name in ("after", "along", "length") if getattr(self, name) is not None]
            if given or self.bend or self.twist:
                raise ValueError(f"end: must not be given together with {', '.join(given) or 'bend or twist'}")
        elif self.length is None:
            raise ValueError("end, length: give one of them")
        needs = ("normal",) if self.end is not None else ("along", "normal") if self.begin is not None else ()
        for name in needs:
            if getattr(self, name) is None:
                raise ValueError(f"{name}: is missing; a strip that begins at a place needs it")
        if self.after is not None and (self.along is not None or self.normal is not None):
            raise ValueError("after: must not be given together with along or normal")
        return self


class JointConfig(Strict):
    """Ends that meet."""

    strips: list[str] = Field(min_length=1, max_length=100, description=f"each {_PLACES}")
    hinge: OwnDirection | None = Field(None, description="axis of a hinge, which turns with the first strip")
    ball: bool = Field(False, description="the strips turn freely against each other")
    angle: dict[str, float | str] = Field(
        default_factory=dict, description="angles by which ends are turned against the drawing, or names of numbers"
    )
    about: OwnDirection = Field("width", description="axis of these angles")
    arm: dict[str, Vector] = Field(default_factory=dict, description="from an end to the joint, on the directors of the end")

    @model_validator(mode="after")
    def _fits(self):
        if self.ball and self.hinge is not None:
            raise ValueError("hinge, ball: give one of them")
        for part in ("angle", "arm"):
            for name in getattr(self, part):
                if name not in self.strips:
                    raise ValueError(f"{part}: {one_of(name, self.strips, 'the strips of the joint: ')}")
        return self


class ForceConfig(Strict):
    """What a load does at a joint."""

    force: Vector | None = Field(None, description="direction and size of the force, for a number of 1")
    arm: Vector = Field((0.0, 0.0, 0.0), description="from the joint to where it acts, on the axes of the drawing")
    follows: bool = Field(False, description="the force turns with the first strip of the joint: no energy, and no index")
    moment: float | None = Field(None, description="size of the moment about the axis of the hinge, for a number of 1")

    @model_validator(mode="after")
    def _fits(self):
        if (self.force is None) == (self.moment is None):
            raise ValueError("force, moment: give one of them")
        if self.follows and self.force is None:
            raise ValueError("follows: a moment that follows is not there; give a force")
        return self


class NetworkStageConfig(FollowConfig):
    """A stage of a network; from there on, joints may be held otherwise."""

    held: dict[str, EndWords] = Field(default_factory=dict, description="what is held at joints from here on (as before)")
    joints: dict[str, Literal["rigid", "hinge", "ball"]] = Field(
        default_factory=dict, description="kinds of joints from here on (as before); a hinge is about the axis of the joint"
    )
    phase: int | None = Field(
        None, ge=1, le=20, description="of a loop that floats: hold the sine of so many waves, so that it cannot shift",
    )  # fmt: skip


class NetworkDirections(Strict):
    """Where loads point to."""

    weight: Axis = (0.0, -1.0, 0.0)
    foundation: Axis = Field((0.0, 1.0, 0.0), description="the normal of the plane from which a foundation holds")
    pressure: Axis = Field((1.0, 0.0, 0.0), description="the normal of the plane, about which the strips go around an area")
    field: Axis = Field((0.0, 1.0, 0.0), description="of a uniform field on magnetized strips")


def _short(field: str) -> BeforeValidator:
    """Return what takes a list for a mapping with this field."""
    return BeforeValidator(lambda value: {field: value} if isinstance(value, list) else value)


class NetworkScene(StagedScene):
    """Strips that meet at joints, and the stages in which their numbers are followed."""

    KIND: ClassVar[str] = "network"
    LISTS: ClassVar[tuple] = (
        ("sections", "*", "*"), *((part, "*") for part in ("material", "dimensions", "numbers")),
        ("stages", "#", "to"), ("stages", "#", "numbers", "*"),
    )  # fmt: skip

    SUPPORTS: ClassVar[str] = "held, joints"

    title: str = ""
    material: Material | None = Field(None, description="law, and its numbers, of all strips")
    sections: dict[str, Material] = Field(default_factory=dict, description="several of these, by name")
    dimensions: DimensionsConfig | None = Field(None, description="of the strips, whose unit in computations is their length")
    along: Along = Field(
        default_factory=dict, description="data along strips, with s from 0 to 1: expressions, or tables of [s, value]"
    )
    strips: dict[str, StripConfig] = Field(min_length=1, max_length=200)
    joints: dict[str, Annotated[JointConfig, _short("strips")]] = Field(default_factory=dict)
    held: dict[str, EndWords] = Field(default_factory=dict, description="what is held at joints; nothing: the network floats")
    loads: dict[str, dict[str, Annotated[ForceConfig, _short("force")]]] = Field(default_factory=dict)
    numbers: dict[str, float] = Field(default_factory=dict)
    directions: NetworkDirections = NetworkDirections()
    phases: Phases = Field(
        default_factory=list, max_length=2, description="what a single strip is held by, which shifts or spins"
    )
    magnetized: Literal["width", "normal", "tangent"] = "tangent"
    stages: list[NetworkStageConfig] = Field(min_length=1, max_length=50)
    mesh: OpenMesh = OpenMesh(degree=6)
    steps: StepConfig = StepConfig()
    stride: int = Field(1, ge=1)

    @classmethod
    def prepared(cls, values: dict) -> dict:
        """Write out copies of strips."""
        return copied(values)

    @model_validator(mode="after")
    def _fits(self):
        for names in (self.sections, self.strips, self.joints, self.loads):
            for name in names:
                if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
                    raise ValueError(f"{name!r} is not usable as a name (letters, digits and _, from a letter on)")
        if (self.material is None) == (not self.sections):
            raise ValueError("material, sections: give one of them")
        if self.stages[0].held or self.stages[0].joints or self.stages[0].numbers:
            raise ValueError("stage 1: held, joints, numbers: those of the scene are the first stage's")
        self.check_stages()
        networks = [self.strip(number) for number in range(1, len(self.stages) + 1)]
        names = [*({name for network in networks for name in network.parameters}), *self.found_names, *OWN]
        for name, times in Counter([*names, *(f"error_{name}" for name in names)]).items():
            if times > 1:
                raise ValueError(f"{name}: is the name of two columns; give a load, joint or number another name")
        return self

    # --- the network --------------------------------------------------------------------------------------------------

    @property
    def units(self) -> str:
        return super().units if self.dimensions else "the units of the scene"

    def kind(self, name: str) -> str:
        return self._kinds.get(name, "")

    @functools.cached_property
    def _kinds(self) -> dict[str, str]:
        return {name: kind for number in range(1, len(self.stages) + 1) for name, kind in self.strip(number).kinds.items()}

    def _held(self, stage: int) -> tuple[int | None, dict[str, End], dict[str, str], tuple[str, ...]]:
        """Return the phase, what is held and kinds of joints in a stage, and the joints whose support has changed since."""
        one = self.stages[stage - 1]
        if stage == 1:
            return one.phase, {name: end.end(self.axes_at(name)) for name, end in self.held.items()}, {}, ()
        _, held, kinds, changed = self._held(one.stage or stage - 1)
        held = held | {name: end.end(self.axes_at(name)) for name, end in one.held.items()}
        held = {name: end for name, end in held.items() if end != FREE_END}
        return one.phase, held, kinds | one.joints, tuple(dict.fromkeys((*changed, *one.held)))

    def _strip_with(
        self, waves: int | None, held: dict[str, End], kinds: dict[str, str], changed: tuple[str, ...]
    ) -> Network:  # fmt: skip
        """Return the network with the states of the phases of all stages, of which one holds."""
        network = self._network(held, changed, kinds)
        known = list(dict.fromkeys(stage.phase for stage in self.stages if stage.phase is not None))
        if known and not network.floats:
            raise ValueError("stages: phase: a network that is held does not shift; leave it out, or hold nothing")
        phases = [replace(network.with_waves(count).phases[-1], holds=count == waves) for count in known]
        return replace(network, phases=(*network.phases, *phases))

    def axes_at(self, joint: str) -> Mapping[str, Vector]:
        """Return width, normal and tangent of the first strip at a joint as drawn; the largest part of each is positive."""
        if joint not in self.joints:
            return DIRECTIONS
        name, end, part = _parsed(f"joints: {joint}", self.joints[joint].strips[0], self._drawn)
        part = {START: 0.0, FINISH: 1.0}.get(end, part)
        rows = np.reshape(directors(*self._drawn[name].drawn([part * self._drawn[name].length])[0, :4]), (3, 3))
        rows = np.where(np.abs(rows) < LOOSE, 0.0, rows)
        largest = [row[np.argmax(np.abs(row) > np.abs(row).max() - LOOSE)] for row in rows]
        return {word: tuple(map(float, row * np.sign(one) + 0.0)) for word, row, one in zip(DIRECTIONS, rows, largest)}

    def told_axes(self, stage: int) -> Iterator[str]:
        """Yield what the words of directions at joints mean that a stage brings."""
        held = (self.stages[stage - 1] if stage > 1 else self).held
        said = {f"held: {name}": (name, end.words) for name, end in held.items()}
        for name, joint in self.joints.items() if stage == 1 else ():
            used = [field for field in ("hinge", "about") if isinstance(getattr(joint, field), str)]
            said[f"joints: {name}"] = name, {field: getattr(joint, field) for field in used if field != "about" or joint.angle}
        for where, (name, words) in said.items():
            for field, word in words.items():
                yield f"{where}: {field}: {word} is the direction ({', '.join(f'{x:.6g}' for x in self.axes_at(name)[word])})"

    def first(self, grows: Mapping[str, float], options: dict[str, Any]) -> tuple[Any, str]:
        """As `StagedScene.first`; what a floating network is turned by is small, where it ``grows`` from zero."""
        from contin import ContinError
        from ribbon_model.network_first import first_state

        try:
            return first_state(self.strip(), self.mesh.intervals, grows=grows, **options)
        except (ContinError, ValueError) as error:
            units = " (numbers in units of L and B)" if self.dimensions else ""
            raise ConfigError(f"strips: no first state was found from the drawing: {error}{units}") from error

    def replacing(self, stage: int) -> tuple[str, ...]:
        _, held, _, changed = self._held(stage)
        return tuple(number for name in changed for number in replacing(name, held.get(name)))

    def _network(self, held: dict[str, End], changed: tuple[str, ...], kinds: dict[str, str]) -> Network:
        for name in kinds:
            if name not in self.joints:
                raise ValueError(f"joints: {one_of(name, self.joints)}")
        sections = self._sections()
        members, joints = dict(self._drawn), {}
        cuts: dict[str, list[float]] = {}
        for where, place, joined in self._places():
            name, end, part = _parsed(where, place, members, joined)
            if end is None and part not in cuts.setdefault(name, []):
                cuts[name].append(part)
        pieces: dict[str, list[str]] = {}
        for name, member in list(members.items()):
            parts = sorted(cuts.get(name, []))
            if parts:
                pieces[name] = [f"{name} {number}" for number in range(1, len(parts) + 2)]
                del members[name]
                members.update(zip(pieces[name], member.cut(parts)))
        for name, joint in self.joints.items():
            axes, arms = self.axes_at(name), {place: _over(arm, self.size("length")) for place, arm in joint.arm.items()}
            about = axes.get(joint.about, joint.about)
            hinge = axes.get(joint.hinge, joint.hinge or about)
            kind = kinds.get(name, BALL if joint.ball else RIGID if joint.hinge is None else HINGE)
            ends = [
                JointEnd(piece, end, joint.angle.get(place, 0.0), about, arms.get(place, (0.0, 0.0, 0.0)), goes_on)
                for place in joint.strips
                for piece, end, goes_on in _ends_at(*_parsed(f"joints: {name}", place, self.strips), cuts, pieces)
            ]
            joints[name] = Joint(ends, kind, hinge)
        loads = {number: self._load(number, actions, joints, cuts, pieces) for number, actions in self.loads.items()}
        for name in changed:
            if name not in joints:
                raise ValueError(f"held: {one_of(name, joints)}")
        for name in changed:
            for number, load in replacing(name, held.get(name)).items():
                if number in loads:
                    raise ValueError(
                        f"loads: {number}: replaces a reaction at {name}, where the support changes; give another name"
                    )
                loads[number] = load
        told = {name for stage in self.stages for name in (stage.follow, *stage.numbers)}
        numbers = dict.fromkeys((name for name in (*POTENTIALS, FOLLOWER) if name in told), 0.0) | self.numbers
        where, first = self.directions, list(DIRECTIONS).index(self.magnetized)
        directions = where.weight, where.pressure, where.field, first
        bare = Network(sections, members, joints, held, loads, {}, *directions)
        if changed:  # a support that is let go has no numbers
            numbers = {name: value for name, value in numbers.items() if name in bare.known}
        numbers = {name: value / self.size(bare.kinds.get(name, "")) for name, value in numbers.items()}
        return Network(sections, members, joints, held, loads, numbers, *directions, self.phases, where.foundation)

    def _sections(self) -> dict[str, Section]:
        found, names = {}, {name: "" if len(self.given) == 1 else f"_{name}" for name in self.given}
        for name in self.along:
            if not name.endswith(tuple(names.values())):
                raise ValueError(f"along: {name!r} must end in the name of a section, as in {name}{[*names.values()][0]}")
        for name, values in self.given.items():
            where = "material" if self.material is not None else f"sections: {name}"
            try:
                behind = names[name]
                own = {each.removesuffix(behind): text for each, text in self.along.items() if each.endswith(behind)}
                found[name] = self.section(where, values, own)
            except ValueError as error:
                raise ValueError(str(error) if str(error).startswith(where) else f"{where}: {error}") from error
        return found

    @functools.cached_property
    def _drawn(self) -> dict[str, Member]:
        """The members; each strip must come after the one that it goes on from."""
        found: dict[str, Member] = {}
        sections = self._sections()
        for name, strip in self.strips.items():
            section = strip.section or (next(iter(sections)) if len(sections) == 1 else None)
            if section not in sections:
                raise ValueError(f"strips: {name}: section: {one_of(strip.section, sections)}")
            if strip.after is not None and strip.after not in found:
                raise ValueError(f"strips: {name}: after: {one_of(strip.after, found, 'the strips before it: ')}")
            try:
                found[name] = _member(section, strip, found)
            except ValueError as error:
                raise ValueError(f"strips: {name}: {error}") from error
        return {
            name: Member(one.section, one.length / L, _over(one.place, L), one.frame, _over(one.strains, 1 / L))
            for L in [self.size("length")] for name, one in found.items()
        }  # fmt: skip

    def _places(self) -> Iterator[tuple[str, str, Iterable[str]]]:
        """Yield where places along strips are named, the places, and the joints that may stand there."""
        for name, joint in self.joints.items():
            yield from ((f"joints: {name}", place, ()) for place in joint.strips)
        for number, actions in self.loads.items():
            yield from ((f"loads: {number}", place, self.joints) for place in actions if place not in self.joints)

    def _load(self, number: str, actions: dict[str, ForceConfig], joints: dict[str, Joint], cuts, pieces) -> Load:
        """Return a load; a place along a strip that is no joint becomes one."""
        forces, moments, followers = [], [], []
        for place, action in actions.items():
            name = place
            if place not in self.joints:
                strip, side, part = _parsed(f"loads: {number}", place, self.strips)
                ends = list(_ends_at(strip, side, part, cuts, pieces))
                name, where = place if side else f"{strip} at {part!r}", {(piece, end) for piece, end, _ in ends}
                for other, joint in joints.items():
                    if other != name and where & {(each.member, each.end) for each in joint.members}:
                        raise ValueError(f"loads: {number}: {place!r} is joined at {other}; give {other} in its place")
                joints.setdefault(name, Joint([JointEnd(piece, end) for piece, end, _ in ends]))
            if action.force is not None:
                (followers if action.follows else forces).append((name, action.force, _over(action.arm, self.size("length"))))
            else:
                moments.append((name, action.moment))
        if self.dimensions and moments and (forces or followers):
            raise ValueError(f"loads: {number}: a force and a moment have no common unit; give each a load of its own")
        return Load(forces, moments, followers)

    @functools.cached_property
    def longest(self) -> float:
        """The length of the longest strip."""
        return self.strip().longest

    @property
    def law_name(self) -> str:
        return next(iter(self.strip().sections.values())).law.name

    @property
    def name(self) -> str:
        """The network in words."""
        count, joints = len(self.strips), len(self.joints)
        return f"{count} strip{'s' * (count != 1)} ({self.law_name}), {joints} joint{'s' * (joints != 1)}"


def _parsed(where: str, place: str, names, joints: Iterable[str] = ()) -> tuple[str, str | None, float | None]:
    """Return strip, end and part of the length that words name; a message names the ``joints`` that may stand there, too."""
    found = _PLACE.fullmatch(place)
    if not found or found[1] not in names or (found[3] is not None and not 0 < float(found[3]) < 1):
        near = meant(place, [*(f"{name} {end}" for name in names for end in (START, FINISH)), *joints])
        others = f"; joints are {', '.join(joints)}" if joints else ""
        must = f"{'a joint, or ' if joints else ''}{_PLACES}"
        raise ValueError(f"{where}: {place!r}{near} must be {must}; strips are {', '.join(names)}{others}")
    return found[1], found[2], None if found[3] is None else float(found[3])


def _ends_at(name: str, end: str | None, part: float | None, cuts, pieces) -> Iterator[tuple[str, str, bool]]:
    """Yield the ends of pieces at a place of a strip, and whether the strip goes on there from the one before."""
    parts = pieces.get(name, [name])
    if end is not None:
        yield (parts[0] if end == START else parts[-1]), end, False
        return
    number = sorted(cuts[name]).index(part)
    yield parts[number], FINISH, False
    yield parts[number + 1], START, True


def _member(section: str, strip: StripConfig, before: dict[str, Member]) -> Member:
    if strip.end is not None:
        return straight(section, strip.begin, strip.end, strip.normal)
    strains = (strip.bend / strip.length, 0.0, strip.twist / strip.length)
    if strip.after is not None:
        return before[strip.after].followed_by(section, strip.length, strains)
    return Member(section, strip.length, strip.begin, frame_along(strip.along, strip.normal, "the strip"), strains)
