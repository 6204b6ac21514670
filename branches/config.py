"""A scene: what to compute, from a YAML file, checked field by field before anything starts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator


class ConfigError(Exception):
    """A scene that cannot be run; the message is one sentence that names the field, the value and what is allowed."""


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class MeshConfig(_Strict):
    """How finely a branch is resolved."""

    degree: int = Field(7, ge=2, le=8, description="polynomial degree of the collocation")
    intervals: int = Field(10, ge=1, le=2000, description="intervals of the first mesh")
    max_intervals: int = Field(2000, ge=1, le=2000)
    tolerance: float = Field(1e-12, ge=1e-14, le=1e-2, description="wanted error; the number of intervals adapts to it")
    adapt_every: int = Field(3, ge=0, description="steps between looks at the mesh, 0 for a fixed one")

    @model_validator(mode="after")
    def _order(self):
        if self.intervals > self.max_intervals:
            raise ValueError(f"intervals = {self.intervals} must not exceed max_intervals = {self.max_intervals}")
        return self


class StepConfig(_Strict):
    """How a branch is stepped along."""

    first: float = Field(0.05, ge=1e-6, le=10, description="first step of arclength")
    smallest: float = Field(1e-6, gt=0, le=1)
    largest: float = Field(10.0, gt=0, description="largest step of arclength")
    max_points: int = Field(2000, ge=1, le=1_000_000)
    angle: float = Field(0.35, gt=0.001, le=1.0, description="largest angle between consecutive tangents, radians")

    @model_validator(mode="after")
    def _order(self):
        if not self.smallest <= self.first <= self.largest:
            raise ValueError(
                f"first = {self.first:g} must lie between smallest = {self.smallest:g} and largest = {self.largest:g}"
            )
        return self


def _ordered(ends: tuple[float, float]) -> tuple[float, float]:
    if not ends[0] < ends[1]:
        raise ValueError(f"the first number must be the smaller, not {ends[0]:g}, {ends[1]:g}")
    return ends


Interval = Annotated[tuple[float, float], Field(strict=False), AfterValidator(_ordered)]
Column = Literal["kappa_n", "kappa_star", "energy", "M1", "M2"]


class Config(_Strict):
    """One primary branch: the mode of wavenumber n on the m-covered circle, followed to its end."""

    title: str = ""
    law: Literal["ribbon", "flat rod", "isotropic rod"] = "ribbon"
    nu: float = Field(0.3, gt=-1, le=0.5, description="Poisson's ratio")
    m: int = Field(ge=1, le=1000, description="covering index of the circle that the branch leaves")
    n: int = Field(ge=1, le=1000, description="wavenumber of the mode")
    domain: Literal["cell", "half loop"] = "cell"
    limits: dict[Column, Interval] = Field(default_factory=lambda: {"kappa_n": (-100.0, 100.0)})
    zeros: dict[Column, list[float]] = Field(default_factory=dict, description="values to label UZ")
    mesh: MeshConfig = MeshConfig()
    steps: StepConfig = StepConfig()
    stride: int = Field(1, ge=1, description="the full solution is kept at every stride-th point and at labelled ones")

    @model_validator(mode="after")
    def _bifurcation_exists(self):
        from ribbon_model.laws import LAWS
        from ribbon_model.linear import thresholds

        kappa_n = thresholds(LAWS[self.law], self.m, self.n, self.nu)[0]
        for name, (low, high) in self.limits.items():
            if name == "kappa_n" and not low < kappa_n < high:
                raise ValueError(f"limits: kappa_n: {low:g}, {high:g} must contain the bifurcation at {kappa_n:.6g}")
        return self


def load(path: str | Path, settings: list[str] = ()) -> Config:
    """The scene of a YAML file, with ``key=value`` settings (dotted keys, YAML values) put over it.

    Raises
    ------
    ConfigError
        A file that cannot be read, or a field that is unknown, of the wrong type or impossible.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"cannot read the config {str(path)!r}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"cannot read the config {str(path)!r}: it is not UTF-8 text") from error
    return parse(text, str(path), settings)


def parse(text: str, name: str, settings: list[str] = ()) -> Config:
    """The scene of a YAML text; ``name`` says in messages where it came from."""
    values = _yaml(text, name)
    if not isinstance(values, dict):
        raise ConfigError(f"{name}: must hold `key: value` lines, not {_show(values)}")
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals or not key:
            raise ConfigError(f"--set {setting!r}: must be key=value")
        _put(values, key, _yaml(value, f"--set {key}"))
    try:
        return Config.model_validate(values)
    except ValidationError as error:
        raise ConfigError(f"{name}: {_sentence(error)}") from error


def _yaml(text: str, name: str) -> Any:
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f" in line {mark.line + 1}" if mark else ""
        raise ConfigError(f"{name}: not YAML{where}: {getattr(error, 'problem', None) or error}") from error
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{name}: not usable YAML: {type(error).__name__}") from error


def _put(values: dict, key: str, value: Any) -> None:
    *path, last = key.split(".")
    for part in path:
        values = values.setdefault(part, {})
        if not isinstance(values, dict):
            raise ConfigError(f"--set {key}: {part!r} has no fields")
    values[last] = value


def _sentence(error: ValidationError) -> str:
    """The first complaint as `field: value ... what is allowed`, and how many more there are."""
    errors = error.errors()
    first = errors[0]
    where = ".".join(str(part) for part in first["loc"])
    kind, message = first["type"], first["msg"].removeprefix("Value error, ")
    if kind == "extra_forbidden":
        text = f"unknown field {where!r}; the fields are {', '.join(_fields(first['loc']))}"
    elif kind == "missing":
        text = f"the field {where!r} is missing"
    elif kind == "value_error" and not where:
        text = message
    elif kind == "value_error":
        text = f"{where}: {message}"
    else:
        text = f"{where}: {message[0].lower()}{message[1:]}, not {_show(first['input'])}"
    return text + (f" (and {len(errors) - 1} more)" if len(errors) > 1 else "")


def _fields(location) -> list[str]:
    model = Config
    for part in location[:-1]:
        field = model.model_fields.get(part)
        if field is None or not isinstance(field.annotation, type) or not issubclass(field.annotation, BaseModel):
            break
        model = field.annotation
    return list(model.model_fields)


def _show(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
