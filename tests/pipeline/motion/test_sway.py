"""The body's sway keeps its margin, is the least that does, and says what it cannot keep."""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

from actuators.errors import LegwattError
from pipeline.commands.robots import robot_file_of
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion
from pipeline.motion.support import Sway, followed_ways, stability_margins
from pipeline.motion.walking import walking_motion
from pipeline.robot.inverse_kinematics import start_postures
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.pipeline.motion.gaited import gaited

CRAWL = {"name": "crawl", "period": "3 s", "stroke": "60 mm", "lift": "40 mm"}


def quadruped(name: str) -> Robot:
    """A published robot that crawls in the stance that `init` guesses."""
    return load_robot(load_robot_file(robot_file_of(name)).with_gait(**CRAWL))


def least_margin(robot: Robot, motion: Motion) -> float:
    return min(float(stability_margins(robot, s).min()) for s in motion.segments)


@pytest.mark.parametrize(
    ("name", "extra"),
    [("solo12", {"slope_forward": "10 deg", "slope_left": "5 deg"}), ("anymal_c", {})],
)
def test_crawl_keeps_the_stated_margin_and_no_foot_pulls(
    root: Path, name: str, extra: dict[str, str]
) -> None:
    robot = gaited(root, name, {"name": "crawl", "stability_margin": "20 mm", **extra})
    motion = walking_motion(robot, samples=201)
    assert least_margin(robot, motion) > 0.020 - 1e-4
    assert None not in motion_demand(robot, motion).contacts  # which refuses feet that pull


def test_where_the_margin_is_kept_anyway_the_body_does_not_sway(root: Path) -> None:
    gait = {"name": "ripple", "transfer_path": "cycloid"}
    still = walking_motion(gaited(root, "hexapod", gait), samples=51)
    gait |= {"sway": "least", "stability_margin": "30 mm"}
    swayed = walking_motion(gaited(root, "hexapod", gait), samples=51)
    for a, b in zip(still.segments, swayed.segments, strict=True):
        np.testing.assert_allclose(a.configuration, b.configuration, atol=1e-9)


def test_what_is_said_to_be_attainable_is(root: Path) -> None:
    def crawl(margin: str) -> Motion:
        robot = gaited(root, "solo12", {"name": "crawl", "stability_margin": margin})
        return walking_motion(robot, samples=51)

    with pytest.raises(LegwattError, match="lower gait.stability_margin") as refused:
        crawl("90 mm")
    found = re.search(r"about ([\d.]+) mm is attainable", str(refused.value))
    assert found
    most = float(found[1])
    assert 20 < most < 90
    crawl(f"{most - 3} mm")
    with pytest.raises(LegwattError, match="attainable"):
        crawl(f"{most + 3} mm")


def test_a_crawl_that_never_has_four_feet_down_has_no_margin_to_keep(root: Path) -> None:
    """At a duty factor of 3/4 two triangles meet in a line at the change of legs."""
    robot = gaited(root, "solo12", {"name": "crawl", "duty_factor": 0.75})
    with pytest.raises(LegwattError, match="raise gait.duty_factor"):
        walking_motion(robot, samples=51)


def test_the_path_is_periodic_and_its_rates_are_its_derivatives() -> None:
    sway = Sway(np.random.default_rng(1).normal(size=(16, 2)), period=2.0)
    share = np.linspace(0, 1, 4001)
    course = sway.course(share)
    for value in course:
        np.testing.assert_allclose(value[0], value[-1], atol=1e-9)
    dt = 2.0 / 4000
    for value, rate in itertools.pairwise(course):
        slope = (value[2:] - value[:-2]) / (2 * dt)
        np.testing.assert_allclose(slope, rate[1:-1], atol=1e-4 * np.abs(rate).max())


@pytest.mark.parametrize("name", ["solo8", "go2", "laikago"])
def test_every_published_quadruped_crawls_with_sway(name: str) -> None:
    robot = quadruped(name)
    motion = walking_motion(robot, samples=101)
    demand = motion_demand(robot, motion)  # which refuses feet that pull
    assert least_margin(robot, motion) > (0.004 if name == "solo8" else 0.0099)
    assert all(np.isfinite(part.torque).all() for part in demand.segments)


def test_a_leg_of_two_joints_lets_the_body_sway_in_its_plane_only() -> None:
    for name, ways in (("solo12", 2), ("solo8", 1)):
        robot = quadruped(name)
        gait = gait_of(robot.spec)
        found = followed_ways(robot, gait, start_postures(robot, gait.neutral @ gait.table.body))
        assert found.shape == (2, ways)
    assert np.abs(found[:, 0]) == pytest.approx([1, 0], abs=1e-6)
