"""Scenes of open strips: material, ends, loads, and stages that are followed one after the other; checked field by field.

A scene with ``stages`` is one. With ``dimensions`` (SI units) its numbers are in m, rad, N, N m and N/m; without, in units of
the length of the strip and its bending modulus (`ribbon_model.section`).
"""

from __future__ import annotations

import functools
import itertools
import math
import re
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from branches.scene.fields import ConfigError, Interval, MeshConfig, Scene, StepConfig, Strict, alone, show
from branches.scene.units import STRIP_UNITS, UNITS, quantity, unusual
from contin.lowlevel import exact_text, meant, one_of
from ribbon_model.ends import ANGLES, DIRECTIONS, HINGED, JOINT, PLACE, End, Vector, perpendicular, unit
from ribbon_model.laws import FINITE_WIDTH, FLAT_ROD, RIBBON
from ribbon_model.plate import RIGIDITIES
from ribbon_model.section import KINDS, Section, section_of

#: Ends in one word or two.
_WORDS: dict[str, dict] = {
    "clamped": {}, "hinged": {"rotation": HINGED, "about": "width"}, "ball joint": {"rotation": "free"},
    "free": {"rotation": "free", "place": "free"},
}  # fmt: skip
#: What a kind of number is measured in: the power of the length, the power of the modulus B, and the name of the unit.
_UNITS = {
    "length": (1, 0, "m"), "angle": (0, 0, "rad"), "force": (-2, 1, "N"), "moment": (-1, 1, "N m"), "energy": (-1, 1, "J"),
    "force per length": (-3, 1, "N/m"), "couple per length": (-2, 1, "N"), "stiffness per length": (-4, 1, "N/m^2"),
    "curvature": (-1, 0, "1/m"), "": (0, 0, ""),
}  # fmt: skip
#: Kinds of the numbers of open strips; others are ratios.
_KINDS = KINDS | dict.fromkeys((*PLACE, "stroke", "roller"), "length") | dict.fromkeys(ANGLES, "angle") | {
    f"{name}_{axis}": "moment" if name.endswith("M") else "force"
    for name in ("force", "F", "M", "start_F", "start_M") for axis in DIRECTIONS
} | {"moment": "moment", "F_roller": "force", "F_stroke": "force"}  # fmt: skip
#: Powers of the length L and the modulus B, as axes write them.
_NATURAL = {(1, 0): "L", (-1, 0): "1/L", (-1, 1): "B/L", (-2, 1): "B/L²", (-3, 1): "B/L³", (-4, 1): "B/L⁴"}
#: Laws of a strip with dimensions; the first one if none is given.
_OF_DIMENSIONS = (FINITE_WIDTH.name, FLAT_ROD.name, RIBBON.name)

#: A direction: in words of the first end of an open strip, of the strip at a joint, which keeps its word, and of space.
Direction = Annotated[tuple[float, float, float], BeforeValidator(lambda value: _direction(value, DIRECTIONS))]
OwnDirection = Annotated[tuple[float, float, float] | str, BeforeValidator(lambda v: _direction(v, {n: n for n in DIRECTIONS}))]
Phases = list[Literal["spin", "shift, right", "shift, left", "shift, two waves"]]
Axis = Annotated[tuple[float, float, float], BeforeValidator(lambda v: _direction(v, dict(zip("xyz", DIRECTIONS.values()))))]


def _direction(value: object, words: Mapping[str, Any]) -> Any:
    if isinstance(value, str) and value in words:
        return words[value]
    if not isinstance(value, (list, tuple)) or len(value) != 3 or any(type(part) not in (int, float) for part in value):
        raise ValueError(f"must be {', '.join(words)} or three numbers, not {value!r}{meant(str(value), words)}")
    return unit("direction", value)


