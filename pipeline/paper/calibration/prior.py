"""Prior knowledge of the unpublished numbers, as coordinates in which it is a unit Gaussian."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuators.errors import UnitError, closest
from actuators.units import to_si
from pipeline.paper.errors import PriorError

Array = NDArray[np.float64]
PRIOR_FILE = Path(__file__).parent / "prior.toml"
_KEYS = ("value", "unit", "interval", "bounds", "scale", "source", "reason")
#: Half of a 95 % interval in standard deviations.
_SIGMAS = 1.96


@dataclass(frozen=True)
class Free:
    """One free number.

    Attributes:
        key: ``robot.<name>`` or ``<component>.<name>``.
        centre: Prior centre, SI.
        interval: Holds about 95 % of the belief, SI.
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
    def spread(self) -> float:
        """One standard deviation, in SI or in natural logarithms."""
        low, high = self.interval
        if self.logarithmic:
            return (math.log(high) - math.log(low)) / (2 * _SIGMAS)
        return (high - low) / (2 * _SIGMAS)

    def value(self, z: float) -> float:
        """SI value at a coordinate, kept inside the bounds against rounding."""
        if self.logarithmic:
            raw = self.centre * math.exp(self.spread * z)
        else:
            raw = self.centre + self.spread * z
        return min(max(raw, self.bounds[0]), self.bounds[1])

    def coordinate(self, value: float) -> float:
        """Coordinate of an SI value."""
        if self.logarithmic:
            return math.log(value / self.centre) / self.spread
        return (value - self.centre) / self.spread


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
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else " ".join(str(error).split())
        raise PriorError(f"{path.name}: cannot be read ({reason})") from None
    return Prior(tuple(_free(key, entry, path.name) for key, entry in table.items()))


def _free(key: str, entry: object, file: str) -> Free:
    where = f"{file}: '{key}'"
    if not isinstance(entry, dict):
        raise PriorError(f"{where}: expected a table")
    for name in entry:
        if name not in _KEYS:
            raise PriorError(f"{where}: unknown key '{name}'; {closest(name, _KEYS)}")
    for name in _KEYS:
        if name not in entry:
            raise PriorError(f"{where}: missing key '{name}'")
    if entry["scale"] not in ("linear", "log"):
        raise PriorError(f"{where}: scale must be 'linear' or 'log'")
    try:
        numbers = [float(entry["value"]), *map(float, entry["interval"] + entry["bounds"])]
        value, low, high, least, most = (to_si(x, entry["unit"]) for x in numbers)
    except UnitError as error:
        raise PriorError(f"{where}: {error}") from None
    except (TypeError, ValueError):
        raise PriorError(
            f"{where}: value, interval and bounds must be 1, 2 and 2 numbers"
        ) from None
    if not low < high or not least < most:
        raise PriorError(f"{where}: interval and bounds must be [low, high]")
    if not least <= value <= most:
        raise PriorError(f"{where}: the bounds exclude the value; widen them or move it")
    if not (low <= value <= high):
        raise PriorError(f"{where}: the interval excludes the value; widen it or move it")
    if entry["scale"] == "log" and min(low, least, value) <= 0:
        raise PriorError(f"{where}: a logarithmic scale needs positive numbers")
    return Free(
        key,
        value,
        (low, high),
        (least, most),
        entry["scale"] == "log",
        entry["unit"],
        str(entry["source"]),
        str(entry["reason"]),
    )
