"""Inverse kinematics of any leg: iteration, joints to spare, directions that lack."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from actuators.errors import LegwattError
from pipeline.robot.inverse_kinematics import Freedom, freedoms, reach, solve_positions, solve_rates
from pipeline.robot.kinematics import LegChains, foot_jacobians, foot_positions
from pipeline.robot.postures import foot_tracking, neutral_postures
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.pipeline.robot.walkers import MIXED, Leg, walker

T = np.linspace(0.0, 1.0, 401)
PITCH, YAW, SLIDE = ("revolute", "0 1 0"), ("revolute", "0 0 1"), ("prismatic", "0 0 -1")
KINDS: dict[str, tuple[Leg, Freedom]] = {
    "two parallel axes": ((PITCH, PITCH), Freedom(2, 2)),
    "two axes across": ((YAW, PITCH), Freedom(2, 2)),
    "a hip that turns and a leg that slides": ((PITCH, SLIDE), Freedom(2, 2)),
    "three parallel axes": ((PITCH, PITCH, PITCH), Freedom(3, 2)),
    "one axis": ((PITCH,), Freedom(1, 1)),
    "seven joints, one of which slides": (MIXED[3], Freedom(7, 3)),
    "four joints": ((YAW, PITCH, PITCH, PITCH), Freedom(4, 3)),
    "a sliding shank": ((YAW, PITCH, SLIDE), Freedom(3, 3)),
}


def stance(chains: LegChains) -> LegChains:
    """The legs bent, about which posture they move least."""
    bent = np.where(chains.real, np.linspace(0.5, 1.0, chains.real.shape[1]), 0.0)
    slid = np.where(chains.slides, 0.1, bent)
    return replace(chains, nominal=slid)


def path(chains: LegChains, time: np.ndarray = T) -> tuple[np.ndarray, ...]:
    """Place, velocity and acceleration of feet on a closed curve through the stance."""
    w, size = 2 * np.pi, np.array([0.015, 0.01, 0.01])
    s, c, s2, c2 = np.sin(w * time), np.cos(w * time), np.sin(2 * w * time), np.cos(2 * w * time)
    foot = foot_positions(chains, chains.nominal[None])
    x = foot + (size * np.stack([c - 1, s, s2], -1))[:, None]
    v = (size * w * np.stack([-s, c, 2 * c2], -1))[:, None] + 0 * foot
    a = (size * w**2 * np.stack([-c, -s, -4 * s2], -1))[:, None] + 0 * foot
    return x, v, a


@pytest.fixture(scope="module", params=KINDS)
def kind(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[LegChains, Freedom]:
    leg, freedom = KINDS[request.param]
    robot = walker(tmp_path_factory.mktemp("kind"), (leg,) * 3, turned=False)
    return stance(robot.chains), freedom


def test_rates_are_those_of_the_positions(kind: tuple[LegChains, Freedom]) -> None:
    """Velocity and acceleration against differences of fourth order, foot missed or not."""
    chains, freedom = kind
    assert set(freedoms(chains)) == {freedom}
    x, v, a = path(chains)
    q = solve_positions(chains, x, chains.nominal, T)
    q_dot, q_ddot = solve_rates(chains, q, v, a, T, x)
    for value, rate in ((q, q_dot), (q_dot, q_ddot)):
        slope = (value[:-4] - 8 * value[1:-3] + 8 * value[3:-1] - value[4:]) / (12 * (T[1] - T[0]))
        np.testing.assert_allclose(slope, rate[2:-2], atol=3e-6 * np.abs(rate).max())


def test_a_leg_does_what_it_can(kind: tuple[LegChains, Freedom]) -> None:
    """Against a general minimiser: the nearest foot, and among those the least motion."""
    chains, freedom = kind
    leg, n, sample = 1, freedom.joints, 130
    one = chains.of([leg])
    x, _, _ = path(chains)
    q = solve_positions(chains, x, chains.nominal, T)[sample, leg]
    off = np.linalg.norm(foot_positions(one, q[None, None])[0, 0] - x[sample, leg])
    if freedom.directions == 3:
        assert off < 1e-9
    metric = np.where(one.slides[0, :n], 1 / one.reach[0], 1.0)

    def miss(own: np.ndarray) -> np.ndarray:
        full = np.zeros(one.real.shape[1])
        full[:n] = own
        return np.asarray(foot_positions(one, full[None, None])[0, 0] - x[sample, leg])

    def moved(own: np.ndarray) -> float:
        return float(((metric * (own - chains.nominal[leg, :n])) ** 2).sum())

    def far(own: np.ndarray) -> float:
        return 1e4 * float((miss(own) ** 2).sum())

    near = minimize(far, q[:n] + 0.01, method="BFGS", options={"gtol": 1e-9})
    assert far(q[:n]) <= near.fun + 1e-9
    if freedom.joints > freedom.directions:
        height = [0, 1, 2] if freedom.directions == 3 else [0, 2]  # the others are out of reach
        held = {"type": "eq", "fun": lambda own: miss(own)[height]}
        least = minimize(moved, q[:n] + 0.01, method="SLSQP", constraints=held, tol=1e-12)
        np.testing.assert_allclose(q[:n], least.x, atol=1e-5)
    else:
        np.testing.assert_allclose(q[:n], near.x, atol=1e-5)


def test_directions_a_leg_lacks_and_how_far_its_foot_leaves_its_path(tmp_path: Path) -> None:
    """Two parallel axes across the robot: the foot cannot go sideways, and is off by just that."""
    chains = stance(walker(tmp_path, ((PITCH, PITCH),) * 2 + (MIXED[0],), turned=False).chains)
    x, _, _ = path(chains)
    q = solve_positions(chains, x, chains.nominal, T)
    tracking = foot_tracking(chains, [(T, q, x)])
    assert [leg.cannot_move for leg in tracking] == [((0.0, 1.0, 0.0),)] * 2 + [()]
    for leg in tracking[:2]:
        assert leg.deviation == pytest.approx(0.01, rel=1e-9)
        assert leg.deviation_time in (0.25, 0.75)
    assert tracking[2].deviation < 1e-9
    assert np.isnan(tracking[2].deviation_time)
    at = q[[round(tracking[2].singular_time * 400)]]
    values = np.linalg.svd(foot_jacobians(chains, at)[1][0, 2], compute_uv=False)
    assert tracking[2].least_singular_value == pytest.approx(values[-1], rel=1e-12)


@pytest.mark.parametrize("name", ["hexapod", "hexapod_axis90", "solo12", "anymal_c"])
def test_feet_lead_back_to_the_posture_they_are_from(root: Path, name: str) -> None:
    robot = load_robot(load_robot_file(root / "urdf" / f"{name}.toml"))
    start, chains = neutral_postures(robot), robot.chains
    rng = np.random.default_rng(2)
    wanted = start + rng.uniform(-0.2, 0.2, (50, *start.shape))
    found, miss = reach(chains, foot_positions(chains, wanted), start)
    np.testing.assert_allclose(found, wanted, atol=1e-9)
    assert miss.max() < 1e-11


def test_a_jump_between_branches_is_refused(root: Path) -> None:
    chains = load_robot(load_robot_file(root / "urdf" / "solo12.toml")).chains
    time = np.linspace(0.0, 1.0, 20)
    q = np.tile([0.1, 0.8, -1.6], (20, 4, 1))
    q[10:, 2] = [0.1, -0.8, 1.6]
    still = np.zeros((20, 4, 3))
    with pytest.raises(LegwattError, match=r"leg 'HL', joint 3: .* by 3.2 rad at t = 0.4737"):
        solve_rates(chains, q, still, still, time)


def test_a_stretched_leg_of_two_joints_is_refused(tmp_path: Path) -> None:
    chains = stance(walker(tmp_path, ((PITCH, PITCH),) * 3, turned=False).chains)
    x, v, a = path(chains)
    far = x + [0.0, 0.0, -0.5]
    q = solve_positions(chains, far, chains.nominal, T)
    with pytest.raises(LegwattError, match="leg 'leg0' is stretched or folded"):
        solve_rates(chains, q, v, a, T, far)


def changed(robot: Robot, **legs: dict[str, object]) -> Robot:
    """The robot with legs that its file states otherwise."""
    own = tuple(replace(leg, **legs.get(leg.name, {})) for leg in robot.spec.legs)  # type: ignore[arg-type]
    return replace(robot, spec=replace(robot.spec, legs=own))


def test_every_offered_posture_is_a_start_that_arrives(hexapod: Robot) -> None:
    """The knee the other way lies beyond the limits; each offer, pasted in, is taken."""
    other_knee = {"start_posture": (0.0, -1.0, 3.0)}
    lost = changed(hexapod, **dict.fromkeys(hexapod.leg_names, other_knee))
    with pytest.raises(LegwattError, match="start_posture lies on another branch") as caught:
        neutral_postures(lost)
    offers = dict(re.findall(r"legs\.(\w+): \[([^\]]*)\]", str(caught.value)))
    assert tuple(offers) == hexapod.leg_names
    taken = {leg: {"start_posture": tuple(map(float, x.split(",")))} for leg, x in offers.items()}
    mended = neutral_postures(changed(hexapod, **taken))
    np.testing.assert_allclose(mended, neutral_postures(hexapod), atol=1e-9)


def test_a_foot_out_of_reach_is_as_far_as_the_stretched_leg_leaves_it(hexapod: Robot) -> None:
    """Straight out from joint 1, coxa, femur and tibia in one line: what is left is geometry."""
    p = hexapod.spec.parameters
    reach = p["joint_2_lateral"] + p["femur_length"] + p["tibia_length"]
    far = changed(hexapod, rm={"neutral_foot": (0.0, -reach - 0.0736, 0.0)})
    with pytest.raises(LegwattError, match=r"leg 'rm' .* lies 73\.6 mm beyond its reach"):
        neutral_postures(far)


def test_limits_that_forbid_every_branch_are_named(hexapod: Robot) -> None:
    narrow = changed(hexapod, rf={"neutral_foot": (0.05, -0.14, -0.29)})
    with pytest.raises(
        LegwattError, match=r"'rf_joint_\d' would\s+have to reach .* its limits are"
    ):
        neutral_postures(narrow)
