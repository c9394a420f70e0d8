"""Any gait against its definition: feet fixed in the ground, rates against finite differences."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from pipeline.motion.feet import base_in_world
from pipeline.motion.footfall import TRANSFER_PATHS
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.walking import walking_motion
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file

SLOPES = {"slope_forward": "6 deg", "slope_left": "-4 deg"}
#: Robot, then what its table ``[gait]`` states on top of its file.
GAITS: dict[str, tuple[str, dict[str, Any]]] = {
    "tripod on level ground": ("hexapod", {}),
    "sideways tetrapod uphill": ("hexapod", {"name": "tetrapod", "heading": "90 deg", **SLOPES}),
    "ripple in a bend on a slope, tilted": (
        "hexapod",
        {"name": "ripple", "speed": "0.05 m/s", "yaw_rate": "-6 deg/s", "heading": "30 deg"}
        | {"body_roll": "3 deg", "body_pitch": "-4 deg", "body_height": "280 mm", **SLOPES},
    ),
    "crawl with sway in a bend on a slope": (
        "anymal_c",
        {"speed": "0.06 m/s", "yaw_rate": "5 deg/s", "body_pitch": "3 deg", **SLOPES},
    ),
}


@pytest.fixture(scope="module", params=GAITS)
def walked(request: pytest.FixtureRequest, root: Path) -> tuple[Robot, Motion]:
    name, gait = GAITS[request.param]
    robot = load_robot(load_robot_file(root / "urdf" / f"{name}.toml").with_gait(**gait))
    return robot, walking_motion(robot, samples=301)


def feet_in_world(robot: Robot, segment: Segment) -> np.ndarray:
    q = segment.configuration
    feet = foot_positions(robot.chains, robot.leg_positions(q))
    return np.einsum("nij,nfj->nfi", robot.base_rotation(q), feet) + q[:, None, :3]


def test_rates_are_the_derivatives_of_the_configuration_and_of_the_base_in_the_world(
    walked: tuple[Robot, Motion],
) -> None:
    robot, motion = walked
    for segment in motion.segments:
        dt = segment.time[1] - segment.time[0]
        q, v, a = segment.configuration, segment.velocity, segment.acceleration
        steps = [pin.difference(robot.model, *pair) for pair in itertools.pairwise(q)]
        # Euler-Maclaurin and Simpson, whose errors shrink with the fourth power of the step.
        way = (v[:-1] + v[1:]) / 2 - dt * (a[1:] - a[:-1]) / 12
        np.testing.assert_allclose(np.array(steps) / dt, way, atol=2e-5 * np.abs(v).max())
        change = (a[:-2] + 4 * a[1:-1] + a[2:]) / 6
        np.testing.assert_allclose(
            (v[2:] - v[:-2]) / (2 * dt), change, atol=2e-5 * np.abs(a).max() + 1e-9
        )
        base = base_in_world(segment)
        for value, rate, atol in (
            ("position", "velocity", 3e-4),
            ("velocity", "acceleration", 5e-3),
        ):
            slope = (base[value][2:] - base[value][:-2]) / (2 * dt)
            np.testing.assert_allclose(slope, base[rate][1:-1], atol=atol)


def test_standing_feet_rest_in_the_ground_and_lifted_ones_do_not(
    walked: tuple[Robot, Motion],
) -> None:
    robot, motion = walked
    lift = gait_of(robot.spec).lift
    lowest = np.inf
    highest = np.full(len(robot.leg_names), -np.inf)
    for segment in motion.segments:
        feet = feet_in_world(robot, segment)
        height = feet @ segment.ground_normal
        stance = [robot.leg_names.index(leg) for leg in segment.stance]
        np.testing.assert_allclose(np.ptp(feet[:, stance], axis=0), 0, atol=1e-8)
        np.testing.assert_allclose(np.ptp(height[:, stance]), 0, atol=1e-8)
        ground = height[:, stance].mean()
        lowest = min(lowest, float((height - ground).min()))
        highest = np.maximum(highest, (height - ground).max(axis=0))
    assert lowest > -1e-8
    np.testing.assert_allclose(highest, lift, atol=2e-4)  # of the sample next to the middle


def test_segments_join_and_the_period_closes(walked: tuple[Robot, Motion]) -> None:
    robot, motion = walked
    joints = robot.position_index
    for before, after in zip(motion.segments[:-1], motion.segments[1:], strict=True):
        assert before.time[-1] == after.time[0]  # which is why no series runs backwards there
        np.testing.assert_allclose(before.configuration[-1], after.configuration[0], atol=1e-8)
        np.testing.assert_allclose(before.velocity[-1], after.velocity[0], atol=1e-7)
    first, last = motion.segments[0], motion.segments[-1]
    np.testing.assert_allclose(
        last.configuration[-1, joints], first.configuration[0, joints], atol=1e-8
    )
    np.testing.assert_allclose(last.velocity[-1], first.velocity[0], atol=1e-7)


@pytest.mark.parametrize("name", TRANSFER_PATHS)
def test_transfer_paths_go_from_rest_to_rest_by_their_own_derivatives(name: str) -> None:
    (advance, lift), s, h = TRANSFER_PATHS[name], np.linspace(0.01, 0.99, 50), 1e-6
    for profile in (advance, lift):
        for order, atol in ((0, 1e-8), (1, 1e-6)):
            slope = (profile(s + h)[order] - profile(s - h)[order]) / (2 * h)
            np.testing.assert_allclose(slope, profile(s)[order + 1], atol=atol)
    ends, middle = np.array([0.0, 1.0]), np.array([0.5])
    (way, rate, _), (height, lift_rate, _) = advance(ends), lift(ends)
    np.testing.assert_allclose(way, [0, 1], atol=1e-12)
    np.testing.assert_allclose([height, rate, lift_rate], 0, atol=1e-12)
    assert lift(middle)[0] == pytest.approx(1)
    assert advance(middle)[0] == pytest.approx(0.5)
