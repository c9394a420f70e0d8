"""Support margins against hand-drawn ones; the body's sway keeps its margin or says why not."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from actuators.errors import LegwattError
from pipeline.commands.robots import robot_file_of
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion
from pipeline.motion.support import followed_ways, stability_margins, support_margin
from pipeline.motion.walking import walking_motion
from pipeline.robot.inverse_kinematics import start_postures
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.pipeline.motion.gaited import gaited

CRAWL = {"name": "crawl", "period": "3 s", "stroke": "60 mm", "lift": "40 mm"}
SHUFFLED = [[1, 1, 0], [-1, -1, 0], [-1, 1, 0], [1, -1, 0]]
WEDGE = [[1, 0, 0], [-1, 1, 0], [-1, -1, 0]]


@pytest.mark.parametrize(
    ("feet", "point", "nearest"),
    [
        (SHUFFLED, (0.5, 0.2), 0.5),
        (SHUFFLED, (1.25, 0), -0.25),
        (WEDGE, (0, -0.2), 0.6 / np.sqrt(5)),
        (WEDGE, (0.8, 0.2), -0.2 / np.sqrt(5)),
    ],
)
def test_margins_are_distances_to_the_nearest_edge(
    feet: list[list[float]], point: tuple[float, float], nearest: float
) -> None:
    corners, at = np.array([feet], dtype=float), np.array([point], dtype=float)
    assert support_margin(corners, at) == pytest.approx([nearest])


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
    def crawl(**gait: object) -> Motion:
        return walking_motion(gaited(root, "solo12", {"name": "crawl", **gait}), samples=51)

    with pytest.raises(LegwattError, match=r"lower gait.stability_margin") as refused:
        crawl(stability_margin="90 mm")
    found = re.search(r"about ([\d.]+) mm is attainable", str(refused.value))
    assert found
    most = float(found[1])
    assert 20 < most < 90
    crawl(stability_margin=f"{most - 3} mm")
    with pytest.raises(LegwattError, match="attainable"):
        crawl(stability_margin=f"{most + 3} mm")
    # At a duty factor of 3/4 two triangles meet in a line at the change of legs.
    with pytest.raises(LegwattError, match="raise gait.duty_factor"):
        crawl(duty_factor=0.75)


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
