"""Static stability: where the centre of mass stands over the support polygon."""

from __future__ import annotations

from actuators.arrays import Array
from pipeline.motion.motion import Segment
from pipeline.motion.support import stance_and_centre, support_margin
from pipeline.robot.robot import Robot


def stability_margins(robot: Robot, segment: Segment) -> Array:
    """Margin of static stability along a segment.

    Returns distance of the centre of mass's vertical projection from the nearest edge of the
    support polygon [m], shape (N,); negative outside.
    """
    feet, centre = stance_and_centre(robot, segment)
    return support_margin(feet, centre[:, :2])
