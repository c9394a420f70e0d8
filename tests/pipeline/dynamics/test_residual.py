"""The residual: its weight by linear algebra, its columns by differences, a robot that walks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy import signal
from scipy.spatial.transform import Rotation

from pipeline.dynamics.residual import (
    EquationsOfMotion,
    Feet,
    carried,
    foot_rows,
    noise_covariance,
)
from pipeline.dynamics.residual_columns import (
    at_joints,
    body_columns,
    joint_columns,
    tilt_columns,
    zero_columns,
)
from pipeline.robot.kinematics import foot_positions
from pipeline.robot.robot import Robot
from tests.pipeline.dynamics.walking_engine import TORQUE_NOISE, Walked, walked

CUTOFF = 8.0  # [Hz]
FORCE_NOISE = 0.25  # after the filter [N]
#: What springy servos and contacts leave of the accelerations after the filter [m/s^2, rad/s^2].
ACCELERATION = np.r_[np.full(3, 0.03), np.full(3, 0.1), np.full(18, 0.1)]


def random_equations(robot: Robot, force: float, n: int = 5) -> EquationsOfMotion:
    """Random states; feet of which three or four stand, forces measured to a deviation or not."""
    rng = np.random.default_rng(4)
    model, joints = robot.model, robot.velocity_index
    q = rng.uniform(-0.3, 0.3, (n, len(robot.joints)))
    J = foot_rows(model, robot.chains, robot.layout, joints, q)
    standing = np.arange(6) < np.array([3, 4, 3, 4, 3])[:n, None]
    known = rng.normal(0, 50, (n, 6, 3)) if force else np.full((n, 6, 3), np.nan)
    motion = (
        robot.configuration(q),
        rng.normal(size=(n, model.nv)),
        rng.normal(size=(n, model.nv)),
    )
    root = rng.normal(size=(n, model.nv, model.nv)) + 3 * np.eye(model.nv)
    torque = robot.tangent(rng.normal(0, 10, q.shape))
    noise = root @ root.transpose(0, 2, 1)
    return EquationsOfMotion(model, motion, torque, noise, Feet(J, standing, known, force))


def test_weight_of_a_sample_is_that_of_the_forces_eliminated(hexapod: Robot) -> None:
    measured = random_equations(hexapod, 2.0)
    W, rows = measured.whitening, measured.feet.rows  # type: ignore[union-attr]
    full = measured.noise + 4.0 * rows.transpose(0, 2, 1) @ rows
    assert np.allclose(W.transpose(0, 2, 1) @ W, np.linalg.inv(full), rtol=1e-8, atol=1e-12)
    unknown = random_equations(hexapod, 0.0)
    for k, W in enumerate(unknown.whitening):
        R, J = unknown.noise[k], unknown.feet.rows[k]  # type: ignore[union-attr]
        N = np.linalg.svd(J)[2][np.linalg.matrix_rank(J) :].T  # null space of J_c
        assert np.allclose(W.T @ W, N @ np.linalg.inv(N.T @ R @ N) @ N.T, atol=1e-12)
    assert np.allclose(unknown.freedom, [15, 12, 15, 12, 15])
    # The gap in joints and base is the projected one.
    left = unknown.whitened(unknown.residual)
    assert np.allclose(unknown.whitened(unknown.gap()), left)
    some = unknown.at(slice(1, 3))
    assert np.allclose(some.whitened(some.residual), left[1:3])


def test_part_of_the_forces_may_be_measured(hexapod: Robot) -> None:
    """Vertical forces alone are as good as all three with the others known to nothing."""
    full = random_equations(hexapod, 2.0)
    assert full.feet is not None
    force = full.feet.force.copy()
    force[..., :2] = np.nan
    part = replace(full, feet=replace(full.feet, force=force))
    J = full.feet.rows
    variance = np.tile([1e10, 1e10, 4.0], 6)
    limit = np.linalg.inv(full.noise + J.transpose(0, 2, 1) * variance @ J)
    assert np.allclose(part.whitening.transpose(0, 2, 1) @ part.whitening, limit, atol=1e-8)


def test_feet_carry_the_base(hexapod: Robot) -> None:
    """No standing foot moves in what the feet are said to make of the base; by Pinocchio."""
    rng = np.random.default_rng(5)
    model, n = hexapod.model, 4
    q, turn = rng.uniform(-0.2, 0.2, (n, 18)), rng.normal(0, 0.3, (n, 6))
    rows = foot_rows(model, hexapod.chains, hexapod.layout, hexapod.velocity_index, q)
    leg = rng.normal(size=(n, 18)), rng.normal(size=(n, 18))
    standing = np.tile(np.arange(6) == 2, (n, 1))  # any motion of one leg is a base's motion
    v, a, known = carried(hexapod.chains, hexapod.layout, (q, *leg), rows, standing, turn)
    assert known.all()
    assert not carried(hexapod.chains, hexapod.layout, (q, *leg), rows, standing)[2].any()
    data, foot = model.createData(), model.getFrameId(hexapod.spec.legs[2].foot)
    for k, configuration in enumerate(hexapod.configuration(q)):
        whole = hexapod.tangent(leg[0], v)[k], hexapod.tangent(leg[1], a)[k]
        pin.forwardKinematics(model, data, configuration, *whole)
        pin.updateFramePlacements(model, data)
        speed = pin.getFrameVelocity(model, data, foot, pin.LOCAL_WORLD_ALIGNED).linear
        rate = pin.getFrameClassicalAcceleration(model, data, foot, pin.LOCAL_WORLD_ALIGNED).linear
        assert np.abs(speed).max() < 1e-9
        assert np.abs(rate).max() < 1e-9
        assert np.allclose(v[k, 3:], turn[k, :3])


def test_columns_are_the_change_of_the_residual(hexapod: Robot) -> None:
    equations = random_equations(hexapod, 0.0)
    model = equations.model.copy()
    ten = np.asarray(model.inertias[5].toDynamicParameters()) * 1.1
    change = np.zeros(10 * (model.njoints - 1))
    change[40:50] = ten - np.asarray(model.inertias[5].toDynamicParameters())
    model.inertias[5] = pin.Inertia.FromDynamicParameters(ten)
    more = replace(equations, model=model).rigid - equations.rigid
    assert np.allclose(body_columns(equations) @ change, more)
    tilted = equations.model.copy()
    angles = np.array([1e-6, -2e-6])
    tilt = pin.rpy.rpyToMatrix(*angles, 0.0)
    tilted.gravity.linear = tilt.T @ equations.model.gravity.linear
    more = replace(equations, model=tilted).rigid - equations.rigid
    assert np.allclose(tilt_columns(equations) @ angles, more, atol=1e-8)

    def build(q: np.ndarray) -> EquationsOfMotion:
        rows = foot_rows(hexapod.model, hexapod.chains, hexapod.layout, hexapod.velocity_index, q)
        assert equations.feet is not None
        motion = (hexapod.configuration(q), *equations.motion[1:])
        return replace(equations, motion=motion, feet=replace(equations.feet, jacobian=rows))

    q = equations.motion[0][:, hexapod.position_index]
    off = np.zeros(18)
    off[4] = 1e-3
    shown = build(q).whitened(zero_columns(build, q) @ off)
    # To first order: forces follow, and only what they cannot follow is seen.
    left = build(q).whitened(build(q).residual) - build(q).whitened(build(q + off).gap())
    assert np.abs(shown - left).max() < 0.03 * np.abs(shown).max()


def logged(robot: Robot, log: Walked, kind: str) -> EquationsOfMotion:
    """Rows of a log with foot forces, with contact flags, or with neither and no orientation."""
    dt = log.time[1] - log.time[0]
    sos = signal.butter(4, CUTOFF * 2 * dt, output="sos")
    q, torque = (signal.sosfiltfilt(sos, x, axis=0) for x in (log.q, log.torque))
    v = np.gradient(q, dt, axis=0)
    a = np.gradient(v, dt, axis=0)
    turn = Rotation.from_quat(log.orientation)
    force = np.einsum("nji,nfj->nfi", turn.as_matrix(), log.force)
    force = signal.sosfiltfilt(sos, force, axis=0)
    force += np.random.default_rng(3).normal(0.0, FORCE_NOISE, force.shape)
    height = foot_positions(robot.chains, robot.layout.by_leg(q))[..., 2]
    standing = log.force[..., 2] > 15.0
    level = Rotation.from_euler("YX", turn.as_euler("ZYX")[:, 1:])
    if kind == "neither":
        level = Rotation.identity(len(q))
        standing = height < height.min(axis=1, keepdims=True) + 5e-3
    if kind != "forces":
        force[:] = np.nan
    changes = log.time[1:][(standing[1:] != standing[:-1]).any(axis=1)]
    settled = np.abs(log.time[:, None] - changes).min(axis=1) > 0.12
    rows = np.flatnonzero(settled)[::6]
    rows = rows[(rows > 100) & (rows < len(q) - 100)]
    q, v, a, torque, standing = (x[rows] for x in (q, v, a, torque, standing))
    J = foot_rows(robot.model, robot.chains, robot.layout, robot.velocity_index, q)
    velocity, acceleration, known = carried(robot.chains, robot.layout, (q, v, a), J, standing)
    assert known.all()
    configuration = robot.configuration(q)
    configuration[:, 3:7] = level[rows].as_quat()
    motion = (configuration, robot.tangent(v, velocity), robot.tangent(a, acceleration))
    own = robot.tangent(np.full((1, 18), TORQUE_NOISE * np.sqrt(CUTOFF * 2 * dt)))[0]
    tilt = 1e-2 if kind == "neither" else 2e-3
    R = noise_covariance(robot.model, configuration, own, ACCELERATION, tilt)
    feet = Feet(J, standing, force[rows], FORCE_NOISE)
    return EquationsOfMotion(robot.model, motion, robot.tangent(torque), R, feet)


def estimated(robot: Robot, equations: EquationsOfMotion) -> tuple[np.ndarray, float]:
    """Payload of the base (mass and first moment) with Coulomb and viscous friction; what is left.

    The latter is the variance of a whitened equation.
    """
    v = equations.motion[1][:, robot.velocity_index]
    load, slow = equations.torque[:, robot.velocity_index], np.ones(18)
    laws = joint_columns(v, v, sign=np.tanh(v / 0.01), load=load, rate=v, slow=slow)
    own = [at_joints(laws[k], robot.velocity_index, 24) for k in ("coulomb", "viscous")]
    X = np.concatenate([body_columns(equations)[..., :4], *own], axis=2)
    X, y = equations.whitened(X).reshape(-1, X.shape[2]), equations.whitened(equations.residual)
    x = np.linalg.lstsq(X, y.ravel())[0]
    left = y.ravel() - X @ x
    return x, float(left @ left / equations.freedom.sum())


@pytest.mark.parametrize(
    ("kind", "kilograms", "metres"),
    [("forces", 0.15, 0.01), ("flags", 0.15, 0.01), ("neither", 0.45, 0.03)],
)
def test_payload_of_a_robot_that_walks(
    hexapod: Robot, loaded: Walked, kind: str, kilograms: float, metres: float
) -> None:
    equations = logged(hexapod, loaded, kind)
    x, variance = estimated(hexapod, equations)
    assert x[0] == pytest.approx(3.0, abs=kilograms)
    assert np.abs(x[1:3] / x[0] - [0.12, 0.05]).max() < metres
    assert np.abs(x[4:22]).max() < 0.15  # it has no friction [N*m]
    assert 0.5 < variance < 2.0
    truth = body_columns(equations)[..., :4] @ [3.0, 0.36, 0.15, 0.0]
    left = equations.whitened(equations.residual - truth)
    assert 0.7 < np.sum(left**2) / equations.freedom.sum() < 1.5
    assert np.all(equations.seen() <= 1.0 + 1e-9)


def test_nothing_is_found_where_nothing_is_carried(hexapod: Robot) -> None:
    x, variance = estimated(hexapod, logged(hexapod, walked(hexapod, periods=(3.0, 2.6)), "flags"))
    assert abs(x[0]) < 0.15
    assert np.abs(x[1:3]).max() < 0.03
    assert 0.5 < variance < 2.0


@pytest.fixture(scope="module")
def loaded(hexapod: Robot) -> Walked:
    carried_load = (3.0, (0.12, 0.05, 0.0))
    return walked(hexapod, periods=(3.0, 3.4, 4.2, 2.6), payload=carried_load)
