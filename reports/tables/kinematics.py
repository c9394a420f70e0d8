"""How well the legs follow their feet's paths."""

from __future__ import annotations

from collections.abc import Sequence

from pipeline.robot.inverse.foot_tracking import FootTracking
from reports.table import Table, table_from_rows


def foot_tracking(legs: Sequence[FootTracking]) -> Table:
    """One row for each leg, and one more for each further direction that it lacks."""
    rows = []
    for leg in legs:
        for x, y, z in leg.cannot_move or ((None, None, None),):
            rows.append(
                {
                    "leg": leg.leg,
                    "joints": leg.joints,
                    "directions": leg.directions,
                    "cannot_move_x": x,
                    "cannot_move_y": y,
                    "cannot_move_z": z,
                    "deviation_m": leg.deviation,
                    "deviation_time_s": leg.deviation_time,
                    "least_singular_value_m": leg.least_singular_value,
                    "singular_time_s": leg.singular_time,
                }
            )
    place = "of the direction, in the base frame at the motion's start, in which the foot is stuck"
    return table_from_rows(
        "foot_tracking",
        rows,
        {
            "leg": ("leg", ""),
            "joints": ("joints of the leg", "1"),
            "directions": ("directions in which they move the foot", "1"),
            "cannot_move_x": (f"x component {place}; empty where it moves in all", "1"),
            "cannot_move_y": (f"y component {place}", "1"),
            "cannot_move_z": (f"z component {place}", "1"),
            "deviation_m": ("largest distance of the foot from its path", "m"),
            "deviation_time_s": ("when it is so far off; empty where it follows", "s"),
            "least_singular_value_m": (
                "smallest singular value of the foot's Jacobian along the motion: near zero the "
                "leg is stretched or folded",
                "m",
            ),
            "singular_time_s": ("when it is that small", "s"),
        },
        "How well the legs follow their feet's paths; a leg that lacks a direction puts its foot "
        "as near to the path as it gets.",
    )
