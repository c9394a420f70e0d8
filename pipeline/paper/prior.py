"""Prior knowledge of the unpublished numbers, as coordinates in which it is a unit Gaussian."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from actuators.arrays import Array
from actuators.text_file import read_toml_file
from actuators.units import to_si

PRIOR_FILE = Path(__file__).parent / "prior.toml"


@dataclass(frozen=True)
class Free:
    """One free number."""

    key: str  #: ``robot.<name>`` or ``<component>.<name>``.
    centre: float  #: Prior centre, SI.
    deviation: float  #: One standard deviation, SI or of the natural logarithm.
    bounds: tuple[float, float]  #: Hard, SI.
    logarithmic: bool  #: Whether the belief spreads over factors.
    unit: str  #: As written.

    @property
    def ends(self) -> tuple[float, float]:
        """The bounds as coordinates."""
        return self.coordinate(self.bounds[0]), self.coordinate(self.bounds[1])

    def value(self, z: float) -> float:
        """SI value at a coordinate, kept inside the bounds against rounding."""
        return float(self.at(np.asarray(z)))

    def at(self, z: Array) -> Array:
        """SI values at coordinates (W,)."""
        away = self.deviation * z
        raw = self.centre * np.exp(away) if self.logarithmic else self.centre + away
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

    @cached_property
    def ends(self) -> Array:
        """Lower and upper bounds in coordinates, (2, D)."""
        return np.transpose([f.ends for f in self.free])

    def values(self, z: Array) -> dict[str, float]:
        """SI values at coordinates (D,)."""
        return {f.key: f.value(float(x)) for f, x in zip(self.free, z, strict=True)}

    def draw(self, rng: np.random.Generator) -> Array:
        """Random coordinates from the Gaussian cut off at the bounds, (D,)."""
        lower, upper = self.ends
        z = rng.normal(size=len(self.free))
        while (outside := (z < lower) | (z > upper)).any():
            z[outside] = rng.normal(size=int(outside.sum()))
        return z


def load_prior() -> Prior:
    """Read `prior.toml`, whose head says what its entries mean."""
    free = []
    for key, entry in read_toml_file(PRIOR_FILE).items():
        unit, logarithmic = entry["unit"], entry["scale"] == "log"
        away = entry["deviation"]
        deviation = math.log(away) if logarithmic else to_si(away, unit)
        centre, low, high = (to_si(x, unit) for x in (entry["value"], *entry["bounds"]))
        free.append(Free(key, centre, deviation, (low, high), logarithmic, unit))
    return Prior(tuple(free))
