"""Prior knowledge of the unpublished numbers, as coordinates in which it is a unit Gaussian."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator
from scipy.special import ndtr, ndtri

from actuators.checked import Number, Pair, Table, checked
from actuators.errors import UnitError, one_line
from actuators.text_file import UnreadableTextError, read_toml_file
from actuators.units import dimension, to_si
from pipeline.paper.errors import PriorError

Array = NDArray[np.float64]
PRIOR_FILE = Path(__file__).parent / "prior.toml"


@dataclass(frozen=True)
class Free:
    """One free number.

    Attributes:
        key: ``robot.<name>`` or ``<component>.<name>``.
        centre: Prior centre, SI.
        deviation: One standard deviation, SI or of the natural logarithm.
        bounds: Hard, SI.
        logarithmic: Whether the belief spreads over factors.
        unit: As written.
        source: Where the belief comes from.
        reason: Why.
    """

    key: str
    centre: float
    deviation: float
    bounds: tuple[float, float]
    logarithmic: bool
    unit: str
    source: str
    reason: str

    @property
    def interval(self) -> tuple[float, float]:
        """What 95 % of the belief spans inside the bounds, as much left out below as above, SI."""
        low, high = (ndtr(self.coordinate(bound)) for bound in self.bounds)
        ends = ndtri(low + np.array([0.025, 0.975]) * (high - low))
        return self.value(ends[0]), self.value(ends[1])

    def value(self, z: float) -> float:
        """SI value at a coordinate, kept inside the bounds against rounding."""
        return float(self.at(np.asarray(z)))

    def at(self, z: Array) -> Array:
        """SI values at coordinates (W,)."""
        if self.logarithmic:
            raw = self.centre * np.exp(self.deviation * z)
        else:
            raw = self.centre + self.deviation * z
        return np.clip(raw, *self.bounds)

    def coordinate(self, value: float) -> float:
        """Coordinate of an SI value."""
        away = math.log(value / self.centre) if self.logarithmic else value - self.centre
        return away / self.deviation


@dataclass(frozen=True)
class Prior:
    """All free numbers, in order."""

    free: tuple[Free, ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(f.key for f in self.free)

    @property
    def lower(self) -> Array:
        """Lower bounds in coordinates, (D,)."""
        return np.array([f.coordinate(f.bounds[0]) for f in self.free])

    @property
    def upper(self) -> Array:
        """Upper bounds in coordinates, (D,)."""
        return np.array([f.coordinate(f.bounds[1]) for f in self.free])

    def values(self, z: Array) -> dict[str, float]:
        """SI values at coordinates (D,)."""
        return {f.key: f.value(float(x)) for f, x in zip(self.free, z, strict=True)}

    def coordinates(self, values: dict[str, float]) -> Array:
        """Coordinates (D,) of SI values."""
        return np.array([f.coordinate(values[f.key]) for f in self.free])

    def draw(self, rng: np.random.Generator) -> Array:
        """Random coordinates from the Gaussian cut off at the bounds, (D,)."""
        z = rng.normal(size=len(self.free))
        outside = (z < self.lower) | (z > self.upper)
        while outside.any():
            z[outside] = rng.normal(size=int(outside.sum()))
            outside = (z < self.lower) | (z > self.upper)
        return z


def load_prior(path: Path = PRIOR_FILE) -> Prior:
    """Read the prior.

    Raises:
        PriorError: Missing or malformed, an unknown key or unit, or bounds that exclude the value.
    """
    try:
        table = read_toml_file(path)
    except UnreadableTextError as error:
        raise PriorError(f"{path.name}: cannot be read ({error})") from None
    return Prior(tuple(_free(key, entry, path.name) for key, entry in table.items()))


class _Written(Table):
    """A free number as it stands in the file."""

    expected = "value, unit, deviation, bounds, scale, source and reason"
    value: Number
    unit: str
    deviation: Number
    bounds: Pair
    scale: Literal["linear", "log"]
    source: str
    reason: str

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        try:
            dimension(self.unit)
        except UnitError as error:
            raise ValueError(str(error)) from None
        least, most = self.bounds
        if not least < most:
            raise ValueError("bounds must be [low, high]")
        if not least <= self.value <= most:
            raise ValueError("the bounds exclude the value; widen them or move it")
        if self.deviation <= (1 if self.scale == "log" else 0):
            raise ValueError('deviation must be positive; a factor above 1 with scale = "log"')
        if self.scale == "log" and min(to_si(x, self.unit) for x in (least, self.value)) <= 0:
            raise ValueError("a logarithmic scale needs positive numbers")
        return self


def _free(key: str, entry: object, file: str) -> Free:
    """One free number in SI units."""
    written = checked(_Written, entry, f"{file}: '{one_line(key)}'", PriorError)

    logarithmic = written.scale == "log"
    deviation = (
        math.log(written.deviation) if logarithmic else to_si(written.deviation, written.unit)
    )
    return Free(
        key=key,
        centre=to_si(written.value, written.unit),
        deviation=deviation,
        bounds=(to_si(written.bounds[0], written.unit), to_si(written.bounds[1], written.unit)),
        logarithmic=logarithmic,
        unit=written.unit,
        source=written.source,
        reason=written.reason,
    )
