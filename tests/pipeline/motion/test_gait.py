"""The gait against its own definition, by finite differences and at contact events."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.errors import GaitError, OutOfReachError
from pipeline.motion.motion import Motion
from pipeline.motion.standing import standing_posture
from pipeline.motion.transfer_path import TRANSFER_PATHS, transfer_path
from pipeline.motion.walking import walking_motion
from pipeline.robot.kinematics import foot_jacobians, foot_positions
from pipeline.robot.robot import Robot, load_robot


def with_path(robot: Robot, name: str) -> Robot:
    return load_robot(robot.spec.with_gait(transfer_path=name))


@pytest.mark.parametrize("name", TRANSFER_PATHS)
def test_profiles_are_their_own_derivatives(name: str) -> None:
    path = transfer_path(name)
    s = np.linspace(0.01, 0.99, 50)
    h = 1e-6
    for profile in (path.advance, path.lift):
        _, first, second = profile(s)
        np.testing.assert_allclose(
            (profile(s + h)[0] - profile(s - h)[0]) / (2 * h), first, atol=1e-8
        )
        np.testing.assert_allclose(
            (profile(s + h)[1] - profile(s - h)[1]) / (2 * h), second, atol=1e-6
        )


@pytest.mark.parametrize("name", TRANSFER_PATHS)
def test_profiles_start_and_end_at_rest_on_the_ground(name: str) -> None:
    path = transfer_path(name)
    ends = np.array([0.0, 1.0])
    advance, advance_1, _ = path.advance(ends)
    lift, lift_1, _ = path.lift(ends)
    np.testing.assert_allclose(advance, [0, 1], atol=1e-12)
    np.testing.assert_allclose([lift, advance_1, lift_1], 0, atol=1e-12)
    assert path.lift(np.array([0.5]))[0] == pytest.approx(1)
    fine = path.advance(np.linspace(0, 1, 100001))[1]
    assert fine.max() == pytest.approx(path.peak_advance_rate, rel=1e-8)


@pytest.mark.parametrize("name", TRANSFER_PATHS)
def test_a_smooth_path_is_one_whose_acceleration_vanishes_at_both_ends(name: str) -> None:
    path = transfer_path(name)
    ends = path.advance(np.array([0.0, 1.0]))[2]
    assert np.allclose(ends, 0.0, atol=1e-9) == path.smooth_acceleration
    assert path.advance(np.array([0.5]))[0] == pytest.approx(0.5)  # there and back alike


@pytest.mark.parametrize("name", TRANSFER_PATHS)
def test_joint_rates_are_finite_differences(hexapod: Robot, name: str) -> None:
    motion = walking_motion(with_path(hexapod, name), samples=3001)
    for segment in motion.segments:
        dt = segment.time[1] - segment.time[0]
        joints = hexapod.position_index
        q = segment.configuration[:, joints]
        v = segment.velocity[:, hexapod.velocity_index]
        a = segment.acceleration[:, hexapod.velocity_index]
        np.testing.assert_allclose((q[2:] - q[:-2]) / (2 * dt), v[1:-1], atol=2e-5)
        np.testing.assert_allclose((v[2:] - v[:-2]) / (2 * dt), a[1:-1], atol=5e-4)


def test_foot_velocity_over_ground_is_continuous(hexapod: Robot, walk: Motion) -> None:
    """A foot rests on the ground on both sides of lift-off and touch-down."""
    speed = hexapod.spec.parameters["walking_speed"]
    for segment in walk.segments:
        q = hexapod.leg_positions(segment.configuration)
        _, jacobian = foot_jacobians(hexapod.chains, q)
        rate = segment.velocity[:, hexapod.velocity_index].reshape(q.shape)
        foot = np.einsum("nlij,nlj->nli", jacobian, rate) + [speed, 0, 0]
        np.testing.assert_allclose(foot[[0, -1]], 0, atol=1e-9)
        stance = [hexapod.leg_names.index(leg) for leg in segment.stance]
        np.testing.assert_allclose(foot[:, stance], 0, atol=1e-9)


def test_segments_join(hexapod: Robot, walk: Motion) -> None:
    first, second = walk.segments
    assert first.time[-1] == second.time[0] == pytest.approx(1.5)
    joints = hexapod.position_index
    np.testing.assert_allclose(first.configuration[-1], second.configuration[0], atol=1e-9)
    np.testing.assert_allclose(
        second.configuration[-1, joints], first.configuration[0, joints], atol=1e-9
    )
    np.testing.assert_allclose(first.velocity[-1], second.velocity[0], atol=1e-8)


def test_stroke_and_lift_are_those_of_table_ii(hexapod: Robot, walk: Motion) -> None:
    middle = hexapod.leg_names.index("rm")
    feet = [
        foot_positions(hexapod.chains, hexapod.leg_positions(s.configuration))[:, middle]
        for s in walk.segments
    ]
    support, transfer = feet
    assert "rm" in walk.segments[0].stance
    assert support[0, 0] - support[-1, 0] == pytest.approx(0.240)
    assert np.ptp(transfer[:, 2]) == pytest.approx(0.075)
    assert np.ptp(support[:, 2]) == pytest.approx(0, abs=1e-9)


def test_standing_lifts_the_other_feet(hexapod: Robot) -> None:
    segment = standing_posture(hexapod)
    feet = foot_positions(hexapod.chains, hexapod.leg_positions(segment.configuration))[0]
    ground = -hexapod.spec.parameters["body_height"]
    for leg, foot in zip(hexapod.leg_names, feet, strict=True):
        lifted = 0.0 if leg in ("lf", "lr", "rm") else 0.075
        assert foot[2] == pytest.approx(ground + lifted, abs=1e-9)


def test_a_stroke_beyond_reach_is_refused(hexapod: Robot) -> None:
    spec = hexapod.spec.with_parameters({"foot_stroke": 1.2, "walking_speed": 0.8})
    with pytest.raises(OutOfReachError, match=r"leg '\w+' at t = .* beyond its reach"):
        walking_motion(load_robot(spec))


def test_stroke_and_speed_agree_within_a_millionth(hexapod: Robot) -> None:
    for share, good in ((5e-7, True), (2e-6, False), (-2e-6, False)):
        spec = hexapod.spec.with_parameters({"walking_speed": 0.16 * (1 + share)})
        robot = load_robot(spec)
        if good:
            walking_motion(robot, samples=2)
            continue
        with pytest.raises(GaitError, match="change one"):
            walking_motion(robot, samples=2)


@pytest.mark.parametrize(
    "tripods",
    [
        (("lf", "lr", "rm"),),
        (("lf", "lr", "rm"), ("rf", "rr")),
        (("lf", "lr", "rm"), ("rf", "rr", "rm")),
        (("lf", "lr"), ("rm", "rf"), ("rr", "lm")),
    ],
)
def test_sets_that_do_not_part_the_legs_in_two_are_refused(
    hexapod: Robot, tripods: tuple[tuple[str, ...], ...]
) -> None:
    robot = replace(hexapod, spec=hexapod.spec.with_gait(tripods=[list(t) for t in tripods]))
    with pytest.raises(GaitError, match="must part the legs .* in two sets"):
        walking_motion(robot)


def test_the_first_set_supports_first_and_the_body_moves_on(hexapod: Robot, walk: Motion) -> None:
    speed = hexapod.spec.parameters["walking_speed"]
    assert tuple(s.stance for s in walk.segments) == (
        ("lf", "lr", "rm"),
        ("rf", "rr", "lm"),
    )
    for segment in walk.segments:
        base, rate = segment.configuration[:, :3], segment.velocity[:, :6]
        np.testing.assert_allclose(base[:, 0], speed * segment.time, atol=1e-12)
        assert not base[:, 1:].any()
        np.testing.assert_allclose(rate, np.tile([speed, 0, 0, 0, 0, 0], (len(rate), 1)))
        assert not segment.acceleration[:, :6].any()


def test_standing_on_feet_of_ones_choice(hexapod: Robot) -> None:
    segment = standing_posture(hexapod, ("lf", "lm", "lr", "rf", "rr"))
    feet = foot_positions(hexapod.chains, hexapod.leg_positions(segment.configuration))[0]
    neutral = np.array([leg.neutral_foot for leg in hexapod.spec.legs])
    neutral[hexapod.leg_names.index("rm"), 2] += hexapod.spec.parameters["foot_lift"]
    np.testing.assert_allclose(feet, neutral, atol=1e-9)
    assert not segment.velocity.any()
    assert not segment.acceleration.any()
    assert segment.name == "standing on lf, lm, lr, rf, rr"


def test_numbers_that_contradict_each_other_are_refused(hexapod: Robot) -> None:
    spec = hexapod.spec.with_parameters({"walking_speed": 0.2})
    with pytest.raises(GaitError, match="foot_stroke is 0.24 m"):
        walking_motion(load_robot(spec))


@pytest.mark.parametrize("samples", [0, 1, -5])
def test_too_few_samples_are_refused(hexapod: Robot, samples: int) -> None:
    with pytest.raises(GaitError, match="at least 2"):
        walking_motion(hexapod, samples=samples)


def test_an_unknown_path_offers_the_closest(hexapod: Robot) -> None:
    with pytest.raises(GaitError, match="did you mean 'cycloid'"):
        walking_motion(with_path(hexapod, "cyclod"))
