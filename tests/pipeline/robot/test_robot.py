"""A loaded robot: joints that are in no leg, and what cannot be loaded."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from actuators.errors import LegwattError
from pipeline.dynamics.joint_demand import segment_demand
from pipeline.motion.motion import Segment
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.pipeline.robot.walkers import MIXED, robot_text, urdf_text, walker

LEG1, FOOT1 = '["leg1_0", "leg1_1"]', 'foot = "leg1_foot"'


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return walker(tmp_path_factory.mktemp("mixed"), MIXED, arm=True)


def test_joints_outside_the_legs_are_held_and_their_torque_is_told(mixed: Robot) -> None:
    assert mixed.joints[-1] == "arm"
    q = np.zeros((1, *mixed.chains.columns.shape))
    configuration = mixed.configuration(mixed.joint_positions(q), np.zeros((1, 3)))
    still = mixed.tangent(mixed.chains.by_joint(q))
    segment = Segment("still", np.zeros(1), configuration, still, still, mixed.leg_names)
    demand, _ = segment_demand(mixed, segment)
    assert demand.position[0, -1] == 0.4
    # 0.7 kg at (0.01, -0.05) m of the joint's x and z, turned by 0.4 rad about y.
    ahead = 0.01 * np.cos(0.4) - 0.05 * np.sin(0.4)
    assert demand.torque[0, -1] == pytest.approx(-0.7 * 9.81 * ahead, rel=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("arm = 0.4", "arn = 0.4", "the URDF has no joint 'arn': did you mean 'arm'"),
        ("arm = 0.4", "arm = 0.4\nleg0_1 = 0", "held.leg0_1: the joint belongs to leg 'leg0'"),
        (LEG1, '["leg1_0", "leg0_1"]', "joint 'leg0_1' belongs to two legs"),
        ('side = "left"', 'side = "port"', "'legs.leg0.side': 'port': known: left, right"),
        (FOOT1, f"{FOOT1}\nstart_posture = [0]", "as many numbers as there are joints, 2"),
        (LEG1, '["leg1_0", "leg1_tip"]', "joint 'leg1_tip' is fixed"),
        (LEG1, '["leg1_1", "leg1_0"]', "'leg1_1' hangs on 'leg1_0', not on"),
        (FOOT1, 'foot = "leg1_fot"', "no frame 'leg1_fot': .* 'leg1_foot'"),
        (FOOT1, 'foot = "leg2_foot"', "'leg2_foot' is not carried by 'leg1_1'"),
        ('"leg1_0" type="revolute"', '"leg1_0" type="planar"', "'leg1_0' is of several coord"),
    ],
)
def test_what_cannot_be_loaded(tmp_path: Path, old: str, new: str, message: str) -> None:
    urdf, text = urdf_text(MIXED, arm=True), robot_text(MIXED, arm=True)
    assert old in urdf + text
    (tmp_path / "walker.urdf").write_text(urdf.replace(old, new), encoding="utf-8")
    path = tmp_path / "walker.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(LegwattError, match=message):
        load_robot(load_robot_file(path))
