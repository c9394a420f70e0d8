"""Prior knowledge of the unpublished numbers, as coordinates in which it is a unit Gaussian."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, Self

import numpy as np
from pydantic import model_validator
from scipy.special import ndtr, ndtri

from actuators.arrays import Array
from actuators.checked import Number, Pair, Table, checked
from actuators.errors import UnitError, one_line
from actuators.text_file import UnreadableTextError, read_toml_file
from actuators.units import dimension, to_si
from pipeline.errors import CalibrationError

PRIOR_FILE = Path(__file__).parent / "prior.toml"


class _Written(Table):
    """What is known of a number before, as the file writes it."""

    expected = "value, unit, deviation, bounds, scale, source and reason"
    value: Number  #: Centre.
    unit: str
    deviation: Number  #: One standard deviation; a factor where `scale` is ``log``.
    bounds: Pair  #: Hard.
    scale: Literal["linear", "log"]  #: ``log`` where the belief spreads over factors.
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

    @property
    def spread(self) -> float:
        """Standard deviation of the coordinate, a standard normal cut off at the bounds [1].

        Johnson, Kotz, Balakrishnan, *Continuous Univariate Distributions* 1, section 10.1. The
        same as SciPy's ``truncnorm.std``, whose import takes longer than all tables of a run.
        """
        ends = np.array(self.ends)
        density = np.exp(-(ends**2) / 2) / np.sqrt(2 * np.pi)
        share = np.diff(ndtr(ends))[0]
        mean = -np.diff(density)[0] / share
        return float(np.sqrt(1 - np.diff(ends * density)[0] / share - mean**2))

    @property
    def interval(self) -> tuple[float, float]:
        """What 95 % of the belief spans inside the bounds, as much left out below as above, SI."""
        low, high = ndtr(self.ends)
        ends = ndtri(low + np.array([0.025, 0.975]) * (high - low))
        return self.value(ends[0]), self.value(ends[1])

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


def load_prior(path: Path = PRIOR_FILE) -> Prior:
    """Read the prior.

    Raises:
        CalibrationError: Missing or malformed, an unknown key or unit, or bounds that exclude
            the value.
    """
    try:
        table = read_toml_file(path)
    except UnreadableTextError as error:
        raise CalibrationError(f"{path.name}: cannot be read ({error})") from None
    free = []
    for key, entry in table.items():
        w = checked(_Written, entry, f"{path.name}: '{one_line(key)}'", CalibrationError)
        logarithmic = w.scale == "log"
        deviation = math.log(w.deviation) if logarithmic else to_si(w.deviation, w.unit)
        centre, low, high = (to_si(x, w.unit) for x in (w.value, *w.bounds))
        free.append(Free(key, centre, deviation, (low, high), logarithmic, w.unit))
    return Prior(tuple(free))
