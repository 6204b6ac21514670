"""Scenes: the input of a computation, from a YAML file, checked field by field before the computation starts."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import yaml
from pydantic import BaseModel, Field, ValidationError, model_validator

from branches.fields import Interval, MeshConfig, StepConfig, Strict, show
from branches.units import STRIP_UNITS, quantity
from contin.lowlevel import exact_text
from ribbon_model.laws import FINITE_WIDTH, LAWS, RIBBON, label


class ConfigError(Exception):
    """A scene that cannot be run; the message is one sentence that names the field, the value and what is allowed."""


Column = Literal["kappa_n", "kappa_star", "energy", "M1", "M2"]


class OriginConfig(Strict):
    """The point at which a secondary branch leaves the primary branch (m, n)."""

    kappa_n: float = Field(description="natural curvature there")
    kappa_star: float = Field(description="conjugate curvature there, which distinguishes points with the same kappa_n")
    mode: str = Field(description="class of the critical mode: the name of the labelled point SB on the primary branch")


class Config(Strict):
    """One branch: that of the mode of wavenumber n on the m-covered circle, or a secondary branch that leaves it."""

    title: str = ""
    law: Literal[*LAWS] = RIBBON.name
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

        Raises
        ------
        ValueError
            The mode has no bifurcation; see `ribbon_model.linear.thresholds`.
        """
        from ribbon_model.linear import circle, thresholds

        law, parameters = LAWS[self.law], self.parameters
        kappa_n = thresholds(law, self.m, self.n, parameters)[0]
        return {"kappa_n": kappa_n, "M2": 0.0, **circle(law, self.m, kappa_n, parameters)}

    @property
    def parameters(self) -> dict[str, float | None]:
        """The parameters of the law by name; None: not given."""
        return {"nu": self.nu, "Gamma": self.Gamma}

    @property
    def material(self) -> str:
        """The name of the law, with its Gamma if it has one."""
        return label(self.law, self.Gamma)


@dataclass(frozen=True)
class DiagramConfig:
    """A scene of many branches: lists in place of ``law``, ``nu``, ``Gamma``, ``m`` or ``n``, or ``pairs`` of (m, n).

    Attributes
    ----------
    title : str
    values : dict
        The fields of the scene as given.
    branches : tuple of Config
        Every combination, without n = m (a rigid rotation) and, on the cell, even m / n (a loop that does not close).
    absent : dict
        Combinations that cannot be run, by name, with the reason: no such bifurcation, or one outside the limits.
    """

    title: str
    values: dict
    branches: tuple[Config, ...]
    absent: dict[str, str]


#: Fields that may hold a list; a scene that has one, or ``pairs``, is a diagram.
_SWEPT = ("law", "nu", "Gamma", "m", "n")
#: Largest number of branches in one scene. With ten times more, a mistyped list would run for hours.
_MOST_BRANCHES = 10_000


def _is_diagram(values: dict) -> bool:
    return "pairs" in values or any(isinstance(values.get(name), list) for name in _SWEPT)


def _diagram(values: dict, name: str, settings: list[str]) -> DiagramConfig:
    """Return the scene of many branches with these values."""
    lists = {key: values[key] if isinstance(values.get(key), list) else [values[key]] for key in _SWEPT if key in values}
    for key, entries in lists.items():
        if not entries:
            raise ConfigError(f"{name}: {key}: the list is empty")
    if "origin" in values:
        raise ConfigError(f"{name}: origin: must not be given in a scene of many branches")
    pairs = _pairs(values, lists, name)
    families = _families(lists)
    if len(families) * len(pairs) > _MOST_BRANCHES:
        raise ConfigError(f"{name}: {len(families) * len(pairs)} branches are more than {_MOST_BRANCHES}")
    shared = {key: value for key, value in values.items() if key not in (*_SWEPT, "pairs", "title")}
    found, absent = [], {}
    for (law, nu, Gamma), (m, n) in itertools.product(families, pairs):
        whole = type(m) is int and type(n) is int and m > 0 and n > 0
        if whole and (m == n or (shared.get("domain", "cell") == "cell" and m % (2 * n) == 0)):
            continue
        try:
            found.append(Config.model_validate({**shared, "law": law, "nu": nu, "Gamma": Gamma, "m": m, "n": n}))
        except ValidationError as error:
            if error.errors()[0]["loc"]:  # a field is invalid in every combination
                raise ConfigError(f"{_origin(error, name, settings)}: {_sentence(error)}") from error
            absent[_branch_name(law, Gamma, nu, m, n)] = _sentence(error)
    if not found:
        reason = next(iter(absent.values()), "n = m is a rigid rotation")
        raise ConfigError(f"{name}: none of its branches can be run ({reason})")
    _check_different(found, name)
    return DiagramConfig(str(values.get("title", "")), values, tuple(found), absent)


