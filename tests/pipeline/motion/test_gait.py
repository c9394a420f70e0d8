"""Any gait: feet fixed in the ground, rates by differences, margins by hand and formula, sway."""

import itertools
import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from actuators.errors import LegwattError
from pipeline.commands.robots import robot_file_of
from pipeline.dynamics.joint_demand import motion_demand
from pipeline.motion.footfall import TRANSFER_PATHS, Footfall, wave
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion, Segment, base_in_world
from pipeline.motion.walking import stability_margins, walking_motion
from pipeline.robot.kinematics import foot_positions, support_margin
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import LegSpec, RobotSpec, load_robot_file

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


def test_rates_are_the_derivatives_of_the_configuration_and_of_the_base_in_the_world(walked):
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


def test_standing_feet_rest_in_the_ground_and_lifted_ones_do_not(walked):
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


def test_segments_join_and_the_period_closes(walked):
    robot, motion = walked
    parts, joints = motion.segments, robot.position_index
    for before, after in zip(parts, [*parts[1:], parts[0]], strict=True):
        here = slice(None) if after is not parts[0] else joints  # a period on, the base is ahead
        ends = before.configuration[-1, here], after.configuration[0, here]
        np.testing.assert_allclose(*ends, atol=1e-8)
        np.testing.assert_allclose(before.velocity[-1], after.velocity[0], atol=1e-7)
        # Which is why no series runs backwards there.
        assert after is parts[0] or before.time[-1] == after.time[0]


@pytest.mark.parametrize("name", TRANSFER_PATHS)
def test_transfer_paths_go_from_rest_to_rest_by_their_own_derivatives(name):
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


LEGS = ("lf", "lm", "lr", "rf", "rm", "rr")


@pytest.fixture(scope="module")
def spec(root: Path) -> RobotSpec:
    return load_robot_file(root / "urdf" / "hexapod.toml")


@pytest.mark.parametrize(
    ("gait", "message"),
    [
        ({"perod": "3 s"}, r"unknown key 'perod'.* 'period'"),
        ({"period": 3}, r"'period'.* 3 has no unit; expected such as '1 s'"),
        ({"period": "0.049 s"}, r"0\.049 s: must be from 0\.05 to 1000 s"),
        ({"speed": "20.1 m/s"}, r"20\.1 m/s: must be from 0 to 20 m/s"),
        ({"phase": {"lf": 0.8}}, r"says nothing of lm, lr, rf, rm, rr"),
        ({"name": "crowl"}, r"gait: 'name': no gait 'crowl': did you mean 'crawl'\?"),
        ({"name": "wave", "phase": dict.fromkeys(LEGS, 0)}, r"gait\.name and gait\.phase both"),
        ({"name": "crawl"}, r"'crawl' is for 4 legs, the robot has 6; wave is for any"),
        ({"duty_factor": 0.45}, r"only 0 feet stand .*raise gait\.duty_factor"),
        ({"stability_margin": "1 cm"}, r"state gait\.sway = 'least', too"),
    ],
)
def test_one_line_says_what_is_wrong_with_a_gait(spec, gait, message):
    with pytest.raises(LegwattError, match=message) as refused:
        gait_of(spec.model_copy(update={"gait": gait}))
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith(f"{spec.path}: ")


@pytest.mark.parametrize(
    ("stated", "speed", "period", "stroke"),
    [
        ({}, 0.16, 3.0, 0.24),
        ({"speed": "0.12 m/s"}, 0.12, 4.0, 0.24),
        ({"speed": "0.1 m/s", "stroke": "0.1 m", "period": "2 s"}, 0.1, 2.0, 0.1),
    ],
)
def test_two_of_speed_period_and_stroke_give_the_third(spec, stated, speed, period, stroke):
    gait = gait_of(spec.with_gait(**stated))
    found = (gait.speed, gait.period, gait.strokes.max())
    assert found == pytest.approx((speed, period, stroke))


PITCH, WIDTH, STROKE = 0.3, 0.5, 0.2  # [m]


def pairs(count: int) -> tuple[LegSpec, ...]:
    """Legs in pairs, one pitch apart from front to rear."""
    legs = []
    for side, y in (("left", WIDTH / 2), ("right", -WIDTH / 2)):
        for k in range(count):
            x = PITCH * ((count - 1) / 2 - k)
            name, foot = f"{side[0]}{k}", (x, y, -0.3)
            legs.append(LegSpec(name=name, joints=("j",), foot="f", side=side, neutral_foot=foot))
    return tuple(legs)


@pytest.mark.parametrize(("count", "duty"), [(2, 0.76), (2, 0.97), (3, 0.5), (4, 0.6), (5, 0.7)])
def test_wave_gaits_have_the_longitudinal_margin_of_song_and_waldron(count, duty):
    """S = (n/2 - 1) P + (duty - 3/4) stride, for n legs on a side P apart.

    Before and behind the body's middle an edge joins the last standing foot of either side.
    """
    legs = pairs(count)
    footfall, least = Footfall("wave", wave(legs, duty), duty), np.inf
    for begin, end, stance in footfall.stances():
        for ahead in (1.0, -1.0):
            last: dict[str, list[np.ndarray]] = {"left": [], "right": []}
            for leg in (leg for leg in legs if leg.name in stance):
                since = footfall.since(leg.name, begin, stood=True) + np.array([0.0, end - begin])
                x = leg.neutral_foot[0] + STROKE * (0.5 - since / duty)
                last[leg.side].append(ahead * x)
            way = 0.5 * sum(np.max(feet, axis=0) for feet in last.values())
            least = min(least, float(np.min(way)))
    expected = (count / 2 - 1) * PITCH + (duty - 0.75) * STROKE / duty
    assert least == pytest.approx(expected)


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
def test_margins_are_distances_to_the_nearest_edge(feet, point, nearest):
    corners, at = np.array([feet], dtype=float), np.array([point], dtype=float)
    assert support_margin(corners, at) == pytest.approx([nearest])


def least_static_margin(robot: Robot, motion: Motion) -> float:
    return min(float(stability_margins(robot, s).min()) for s in motion.segments)


SLOW_STEPS = {"period": "3 s", "stroke": "60 mm", "lift": "40 mm"}
#: Quadrupeds, in the stance that `init` guesses where no file ships, and the margin [m] of a crawl.
CRAWLS: dict[str, tuple[dict[str, str], float]] = {
    "solo12": ({"stability_margin": "20 mm"} | SLOPES, 0.0199),
    "anymal_c": ({"stability_margin": "20 mm"}, 0.0199),
    "solo8": (SLOW_STEPS, 0.004),  # a leg of two joints sways in its plane only
    "laikago": (SLOW_STEPS, 0.0099),
}


@pytest.mark.parametrize("name", CRAWLS)
def test_crawl_keeps_the_stated_margin_and_no_foot_pulls(root, name):
    (stated, margin), file = CRAWLS[name], root / "urdf" / f"{name}.toml"
    spec = load_robot_file(file if file.is_file() else robot_file_of(name))
    robot = load_robot(spec.with_gait(name="crawl", **stated))
    motion = walking_motion(robot, samples=201)
    assert least_static_margin(robot, motion) > margin
    demand = motion_demand(robot, motion)  # which refuses feet that pull
    assert None not in demand.contacts
    assert all(np.isfinite(part.torque).all() for part in demand.segments)


def test_what_is_said_to_be_attainable_is(root):
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