class EndConfig(Strict):
    """What is held at an end."""

    rotation: Literal["clamped", "hinged", "joint", "free"] = "clamped"
    about: OwnDirection | None = Field(None, description="axis of a hinge, or the axis of a joint that is fixed in space")
    perpendicular: Literal["width", "normal", "tangent"] | None = Field(
        None, description="direction of the strip that a joint keeps perpendicular to its axis"
    )
    place: Literal["held", "free"] = "held"
    slides_along: OwnDirection | None = None
    slides_in_plane: OwnDirection | None = Field(None, description="the normal of the plane")
    only: Literal["pushes"] | None = Field(None, description="the plane pushes along its normal, and cannot pull")

    @model_validator(mode="after")
    def _fits(self):
        slides = [value for value in (self.slides_along, self.slides_in_plane) if value is not None]
        if len(slides) > 1 or (slides and self.place == "free"):
            raise ValueError("place, slides_along, slides_in_plane: give one of them")
        if (self.about is None) != (self.rotation in ("clamped", "free")):
            raise ValueError(_belongs("about", "hinged or joint", self.about, self.rotation))
        if (self.perpendicular is None) != (self.rotation != JOINT):
            raise ValueError(_belongs("perpendicular", "joint", self.perpendicular, self.rotation))
        if self.only and self.slides_in_plane is None:
            raise ValueError("only: belongs to slides_in_plane, along whose normal a support pushes")
        self.end()
        return self

    def end(self, axes: Mapping[str, Vector] = DIRECTIONS) -> End:
        """Return the end; ``axes`` are the directions of the strip there."""
        about, along, plane = (axes.get(one, one) for one in (self.about or "width", self.slides_along, self.slides_in_plane))
        held = tuple(DIRECTIONS.values()) if self.place == "held" else ()
        held = perpendicular(along) if along else (plane,) if plane else held
        return End(self.rotation, about, axes[self.perpendicular or "width"], held, bool(self.only))

    @property
    def words(self) -> dict[str, str]:
        """The fields that name directions of the strip."""
        names = ("about", "perpendicular", "slides_along", "slides_in_plane")
        return {name: word for name in names if isinstance(word := getattr(self, name), str)}


def _belongs(field: str, rotations: str, value: object, rotation: str) -> str:
    """Return what is wrong with a field that is missing, or that this rotation does not have."""
    if value is None:
        return f"{field}: is missing; the rotation {rotation!r} needs it"
    return f"{field}: belongs to the rotation {rotations}, not to {rotation!r}"


def _end(value: object) -> Any:
    if isinstance(value, str) and value not in _WORDS:
        raise ValueError(
            f"{value!r}{meant(value, _WORDS)} must be {', '.join(_WORDS)}, or fields such as rotation and slides_along"
        )
    return _WORDS[value] if isinstance(value, str) else value


EndWords = Annotated[EndConfig, BeforeValidator(_end)]


class ClosedConfig(Strict):
    """A strip whose ends are joined."""

    half_twists: int = Field(0, ge=-20, le=20, description="half twists between the ends before they are joined")


class DirectionsConfig(Strict):
    """Where loads and displacements point to."""

    weight: Direction = (0.0, -1.0, 0.0)
    foundation: Direction = DIRECTIONS["normal"]
    stroke: Direction = DIRECTIONS["tangent"]


class RollerConfig(Strict):
    """A support between the ends."""

    at: float = Field(gt=0, lt=1, description="where along the strip, over its length")
    held: Direction = Field(DIRECTIONS["normal"], description="direction in which the place is held")
    only: Literal["pushes"] | None = Field(None, description="it pushes to where it moves, or along held, and cannot pull")


class DimensionsConfig(Strict):
    """A strip, in SI units or with units."""

    width: float = Field(gt=0)
    thickness: float = Field(gt=0)
    length: float = Field(gt=0)
    poisson_ratio: float = Field(gt=-1, le=0.5)
    youngs_modulus: float = Field(gt=0)

    @field_validator("*", mode="before")
    @classmethod
    def _in_si_units(cls, value, info):
        return quantity(value, STRIP_UNITS[info.field_name]) if isinstance(value, str) else value

    @model_validator(mode="after")
    def _thin(self):
        if not self.thickness < self.width < self.length:
            raise ValueError("width must lie between thickness and length")
        return self

    @property
    def modulus(self) -> float:
        """B in N m**2: that of the plate times the width."""
        return self.youngs_modulus * self.thickness**3 * self.width / (12 * (1 - self.poisson_ratio**2))