def _branch_name(law: str, Gamma: float | None, nu: float, m: int, n: int) -> str:
    """Return the name of a branch of a diagram, for messages."""
    return f"{label(law, Gamma)}, nu = {exact_text(nu)}, ({m}, {n})"


def _check_different(branches: list[Config], name: str) -> None:
    """Raise ConfigError if a branch is listed twice, or if two values of Gamma are so close that their names are equal."""
    seen, Gammas = set(), {}
    for one in branches:
        key = one.law, one.Gamma, one.nu, one.m, one.n
        if key in seen:
            raise ConfigError(f"{name}: the branch {_branch_name(*key)} is listed twice; give each value once")
        seen.add(key)
        other = Gammas.setdefault(one.material, one.Gamma)
        if other != one.Gamma:
            both = f"{exact_text(other)} and {exact_text(one.Gamma)}"
            raise ConfigError(f"{name}: Gamma: {both} agree in 12 digits, the precision of the names of results; give one")


def _families(lists: dict) -> list[tuple]:
    """Return all (law, nu, Gamma) of a diagram; laws without a Gamma get None."""
    laws, Gammas = lists.get("law", [RIBBON.name]), lists.get("Gamma", [None])
    wide = [name for name, law in LAWS.items() if law.has_width and name in laws]
    without = [None] if wide else Gammas
    kinds = [(law, Gamma) for law in laws for Gamma in (Gammas if law in wide else without)]
    return [(law, nu, Gamma) for law, Gamma in kinds for nu in lists.get("nu", [0.3])]


def _pairs(values: dict, lists: dict, name: str) -> list[tuple]:
    """Return all (m, n) of a diagram."""
    if "pairs" not in values:
        for key in ("m", "n"):
            if key not in lists:
                raise ConfigError(f"{name}: the field {key!r} is missing")
        return list(itertools.product(lists["m"], lists["n"]))
    if "m" in values or "n" in values:
        raise ConfigError(f"{name}: pairs: must not be given together with m or n")
    pairs = values["pairs"]
    if not (isinstance(pairs, list) and pairs and all(isinstance(pair, list) and len(pair) == 2 for pair in pairs)):
        raise ConfigError(f"{name}: pairs: must be a list of [m, n], not {show(pairs)}")
    return [tuple(pair) for pair in pairs]


#: Largest size of a scene. Scenes have a few lines; a larger file is not a scene (or is a device that never ends).
_MOST_BYTES = 1_000_000


