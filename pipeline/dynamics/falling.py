"""Stances that no forces can satisfy, named with instant, foot and margin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.dynamics.internal_forces import held_by_friction, internal_basis, least_friction
from pipeline.dynamics.stability import stability_margins
from pipeline.dynamics.tipping import margin_and_remedy
from pipeline.errors import SlidingError, TippingError
from pipeline.motion.motion import Segment
from pipeline.robot.robot import Robot

#: Share of the largest force: a foot that is exactly unloaded (a tripod at the edge of its
#: stability) still stands, and one on its cone's surface still holds.
_ROUNDING = 1e-9


def refuse_falling(
    robot: Robot, segment: Segment, force: Array, feet: Array, friction_coefficient: float | None
) -> None:
    """Refuse forces that break a bound, as they do only where no forces are within them.

    `force`: on the standing feet, z along the ground's normal [N], shape (N, K, 3). `feet`: in the
    same frame [m], shape (N, K, 3). `friction_coefficient`: None for no limit.

    Raises:
        TippingError: A foot would have to pull.
        SlidingError: The feet would slide.
    """
    normal = force[..., 2]
    lowest = float(normal.min())  # NaN where any force is
    if not np.isfinite(lowest):
        raise TippingError(
            f"the robot tips: in '{segment.name}' the feet stand in one line and carry no moment "
            "across it; stand on feet of both sides"
        )
    slack = _ROUNDING * max(1.0, float(np.abs(normal).max()))
    if lowest < -slack:
        sample, foot = np.unravel_index(int(normal.argmin()), normal.shape)
        margin = stability_margins(robot, segment)[sample]
        raise TippingError(
            f"the robot tips at t = {segment.time[sample]:.4g} s ({segment.name}): the foot of leg "
            f"'{segment.stance[foot]}' would have to pull with {-lowest:.1f} N, "
            f"{margin_and_remedy(robot, segment, int(sample), float(margin))}"
        )
    if friction_coefficient is None:
        return
    beyond = np.hypot(force[..., 0], force[..., 1]) - friction_coefficient * normal
    sliding = np.flatnonzero(beyond.max(axis=1) > slack)
    if sliding.size:
        raise _slides(segment, force, feet, friction_coefficient, sliding)


def _slides(
    segment: Segment, force: Array, feet: Array, given: float, rows: NDArray[np.intp]
) -> SlidingError:
    """Of the instants that slide, the one that asks for most."""
    most, worst = given, int(rows[0])
    tangential, normal = np.hypot(force[..., 0], force[..., 1]), force[..., 2]
    endless = np.where(tangential > 0, np.inf, 0.0)
    ratio = np.divide(tangential, normal, out=endless, where=normal > 0)
    bases = internal_basis(feet[rows])
    for row, basis in zip(rows, bases, strict=True):
        if held_by_friction(force[row], basis, most) is None:
            most, worst = least_friction(force[row], basis, float(ratio[row].max())), int(row)
    foot = segment.stance[int(ratio[worst].argmax())]
    return SlidingError(
        f"the robot slides at t = {segment.time[worst]:.4g} s ({segment.name}), the foot of leg "
        f"'{foot}' first: no forces hold with a friction coefficient below {most:.3g}, "
        f"{given:g} is given ({most - given:.3g} short); lessen slope or acceleration, or give the "
        "coefficient of a rougher ground"
    )