class _Where(Strict):
    """What a stage follows, and from where."""

    follow: str = Field(description="the number that is followed")
    to: float = Field(description="the value at which the stage ends")
    start_at: str | None = Field(None, description="labelled point to start from, as in BP 2 (the end of the stage before)")
    stage: int | None = Field(None, ge=1, description="number of the stage of that point (the one before)")
    way: Literal["forward", "backward"] = Field("forward", description="which of the two ways away from a branch point")

    @model_validator(mode="after")
    def _point(self):
        if self.start_at is not None and not re.fullmatch(r"(EP|BP|LP|UZ)( [1-9][0-9]{0,2})?", self.start_at):
            raise ValueError(f"start_at: {self.start_at!r} must be a label with a number, as in BP 1, LP 2, UZ 1")
        return self

    def place_among(self, labelled: Sequence[tuple[str, str]]) -> int | None:
        """Return which of the labelled points (label, name) of a stage this one starts from; None if there is none."""
        if self.start_at is None:
            return len(labelled) - 1
        label, _, count = self.start_at.partition(" ")
        found = [place for place, (other, name) in enumerate(labelled) if other == label and name != "start"]
        return found[int(count or 1) - 1] if int(count or 1) <= len(found) else None


class _Ends(Strict):
    """What is held in a stage."""

    start: EndWords | None = Field(None, description="what is held at the first end from here on (as before)")
    finish: EndWords | None = Field(None, description="what is held at the last end from here on (as before)")


class _How(Strict):
    """With which numbers a stage begins, and how far it goes."""

    numbers: dict[str, float] = Field(default_factory=dict, description="numbers that the stage begins with (as before)")
    max_points: int | None = Field(None, ge=1, le=1_000_000, description="steps.max_points of this stage")
    limits: dict[str, Interval] = Field(default_factory=dict)
    label: dict[str, Annotated[list[float], Field(max_length=100)]] = Field(
        default_factory=dict, description="values at which points are labelled UZ"
    )


class FollowConfig(_How, _Where):
    """One stage: a number that is followed from a labelled point to a value."""


class StageConfig(_How, _Ends, _Where):
    """A stage of an open strip; from there on, the ends may be held otherwise."""


def _expression(value: object) -> Any:
    """Return data along the strip as an expression: a table is the polynomial through its points (Newton's form)."""
    if not isinstance(value, list):
        return value
    pairs = all(isinstance(pair, list) and len(pair) == 2 and all(type(x) in (int, float) for x in pair) for pair in value)
    if not (pairs and 2 <= len(value) <= 12):
        raise ValueError(f"a table must have 2 to 12 points [s, value], not {show(value)}")
    s, y = ([float(pair[i]) for pair in value] for i in (0, 1))
    if s != sorted(set(s)) or s[0] != 0 or s[-1] != 1:
        raise ValueError("the places s of a table must increase from 0 to 1")
    differences = list(y)
    for order in range(1, len(s)):
        for i in reversed(range(order, len(s))):
            differences[i] = (differences[i] - differences[i - 1]) / (s[i] - s[i - order])
    text = repr(differences[-1])
    for i in reversed(range(len(s) - 1)):
        text = f"({differences[i]!r}) + (s - {s[i]!r}) * ({text})"
    return text


Along = dict[str, Annotated[str, BeforeValidator(_expression)]]


def _finite(section: object) -> Any:
    """Return the fields of a section with an infinite B2 as text: other numbers must be finite."""
    return section | {"B2": "inf"} if isinstance(section, dict) and section.get("B2") == math.inf else section


Material = Annotated[dict[str, float | int | str], BeforeValidator(_finite)]


