"""Table III and the reaction of section II.C, from the robot file through the general functions."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.support import standing_posture
from pipeline.robot.robot import Robot, load_robot

PUBLISHED_TORQUE = {"rm_joint_1": 0.0, "rm_joint_2": -30.71, "rm_joint_3": 1.46}  # [N*m]
TORQUE_TOLERANCE = 0.005  # half of the last printed digit [N*m]
PUBLISHED_REACTION = 192.6  # [N]
REACTION_TOLERANCE = 0.05


def test_reaction_of_the_middle_right_foot(hexapod: Robot) -> None:
    _, contacts = segment_demand(hexapod, standing_posture(hexapod))
    assert contacts is not None
    force = contacts.force_world[0, contacts.legs.index("rm")]
    assert force[2] == pytest.approx(PUBLISHED_REACTION, abs=REACTION_TOLERANCE)
    assert np.hypot(force[0], force[1]) < 1e-9  # nothing pushes sideways when standing


@pytest.mark.parametrize("axis_deg", [0, 45, 90])
def test_every_axis_angle_meets_table_iii(hexapod: Robot, axis_deg: float) -> None:
    """Joint 1's axis lies in the frontal plane, as do all forces when standing at mid-stroke."""
    spec = hexapod.spec.with_parameters({"joint_1_axis_angle": np.radians(axis_deg)})
    robot = load_robot(spec)
    demand, _ = segment_demand(robot, standing_posture(robot))
    for joint, torque in PUBLISHED_TORQUE.items():
        assert demand.torque[0, demand.joints.index(joint)] == pytest.approx(
            torque, abs=TORQUE_TOLERANCE
        )
