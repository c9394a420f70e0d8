"""The demand against the rate of mechanical energy, slow walking, and another engine.

MuJoCo's inverse dynamics shares no code with Pinocchio: same URDF, motion and ground forces.
"""

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from pipeline.commands.robots import robot_file_of
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.force_rules import LEAST_TORQUE, PAPER, GroundForces
from pipeline.dynamics.joint_demand import MotionDemand, motion_demand, segment_demand
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.support import standing_posture
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file

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


def test_joint_power_is_the_rate_of_energy_since_standing_feet_rest(walked: Walked) -> None:
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


def test_quasi_static_is_the_limit_of_slow_walking(hexapod: Robot) -> None:
    """At a hundredth of the speed full inverse dynamics comes down to gravity and contact."""
    slow = load_robot(hexapod.spec.with_parameters({"gait_period": 300.0, "walking_speed": 0.0016}))
    motion = walking_motion(slow, samples=101)
    full = motion_demand(slow, motion)
    static = motion_demand(hexapod, walking_motion(hexapod, samples=101), quasi_static=True)
    for a, b in zip(full.segments, static.segments, strict=True):
        np.testing.assert_allclose(a.torque, b.torque, atol=1e-3)


mujoco = pytest.importorskip("mujoco")


def model_of(robot: Robot) -> mujoco.MjModel:
    """The robot's URDF on a free joint, without contacts, limits, friction or rotor inertia."""
    root = ET.fromstring(robot.urdf)
    for link in root.findall("link"):
        for part in (*link.findall("visual"), *link.findall("collision")):
            link.remove(part)  # meshes are not at hand and do not matter
    for tag in ("transmission", "gazebo", "sensor"):
        for part in root.findall(tag):
            root.remove(part)
    compiler = ET.SubElement(ET.SubElement(root, "mujoco"), "compiler")
    # As the URDF says: no link dropped, none balanced.
    compiler.attrib = {"fusestatic": "false", "balanceinertia": "false", "angle": "radian"}
    spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
    spec.body(robot.spec.robot.base_link).add_freejoint(name="base_free")
    model = spec.compile()
    model.dof_damping[:] = model.dof_armature[:] = model.dof_frictionloss[:] = 0.0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    model.opt.gravity[:] = robot.model.gravity.linear
    return model


def joint_torque(
    robot: Robot, segment: Segment, ground: ContactForces
) -> tuple[np.ndarray, np.ndarray]:
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
def test_torque_agrees_with_mujoco(name: str, rule: GroundForces, root: Path) -> None:
    shipped = root / "urdf" / f"{name}.toml"
    robot = load_robot(load_robot_file(shipped if shipped.is_file() else robot_file_of(name)))
    segment = moving(robot)
    demand, ground = segment_demand(robot, segment, forces=rule)
    assert ground is not None
    torque, base = joint_torque(robot, segment, ground)
    scale = np.abs(demand.torque).max()
    assert np.abs(torque - demand.torque).max() < 1e-6 * scale
    assert np.abs(base).max() < 1e-6 * robot.mass * 9.81