class OpenMesh(MeshConfig):
    """Fields of the mesh."""

    degree: int = Field(7, ge=2, le=8)
    intervals: int = Field(10, ge=1, le=2000)
    tolerance: float = Field(1e-9, ge=1e-14, le=1e-2)


class StagedScene(Scene):
    """What scenes share whose numbers are followed in stages."""

    @abstractmethod
    def _held(self, stage: int) -> tuple:
        """Return what is held in a stage, and what has changed since the first one."""

    @abstractmethod
    def _strip_with(self, *held: Any) -> Any:
        """Return the mechanics of what is held so."""

    def strip(self, stage: int = 1) -> Any:
        """Return the `ribbon_model.network.Network` of a stage, from 1: an `OpenStrip` of an open strip.

        Raises ValueError for fields that do not fit; one sentence.
        """
        held = self._held(stage)
        if repr(held) not in self._strips:
            try:
                self._strips[repr(held)] = self._strip_with(*held)
            except ValueError as error:
                raise ValueError(f"stage {stage}: {error}" if held[-1] else str(error)) from error
        return self._strips[repr(held)]

    @functools.cached_property
    def _strips(self) -> dict[str, Any]:
        """The mechanics of all stages by what is held."""
        return {}

    # --- units ----------------------------------------------------------------------------------------------------------

    @abstractmethod
    def kind(self, name: str) -> str:
        """Return the kind of a number or column, from which its unit follows; '' for a ratio."""

    def factor(self, name: str) -> float:
        """Return what a number or column is multiplied by to have its unit."""
        return self.size(self.kind(name))

    def size(self, kind: str) -> float:
        """Return the same for a kind of number."""
        length, modulus, _ = _UNITS[kind]
        return self.dimensions.length**length * self.modulus**modulus if self.dimensions else 1.0

    def unit(self, name: str) -> str:
        """Return the unit of a number, '' without dimensions."""
        return _UNITS[self.kind(name)][2] if self.dimensions is not None else ""

    @property
    def units(self) -> str:
        """What lengths and moduli are measured in."""
        sizes = self.dimensions
        length = "1" if sizes is None else f"1 ({exact_text(sizes.length)} m)"
        modulus = "1" if sizes is None else f"1 ({self.modulus:.12g} N m^2)"
        return f"bending modulus B = {modulus}, length L = {length}"

    @property
    def given(self) -> Mapping[str, Mapping[str, Any]]:
        """The fields of all sections by name."""
        return getattr(self, "sections", None) or {"strip": self.material}

    @property
    def _law(self) -> Any:
        """The law of the first section with dimensions."""
        return next(iter(self.given.values())).get("law", FINITE_WIDTH.name)

    @property
    def modulus(self) -> float:
        """The bending modulus that is 1 in the law, in N m^2; 1 without dimensions."""
        if self.dimensions is None:
            return 1.0
        narrow = 1 - self.dimensions.poisson_ratio**2 if self._law == FLAT_ROD.name else 1.0
        return self.dimensions.modulus * narrow  # a narrow strip is free to bend across: E h^3 w/12

    @property
    def cautions(self) -> list[str]:
        return unusual(self.dimensions.model_dump()) if self.dimensions else []

    def section(self, where: str, fields: Mapping[str, Any], along: Mapping[str, str]) -> Section:
        """Return the section of these fields, with the numbers that follow from dimensions; raise ValueError."""
        values, d = dict(fields), self.dimensions
        law = values.pop("law", d and FINITE_WIDTH.name)
        if d is not None:
            given = [name for name in ("nu", "Gamma", *RIGIDITIES) if name in values]
            if given:
                raise ValueError(f"{where}: {given[0]} must not be given together with dimensions")
            if law not in _OF_DIMENSIONS:
                raise ValueError(f"{where}: law: {one_of(law, _OF_DIMENSIONS)} together with dimensions")
            if law != self._law:
                raise ValueError(f"{where}: law: {law!r} must be that of the first section, {self._law!r}, with dimensions")
            values["nu"] = d.poisson_ratio
            if law == FINITE_WIDTH.name:
                values["Gamma"] = d.width**2 / (d.thickness * d.length)
        if law is None:
            raise ValueError(f"{where}: the field 'law' is missing")
        numbers = numbers_of(where, values)
        return section_of(str(law), {name: x / self.size(KINDS.get(name, "")) for name, x in numbers.items()}, along)

    def check_stages(self, columns: Sequence[str] = ()) -> None:
        """Raise ValueError for a stage that names what is not there; ``columns`` are others than numbers and what is found."""
        for number, stage in enumerate(self.stages, 1):
            if stage.stage is not None and stage.stage >= number:
                raise ValueError(f"stage {number}: stage: {stage.stage} must be an earlier stage")
            parameters = (strip := self.strip(number)).parameters
            if stage.follow not in parameters:
                known = [name for name in dict.fromkeys((*parameters, *strip.known)) if name != stage.follow]
                raise ValueError(f"stage {number}: follow: {one_of(stage.follow, known, 'the numbers here: ')}")
            if number == 1 and (stage.start_at or stage.stage):
                raise ValueError("stage 1: start_at: the first stage starts from the first state")
            for name in stage.numbers:
                if name not in parameters:
                    raise ValueError(f"stage {number}: numbers: {one_of(name, parameters)}")
            for name in (*stage.limits, *stage.label):
                known = dict.fromkeys((*parameters, *columns, "energy", *self.found_names))
                if name not in known:
                    raise ValueError(f"stage {number}: {one_of(name, known, 'the columns ')}")

    #: A column that the table of a run shows beside the followed number and the energy; '' for what is conjugate to the number.
    BESIDE: ClassVar[str] = ""
    #: Fields that say what is held.
    SUPPORTS: ClassVar[str]

    @abstractmethod
    def first(self, grows: Mapping[str, float], options: dict[str, Any]) -> tuple[Any, str]:
        """Return the state from which the first stage starts, a `contin.Point`, and how it was found, in words; '' for nothing.

        Raises ConfigError where there is none, or nothing determines it.
        """

    @abstractmethod
    def replacing(self, stage: int) -> Sequence[str]:
        """Return the names of the loads that replace reactions in a stage."""

    def told_axes(self, stage: int) -> Iterable[str]:
        """Return what the words of directions mean that a stage brings."""
        return ()

    @functools.cached_property
    def found_names(self) -> tuple[str, ...]:
        """The columns of what is found in states."""
        found = (self.strip(number).found_names for number in range(1, len(self.stages) + 1))
        return ("potential", *dict.fromkeys(itertools.chain.from_iterable(found)))

    @property
    def stage_count(self) -> int:
        return len(self.stages)

    def up_to(self, count: int) -> Scene:
        return self.model_copy(update={"stages": self.stages[:count]})

    def file_of(self, numbers: dict[str, Any]) -> str:
        return "_".join(f"{name}{_text(value)}".replace(" ", "_") for name, value in numbers.items()) + ".h5"

    @classmethod
    def words_of(cls, fields: dict, numbers: dict[str, Any]) -> str:
        return ", ".join(f"{name} = {_text(value)}" for name, value in numbers.items())

    def words(self, numbers: dict[str, Any]) -> str:
        return self.words_of({}, numbers)

    @property
    def heading(self) -> str:
        return self.title or self.name

    title_or_name = heading


