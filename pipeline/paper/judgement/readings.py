"""Which reading of the paper the numbers support.

Open are the angle of joint 1's axis, who stands in Fig. 21, and whether energy that flows back from
a motor is taken off its consumption.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from actuators.units import from_si
from pipeline.paper.hexapod import PUBLISHED_LEG
from pipeline.paper.judgement.evidence import numbers
from pipeline.paper.judgement.rows import MISSED, REPRODUCED
from pipeline.paper.published import CYCLE, EVEN, Published
from pipeline.paper.quantities import pair_break_even

#: Half widths within which the search meets a row whose tolerance is a hard edge.
SEARCH_SLACK = 0.02


@dataclass(frozen=True)
class CalibratedReading:
    """One reading, calibrated on its own; numbers are NaN where nothing walks.

    Attributes:
        axis_deg: Angle of joint 1's axis from the vertical.
        legs: Middle legs that Fig. 21 counts as loaded.
        net: Whether consumption is E_el(+) - E_el(-) instead of E_el(+).
        worst_error: Largest misfit of a fitted row, in half widths.
        worst_row: Its name.
        worst_limit: Largest motor quantity over its limit, less one.
        worst_limit_name: Its name.
        prior_distance: Half the squared distance from the prior's centre, in sigmas.
        ideal_energy: Consumption of the middle right leg per cycle, ideal actuator [J].
        ratio_joint_2: E_el(+) over E_m(+) at joint 2 with the ideal actuator.
        ratio_others: The larger of the same ratios at joints 1 and 3.
    """

    axis_deg: float
    legs: int
    net: bool
    worst_error: float = math.nan
    worst_row: str = "none walks"
    worst_limit: float = math.nan
    worst_limit_name: str = "none walks"
    prior_distance: float = math.nan
    ideal_energy: float = math.nan
    ratio_joint_2: float = math.nan
    ratio_others: float = math.nan

    @property
    def meets_all(self) -> bool:
        """Every fitted row within its half width and every motor within its data sheet."""
        return self.worst_error <= 1 + SEARCH_SLACK and self.worst_limit <= 0

    @property
    def name(self) -> str:
        """In words."""
        who = "only the middle right leg" if self.legs == 1 else "both middle legs"
        return f"an axis at {self.axis_deg:g}° with {who} loaded while standing"

    @property
    def missed(self) -> str:
        """What it leaves unmet, in words."""
        words = []
        if self.worst_error > 1 + SEARCH_SLACK:
            words.append(f"{self.worst_row} off by {self.worst_error:.1f} half widths")
        if self.worst_limit > 0:
            over = 100 * self.worst_limit
            words.append(f"{self.worst_limit_name} {over:.1f} % over the data sheet")
        return ", ".join(words) or "nothing that can walk"


def readings(results: Mapping[str, Any]) -> list[CalibratedReading]:
    """Every reading of the stored calibration."""
    return [_reading(**entry) for entry in results["readings"]]


def _reading(
    axis_deg: float, legs: int, net: bool, point: Mapping[str, Any] | None
) -> CalibratedReading:
    if point is None:
        return CalibratedReading(axis_deg, legs, net)
    row, error = max(point["errors"].items(), key=lambda item: abs(item[1]))
    limit, excess = max(point["excess"].items(), key=lambda item: item[1])
    ratio = {joint[-1]: value for joint, value in point["electrical_over_mechanical"].items()}
    others = max(value or math.nan for joint, value in ratio.items() if joint != "2")
    ideal = consumption(point, net=net)["ideal"][PUBLISHED_LEG]
    worst = (abs(error), row, excess, limit)
    distance = point["prior_distance"]
    return CalibratedReading(axis_deg, legs, net, *worst, distance, ideal, ratio["2"], others)


def consumption(point: Mapping[str, Any], *, net: bool) -> dict[str, dict[str, float]]:
    """Energy per cycle of a stored point by alternative and leg [J].

    Args:
        point: As the search keeps it.
        net: Whether what flows back is taken off.
    """
    return {
        name: {leg: e - (point["returned"][name][leg] if net else 0.0) for leg, e in legs.items()}
        for name, legs in point["drawn"].items()
    }


def supported(found: Sequence[CalibratedReading]) -> CalibratedReading | None:
    """The reading that meets everything and asks least of the prior, or None."""
    good = [r for r in found if r.meets_all]
    return min(good, key=lambda r: r.prior_distance) if good else None


def verdict(found: Sequence[CalibratedReading], point: Mapping[str, Any]) -> tuple[str, ...]:
    """In words: which reading the numbers support, what speaks against it, what stays open.

    Args:
        found: Every reading.
        point: The calibrated point, for what another reading makes of its numbers.
    """
    axis_and_legs = _axis_and_legs([r for r in found if not r.net])
    return axis_and_legs, _same_numbers_text(point) + _net([r for r in found if r.net])


def _axis_and_legs(found: Sequence[CalibratedReading]) -> str:
    best = supported(found)
    if best is None:
        known = [r for r in found if not math.isnan(r.worst_error)] or found
        nearest = min(known, key=lambda r: r.worst_error)
        return (
            "No reading meets every printed figure inside the motor's data sheet; the nearest miss "
            f"is {nearest.name} with {nearest.worst_row} off by {nearest.worst_error:.2f} half "
            "widths."
        )
    rivals = sorted(
        (r for r in found if r.meets_all and r is not best), key=lambda r: r.prior_distance
    )
    also = "; ".join(
        f"{r.name} also meets every row, at a prior distance of {r.prior_distance:.1f}"
        for r in rivals
    )
    failing = "; ".join(f"{r.name} ({r.missed})" for r in found if not r.meets_all)
    return (
        f"The numbers support **{best.name}**: every fitted row is met inside the motor's data "
        f"sheet at a prior distance of {best.prior_distance:.1f}, the ideal leg needs "
        f"{best.ideal_energy:.2f} J per cycle, and joint 2 alone draws {best.ratio_joint_2:.1f} "
        "times its mechanical energy (the others at most "
        f"{best.ratio_others:.2f} times), as section IV.A.1 says. "
        + (f"Against certainty: {also}. " if also else "")
        + (f"Out of reach: {failing}. " if failing else "")
        + "The layout remains an objection: with the feet 260 mm from the mid-plane and a coxa, "
        "joint 1 lies only 40 to 90 mm from it."
    )


def _same_numbers_text(point: Mapping[str, Any]) -> str:
    """What the calibrated numbers make of consumption net of what returns."""
    ratios = []
    for net in (True, False):
        energy = consumption(point, net=net)
        ideal = energy.pop("ideal")[PUBLISHED_LEG]
        ratios.append(", ".join(f"{legs[PUBLISHED_LEG] / ideal:.1f}" for legs in energy.values()))
    names = ", ".join(name for name in point["drawn"] if name != "ideal")
    return (
        "The paper also leaves open whether *consumption* is what the supply delivers, E_el(+), or "
        "that less what flows back, E_el(+) - E_el(-). Everything here is E_el(+). Net of what "
        f"returns, the ratios of {names} to ideal would be {ratios[0]} instead of {ratios[1]} with "
        "these numbers. "
    )


def _net(found: Sequence[CalibratedReading]) -> str:
    """What the net readings come to, calibrated on their own."""
    met = supported(found)
    if met is not None:
        return (
            f"Calibrated on its own, the net reading too meets every fitted row ({met.name}), at "
            f"a prior distance of {met.prior_distance:.1f}: the numbers do not rule it out."
        )
    known = [r for r in found if not math.isnan(r.worst_error)]
    if not known:
        return ""
    best = min(known, key=lambda r: max(r.worst_error - 1, 0.0) + max(r.worst_limit, 0.0))
    return (
        f"Calibrated on its own, the net reading is out of reach: {best.name} comes nearest, "
        f"with {best.missed}, at a prior distance of {best.prior_distance:.1f}."
    )


def reading_rows(
    results: Mapping[str, Any], published: Mapping[str, Published]
) -> list[dict[str, Any]]:
    """Every reading with every printed value, its constraints and the discriminators.

    Args:
        results: The stored calibration.
        published: The printed values.
    """
    rows = []
    for entry in results["readings"]:
        head = _head(entry["axis_deg"], entry["legs"], net=bool(entry["net"]))
        rows += [head | row for row in _reading_rows(entry, published)]
    return rows + _same_numbers(results["nearest"], published)


def _reading_rows(
    entry: Mapping[str, Any], published: Mapping[str, Published]
) -> list[dict[str, Any]]:
    point = entry["point"]
    if point is None:
        return [_row("search", "1", math.nan, "no point: the robot cannot walk")]
    values = numbers(point["values"])
    rows = [_value_row(p, from_si(values[p.id], p.unit)) for p in published.values()]
    for name, excess in point["excess"].items():
        word = "within the data sheet" if excess <= 0 else "breach"
        rows.append(_row(f"limit:{name}", "1", excess, word))
    ideal = consumption(point, net=bool(entry["net"]))["ideal"][PUBLISHED_LEG]
    rows.append(_row("ideal_leg_energy_cycle", "J", ideal))
    for joint, ratio in point["electrical_over_mechanical"].items():
        rows.append(_row(f"electrical_over_mechanical:{joint}", "1", ratio))
    return [*rows, _row("prior_distance", "1", point["prior_distance"])]


def _same_numbers(
    point: Mapping[str, Any], published: Mapping[str, Published]
) -> list[dict[str, Any]]:
    """The net reading of the calibrated point itself."""
    energy = consumption(point, net=True)
    ideal = energy["ideal"][PUBLISHED_LEG]
    values = {
        f"walking_ratio_{name}": legs[PUBLISHED_LEG] / ideal
        for name, legs in energy.items()
        if name != "ideal"
    }
    held = point["values"]["reversible_leg_energy_3s"] / CYCLE
    values[EVEN] = pair_break_even(energy, held, 1)
    rows = [_value_row(published[name], value) for name, value in values.items()]
    rows.append(_row("ideal_leg_energy_cycle", "J", ideal))
    head = _head(0.0, 1, net=True) | {"numbers": "as calibrated for drawn"}
    return [head | row for row in rows]


def _head(axis_deg: float, legs: int, *, net: bool) -> dict[str, Any]:
    return {
        "axis_deg": axis_deg,
        "standing_legs_counted": legs,
        "consumption": "net" if net else "drawn",
        "numbers": "own calibration",
    }


def _value_row(printed: Published, ours: float) -> dict[str, Any]:
    """A printed value beside ours, in its unit."""
    fits = REPRODUCED if printed.reproduced(ours) else MISSED
    return _row(printed.id, printed.unit, ours, fits)


def _row(name: str, unit: str, value: float | None, verdict: str = "") -> dict[str, Any]:
    return {"id": name, "unit": unit, "computed": value, "verdict": verdict}
