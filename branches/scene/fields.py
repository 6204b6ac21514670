"""Fields that scenes of closed and of open strips share."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from contin.lowlevel import exact_text


class ConfigError(Exception):
    """A scene that cannot be run; the message is one sentence that names the field, the value and what is allowed."""


class Strict(BaseModel):
    """A part of a scene: unknown fields, other types and numbers that are not finite are rejected."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class MeshConfig(Strict):
    """Fields of the mesh."""

    degree: int = Field(7, ge=2, le=8, description="polynomial degree of the collocation")
    intervals: int = Field(8, ge=1, le=2000, description="intervals of the first mesh")
    max_intervals: int = Field(2000, ge=1, le=2000)
    tolerance: float = Field(
        1e-12, ge=1e-14, le=1e-2, description="tolerance of the discretization error; the number of intervals adapts to it"
    )
    adapt_every: int = Field(3, ge=0, description="steps between adaptations of the mesh, 0 for a fixed mesh")

    @model_validator(mode="after")
    def _order(self):
        if self.intervals > self.max_intervals:
            raise ValueError(f"intervals = {self.intervals} must not exceed max_intervals = {self.max_intervals}")
        return self


class StepConfig(Strict):
    """Fields of the steps along a branch."""

    first: float | None = Field(None, ge=1e-6, le=10, description="first step of arclength; 0.05 if the bounds allow it")
    smallest: float = Field(1e-6, gt=0, le=1)
    largest: float = Field(10.0, gt=0, description="largest step of arclength")
    max_points: int = Field(2000, ge=1, le=1_000_000)
    angle: float = Field(0.35, gt=0.001, le=1.0, description="largest angle between consecutive tangents, radians")

    @model_validator(mode="after")
    def _order(self):
        if self.smallest > self.largest:
            raise ValueError(f"smallest = {exact_text(self.smallest)} must not exceed largest = {exact_text(self.largest)}")
        if self.first is not None and not self.smallest <= self.first <= self.largest:
            bounds = f"smallest = {exact_text(self.smallest)} and largest = {exact_text(self.largest)}"
            raise ValueError(f"first = {exact_text(self.first)} must lie between {bounds}")
        return self

    @property
    def first_step(self) -> float:
        """The first step of arclength; chosen if ``first`` is not given."""
        return min(max(0.05, self.smallest), self.largest) if self.first is None else self.first


def _two_ordered_numbers(ends: Any) -> Any:
    numbers = isinstance(ends, (list, tuple)) and all(type(end) in (int, float) and math.isfinite(end) for end in ends)
    if not (numbers and len(ends) == 2 and ends[0] < ends[1]):
        raise ValueError(f"must be two finite numbers, the smaller first, as in [-100, 100], not {show(ends)}")
    return tuple(ends)


Interval = Annotated[tuple[float, float], BeforeValidator(_two_ordered_numbers)]


def show(value: Any) -> str:
    """Return a value for a message, at most 60 letters of it."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