class OpenScene(StagedScene):
    """An open strip (or a closed, twisted one), and the stages in which its numbers are followed."""

    KIND: ClassVar[str] = "open strip"
    LISTS: ClassVar[tuple] = (
        *((part, "*") for part in ("material", "dimensions", "numbers", "closed")), ("roller", "at"),
        ("stages", "#", "to"), ("stages", "#", "numbers", "*"),
    )  # fmt: skip

    title: str = ""
    material: Material = Field(description="law, and its numbers")
    dimensions: DimensionsConfig | None = None
    along: Along = Field(default_factory=dict, description="data along the strip: expressions in s, or tables of [s, value]")
    start: EndWords = EndConfig()
    finish: EndWords = EndConfig()
    closed: ClosedConfig | None = None
    roller: RollerConfig | None = None
    numbers: dict[str, float] = Field(default_factory=dict)
    directions: DirectionsConfig = DirectionsConfig()
    begin: Literal["natural", "arch", "arch, other side", "twisted", "circle"] = "natural"
    phases: Phases = Field(default_factory=list, max_length=2)
    stages: list[StageConfig] = Field(min_length=1, max_length=50)
    mesh: OpenMesh = OpenMesh()
    steps: StepConfig = StepConfig()
    stride: int = Field(1, ge=1)

    @classmethod
    def prepared(cls, values: dict) -> dict:
        """Read numbers with units, as in 380 mm, which a scene with dimensions may have."""
        if "dimensions" not in values:
            return values
        read = {"numbers": _in_si_units("numbers", values["numbers"])} if "numbers" in values else {}
        stages = values["stages"]
        return values | read | {"stages": [_stage_in_si_units(one) for one in stages] if isinstance(stages, list) else stages}

    @model_validator(mode="after")
    def _fits(self):
        if self.closed is not None and (self.start, self.finish) != (EndConfig(), EndConfig()):
            raise ValueError("closed: must not be given together with start or finish")
        for number, stage in enumerate(self.stages, 1):
            if number == 1 and (stage.start or stage.finish or stage.numbers):
                raise ValueError("stage 1: start, finish, numbers: those of the scene are the first stage's")
        self.check_stages(PLACE)
        return self

    # --- the strip ----------------------------------------------------------------------------------------------------

    #: Lengths are over that of the strip.
    longest: ClassVar[float] = 1.0
    BESIDE: ClassVar[str] = "F_tangent"
    SUPPORTS: ClassVar[str] = "start, finish"

    def kind(self, name: str) -> str:
        return _KINDS.get(name, "")

    def replacing(self, stage: int) -> Sequence[str]:
        from ribbon_model.loads import REPLACING

        return [name for name in REPLACING if name in self.strip(stage).numbers]

    def first(self, grows: Mapping[str, float], options: dict[str, Any]) -> tuple[Any, str]:
        """Return the state from which the first stage starts, and ''; raise ConfigError where there is none."""
        from contin import ProblemError

        try:
            strip, intervals = self.strip(), self.mesh.intervals
            guess, values = self._guess(strip)
            intervals = strip.roller.intervals(intervals) if strip.roller else intervals
            return strip.first_point(guess, values, intervals, **options), ""
        except (ProblemError, ValueError) as error:
            raise ConfigError(f"begin: {self.begin}: {error}") from error

    def _guess(self, strip: Any) -> tuple[Any, dict[str, float]]:
        """Return the first guess, and the place of a roller that touches the strip where that is."""
        turn = strip.parameters.get("turn", 0.0)
        guesses = {
            "natural": lambda: None, "arch": lambda: strip.arch(), "arch, other side": lambda: strip.arch(side=-1.0),
            "circle": lambda: strip.twisted_circle(turn / math.pi), "twisted": lambda: strip.twisted(turn),
        }  # fmt: skip
        guess, roller = guesses[self.begin](), strip.roller
        if roller is None or guess is None or "roller" in self.numbers:
            return guess, {}
        return guess, {"roller": sum(x * y for x, y in zip(guess(roller.at)[4:7], roller.direction))}

    def natural_unit(self, name: str) -> str:
        """Return what a number is divided by: powers of the length L and the bending modulus B; '' for ratios."""
        length, modulus, unit = _UNITS[self.kind(name)]
        return _NATURAL[length, modulus] if length or modulus else unit

    def _held(self, stage: int) -> tuple[EndConfig, EndConfig, bool]:
        if stage == 1:
            return self.start, self.finish, False
        one = self.stages[stage - 1]
        start, finish, changed = self._held(one.stage or stage - 1)
        return one.start or start, one.finish or finish, changed or bool(one.start or one.finish)

    def _strip_with(self, start: EndConfig, finish: EndConfig, changed: bool):
        """Return the strip with these ends; once they have changed, with all loads that can replace reactions."""
        from ribbon_model.ends import Roller
        from ribbon_model.loads import LOADS, STROKE, replacing_loads
        from ribbon_model.open_strip import OpenStrip

        ends, where = (start.end(), finish.end()), self.directions
        directions = where.weight, where.foundation, where.stroke
        material = self.section("material", self.material, self.along)
        replacing = replacing_loads(ends[1])
        unknown = {"moment"} - set(replacing)
        more = (tuple(self.phases), Roller(self.roller.at, self.roller.held) if self.roller else None)
        known = set(OpenStrip(material, *ends, {}, *directions, *more).known) - unknown
        numbers = {name: value / self.factor(name) for name, value in self.numbers.items()}
        if self.closed is not None:
            numbers = {**dict.fromkeys((*PLACE, *ANGLES), 0.0), "turn": math.pi * self.closed.half_twists, **numbers}
        if changed:
            numbers = dict.fromkeys(replacing, 0.0) | {name: value for name, value in numbers.items() if name in known}
        for name in itertools.chain.from_iterable((stage.follow, *stage.numbers) for stage in self.stages):
            if name in (STROKE, *LOADS) and name in known:
                numbers.setdefault(name, 0.0)
        strip = OpenStrip(material, *ends, numbers, *directions, *more)
        if self.roller is None or self.roller.only is None:
            return strip
        begins = {**strip.parameters, **self._guess(strip)[1]}["roller"]
        to = next((one.to / self.factor("roller") for one in self.stages if one.follow == "roller"), math.inf)
        roller = Roller(self.roller.at, self.roller.held, -1 if to < begins else 1)
        return OpenStrip(material, *ends, numbers, *directions, more[0], roller)

    @property
    def law_name(self) -> str:
        return self.strip().section.law.name

    @property
    def name(self) -> str:
        law = self.strip().section.law.name
        if self.closed is not None:
            twists = self.closed.half_twists
            return f"{law}, closed with {twists} half twist{'s' * (abs(twists) != 1)}"
        return f"{law}, {self.strip().start.words} and {self.strip().finish.words}"


