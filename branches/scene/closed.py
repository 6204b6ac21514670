"""Scenes of closed strips: one branch that leaves a circle, or a secondary branch that leaves a primary one."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, Field, model_validator

from branches.scene.fields import Interval, MeshConfig, Scene, StepConfig, Strict, missing, show, unknown
from branches.scene.units import STRIP_UNITS, quantity, unusual
from contin.lowlevel import exact_text, meant
from ribbon_model.laws import FINITE_WIDTH, LAWS, RIBBON, Law

Column = Literal["kappa_n", "kappa_star", "energy", "M1", "M2"]


class OriginConfig(Strict):
    """The point at which a secondary branch leaves the primary branch (m, n)."""

    kappa_n: float = Field(description="natural curvature there")
    kappa_star: float = Field(description="conjugate curvature there, which distinguishes points with the same kappa_n")
    mode: str = Field(description="class of the critical mode: the name of the labelled point SB on the primary branch")


def _known_law(name: str) -> str:
    if name not in LAWS:
        *others, last = map(repr, LAWS)
        raise ValueError(f"must be {', '.join(others)} or {last}, not {name!r}{meant(name, LAWS)}")
    return name


def _further(Gamma: float | None, parameters: Mapping[str, float]) -> list[tuple[str, float]]:
    return [*([] if Gamma is None else [("Gamma", Gamma)]), *parameters.items()]


def _material(law: str, Gamma: float | None, parameters: Mapping[str, float]) -> str:
    return ", ".join([law, *(f"{name} = {value:.12g}" for name, value in _further(Gamma, parameters))])


def law_of(material: str, nu: float) -> tuple[Law, dict[str, float]]:
    """Return a law and its parameters from `ClosedScene.material`, by which diagrams know them, and nu.

    Examples
    --------
    >>> law_of("finite width, Gamma = 30", 0.3)
    (<law 'finite width'>, {'nu': 0.3, 'Gamma': 30.0})
    """
    name, *given = material.split(", ")
    law = LAWS[name]
    pairs = (one.split(" = ") for one in given)
    return law, ({"nu": nu} if "nu" in law.parameters else {}) | {key: float(value) for key, value in pairs}


def and_nu(material: str, nu: float, letter: str = "nu") -> str:
    """Return the end of a strip's name, behind its material: its nu, '' for a law without.

    Examples
    --------
    >>> and_nu("finite width, Gamma = 30", 0.3)
    ', nu = 0.3'
    """
    return f", {letter} = {exact_text(nu)}" if "nu" in LAWS[material.partition(", ")[0]].parameters else ""


class ClosedScene(Scene):
    """One branch: that of the mode of wavenumber n on the m-covered circle, or a secondary branch that leaves it."""

    KIND: ClassVar[str] = "closed strip"
    LISTS: ClassVar[tuple] = (("law",), ("Gamma",), ("parameters", "*"), ("nu",), ("m",), ("n",))
    PAIRS: ClassVar[bool] = True
    CHANGEABLE: ClassVar[tuple[str, ...]] = ("title", "limits", "zeros", "stride", "steps.max_points")

    title: str = ""
    law: Annotated[str, AfterValidator(_known_law)] = RIBBON.name
    nu: float = Field(0.3, gt=-1, le=0.5, description="Poisson's ratio")
    Gamma: float | None = Field(None, ge=0, le=1e12, description="w^2 / (h L/2pi), width and thickness; law finite width only")
    m: int = Field(ge=1, le=1000, description="covering index of the circle that the branch leaves")
    n: int = Field(ge=1, le=1000, description="wavenumber of the mode")
    domain: Literal["cell", "half loop", "half loop between axes"] = "cell"
    origin: OriginConfig | None = Field(None, description="follow the secondary branch that leaves (m, n) there instead")
    limits: dict[Column, Interval] = Field(default_factory=lambda: {"kappa_n": (-100.0, 100.0)})
    zeros: dict[Column, Annotated[list[float], Field(max_length=100)]] = Field(
        default_factory=dict, description="values at which points are labelled UZ"
    )
    mesh: MeshConfig = MeshConfig()
    steps: StepConfig = StepConfig()
    stability: bool = Field(False, description="compute the index of every point, and the points where it changes")
    stride: int = Field(1, ge=1, description="the full solution is kept at every stride-th point and at labelled ones")
    strip: dict[str, Annotated[float, Field(allow_inf_nan=True)]] | None = Field(
        None, description="dimensions in SI units, from which law, nu and Gamma follow"
    )
    parameters: dict[str, float] = Field(default_factory=dict, description="further parameters of the law, by name")

    @model_validator(mode="after")
    def _bifurcation_exists(self):
        if (self.domain == "cell" or self.origin) and self.m % (2 * self.n) == 0:
            raise ValueError(
                f"m = {self.m}, n = {self.n}: m / n must not be even on the cell, because the loop would not close"
            )
        self._origin_fits()
        start = self.at_bifurcation() if self.origin is None else self.origin.model_dump()
        for name, (low, high) in self.limits.items():
            if name in start and not low < start[name] < high:
                raise ValueError(
                    f"limits: {name}: {exact_text(low)}, {exact_text(high)} must contain the start of the branch, "
                    f"{name} = {start[name]:.10g}"
                )
        return self

    def _origin_fits(self) -> None:
        """Raise ValueError if a branch from this origin cannot be followed on the domain."""
        if self.origin is None:
            if self.domain == "half loop between axes":
                raise ValueError("domain: the half loop between axes is only for secondary branches, which have an origin")
            return
        from ribbon_model.domains import HALF_LOOPS  # imports the engine (.3 s), which other scenes do not need here
        from ribbon_model.modes import Mode

        allowed = [HALF_LOOPS[reversal].name for reversal in Mode.parse(self.n, self.origin.mode).keeps]
        if not allowed:
            raise ValueError(f"origin: {self.origin.mode!r} keeps no mirror and no axis; such branches are not followed")
        if self.domain not in allowed:
            raise ValueError(f"domain: {self.domain!r} must be {' or '.join(map(repr, allowed))} for {self.origin.mode!r}")

    def at_bifurcation(self) -> dict[Column, float]:
        """Return the columns on the circle where the branch starts (there the strain is omega = (m, 0, 0)).

        Raises ValueError where the mode has no bifurcation; see `ribbon_model.linear.thresholds`.
        """
        from ribbon_model.linear import circle, thresholds

        law, parameters = LAWS[self.law], self.law_parameters
        kappa_n = thresholds(law, self.m, self.n, parameters)[0]
        return {"kappa_n": kappa_n, "M2": 0.0, **circle(law, self.m, kappa_n, parameters)}

    @property
    def law_parameters(self) -> dict[str, float | None]:
        """The parameters of the law by name; None: not given."""
        nu = {"nu": self.nu} if "nu" in LAWS[self.law].parameters or "nu" in self.model_fields_set else {}
        return nu | {"Gamma": self.Gamma} | self.parameters

    @property
    def material(self) -> str:
        """The name of the law, with its parameters besides nu; `law_of` reads it back."""
        return _material(self.law, self.Gamma, self.parameters)

    @property
    def name(self) -> str:
        what = "secondary branch from " if self.origin else ""
        return f"{self.material}, {what}(m, n) = ({self.m}, {self.n}){and_nu(self.law, self.nu)}"

    @property
    def heading(self) -> str:
        return f"{self.name} on the {self.domain}"

    @property
    def cautions(self) -> list[str]:
        return unusual(self.strip or {})

    @functools.cached_property
    def _units(self) -> dict[str, tuple[float, str]]:
        """What columns are multiplied by, and their units, where the sizes of the strip are given."""
        if not self.strip:
            return {}
        from ribbon_model.strip import Strip

        real = Strip(**self.strip)
        radius, moment, energy = real.radius(1), (real.moment_unit, "N m"), (real.energy_unit, "J")
        found = {"kappa_n": (1 / radius, "1/m"), "length": (radius, "m"), "energy": energy, "elastic": energy}
        return found | dict.fromkeys(("M1", "M2", "M3"), moment) | dict.fromkeys(("R1", "R2", "R3"), (moment[0] / radius, "N"))

    def factor(self, column: str) -> float:
        return self._units.get(column, (1.0, ""))[0]

    def unit(self, column: str) -> str:
        return self._units.get(column, (1.0, ""))[1]

    # --- names of files -------------------------------------------------------------------------------------------------

    def file_of(self, numbers: dict[str, Any]) -> str:
        return self.file

    @property
    def file(self) -> str:
        """The file of a primary branch in the folder of its diagram; each branch of a scene has its own."""
        return f"{self._stem(self.m)}.h5"

    @property
    def other_end(self) -> str:
        """The branch (m, n) may end on the (2n - m)-covered circle, where it is the branch (2n - m, n)."""
        other = 2 * self.n - self.m
        return f"{self._stem(other)}.h5" if other < self.m else ""

    @property
    def law_name(self) -> str:
        return self.law

    def secondary_file(self, taken: set[str]) -> str:
        """Return the file of a secondary branch: that of its primary branch, with the origin and the domain.

        kappa_n of the origin has six digits: it was computed, and further digits may differ on another machine. It has more if
        another branch of the diagram already has this name.
        """
        kappa_n, kappa_star = exact_text(self.origin.kappa_n), exact_text(self.origin.kappa_star)
        places = (f"{self.origin.kappa_n:.6g}", kappa_n, f"{kappa_n}_{kappa_star}")
        names = [f"{self._stem(self.m)}_from{place}_{self.domain.replace(' ', '_')}.h5" for place in places]
        return next((name for name in names if name not in taken), names[-1])

    def _stem(self, m: int) -> str:
        law = self.law.replace(" ", "_")
        law += "".join(f"_{name}{value:.12g}" for name, value in _further(self.Gamma, self.parameters))
        nu = f"_nu{exact_text(self.nu)}" if "nu" in LAWS[self.law].parameters else ""
        return f"{law}{nu}_m{m}_n{self.n}"

    @classmethod
    def prepared(cls, values: dict) -> dict:
        return _of_strip(values) if "strip" in values else values

    @classmethod
    def as_written(cls, values: dict) -> dict:
        return {key: value for key, value in values.items() if "strip" not in values or key not in _FROM_STRIP}

    # --- lists in place of single values --------------------------------------------------------------------------------

    @classmethod
    def axes(cls, values: dict, lists: dict[tuple, list]) -> list[tuple[tuple, list[tuple]]]:
        if "origin" in values:
            raise ValueError("origin: must not be given in a scene of many branches")
        if "pairs" not in values:
            if absent := [key for key in ("m", "n") if key not in values]:
                raise ValueError(missing(absent))
            return super().axes(values, lists)
        if "m" in values or "n" in values:
            raise ValueError("pairs: must not be given together with m or n")
        pairs = values["pairs"]
        if not (isinstance(pairs, list) and pairs and all(isinstance(pair, list) and len(pair) == 2 for pair in pairs)):
            raise ValueError(f"pairs: must be a list of [m, n], not {show(pairs)}")
        return [*super().axes(values, lists), ((("m",), ("n",)), [tuple(pair) for pair in pairs])]

    @classmethod
    def combination(cls, fields: dict, lists: dict[tuple, list]) -> dict | None:
        """n = m is a rigid rotation, a loop with even m / n does not close, and Gamma varies for laws with a width only."""
        fields = {key: value for key, value in fields.items() if key not in ("title", "pairs")}
        m, n = fields["m"], fields["n"]
        whole = type(m) is int and type(n) is int and m > 0 and n > 0
        if whole and (m == n or (fields.get("domain", "cell") == "cell" and m % (2 * n) == 0)):
            return None
        laws = lists.get(("law",), [fields.get("law", RIBBON.name)])
        wide = [name for name, law in LAWS.items() if law.has_width and name in laws]
        if "Gamma" in fields and wide and fields.get("law") not in wide:
            first = lists.get(("Gamma",), [fields["Gamma"]])[0]
            return {key: value for key, value in fields.items() if key != "Gamma"} if fields["Gamma"] == first else None
        return fields

    @classmethod
    def words_of(cls, fields: dict, numbers: dict[str, Any]) -> str:
        law = _material(fields.get("law", RIBBON.name), fields.get("Gamma"), fields.get("parameters", {}))
        return f"{law}{and_nu(law, fields.get('nu', 0.3))}, ({fields['m']}, {fields['n']})"

    @classmethod
    def same_name(cls, words: str, a: ClosedScene, b: ClosedScene) -> str:
        if a.Gamma == b.Gamma:
            return super().same_name(words, a, b)
        both = f"{exact_text(a.Gamma)} and {exact_text(b.Gamma)}"
        return f"Gamma: {both} agree in 12 digits, the precision of the names of results; give one"


#: Fields that follow from ``strip``, in the order in which `of_strip` sets them.
_FROM_STRIP = ("law", "nu", "Gamma")


def _of_strip(values: dict) -> dict:
    """Replace the ``strip`` of a scene (SI units) by law, nu and Gamma; its kappa_n is labelled UZ."""
    from ribbon_model.strip import NAMES, Strip

    strip = values["strip"]
    if not isinstance(strip, dict):
        raise ValueError(f"strip: must hold the fields {', '.join(NAMES)}, not {show(strip)}")
    for field in strip:
        if field not in NAMES:
            raise ValueError(unknown(f"strip.{field}", NAMES))
    if absent := [f"strip.{field}" for field in NAMES if field not in strip]:
        raise ValueError(missing(absent))
    for field in _FROM_STRIP:
        if field in values:
            raise ValueError(f"{field}: must not be given together with strip, which determines it")
    strip = dict(strip)
    for field, value in strip.items():
        if isinstance(value, str):
            try:
                strip[field] = quantity(value, STRIP_UNITS[field])
            except ValueError as error:
                raise ValueError(f"strip: {field}: {error}") from error
    try:
        found = Strip(**strip)
    except ValueError as error:
        raise ValueError(f"strip: {error}") from error
    rest = {**values, "strip": strip} | dict(zip(_FROM_STRIP, (FINITE_WIDTH.name, found.poisson_ratio, found.Gamma)))
    zeros = rest.get("zeros", {})
    known = zeros.get("kappa_n", []) if isinstance(zeros, dict) else None
    if isinstance(known, list) and found.kappa_n not in known:  # otherwise the check of the field rejects it
        rest["zeros"] = {**zeros, "kappa_n": [*known, found.kappa_n]}
    return rest