def load(path: str | Path, settings: list[str] = ()) -> Any:
    """Return the scene of a YAML file, changed by ``key=value`` settings (dotted keys, YAML values).

    It is a `Config` or `DiagramConfig`, or of open strips an `OpenConfig` or `OpenSweep`.

    Raises
    ------
    ConfigError
        A file that cannot be read, or a field that is unknown, of the wrong type or invalid.
    """
    try:
        with open(path, "rb") as file:
            data = file.read(_MOST_BYTES + 1)
        text = data.decode("utf-8")
    except OSError as error:
        raise ConfigError(f"cannot read the config {str(path)!r}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"cannot read the config {str(path)!r}: it is not UTF-8 text") from error
    if len(data) > _MOST_BYTES:
        raise ConfigError(f"cannot read the config {str(path)!r}: it is larger than a megabyte; a scene must be smaller")
    return parse(text, _plain(str(path)), settings)


def parse(text: str, name: str, settings: list[str] = ()) -> Any:
    """Return the scene of a YAML text; messages call the text ``name``."""
    values = _yaml(text, name)
    if not isinstance(values, dict):
        found = "it is empty" if values is None else f"not {show(values)}"
        raise ConfigError(f"{name}: must hold `key: value` lines; {found}")
    for setting in settings:
        key, equals, value = setting.partition("=")
        parts = key.strip().split(".")
        if not equals or "" in parts:
            raise ConfigError(f"--set {setting!r}: must be key=value, as in nu=0.2 or mesh.degree=5")
        _put(values, parts, _yaml(value, f"--set {_plain(key)}"))
    if "stages" in values:
        from branches.open_config import OpenConfig  # needs the models of this module
        from branches.sweep_config import lists_in

        lists = lists_in(values)
        return _sweep(values, lists, name, settings) if lists else _validated(OpenConfig, values, name, settings)
    if "strip" in values:
        values = _of_strip(values, name)
    if _is_diagram(values):
        return _diagram(values, name, settings)
    return _validated(Config, values, name, settings)


def _sweep(values: dict, lists: dict[tuple, list], name: str, settings: list[str]):
    """Return the scene of many open strips with these values."""
    from branches.open_config import OpenConfig
    from branches.sweep_config import OpenSweep, combinations, file_of

    for place, entries in lists.items():
        if not entries or any(isinstance(entry, (list, dict)) for entry in entries):
            raise ConfigError(
                f"{name}: {'.'.join(map(str, place))}: must be a number, or a list of numbers, not {show(entries)}"
            )
    count = math.prod(len(entries) for entries in lists.values())
    if count > _MOST_BRANCHES:
        raise ConfigError(f"{name}: {count} branches are more than {_MOST_BRANCHES}")
    branches, numbers, absent = {}, {}, {}
    for words, chosen, fields in combinations(values, lists):
        file = file_of(chosen)
        if file in numbers:
            raise ConfigError(f"{name}: the branch {words} is listed twice; give each value once")
        try:
            branches[file], numbers[file] = OpenConfig.model_validate(fields), chosen
        except ValidationError as error:
            if error.errors()[0]["loc"]:  # a field is invalid in every combination
                raise ConfigError(f"{_origin(error, name, settings)}: {_sentence(error, OpenConfig)}") from error
            absent[words] = _sentence(error, OpenConfig)
    if not branches:
        raise ConfigError(f"{name}: none of its branches can be run ({next(iter(absent.values()))})")
    return OpenSweep(str(values.get("title", "")), values, branches, numbers, absent)


def _validated(model: type[Strict], values: dict, name: str, settings: list[str]) -> Any:
    """Return the scene with these values; raise ConfigError with one sentence."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise ConfigError(f"{_origin(error, name, settings)}: {_sentence(error, model)}") from error


#: Fields that follow from ``strip``, in the order in which `_of_strip` sets them.
_FROM_STRIP = ("law", "nu", "Gamma")


def _of_strip(values: dict, name: str) -> dict:
    """Replace the ``strip`` of a scene (SI units) by law, nu and Gamma; its kappa_n is labelled UZ."""
    from ribbon_model.strip import NAMES, Strip

    strip = values["strip"]
    if not isinstance(strip, dict):
        raise ConfigError(f"{name}: strip: must hold the fields {', '.join(NAMES)}, not {show(strip)}")
    for field in strip:
        if field not in NAMES:
            raise ConfigError(f"{name}: unknown field 'strip.{_plain(str(field))}'; the fields are {', '.join(NAMES)}")
    for field in NAMES:
        if field not in strip:
            raise ConfigError(f"{name}: the field 'strip.{field}' is missing")
    for field in _FROM_STRIP:
        if field in values:
            raise ConfigError(f"{name}: {field}: must not be given together with strip, which determines it")
    strip = dict(strip)
    for field, value in strip.items():
        if isinstance(value, str):
            try:
                strip[field] = quantity(value, STRIP_UNITS[field])
            except ValueError as error:
                raise ConfigError(f"{name}: strip: {field}: {error}") from error
    try:
        found = Strip(**strip)
    except ValueError as error:
        raise ConfigError(f"{name}: strip: {error}") from error
    rest = {**values, "strip": strip} | dict(zip(_FROM_STRIP, (FINITE_WIDTH.name, found.poisson_ratio, found.Gamma)))
    zeros = rest.get("zeros", {})
    known = zeros.get("kappa_n", []) if isinstance(zeros, dict) else None
    if isinstance(known, list) and found.kappa_n not in known:  # otherwise the check of the field rejects it
        rest["zeros"] = {**zeros, "kappa_n": [*known, found.kappa_n]}
    return rest


# --- YAML ---------------------------------------------------------------------------------------------------------


#: Largest number of nested levels. Scenes have three; thousands would take seconds to read.
_DEEPEST = 20


class _Loader(yaml.SafeLoader):
    """Loader for the subset of YAML in scenes: no aliases (which can expand without bound), no tags, no duplicate keys.

    Plain words are read as in YAML 1.2: 1e-12 is a number, while 1:30, 010 and yes are text.
    """

    yaml_implicit_resolvers: dict = {}

    def compose_node(self, parent, index):
        self._depth = getattr(self, "_depth", 0) + 1
        if self._depth > _DEEPEST:
            raise RecursionError
        event = self.peek_event()
        if isinstance(event, yaml.AliasEvent) or getattr(event, "tag", None):
            raise yaml.MarkedYAMLError(problem="a scene has no aliases and no tags", problem_mark=event.start_mark)
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def construct_mapping(self, node, deep=False):
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.value in seen:
                raise yaml.MarkedYAMLError(problem=f"the key {key.value!r} is given twice", problem_mark=key.start_mark)
            seen.add(key.value if isinstance(key, yaml.ScalarNode) else None)
        return super().construct_mapping(node, deep)


for _kind, _pattern, _first in (
    ("null", r"~|null|", ["~", "n", ""]),
    ("bool", r"true|false", list("tf")),
    ("int", r"[-+]?(0|[1-9][0-9]{0,30})", list("-+0123456789")),
    ("float", r"[-+]?((\.[0-9]+|[0-9]+\.[0-9]*)([eE][-+]?[0-9]+)?|[0-9]+[eE][-+]?[0-9]+|\.inf)|\.nan", list("-+.0123456789")),
):
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{_kind}", re.compile(f"^(?:{_pattern})$"), _first)


class _Dumper(yaml.SafeDumper):
    """Dumper that quotes texts which ``_Loader`` would read as other types."""

    yaml_implicit_resolvers = _Loader.yaml_implicit_resolvers


def dump(config: Config | DiagramConfig) -> str:
    """Return the YAML text of a scene without fields at their defaults; `parse` reads it back."""
    values = config.model_dump(mode="json", exclude_defaults=True) if isinstance(config, Strict) else config.values
    if "strip" in values:
        values = {key: value for key, value in values.items() if key not in _FROM_STRIP}
    return yaml.dump(values, Dumper=_Dumper, sort_keys=False)


def difference(stored: Config, config: Config, ignored: Sequence[str] = ()) -> str:
    """Return the first field in which the scene of a file differs from another scene, in words; '' if they agree.

    Parameters
    ----------
    ignored : sequence of str
        Fields that may differ: ``title``, or ``steps.max_points`` for one inside another.
    """
    a, b = stored.model_dump(), config.model_dump()
    for field in ignored:
        name, _, inner = field.partition(".")
        for values in (a, b):
            (values[name] if inner else values).pop(inner or name, None)
    for name in a:
        if a[name] != b[name]:
            return f"{name} = {a[name]!r} there, {b[name]!r} here"
    return ""


def _yaml(text: str, name: str) -> Any:
    try:
        return yaml.load(text, _Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" in line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error).splitlines()[0]
        raise ConfigError(f"{name}: not usable YAML{where}: {problem}") from error
    except RecursionError as error:
        raise ConfigError(f"{name}: not usable YAML: nested too deeply") from error


def _put(values: dict, path: list[str], value: Any) -> None:
    for part in path[:-1]:
        values = values.setdefault(part, {})
        if not isinstance(values, dict):
            raise ConfigError(f"--set {_plain('.'.join(path))}: {part!r} has no fields")
    values[path[-1]] = value


# --- messages -----------------------------------------------------------------------------------------------------


def _where(complaint) -> str:
    return _plain(".".join(str(part) for part in complaint["loc"] if part != "[key]"))


def _origin(error: ValidationError, name: str, settings: list[str]) -> str:
    """Return the setting that the first error is about, otherwise the file."""
    where = _where(error.errors()[0])
    for setting in reversed(settings):
        key = setting.partition("=")[0].strip()
        if f"{where}.".startswith(f"{key}.") or f"{key}.".startswith(f"{where}."):
            return f"--set {_plain(setting)}"
    return name


def _plain(text: str) -> str:
    """Return a text for a message: one line of bounded length."""
    text = text if text.isprintable() else repr(text)[1:-1]
    return text if len(text) <= 200 else text[:197] + "..."


def _sentence(error: ValidationError, model: type[BaseModel] = Config) -> str:
    """Return the first error as `field: value ... what is allowed`, and the number of further errors."""
    errors = error.errors()
    first = errors[0]
    where, kind, message = _where(first), first["type"], first["msg"].removeprefix("Value error, ")
    if kind == "extra_forbidden":
        text = f"unknown field {where!r}; the fields are {', '.join(_fields(first['loc'], model))}"
    elif kind == "missing":
        text = f"the field {where!r} is missing"
    elif kind == "value_error":
        text = f"{where}: {message}" if where else message
    elif kind in ("model_type", "dict_type"):
        text = f"{where}: must hold `key: value` fields, not {show(first['input'])}"
    else:
        message = message.replace("Input should be", "must be")
        text = f"{where}: {message[0].lower()}{message[1:]}, not {show(first['input'])}"
    return text + (f" (and {len(errors) - 1} more)" if len(errors) > 1 else "")


def _fields(location, model: type[BaseModel]) -> list[str]:
    for part in location[:-1]:
        field = model.model_fields.get(part)
        inner = [kind for kind in (field.annotation, *get_args(field.annotation)) if _is_model(kind)] if field else []
        model = inner[0] if inner else model
    return list(model.model_fields)


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)
