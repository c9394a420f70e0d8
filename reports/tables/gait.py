"""The gait as it was walked: its legs, and the body over the cycle."""

from __future__ import annotations

import numpy as np

from pipeline.motion.base_motion import base_in_world
from pipeline.motion.gait import Gait
from pipeline.motion.motion import Motion
from reports.table import Table, table_from_rows
from reports.wide import Quantity, wide_series


def walking_gait(gait: Gait) -> Table:
    """When every leg stands, and how far and high its foot steps.

    Args:
        gait: What was walked.
    """
    rows = [
        {
            "leg": leg,
            "touch_down": gait.footfall.phase[leg],
            "duty_factor": gait.footfall.duty[leg],
            "stroke_m": float(gait.strokes[k]),
            "lift_m": float(gait.lift[k]),
        }
        for k, leg in enumerate(gait.legs)
    ]
    return table_from_rows(
        "walking_gait",
        rows,
        {
            "leg": ("leg", ""),
            "touch_down": ("instant of touch-down as a share of the period", "1"),
            "duty_factor": ("share of the period for which the foot stands", "1"),
            "stroke_m": ("path of the foot relative to the body while it stands", "m"),
            "lift_m": ("height of the foot at the middle of its transfer", "m"),
        },
        f"{gait.title[0].upper()}{gait.title[1:]}: period {gait.period:.6g} s, speed "
        f"{gait.speed:.6g} m/s, yaw rate {gait.twist[2]:.6g} rad/s.",
    )


def walking_base(motion: Motion) -> Table:
    """Place, attitude and motion of the base link in the world.

    Args:
        motion: Of a robot with a floating base.
    """
    series = [base_in_world(segment) for segment in motion.segments]
    labels = [segment.name for segment in motion.segments for _ in segment.time]
    quantities = []
    for name, unit, meaning, field in (
        ("{}", "m", "origin of the base link in the world, {}", "position"),
        ("{}", "rad", "attitude: yaw after pitch after roll, {}", "angles"),
        ("velocity_{}", "m/s", "velocity of that origin, world {}", "velocity"),
        ("acceleration_{}", "m/s^2", "acceleration of that origin, world {}", "acceleration"),
        (
            "angular_velocity_{}",
            "rad/s",
            "angular velocity, world {}; steady, so that its derivative is zero",
            "angular_velocity",
        ),
    ):
        values = np.concatenate([getattr(part, field) for part in series])
        axes = ("roll", "pitch", "yaw") if field == "angles" else "xyz"
        quantities += [
            Quantity(name.format(axis), unit, meaning.format(axis), values[:, [k]])
            for k, axis in enumerate(axes)
        ]
    return wide_series(
        "walking_base",
        np.concatenate([segment.time for segment in motion.segments]),
        ["base"],
        quantities,
        labels={"segment": (labels, "which feet support")},
        description="The base link in the world (x ahead at t = 0, z against gravity) over one "
        "gait cycle.",
    )
