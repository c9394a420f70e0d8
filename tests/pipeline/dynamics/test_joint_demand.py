"""The demand against energy, slow walking, another engine; the residual by linear algebra.

MuJoCo's inverse dynamics shares no code with Pinocchio: same URDF, motion and ground forces.
"""

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from pipeline.commands.robots import robot_file_of
from pipeline.dynamics.contact_forces import LEAST_TORQUE, PAPER, GroundForces
from pipeline.dynamics.joint_demand import MotionDemand, motion_demand, segment_demand
from pipeline.dynamics.residual import EquationsOfMotion, Feet, body_columns, carried, foot_rows
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.walking import standing_posture, walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.pipeline.dynamics.walking_engine import spec_of

GAITS: dict[str, tuple[str, dict[str, Any]]] = {
    "tripod": ("hexapod", {}),
    "tetrapod in a bend on a slope": (
        "hexapod",
        {"name": "tetrapod", "speed": "0.05 m/s", "yaw_rate": "9 deg/s", "slope_left": "4 deg"},
    ),
    "crawl uphill with sway": ("solo12", {"slope_forward": "7 deg", "slope_left": "3 deg"}),
}

Walked = tuple[Robot, Motion, MotionDemand]


@pytest.fixture(scope="module", params=GAITS)
def walked(request: pytest.FixtureRequest, root: Path) -> Walked:
    name, gait = GAITS[request.param]
    spec = load_robot_file(root / "urdf" / f"{name}.toml")
    robot = load_robot(spec.with_gait(transfer_path="cycloid", **gait))  # no jump to difference
    motion = walking_motion(robot, samples=401)
    return robot, motion, motion_demand(robot, motion)


def test_joint_power_is_the_rate_of_energy_since_standing_feet_rest(walked):
    robot, motion, demand = walked
    model, data = robot.model, robot.model.createData()
    for segment, part in zip(motion.segments, demand.segments, strict=True):
        energy = np.array(
            [
                pin.computeKineticEnergy(model, data, q, v)
                + pin.computePotentialEnergy(model, data, q)
                for q, v in zip(segment.configuration, segment.velocity, strict=True)
            ]
        )
        dt = segment.time[1] - segment.time[0]
        rate = (energy[:-4] - 8 * energy[1:-3] + 8 * energy[3:-1] - energy[4:]) / (12 * dt)
        power = (part.torque * part.velocity).sum(axis=1)
        scale = np.abs(part.torque * part.velocity).max()
        np.testing.assert_allclose(power[2:-2], rate, atol=2e-5 * scale)


def test_quasi_static_is_the_limit_of_slow_walking(hexapod):
    """At a hundredth of the speed full inverse dynamics comes down to gravity and contact."""
    slow = load_robot(hexapod.spec.with_parameters({"gait_period": 300.0, "walking_speed": 0.0016}))
    motion = walking_motion(slow, samples=101)
    full = motion_demand(slow, motion)
    for a, part in zip(full.segments, motion.segments, strict=True):
        none = 0.0 * part.velocity
        static, _ = segment_demand(slow, replace(part, velocity=none, acceleration=none))
        np.testing.assert_allclose(a.torque, static.torque, atol=1e-3)


def model_of(robot: Robot) -> mujoco.MjModel:
    """Without contacts, limits, friction or rotor inertia."""
    model = spec_of(ET.fromstring(robot.urdf), robot, balanced=False).compile()
    model.dof_damping[:] = model.dof_armature[:] = model.dof_frictionloss[:] = 0.0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    model.opt.gravity[:] = robot.model.gravity.linear
    return model


