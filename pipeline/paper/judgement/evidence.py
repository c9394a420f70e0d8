"""What a stored calibration says of a computed quantity: before the fit, and with it left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.paper.hexapod import Totals

#: Quantiles shown as low and high.
BAND = (0.025, 0.975)
#: Fewer values than this have no 95 % that is worth showing.
LEAST = 10
Interval = tuple[float, float]
NONE: Interval = (math.nan, math.nan)


@dataclass(frozen=True)
class Point:
    """One set of numbers: what the paper prints, computed in SI, and the whole robot's energy."""

    values: Mapping[str, float]
    totals: Totals


@dataclass(frozen=True)
class Evidence:
    """Sets of numbers, by what they were asked to meet.

    Attributes:
        posterior: Every target: draws of the posterior.
        prior: Nothing but the standing posture, the motor's constants, which Tables III to V
            fix, and the motor's limits: what data sheets and literature say of the rest.
        left_out: Every target but some: draws of the posterior without them, by their names joined
            with ``+``.
    """

    posterior: Sequence[Point]
    prior: Sequence[Point]
    left_out: Mapping[str, Sequence[Point]]

    def of_totals(self, values: Callable[[Totals], Mapping[str, float]]) -> Evidence:
        """The same sets, with what follows from the whole robot's energy as their values."""

        def points(own: Sequence[Point]) -> list[Point]:
            return [Point(values(p.totals), p.totals) for p in own]

        left_out = {key: points(own) for key, own in self.left_out.items()}
        return Evidence(points(self.posterior), points(self.prior), left_out)


def evidence(results: Mapping[str, Any]) -> Evidence:
    """The sets of a stored calibration."""

    def points(stored: Sequence[Mapping[str, Any]]) -> list[Point]:
        return [Point(numbers(p["values"]), p["totals"]) for p in stored]

    left_out = {key: points(stored) for key, stored in results["left_out"].items()}
    return Evidence(points(results["sets"]), points(results["prior"]), left_out)


def numbers(values: Mapping[str, Any]) -> dict[str, float]:
    """Stored values, with NaN where none was."""
    return {key: math.nan if value is None else float(value) for key, value in values.items()}


def quantiles(values: Sequence[float]) -> Interval:
    """The middle 95 % of the values that are known; NaN where fewer than `LEAST` are."""
    known = np.array([v for v in values if not math.isnan(v)])
    if known.size < LEAST:
        return NONE
    low, high = np.quantile(known, BAND)
    return float(low), float(high)
