"""Support margins against hand-drawn ones; the body's sway keeps its margin or says why not."""

import re
from pathlib import Path

import numpy as np
import pytest

from actuators.errors import LegwattError
from pipeline.commands.robots import robot_file_of
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.motion import Motion
from pipeline.motion.support import stability_margins
from pipeline.motion.walking import walking_motion
from pipeline.robot.kinematics import support_margin
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file

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


def least_margin(robot: Robot, motion: Motion) -> float:
    return min(float(stability_margins(robot, s).min()) for s in motion.segments)


@pytest.mark.parametrize(
    ("name", "extra"),
    [("solo12", {"slope_forward": "10 deg", "slope_left": "5 deg"}), ("anymal_c", {})],
)
def test_crawl_keeps_the_stated_margin_and_no_foot_pulls(
    root: Path, name: str, extra: dict[str, str]
) -> None:
    spec = load_robot_file(root / "urdf" / f"{name}.toml")
    robot = load_robot(spec.with_gait(name="crawl", stability_margin="20 mm", **extra))
    motion = walking_motion(robot, samples=201)
    assert least_margin(robot, motion) > 0.020 - 1e-4
    assert None not in motion_demand(robot, motion).contacts  # which refuses feet that pull


def test_what_is_said_to_be_attainable_is(root: Path) -> None:
    spec = load_robot_file(root / "urdf" / "solo12.toml")

    def crawl(margin: str) -> None:
        robot = load_robot(spec.with_gait(name="crawl", stability_margin=margin))
        walking_motion(robot, samples=51)

    with pytest.raises(LegwattError, match=r"lower gait.stability_margin") as refused:
        crawl("90 mm")
    found = re.search(r"about ([\d.]+) mm is attainable", str(refused.value))
    assert found
    most = float(found[1])
    assert 20 < most < 90
    crawl(f"{most - 3} mm")
    with pytest.raises(LegwattError, match="attainable"):
        crawl(f"{most + 3} mm")


@pytest.mark.parametrize("name", ["solo8", "laikago"])
def test_every_published_quadruped_crawls_with_sway(name: str) -> None:
    """In the stance that `init` guesses; a leg of two joints sways in its plane only."""
    crawl = {"name": "crawl", "period": "3 s", "stroke": "60 mm", "lift": "40 mm"}
    robot = load_robot(load_robot_file(robot_file_of(name)).with_gait(**crawl))
    motion = walking_motion(robot, samples=101)
    demand = motion_demand(robot, motion)  # which refuses feet that pull
    assert least_margin(robot, motion) > (0.004 if name == "solo8" else 0.0099)
    assert all(np.isfinite(part.torque).all() for part in demand.segments)