def joint_torque(robot, segment, ground):
    """Torque of the joints (N, J) [N*m] under given ground forces, and what is left on the base.

    The latter (N, 6) [N, N*m] is nothing, where the ground carries the robot.
    """
    model = model_of(robot)
    data = mujoco.MjData(model)
    addresses = [model.joint(name) for name in robot.joints]
    at_q = [joint.qposadr[0] for joint in addresses]
    at_v = [joint.dofadr[0] for joint in addresses]
    feet = [model.body(leg.foot).id for leg in robot.spec.legs]
    torque, base = [], []
    for i, (q, v, a) in enumerate(
        zip(segment.configuration, segment.velocity, segment.acceleration, strict=True)
    ):
        x, y, z, w = q[3:7]
        data.qpos[:7] = [*q[:3], w, x, y, z]
        data.qpos[at_q] = q[robot.position_index]
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, data.qpos[3:7])
        turn = turn.reshape(3, 3)
        # MuJoCo's free joint: linear in the world, angular in the body; its acceleration is the
        # derivative of that velocity, Pinocchio's the spatial one in the body.
        data.qvel[:3], data.qvel[3:6] = turn @ v[:3], v[3:6]
        data.qacc[:3] = turn @ (a[:3] + np.cross(v[3:6], v[:3]))
        data.qacc[3:6] = a[3:6]
        data.qvel[at_v], data.qacc[at_v] = v[robot.velocity_index], a[robot.velocity_index]
        mujoco.mj_inverse(model, data)
        left = np.array(data.qfrc_inverse)
        for leg, body in enumerate(feet):
            jacobian = np.empty((3, model.nv))
            mujoco.mj_jac(model, data, jacobian, None, data.xpos[body], body)
            left -= jacobian.T @ ground.force_world[i, leg]
        torque.append(left[at_v])
        base.append(left[:6])
    return np.array(torque), np.array(base)


def moving(robot: Robot, samples: int = 12) -> Segment:
    """States drawn at random about standing on all feet of a slope, the base turning, too."""
    rng = np.random.default_rng(7)
    still = standing_posture(robot, robot.leg_names)
    q = np.repeat(still.configuration, samples, axis=0)
    q[:, robot.position_index] += rng.uniform(-0.1, 0.1, (samples, len(robot.joints)))
    quaternion = rng.normal(size=(samples, 4)) * 0.05 + [0, 0, 0, 1]
    q[:, 3:7] = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    v = rng.uniform(-0.5, 0.5, (samples, robot.model.nv))
    a = rng.uniform(-0.5, 0.5, (samples, robot.model.nv))
    normal = np.array([0.05, -0.03, 1.0])
    return replace(
        still,
        time=np.arange(samples) * 0.1,
        configuration=q,
        velocity=v,
        acceleration=a,
        ground_normal=normal / np.linalg.norm(normal),
    )


@pytest.mark.parametrize("rule", [PAPER, GroundForces(LEAST_TORQUE, 0.7)], ids=["paper", "torque"])
@pytest.mark.parametrize("name", ["hexapod", "solo12", "go2"])
def test_torque_agrees_with_mujoco(name, rule, root):
    shipped = root / "urdf" / f"{name}.toml"
    robot = load_robot(load_robot_file(shipped if shipped.is_file() else robot_file_of(name)))
    segment = moving(robot)
    demand, ground = segment_demand(robot, segment, forces=rule)
    torque, base = joint_torque(robot, segment, ground)
    scale = np.abs(demand.torque).max()
    assert np.abs(torque - demand.torque).max() < 1e-6 * scale
    assert np.abs(base).max() < 1e-6 * robot.mass * 9.81


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


def test_weight_of_a_sample_is_that_of_the_forces_eliminated(hexapod):
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


def test_part_of_the_forces_may_be_measured(hexapod):
    """Vertical forces alone are as good as all three with the others known to nothing."""
    full = random_equations(hexapod, 2.0)
    force = full.feet.force.copy()
    force[..., :2] = np.nan
    part = replace(full, feet=replace(full.feet, force=force))
    J = full.feet.rows
    variance = np.tile([1e10, 1e10, 4.0], 6)
    limit = np.linalg.inv(full.noise + J.transpose(0, 2, 1) * variance @ J)
    assert np.allclose(part.whitening.transpose(0, 2, 1) @ part.whitening, limit, atol=1e-8)


def test_feet_carry_the_base(hexapod):
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


def test_columns_are_the_change_of_the_residual(hexapod):
    equations = random_equations(hexapod, 0.0)
    model = equations.model.copy()
    ten = np.asarray(model.inertias[5].toDynamicParameters()) * 1.1
    change = np.zeros(10 * (model.njoints - 1))
    change[40:50] = ten - np.asarray(model.inertias[5].toDynamicParameters())
    model.inertias[5] = pin.Inertia.FromDynamicParameters(ten)
    more = replace(equations, model=model).rigid - equations.rigid
    assert np.allclose(body_columns(equations.model, equations.motion) @ change, more)
