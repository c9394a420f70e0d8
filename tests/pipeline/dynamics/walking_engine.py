"""The hexapod walking in MuJoCo: contacts, servos, sensors; nothing of it is the product's."""

import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
import pytest

from pipeline.robot.kinematics import leg_posture
from pipeline.robot.robot import Robot
from tests.blind.machines.machine import Course
from tests.blind.machines.own import gait_course

mujoco = pytest.importorskip("mujoco")

STEP = 1e-3  # of the integration [s]
EVERY = 4  # steps between two rows of the log
KP, KD = 1500.0, 30.0  # of the servos [N*m/rad, N*m*s/rad]
RADIUS = 5e-3  # of the foot [m]
#: Of feet on the ground, MuJoCo's time constant [s] and impedance: on stiffer ground, as by default
#: or with .9995 in 4 ms, feet of all three robots bounce, also of one that stands.
SOFT, IMPEDANCE = 1e-2, [0.95, 0.99]
COUNTS = 2**16  # of an encoder, per turn
TORQUE_NOISE = 0.15  # [N*m]
KEYS = ("xx", "xy", "xz", "yy", "yz", "zz")


@dataclass(frozen=True)
class Walked:
    """A log of a robot that walked."""

    time: np.ndarray  #: (N,) [s].
    q: np.ndarray  #: Encoders, (N, J) [rad].
    torque: np.ndarray  #: With noise, (N, J) [N*m].
    force: np.ndarray  #: World on robot, world axes, (N, L, 3) [N].
    orientation: np.ndarray  #: Base to world, x y z w, (N, 4).


def walked(
    robot: Robot,
    *,
    periods: tuple[float, ...] = (),
    squats: float = 0.0,
    payload: tuple[float, tuple[float, float, float]] = (0.0, (0.0, 0.0, 0.0)),
    centre: float = 0.0,
    tilt: float = 0.0,
    coulomb: dict[str, float] | None = None,
    gain: dict[str, float] | None = None,
    kp: float = KP,
    noise: float = TORQUE_NOISE,
) -> Walked:
    """Let it walk cycles of these periods [s], or stand and go slowly down and up so long [s].

    `payload`: mass [kg] and its place on the base [m]. `centre`: by how much the base's centre of
    mass lies further ahead [m]. `tilt`: of the ground about the lateral axis [rad]. `coulomb`,
    `gain`: by joint, friction [N*m] and what torques read over what they should. `kp`: of the
    servos [N*m/rad]. `noise`: of torques [N*m].
    """
    kd = kp * KD / KP
    course = squatting(robot, squats) if squats else gait_course(robot, periods, STEP)
    model = _model(robot, payload, coulomb or {}, (kp, kd))
    model.body_ipos[model.body(robot.spec.robot.base_link).id, 0] += centre
    model.opt.gravity[:] = np.linalg.norm(model.opt.gravity) * np.array(
        [np.sin(tilt), 0.0, -np.cos(tilt)]
    )
    data = mujoco.MjData(model)
    at = [model.joint(name).qposadr[0] for name in robot.joints]
    dof = [model.joint(name).dofadr[0] for name in robot.joints]
    feet = [model.geom(f"{leg.name}_ball").id for leg in robot.spec.legs]
    data.qpos[at] = course.q[0]
    mujoco.mj_forward(model, data)
    lowest = min(data.geom_xpos[k][2] for k in feet)
    data.qpos[2] += RADIUS - lowest
    rng = np.random.default_rng(1)
    out: dict[str, list[np.ndarray]] = {k: [] for k in ("q", "torque", "force", "turn")}
    settle = round(0.5 / STEP)
    for k in range(-settle, course.time.size):
        row = max(k, 0)
        data.ctrl[:] = course.q[row] + kd / kp * course.v[row] * (k >= 0)
        if k >= 0 and k % EVERY == 0:
            mujoco.mj_forward(model, data)
            out["q"].append(data.qpos[at].copy())
            out["force"].append(_forces(model, data, feet))
            out["turn"].append(data.qpos[[4, 5, 6, 3]].copy())
        before = data.qvel[dof].copy()
        mujoco.mj_step(model, data)
        if k >= 0 and k % EVERY == 0:
            # The integrator takes damping at the step's end: this is what acted on the joints.
            acted = data.actuator_force - kd * (data.qvel[dof] - before)
            out["torque"].append(acted)
    q, torque, force, turn = (np.array(x) for x in out.values())
    count = 2 * np.pi / COUNTS
    scale = np.array([(gain or {}).get(name, 1.0) for name in robot.joints])
    torque = scale * torque + rng.normal(0.0, noise, torque.shape)
    return Walked(course.time[::EVERY], np.round(q / count) * count, torque, force, turn)


