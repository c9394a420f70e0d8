"""A load on the body: mass and place, as ``[gait]`` states them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from pipeline.motion.gait import gait_table
from pipeline.robot.robot import Robot


def with_payload(robot: Robot) -> Robot:
    """The robot with the payload of its ``[gait]`` fixed to the base link; itself without one.

    The load is a point mass: give the place of its centre of mass. The URDF's text stays without.
    """
    table = gait_table(robot.spec)
    if not table.payload_mass:
        return robot
    place = np.array([table.payload_x, table.payload_y, table.payload_z])
    model = robot.model.copy()
    load = pin.Inertia(table.payload_mass, place, np.zeros((3, 3)))
    model.appendBodyToJoint(1 if robot.floating else 0, load, pin.SE3.Identity())
    return replace(robot, model=model)
