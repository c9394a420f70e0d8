"""Which reading of the paper the numbers support: axis of joint 1, and who stands in Fig. 21."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

#: Half widths within which the search meets a row whose tolerance is a hard edge.
SEARCH_SLACK = 0.02


@dataclass(frozen=True)
class Reading:
    """One reading, calibrated on its own.

    Attributes:
        axis_deg: Angle of joint 1's axis from the vertical.
        legs: Middle legs that Fig. 21 counts as loaded.
        worst_error: Largest misfit of a fitted row, in half widths; NaN where nothing walks.
        worst_row: Its name.
        worst_limit: Largest motor quantity over its limit, less one.
        worst_limit_name: Its name.
        prior_distance: Half the squared distance from the prior's centre, in sigmas.
        ideal_energy: Of the middle right leg per cycle, ideal actuator [J].
        ratio_joint_2: E_el(+) over E_m(+) at joint 2 with the ideal actuator.
        ratio_others: The larger of the same ratios at joints 1 and 3.
    """

    axis_deg: float
    legs: int
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
        head = (float(entry["axis_deg"]), int(entry["legs"]))
        if point is None:
            out.append(
                Reading(*head, *(math.nan, "none walks", math.nan, "none walks"), *[math.nan] * 4)
            )
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
                point["energy"]["ideal"]["rm"],
                ratio["2"],
                max(value or math.nan for joint, value in ratio.items() if joint != "2"),
            )
        )
    return out


def supported(found: list[Reading]) -> Reading | None:
    """The reading that meets everything and asks least of the prior, or None."""
    good = [r for r in found if r.meets_all]
    return min(good, key=lambda r: r.prior_distance) if good else None


def verdict(found: list[Reading]) -> str:
    """A paragraph: which reading the numbers support and what speaks against it."""
    best = supported(found)
    if best is None:
        nearest = min(found, key=lambda r: r.worst_error if r.worst_error == r.worst_error else 1e9)
        return (
            "No reading meets every printed figure inside the motor's data sheet; the nearest miss "
            f"is {_name(nearest)} with {nearest.worst_row} off by {nearest.worst_error:.2f} half "
            "widths."
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
        text += (
            "Out of reach: "
            + "; ".join(
                f"{_name(r)} ({r.worst_row} off by {r.worst_error:.1f} half widths"
                + (f", {r.worst_limit_name} {r.worst_limit:+.0%}" if r.worst_limit > 0 else "")
                + ")"
                for r in failing
            )
            + ". "
        )
    return text + (
        "The layout remains an objection: with the feet 260 mm from the mid-plane and a coxa, "
        "joint 1 lies only 40 to 90 mm from it."
    )


def _name(reading: Reading) -> str:
    who = "only the middle right leg" if reading.legs == 1 else "both middle legs"
    return f"an axis at {reading.axis_deg:g}° with {who} loaded while standing"