def squatting(robot: Robot, duration: float, depth: float = 0.15) -> Course:
    """Standing so long [s] while the base goes down and up, twice slowly and twice faster."""
    first = gait_course(robot, (2.0,), STEP).q[0]
    time = np.arange(round(duration / STEP)) * STEP
    phase = np.where(time < duration / 2, 1.0, 2.0) * 4.0 * np.pi * time / duration
    high = -float(leg_posture(robot.chains, robot.chains.by_leg(first[None])).feet[..., 2].mean())
    height = -0.5 * depth * high * (1.0 - np.cos(phase))
    q = np.empty((time.size, first.size))
    q[0] = first
    for k in range(1, time.size):
        legs = leg_posture(robot.chains, robot.chains.by_leg(q[k - 1][None]))
        feet, own = legs.feet, legs.jacobians
        rise = np.zeros((*feet.shape[1:], 1))
        rise[:, 2] = -(height[k] - height[k - 1])
        step = np.linalg.solve(own[0], rise)[..., 0]
        q[k] = q[k - 1] + robot.chains.by_joint(step[None])[0]
    v = np.gradient(q, STEP, axis=0)
    return Course(time, q, v, np.gradient(v, STEP, axis=0))


def spec_of(root: ET.Element, robot: Robot, *, balanced: bool) -> mujoco.MjSpec:
    """A URDF on a free joint, no link dropped; bodies that cannot be are balanced, or as stated."""
    for link in root.findall("link"):
        for part in (*link.findall("visual"), *link.findall("collision")):
            link.remove(part)  # meshes are not at hand and do not matter
    for part in [x for tag in ("transmission", "gazebo", "sensor") for x in root.findall(tag)]:
        root.remove(part)
    compiler = ET.SubElement(ET.SubElement(root, "mujoco"), "compiler")
    balance = str(balanced).lower()
    compiler.attrib = {"fusestatic": "false", "balanceinertia": balance, "angle": "radian"}
    spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
    spec.body(robot.spec.robot.base_link).add_freejoint(name="base_free")
    return spec


def _model(
    robot: Robot, payload: tuple, coulomb: dict[str, float], gains: tuple[float, float]
) -> mujoco.MjModel:
    root = ET.fromstring(robot.urdf)
    _possible(root)
    spec = spec_of(root, robot, balanced=True)
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    base = spec.body(robot.spec.robot.base_link)
    for leg in robot.spec.legs:
        ball = spec.body(leg.foot).add_geom(name=f"{leg.name}_ball", size=[RADIUS, 0, 0], mass=0.0)
        ball.solimp[:2], ball.solref = IMPEDANCE, [SOFT, 1.0]
        ball.type, ball.friction = mujoco.mjtGeom.mjGEOM_SPHERE, [0.9, 0.005, 0.0001]
    ground = spec.worldbody.add_geom(name="ground", size=[50, 50, 1])
    ground.solimp[:2], ground.solref = IMPEDANCE, [SOFT, 1.0]
    ground.type = mujoco.mjtGeom.mjGEOM_PLANE
    for name in robot.joints:
        servo = spec.add_actuator(name=name, target=name)
        servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
        servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        servo.gainprm[0], servo.biasprm[1], servo.biasprm[2] = gains[0], -gains[0], -gains[1]
    mass, place = payload
    if mass:
        box = base.add_body(name="payload", pos=place)
        box.mass, box.inertia, box.explicitinertial = mass, [1e-4 * mass] * 3, True
        box.ipos = [0, 0, 0]
    model = spec.compile()
    model.dof_damping[:] = model.dof_armature[:] = model.dof_frictionloss[:] = 0.0
    model.jnt_limited[:] = 0
    for joint, torque in coulomb.items():
        dof = model.joint(joint).dofadr[0]
        model.dof_frictionloss[dof] = torque
        # Dry: by default it is soft, and gives way while a joint slows down.
        model.dof_solimp[dof, :2], model.dof_solref[dof, 0] = (0.999, 0.9999), 2.0 * STEP
    model.opt.gravity[:] = robot.model.gravity.linear
    return model


def _possible(root: ET.Element) -> None:
    """Make inertias that no body has, as of a published robot's hatch, the nearest possible."""
    for inertia in root.iter("inertia"):
        xx, xy, xz, yy, yz, zz = (float(inertia.attrib[f"i{k}"]) for k in KEYS)
        size, axes = np.linalg.eigh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        least = 1e-3 * max(float(size[-1]), 1e-9)
        if size[0] < 0.0:
            fixed = (axes * np.maximum(size, least)) @ axes.T
            for key, value in zip(KEYS, fixed[np.triu_indices(3)], strict=True):
                inertia.attrib[f"i{key}"] = repr(float(value))


def _forces(model: mujoco.MjModel, data: mujoco.MjData, feet: list[int]) -> np.ndarray:
    out, wrench = np.zeros((len(feet), 3)), np.zeros(6)
    for k in range(data.ncon):
        contact = data.contact[k]
        own = [feet.index(g) for g in (contact.geom1, contact.geom2) if g in feet]
        mujoco.mj_contactForce(model, data, k, wrench)
        world = contact.frame.reshape(3, 3).T @ wrench[:3]
        out[own[0]] += world if contact.geom2 in feet else -world
    return out
