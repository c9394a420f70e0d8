"""Legs of two to seven joints that turn or slide, and joints that belong to no leg."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.dynamics.joint_demand import segment_demand
from pipeline.errors import RobotFileError, UrdfError
from pipeline.motion.motion import Segment
from pipeline.robot.kinematics import (
    foot_positions,
)
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.pipeline.robot.walkers import MIXED, robot_text, urdf_text, walker

N = 12


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return walker(tmp_path_factory.mktemp("mixed"), MIXED, arm=True)


def random_legs(robot: Robot, seed: int) -> np.ndarray:
    values = np.random.default_rng(seed).uniform(-1, 1, (N, *robot.leg_columns.shape))
    return np.where(robot.layout.real, values, 0.0)


def test_what_fills_up_a_short_leg_is_not_heeded(mixed: Robot) -> None:
    q = random_legs(mixed, 5)
    other = np.where(mixed.layout.real, q, 7.0)
    np.testing.assert_array_equal(
        foot_positions(mixed.chains, other), foot_positions(mixed.chains, q)
    )
    there_and_back = mixed.layout.by_leg(mixed.joint_positions(other))
    np.testing.assert_array_equal(there_and_back, q)


def test_joints_outside_the_legs_are_held_and_their_torque_is_told(mixed: Robot) -> None:
    assert mixed.joints[-1] == "arm"
    q = random_legs(mixed, 6)[:1]
    configuration = mixed.configuration(mixed.joint_positions(q), np.zeros((1, 3)))
    still = mixed.tangent(mixed.joint_rates(np.zeros_like(q)))
    segment = Segment("still", np.zeros(1), configuration, still, still, mixed.leg_names)
    demand, _ = segment_demand(mixed, segment)
    assert demand.position[0, -1] == 0.4
    # 0.7 kg at (0.01, -0.05) m of the joint's x and z, turned by 0.4 rad about y.
    ahead = 0.01 * np.cos(0.4) - 0.05 * np.sin(0.4)
    assert demand.torque[0, -1] == pytest.approx(-0.7 * 9.81 * ahead, rel=1e-12)


def test_an_endless_joint_is_an_angle_without_limits(mixed: Robot) -> None:
    lower, upper = mixed.limits
    endless = [mixed.joints.index("leg2_0"), mixed.joints.index("leg3_3")]
    assert np.isinf(lower[endless]).all()
    assert np.isinf(upper[endless]).all()
    assert np.isfinite(np.delete(upper, endless)).all()
    assert mixed.model.nq == mixed.model.nv + 1
    sliding = [mixed.joints[k] for k in np.flatnonzero(mixed.sliding)]
    assert sliding == ["leg2_2", "leg3_5"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("arm = 0.4", "", "joint 'arm' of the URDF belongs to no leg; .*hold it"),
        ("arm = 0.4", "arn = 0.4", "joint 'arn' is not in the URDF; did you mean 'arm'"),
        (
            'joints = ["leg1_0", "leg1_1"]',
            "joints = []",
            "'legs.leg1': joints is empty; a leg",
        ),
        ('["leg1_0", "leg1_1"]', '["leg1_0", "leg1_tip"]', "joint 'leg1_tip' is fixed; list tho"),
        ('["leg1_0", "leg1_1"]', '["leg1_1", "leg1_0"]', "'leg1_1' hangs on 'leg1_0', not on 'r"),
        ('foot = "leg1_foot"', 'foot = "leg1_fot"', "'leg1_fot' is not a frame .* 'leg1_foot'"),
        ("arm = 0.4", "arm = true", "'held.arm' must be a number"),
        ("arm = 0.4", "arm = 0.4\nleg0_1 = 0", "held.leg0_1: the joint belongs to leg 'leg0'"),
        (
            '"walker.urdf"',
            '"example-robot-data:solo21"',
            "robot.urdf: 'solo21' is no file and no robot of .*so",
        ),
        ('"walker.urdf"', '"example-robot-data:cassie"', "describes it in cassie.*not in a URDF"),
    ],
)
def test_what_cannot_be_loaded(tmp_path: Path, old: str, new: str, message: str) -> None:
    (tmp_path / "walker.urdf").write_text(urdf_text(MIXED, arm=True), encoding="utf-8")
    text = robot_text(MIXED, arm=True)
    assert old in text
    path = tmp_path / "walker.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises((UrdfError, RobotFileError), match=message):
        load_robot(load_robot_file(path))
