"""Which reading of the paper the numbers support.

Open are the angle of joint 1's axis, who stands in Fig. 21, and whether energy that flows back from
a motor is taken off its consumption.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from actuators.units import from_si
from pipeline.paper.calibration.machine import PUBLISHED_LEG
from pipeline.paper.calibration.problem import EVEN
from pipeline.paper.calibration.quantities import STANDING_SECONDS, pair_break_even
from pipeline.paper.judgement.evidence import numbers
from pipeline.paper.published import Published

#: Half widths within which the search meets a row whose tolerance is a hard edge.
SEARCH_SLACK = 0.02


@dataclass(frozen=True)
class Reading:
    """One reading, calibrated on its own.

    Attributes:
        axis_deg: Angle of joint 1's axis from the vertical.
        legs: Middle legs that Fig. 21 counts as loaded.
        net: Whether consumption is E_el(+) - E_el(-) instead of E_el(+).
        worst_error: Largest misfit of a fitted row, in half widths; NaN where nothing walks.
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
    worst_error: float
    worst_row: str
    worst_limit: float
    worst_limit_name: str
    prior_distance: float
    ideal_energy: float
    ratio_joint_2: float
    ratio_others: float

    @property
    def meets_all(self) -> bool:
        """Every fitted row within its half width and every motor within its data sheet."""
        return self.worst_error <= 1 + SEARCH_SLACK and self.worst_limit <= 0


def readings(results: Mapping[str, Any]) -> list[Reading]:
    """Every reading of the stored calibration."""
    out = []
    for entry in results["readings"]:
        point = entry["point"]
        head = (float(entry["axis_deg"]), int(entry["legs"]), bool(entry["net"]))
        if point is None:
            none = (math.nan, "none walks")
            out.append(Reading(*head, *none, *none, math.nan, math.nan, math.nan, math.nan))
            continue
        row, error = max(point["errors"].items(), key=lambda item: abs(item[1]))
        limit, excess = max(point["excess"].items(), key=lambda item: item[1])
        ratio = {joint[-1]: value for joint, value in point["electrical_over_mechanical"].items()}
        out.append(
            Reading(
                *head,
                abs(error),
                row,
                excess,
                limit,
                point["prior_distance"],
                consumption(point, net=head[2])["ideal"][PUBLISHED_LEG],
                ratio["2"],
                max(value or math.nan for joint, value in ratio.items() if joint != "2"),
            )
        )
    return out


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


def net_ratios(point: Mapping[str, Any]) -> dict[str, float]:
    """Consumption net of what returns over the ideal actuator's, by alternative."""
    energy = consumption(point, net=True)
    ideal = energy["ideal"][PUBLISHED_LEG]
    return {name: legs[PUBLISHED_LEG] / ideal for name, legs in energy.items()}


def supported(found: list[Reading]) -> Reading | None:
    """The reading that meets everything and asks least of the prior, or None."""
    good = [r for r in found if r.meets_all]
    return min(good, key=lambda r: r.prior_distance) if good else None


def verdict(found: list[Reading], point: Mapping[str, Any]) -> tuple[str, ...]:
    """In words: which reading the numbers support, what speaks against it, what stays open.

    Args:
        found: Every reading.
        point: The calibrated point, for what another reading makes of its numbers.
    """
    return (*_axis_and_legs([r for r in found if not r.net]), _net(found, point))


def _net(found: list[Reading], point: Mapping[str, Any]) -> str:
    drawn, net = consumption(point, net=False), net_ratios(point)
    ideal = drawn["ideal"][PUBLISHED_LEG]
    real = [name for name in net if name != "ideal"]
    text = (
        "The paper also leaves open whether *consumption* is what the supply delivers, E_el(+), or "
        "that less what flows back, E_el(+) - E_el(-). Everything here is E_el(+). Net of what "
        f"returns, the ratios of {', '.join(real)} to ideal would be "
        f"{', '.join(f'{net[n]:.1f}' for n in real)} instead of "
        f"{', '.join(f'{drawn[n][PUBLISHED_LEG] / ideal:.1f}' for n in real)} with these numbers. "
    )
    own = [r for r in found if r.net]
    met = supported(own)
    if met is not None:
        return text + (
            f"Calibrated on its own, the net reading too meets every fitted row ({_name(met)}), at "
            f"a prior distance of {met.prior_distance:.1f}: the numbers do not rule it out."
        )
    known = [r for r in own if r.worst_error == r.worst_error]
    if not known:
        return text
    best = min(known, key=lambda r: max(r.worst_error - 1, 0.0) + max(r.worst_limit, 0.0))
    return text + (
        f"Calibrated on its own, the net reading is out of reach: {_name(best)} comes nearest, "
        f"with {_miss(best)}, at a prior distance of {best.prior_distance:.1f}."
    )


