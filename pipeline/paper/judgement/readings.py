"""Which reading of the paper the numbers support.

Open are the angle of joint 1's axis, who stands in Fig. 21, and whether energy that flows back from
a motor is taken off its consumption.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from actuators.units import from_si
from pipeline.column import column
from pipeline.paper.hexapod import PUBLISHED_LEG
from pipeline.paper.judgement.rows import MISSED, REPRODUCED
from pipeline.paper.published import CYCLE, EVEN, Published
from pipeline.paper.quantities import pair_break_even

#: Half widths within which the search meets a row whose tolerance is a hard edge.
SEARCH_SLACK = 0.02


@dataclass(frozen=True)
class CalibratedReading:
    """One reading, calibrated on its own; numbers are NaN where nothing walks."""

    axis_deg: float  #: Angle of joint 1's axis from the vertical.
    legs: int  #: Middle legs that Fig. 21 counts as loaded.
    net: bool  #: Whether consumption is E_el(+) - E_el(-) instead of E_el(+).
    worst_error: float = math.nan  #: Largest misfit of a fitted row, in half widths.
    worst_row: str = "none walks"  #: Its name.
    worst_limit: float = math.nan  #: Largest motor quantity over its limit, less one.
    worst_limit_name: str = "none walks"
    prior_distance: float = math.nan  #: Half the squared distance from the prior's centre, sigmas.
    ideal_energy: float = math.nan  #: Of the middle right leg per cycle, ideal actuator [J].
    ratio_joint_2: float = math.nan  #: E_el(+) over E_m(+) at joint 2 with the ideal actuator.
    ratio_others: float = math.nan  #: The larger of the same ratios at joints 1 and 3.

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
    """Energy per cycle of a stored point by alternative and leg [J]."""
    return {
        name: {leg: e - (point["returned"][name][leg] if net else 0.0) for leg, e in legs.items()}
        for name, legs in point["drawn"].items()
    }


def walking_ratios(point: Mapping[str, Any], *, net: bool) -> dict[str, float]:
    """Consumption of the middle right leg over the ideal actuator's, by alternative."""
    energy = {name: legs[PUBLISHED_LEG] for name, legs in consumption(point, net=net).items()}
    return {name: e / energy["ideal"] for name, e in energy.items() if name != "ideal"}


def supported(found: Sequence[CalibratedReading]) -> CalibratedReading | None:
    """The reading that meets everything and asks least of the prior, or None."""
    good = (r for r in found if r.meets_all)
    return min(good, key=lambda r: r.prior_distance, default=None)


def verdict(found: Sequence[CalibratedReading], point: Mapping[str, Any]) -> tuple[str, str]:
    """In words: which reading the numbers support, what speaks against it, what stays open.

    Of the calibrated point is said what another reading makes of its numbers.
    """
    net, drawn = (
        ", ".join(f"{ratio:.1f}" for ratio in walking_ratios(point, net=n).values())
        for n in (True, False)
    )
    names = ", ".join(name for name in point["drawn"] if name != "ideal")
    same_numbers = (
        "The paper also leaves open whether *consumption* is what the supply delivers, E_el(+), or "
        "that less what flows back, E_el(+) - E_el(-). Everything here is E_el(+). Net of what "
        f"returns, the ratios of {names} to ideal would be {net} instead of {drawn} with "
        "these numbers. "
    )
    axis_and_legs = _axis_and_legs([r for r in found if not r.net])
    return axis_and_legs, same_numbers + _net([r for r in found if r.net])


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
    rivals = [r for r in found if r.meets_all and r is not best]
    also = "; ".join(
        f"{r.name} also meets every row, at a prior distance of {r.prior_distance:.1f}"
        for r in sorted(rivals, key=lambda r: r.prior_distance)
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


@dataclass(frozen=True)
class ReadingRow:
    """The open readings of the paper, each calibrated on its own."""

    table: ClassVar = "readings"
    about: ClassVar = (
        "limit rows: peak over the data sheet's limit, less one; positive is a breach."
    )
    axis_deg: float = column(
        "angle of joint 1's axis from the vertical, in the frontal plane", "deg"
    )
    standing_legs_counted: int = column("middle legs that Fig. 21 counts as loaded", "1")
    consumption: str = column(
        "drawn: what the supply delivers, E_el(+); net: less what flows back, E_el(+) - E_el(-)"
    )
    numbers: str = column("with which numbers: fitted to this reading, or those of this run")
    id: str = column("printed value, limit:<alternative>.<quantity>, or discriminator")
    unit: str = column("unit of computed")
    computed: float | None = column("with these numbers", "see unit")
    verdict: str = column("for printed values and limits")


def reading_rows(
    results: Mapping[str, Any], published: Mapping[str, Published]
) -> list[ReadingRow]:
    """Every reading with every printed value, its constraints and the discriminators."""
    out = []
    for entry in results["readings"]:
        words = "net" if entry["net"] else "drawn"
        rows = _reading_rows(entry["point"], published, net=entry["net"])
        own = (entry["axis_deg"], entry["legs"], words, "own calibration")
        out += [ReadingRow(*own, *row) for row in rows]
    same = _same_numbers(results["nearest"], published)
    return out + [ReadingRow(0.0, 1, "net", "as calibrated for drawn", *row) for row in same]


#: Id, unit, number and verdict.
_Cells = tuple[str, str, float | None, str]


def _reading_rows(
    point: Mapping[str, Any] | None, published: Mapping[str, Published], *, net: bool
) -> Iterator[_Cells]:
    if point is None:
        yield "search", "1", math.nan, "no point: the robot cannot walk"
        return
    for p in published.values():
        yield _printed(p, point["values"][p.id])
    for name, excess in point["excess"].items():
        word = "within the data sheet" if excess <= 0 else "breach"
        yield f"limit:{name}", "1", excess, word
    yield "ideal_leg_energy_cycle", "J", consumption(point, net=net)["ideal"][PUBLISHED_LEG], ""
    for joint, ratio in point["electrical_over_mechanical"].items():
        yield f"electrical_over_mechanical:{joint}", "1", ratio, ""
    yield "prior_distance", "1", point["prior_distance"], ""


def _same_numbers(point: Mapping[str, Any], published: Mapping[str, Published]) -> Iterator[_Cells]:
    """The net reading of the calibrated point itself."""
    for name, ratio in walking_ratios(point, net=True).items():
        yield _printed(published[f"walking_ratio_{name}"], ratio)
    held, energy = point["values"]["reversible_leg_energy_3s"] / CYCLE, consumption(point, net=True)
    yield _printed(published[EVEN], pair_break_even(energy, held, 1))
    yield "ideal_leg_energy_cycle", "J", energy["ideal"][PUBLISHED_LEG], ""


def _printed(row: Published, value: float | None) -> _Cells:
    """What stands beside a printed value, in its unit; NaN where there is none."""
    ours = math.nan if value is None else from_si(value, row.unit)
    return row.id, row.unit, ours, REPRODUCED if row.reproduced(ours) else MISSED
