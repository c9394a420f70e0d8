"""The batched kinematics against Pinocchio and finite differences.

Legs of two to seven joints that turn or slide, some in frames turned against their parents, as CAD
exports are, and those of the project's robots.
"""

import numpy as np
import pinocchio as pin
import pytest

from actuators.errors import LegwattError
from pipeline.robot.kinematics import (
    directions,
    foot_positions,
    leg_posture,
    solve_positions,
    solve_rates,
)
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.pipeline.robot.walkers import MIXED, Leg, walker

N = 12


@pytest.fixture(scope="module", params=["mixed", "hexapod", "leg"])
def robot(request, root, tmp_path_factory):
    if request.param == "mixed":
        return walker(tmp_path_factory.mktemp("mixed"), MIXED, arm=True)
    return load_robot(load_robot_file(root / "urdf" / f"{request.param}.toml"))


def random_legs(robot: Robot, seed: int) -> np.ndarray:
    values = np.random.default_rng(seed).uniform(-1, 1, (N, *robot.chains.columns.shape))
    return np.where(robot.chains.real, values, 0.0)


def test_feet_and_jacobians_agree_with_pinocchio(robot):
    q = random_legs(robot, 1)
    legs = leg_posture(robot.chains, q)
    np.testing.assert_allclose(foot_positions(robot.chains, q), legs.feet, atol=1e-14)
    model, data = robot.model, robot.model.createData()
    rows = robot.configuration(robot.joint_positions(q), np.zeros((N, 3)))
    for n, row in enumerate(rows):
        pin.computeJointJacobians(model, data, row)
        pin.updateFramePlacements(model, data)
        for i, leg in enumerate(robot.spec.legs):
            frame = model.getFrameId(leg.foot)
            np.testing.assert_allclose(legs.feet[n, i], data.oMf[frame].translation, atol=1e-12)
            full = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3]
            columns = robot.velocity_index[robot.chains.of(i)]
            own, spare = np.split(legs.jacobians[n, i], [columns.size], axis=1)
            np.testing.assert_allclose(own, full[:, columns], atol=1e-12)
            assert not spare.any()


def test_torques_are_the_jacobian_transposed_and_rates_its_derivative(robot):
    q, rate = random_legs(robot, 2), random_legs(robot, 3)
    force = np.random.default_rng(4).normal(size=(*q.shape[:2], 3))
    jacobian = leg_posture(robot.chains, q).jacobians
    np.testing.assert_allclose(
        leg_posture(robot.chains, q).force_torques(force),
        np.einsum("nlij,nli->nlj", jacobian, force),
        atol=1e-12,
    )
    h = 1e-6
    ahead, behind = (leg_posture(robot.chains, q + s * h * rate).jacobians for s in (1, -1))
    expected = np.einsum("nlij,nlj->nli", (ahead - behind) / (2 * h), rate)
    np.testing.assert_allclose(leg_posture(robot.chains, q).drift(rate), expected, atol=1e-8)


T = np.linspace(0.0, 1.0, 401)
PITCH, YAW, SLIDE = ("revolute", "0 1 0"), ("revolute", "0 0 1"), ("prismatic", "0 0 -1")
#: Legs, and in how many directions they move their foot.
KINDS: dict[str, tuple[Leg, int]] = {
    "two parallel axes": ((PITCH, PITCH), 2),
    "a hip that turns and a leg that slides": ((PITCH, SLIDE), 2),
    "three parallel axes": ((PITCH, PITCH, PITCH), 2),
    "a sliding shank": ((YAW, PITCH, SLIDE), 3),
    "one axis": ((PITCH,), 1),
    "seven joints, one of which slides": (MIXED[3], 3),
    "four joints": ((YAW, PITCH, PITCH, PITCH), 3),
}


def stance(robot: Robot) -> np.ndarray:
    """The legs bent."""
    chains = robot.chains
    bent = np.where(chains.real, np.linspace(0.5, 1.0, chains.real.shape[1]), 0.0)
    return np.where(chains.by_leg(robot.sliding[None])[0] > 0, 0.1, bent)


def path(robot: Robot) -> tuple[np.ndarray, ...]:
    """Place, velocity and acceleration of feet on a closed curve through the stance."""
    w, size = 2 * np.pi, np.array([0.015, 0.01, 0.01])
    s, c, s2, c2 = np.sin(w * T), np.cos(w * T), np.sin(2 * w * T), np.cos(2 * w * T)
    foot = foot_positions(robot.chains, stance(robot)[None])
    x = foot + (size * np.stack([c - 1, s, s2], -1))[:, None]
    v = (size * w * np.stack([-s, c, 2 * c2], -1))[:, None] + 0 * foot
    a = (size * w**2 * np.stack([-c, -s, -4 * s2], -1))[:, None] + 0 * foot
    return x, v, a


@pytest.mark.parametrize("kind", KINDS)
def test_feet_follow_as_legs_can_and_rates_are_those_of_the_positions(kind, tmp_path):
    """Rates against differences; the foot where it is to be, or the way left across what it can."""
    leg, moves = KINDS[kind]
    robot = walker(tmp_path, (leg,) * 3, turned=False)
    chains = robot.chains
    assert directions(chains).tolist() == [moves] * 3
    x, v, a = path(robot)
    q = solve_positions(chains, x, stance(robot), T)
    legs = leg_posture(chains, q)
    left = x - legs.feet
    if moves == 3:
        assert np.abs(left).max() < 1e-12
    assert np.abs(legs.force_torques(left)).max() < 1e-10  # nearest there is
    np.testing.assert_allclose(q[0], q[-1], atol=1e-9)  # a closed path closes in the joints
    q_dot, q_ddot = solve_rates(chains, q, v, a, T)
    spare = chains.counts[0] > max(moves, 2)  # joints to spare
    for value, rate, share in ((q, q_dot, 1e-5), (q_dot, q_ddot, 1e-3 if spare else 3e-5)):
        slope = (value[:-4] - 8 * value[1:-3] + 8 * value[3:-1] - value[4:]) / (12 * (T[1] - T[0]))
        np.testing.assert_allclose(slope, rate[2:-2], atol=share * np.abs(rate).max())


def test_jumps_between_branches_and_stretched_legs_are_refused(root):
    chains = load_robot(load_robot_file(root / "urdf" / "solo12.toml")).chains
    time = np.linspace(0.0, 1.0, 20)
    q = np.tile([0.1, 0.8, -1.6], (20, 4, 1))
    q[10:, 2] = [0.1, -0.8, 1.6]
    still = np.zeros((20, 4, 3))
    with pytest.raises(LegwattError, match=r"leg 'HL', joint 3: .* by 3.2 rad at t = 0.4737"):
        solve_rates(chains, q, still, still, time)
    with pytest.raises(LegwattError, match=r"leg 'FL' is stretched .* at t = 0 s"):
        solve_rates(chains, np.zeros_like(q), still, still, time)