def _axis_and_legs(found: list[Reading]) -> tuple[str, ...]:
    best = supported(found)
    if best is None:
        nearest = min(found, key=lambda r: r.worst_error if r.worst_error == r.worst_error else 1e9)
        return (
            "No reading meets every printed figure inside the motor's data sheet; the nearest miss "
            f"is {_name(nearest)} with {nearest.worst_row} off by {nearest.worst_error:.2f} half "
            "widths.",
        )
    failing = [r for r in found if not r.meets_all]
    rivals = [r for r in found if r.meets_all and r is not best]
    text = (
        f"The numbers support **{_name(best)}**: every fitted row is met inside the motor's data "
        f"sheet at a prior distance of {best.prior_distance:.1f}, the ideal leg needs "
        f"{best.ideal_energy:.2f} J per cycle, and joint 2 alone draws {best.ratio_joint_2:.1f} "
        "times its mechanical energy (the others at most "
        f"{best.ratio_others:.2f} times), as section IV.A.1 says. "
    )
    if rivals:
        text += (
            "Against certainty: "
            + "; ".join(
                f"{_name(r)} also meets every row, at a prior distance of {r.prior_distance:.1f}"
                for r in sorted(rivals, key=lambda r: r.prior_distance)
            )
            + ". "
        )
    if failing:
        text += "Out of reach: " + "; ".join(f"{_name(r)} ({_miss(r)})" for r in failing) + ". "
    return (
        text
        + "The layout remains an objection: with the feet 260 mm from the mid-plane and a coxa, "
        "joint 1 lies only 40 to 90 mm from it.",
    )


def _miss(reading: Reading) -> str:
    """What a reading leaves unmet."""
    words = []
    if reading.worst_error > 1 + SEARCH_SLACK:
        words.append(f"{reading.worst_row} off by {reading.worst_error:.1f} half widths")
    if reading.worst_limit > 0:
        words.append(
            f"{reading.worst_limit_name} {100 * reading.worst_limit:.1f} % over the data sheet"
        )
    return ", ".join(words) or "nothing that can walk"


def _name(reading: Reading) -> str:
    who = "only the middle right leg" if reading.legs == 1 else "both middle legs"
    return f"an axis at {reading.axis_deg:g}° with {who} loaded while standing"


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
        net, point = bool(entry["net"]), entry["point"]
        head = _head(entry["axis_deg"], entry["legs"], net=net, own=True)
        if point is None:
            rows.append(head | _row("search", "1", math.nan, "no point: the robot cannot walk"))
            continue
        values = numbers(point["values"])
        for row in published.values():
            ours = from_si(values[row.id], row.unit)
            rows.append(head | _row(row.id, row.unit, ours, _fits(row, ours)))
        for name, excess in point["excess"].items():
            word = "within the data sheet" if excess <= 0 else "breach"
            rows.append(head | _row(f"limit:{name}", "1", excess, word))
        ideal = consumption(point, net=net)["ideal"][PUBLISHED_LEG]
        rows.append(head | _row("ideal_leg_energy_cycle", "J", ideal, ""))
        for joint, ratio in point["electrical_over_mechanical"].items():
            rows.append(head | _row(f"electrical_over_mechanical:{joint}", "1", ratio, ""))
        rows.append(head | _row("prior_distance", "1", point["prior_distance"], ""))
    return rows + _same_numbers(results, published)


def _same_numbers(
    results: Mapping[str, Any], published: Mapping[str, Published]
) -> list[dict[str, Any]]:
    """The net reading of the calibrated point itself."""
    point = results["nearest"]
    head = _head(0.0, 1, net=True, own=False)
    ratios = net_ratios(point)
    energy = consumption(point, net=True)
    values = {f"walking_ratio_{n}": ratio for n, ratio in ratios.items() if n != "ideal"}
    held = point["values"]["reversible_leg_energy_3s"] / STANDING_SECONDS
    values[EVEN] = pair_break_even(energy, held, 1)
    return [
        *(
            head | _row(name, published[name].unit, value, _fits(published[name], value))
            for name, value in values.items()
        ),
        head | _row("ideal_leg_energy_cycle", "J", energy["ideal"][PUBLISHED_LEG], ""),
    ]


def _fits(row: Published, ours: float) -> str:
    return "reproduced" if row.reproduced(ours) else "not reproduced"


def _head(axis_deg: float, legs: int, *, net: bool, own: bool) -> dict[str, Any]:
    return {
        "axis_deg": axis_deg,
        "standing_legs_counted": legs,
        "consumption": "net" if net else "drawn",
        "numbers": "own calibration" if own else "as calibrated for drawn",
    }


def _row(name: str, unit: str, value: float | None, verdict: str) -> dict[str, Any]:
    return {"id": name, "unit": unit, "computed": value, "verdict": verdict}
