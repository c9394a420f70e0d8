"""The residual: its weight by linear algebra, its columns by differences."""

from dataclasses import replace

import numpy as np
import pinocchio as pin

from pipeline.dynamics.residual import EquationsOfMotion, Feet, body_columns, carried, foot_rows
from pipeline.robot.robot import Robot


def random_equations(robot: Robot, force: float, n: int = 5) -> EquationsOfMotion:
    """Random states; feet of which three or four stand, forces measured to a deviation or not."""
    rng = np.random.default_rng(4)
    model, joints = robot.model, robot.velocity_index
    q = rng.uniform(-0.3, 0.3, (n, len(robot.joints)))
    J = foot_rows(model, robot.chains, joints, q)
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
    feet, sure = Feet(J, standing, known, force), np.ones(n, np.bool_)
    return EquationsOfMotion(model, motion, torque, noise, feet, joints, sure)


def test_weight_of_a_sample_is_that_of_the_forces_eliminated(hexapod: Robot) -> None:
    measured = random_equations(hexapod, 2.0)
    W, rows = measured.whitening, measured.feet.rows
    full = measured.noise + 4.0 * rows.transpose(0, 2, 1) @ rows
    assert np.allclose(W.transpose(0, 2, 1) @ W, np.linalg.inv(full), rtol=1e-8, atol=1e-12)
    unknown = random_equations(hexapod, 0.0)
    for k, W in enumerate(unknown.whitening):
        R, J = unknown.noise[k], unknown.feet.rows[k]
        N = np.linalg.svd(J)[2][np.linalg.matrix_rank(J) :].T  # null space of J_c
        assert np.allclose(W.T @ W, N @ np.linalg.inv(N.T @ R @ N) @ N.T, atol=1e-12)
    # What is whitened has unit variance in as many directions as there are equations left.
    left = np.einsum("nij,njk,nik->n", unknown.whitening, unknown.noise, unknown.whitening)
    assert np.allclose(left, [15, 12, 15, 12, 15])
    left = unknown.whitened(unknown.residual)
    some = unknown.at(slice(1, 3))
    assert np.allclose(some.whitened(some.residual), left[1:3])


def test_part_of_the_forces_may_be_measured(hexapod: Robot) -> None:
    """Vertical forces alone are as good as all three with the others known to nothing."""
    full = random_equations(hexapod, 2.0)
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
    rows = foot_rows(model, hexapod.chains, hexapod.velocity_index, q)
    leg = rng.normal(size=(n, 18)), rng.normal(size=(n, 18))
    standing = np.tile(np.arange(6) == 2, (n, 1))  # any motion of one leg is a base's motion
    base = carried(hexapod.chains, (q, *leg), rows, hexapod.velocity_index, standing, turn)
    v, a = base.velocity, base.acceleration
    assert base.determined.all()
    assert not carried(
        hexapod.chains, (q, *leg), rows, hexapod.velocity_index, standing
    ).determined.any()
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
    assert np.allclose(body_columns(equations.model, equations.motion) @ change, more)
