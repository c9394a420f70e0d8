"""Prior knowledge of the unpublished numbers, as coordinates in which it is a unit Gaussian.

The centre is the median, and the interval's ends lie at -1.96 and 1.96: where they are unequally
far from the centre, the belief is as wide on each side as the interval says, and the interval holds
95 % of it all the same, or more where the bounds cut off what lies outside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from actuators.checked import Number, Pair, Table, checked
from actuators.errors import UnitError, one_line
from actuators.text_file import UnreadableTextError, read_toml_file
from actuators.units import dimension, to_si
from pipeline.paper.errors import PriorError

Array = NDArray[np.float64]
PRIOR_FILE = Path(__file__).parent / "prior.toml"
#: Half of a 95 % interval in standard deviations.
_SIGMAS = 1.96


@dataclass(frozen=True)
class Free:
    """One free number.

    Attributes:
        key: ``robot.<name>`` or ``<component>.<name>``.
        centre: Prior centre, SI.
        interval: Holds 95 % of the belief before the bounds cut it off, SI.
        bounds: Hard, SI.
        logarithmic: Whether the belief spreads over factors.
        unit: As written.
        source: Where the belief comes from.
        reason: Why.
    """

    key: str
    centre: float
    interval: tuple[float, float]
    bounds: tuple[float, float]
    logarithmic: bool
    unit: str
    source: str
    reason: str

    @property
    def _sides(self) -> tuple[float, float, float]:
        """Centre and one standard deviation below and above it, in SI or natural logarithms."""
        low, middle, high = (
            math.log(x) if self.logarithmic else x
            for x in (self.interval[0], self.centre, self.interval[1])
        )
        return middle, (middle - low) / _SIGMAS, (high - middle) / _SIGMAS

    def value(self, z: float) -> float:
        """SI value at a coordinate, kept inside the bounds against rounding."""
        return float(self.at(np.asarray(z)))

    def at(self, z: Array) -> Array:
        """SI values at coordinates (W,)."""
        middle, below, above = self._sides
        raw = middle + np.where(z < 0, below, above) * z
        return np.clip(np.exp(raw) if self.logarithmic else raw, *self.bounds)

    def coordinate(self, value: float) -> float:
        """Coordinate of an SI value."""
        middle, below, above = self._sides
        away = (math.log(value) if self.logarithmic else value) - middle
        return away / (below if away < 0 else above)


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

    expected = "value, unit, interval, bounds, scale, source and reason"
    value: Number
    unit: str
    interval: Pair
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
        (low, high), (least, most) = self.interval, self.bounds
        if not low < high or not least < most:
            raise ValueError("interval and bounds must be [low, high]")
        if not least <= self.value <= most:
            raise ValueError("the bounds exclude the value; widen them or move it")
        if not low < self.value < high:
            raise ValueError("the value must lie inside the interval; widen it or move it")
        if self.scale == "log" and min(to_si(x, self.unit) for x in (low, least, self.value)) <= 0:
            raise ValueError("a logarithmic scale needs positive numbers")
        return self


def _free(key: str, entry: object, file: str) -> Free:
    """One free number in SI units."""
    written = checked(_Written, entry, f"{file}: '{one_line(key)}'", PriorError)

    def si(pair: tuple[float, float]) -> tuple[float, float]:
        return to_si(pair[0], written.unit), to_si(pair[1], written.unit)

    return Free(
        key=key,
        centre=to_si(written.value, written.unit),
        interval=si(written.interval),
        bounds=si(written.bounds),
        logarithmic=written.scale == "log",
        unit=written.unit,
        source=written.source,
        reason=written.reason,
    )