def numbers_of(what: str, values: dict[str, Any]) -> dict[str, float]:
    """Return the numbers of a section; B2 may be infinite, as text. Raise ValueError for others."""
    found = {}
    for name, value in values.items():
        if isinstance(value, str) and not (name == "B2" and value == "inf"):
            raise ValueError(f"{what}: {name}: must be a number, not {value!r}{alone(value)}")
        if not name.isidentifier():
            raise ValueError(f"{what}: {name!r} is not usable as a name")
        found[name] = math.inf if isinstance(value, str) else value
    return found


def _stage_in_si_units(stage: object) -> Any:
    if not isinstance(stage, dict):
        return stage
    read = {part: _in_si_units(part, stage[part]) for part in ("numbers", "limits", "label") if part in stage}
    if "to" in stage and "follow" in stage:
        read["to"] = _one_in_si_units(f"stage {stage['follow']}: to", stage["follow"], stage["to"])
    return stage | read


def _in_si_units(part: str, numbers: object) -> Any:
    """Return numbers by name in SI units; what is no number is left for the check of the field."""
    if not isinstance(numbers, dict):
        return numbers
    return {name: _one_in_si_units(f"{part}: {name}", name, value) for name, value in numbers.items()}


def _one_in_si_units(what: str, name: object, value: object) -> Any:
    if isinstance(value, list):
        return [_one_in_si_units(what, name, one) for one in value]
    unit = _UNITS[_KINDS.get(name, "")][2] if isinstance(name, str) else ""
    if not isinstance(value, str) or unit not in UNITS:
        return value
    try:
        return quantity(value, unit)
    except ValueError as error:
        near = "" if name in _KINDS else meant(str(name), _KINDS)
        raise ValueError(f"{what}: {error}{near and f'; {name!r}{near} has no unit'}") from error


def _text(value: object) -> str:
    return exact_text(value) if type(value) in (int, float) else str(value)
