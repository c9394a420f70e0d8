"""MuJoCo source: forward dynamics with a controller in the loop and true sticking.

Dry friction is the engine's own constraint (`frictionloss`), whose level follows the law in every
step; elasticity and play are a second joint between motor and link; all other laws are torques from
outside. The controller is computed torque by the URDF's bodies with PD, its reference evaluated at
every step: one that is held between samples makes a sawtooth that looks like negative viscous
friction.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from pipeline.blind.machines.chains import Machine
from pipeline.blind.machines.motions import Course
from pipeline.blind.machines.plant import Happened, Plant
from pipeline.errors import PipelineError

#: Step of the integration [s]; the shorter one where motors turn apart from their links.
STEPS: Final = (2.5e-4, 1e-4)
#: Frequency of the position loop [Hz], critically damped.
_LOOP: Final = 6.0
#: Of the oscillation of a link on its gear: damping ratio.
_LOSS: Final = 0.05
#: Frequency of the flanks that bound a play, about the link's own inertia [Hz].
_FLANK: Final = 80.0
_RUNAWAY: Final = 60.0  # [rad/s]


class RanAwayError(PipelineError):
    """A joint turned faster than any machine's."""


def step_of(plant: Plant) -> float:
    """Step of the integration [s]."""
    return STEPS[int(plant.parted.any())]


def engine() -> Any:
    """MuJoCo.

    Raises:
        PipelineError: It is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise PipelineError(
            f"the source 'mujoco' needs the package mujoco, which cannot be loaded ({error}); "
            "install the development extra (`pip install -e .[dev]`), or use --source own"
        ) from None
    return mujoco


def own_inertia(model: pin.Model) -> Array:
    """What every joint moves about its axis [kg*m^2], in a bent posture, shape (J,)."""
    data = model.createData()
    return np.diag(pin.crba(model, data, np.full(model.nq, 0.3))).copy()


def _built(machine: Machine, plant: Plant) -> Any:
    """The compiled model: bodies, rotors, and second joints where a motor turns apart."""
    mujoco = engine()
    spec = mujoco.MjSpec.from_string(machine.urdf)
    spec.option.timestep = step_of(plant)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.compiler.autolimits = False
    spec.option.gravity = plant.model.gravity.linear
    inertia = own_inertia(plant.model)
    for k, name in enumerate(machine.joints):
        joint, body = spec.joint(name), spec.body(machine.links[k])
        joint.limited = joint.actfrclimited = 0
        joint.armature, joint.frictionloss = plant.inertia[k], 0.0
        own = plant.model.inertias[plant.model.getJointId(name)]
        i = own.inertia
        body.mass, body.ipos, body.iquat = own.mass, own.lever, [1, 0, 0, 0]
        body.explicitinertial = True
        body.fullinertia = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]
        if plant.parted[k]:
            _part(mujoco, plant, k, joint, body, float(inertia[k]))
    model = spec.compile()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    return model


def _part(mujoco: Any, plant: Plant, k: int, joint: Any, body: Any, inertia: float) -> None:
    """A second joint, from the motor's angle to the link's."""
    second = body.add_joint(
        name=f"{joint.name}_link", type=mujoco.mjtJoint.mjJNT_HINGE, axis=joint.axis, pos=joint.pos
    )
    if plant.compliance[k] > 0:
        stiffness = 1.0 / plant.compliance[k]
        second.stiffness = [stiffness, 0, 0]
        second.damping = [2 * _LOSS * np.sqrt(stiffness * inertia), 0, 0]
    else:
        flank = inertia * (2 * np.pi * _FLANK) ** 2
        second.limited, second.range = 1, [-plant.play[k] / 2, plant.play[k] / 2]
        second.damping = [0.02 * np.sqrt(flank * inertia), 0, 0]
        second.solref_limit = [-flank / inertia, -2 * np.sqrt(flank / inertia)]


def run(machine: Machine, plant: Plant, course: Course) -> Happened:
    """Let the machine follow a course that is planned at `step_of(plant)`.

    Raises:
        PipelineError: MuJoCo is missing.
        RanAwayError: A joint turned faster than any machine's.
    """
    mujoco = engine()
    model = _built(machine, plant)
    data = mujoco.MjData(model)
    dt = course.dt
    at = np.array([model.joint(name).qposadr[0] for name in machine.joints])
    dof = np.array([model.joint(name).dofadr[0] for name in machine.joints])
    links = np.flatnonzero(plant.parted)
    second = [model.joint(f"{machine.joints[k]}_link") for k in links]
    link_at = np.array([joint.qposadr[0] for joint in second], dtype=np.intp)
    link_dof = np.array([joint.dofadr[0] for joint in second], dtype=np.intp)
    prepared, inertia, block = _prepared(machine, course)
    loop = 2 * np.pi * _LOOP
    friction = plant.friction
    laws = [(j, begin(dt)) for j, begin in plant.extra]
    model.dof_frictionloss[dof] = friction.coulomb
    data.qpos[at], data.qvel[dof] = course.q[0], course.v[0]
    out = {name: np.empty_like(course.q) for name in ("q", "v", "a", "motor", "torque")}
    side, load = np.sign(course.v[0]), prepared[0].copy()
    for k, time in enumerate(course.time.tolist()):
        q, v = data.qpos[at].copy(), data.qvel[dof].copy()
        wanted = loop**2 * (course.q[k] - q) + 2 * loop * (course.v[k] - v)
        torque = prepared[k] + inertia[k // block] @ wanted
        force = torque - friction.drag(v)
        for j, law in laws:
            force[j] += law(time, float(q[j]), float(v[j]))
        if not friction.plain:
            # At rest the level is that of the last motion's direction.
            side = np.where(np.abs(v) > 1e-4, np.sign(v), side)
            moving = np.where(np.abs(v) > 1e-4, v, 1e-9 * side)
            model.dof_frictionloss[dof] = friction.level(time, q, moving, load)
        data.qfrc_applied[dof] = force
        out["motor"][k], out["torque"][k], out["q"][k], out["v"][k] = q, torque, q, v
        if links.size:
            out["q"][k, links] += data.qpos[link_at]
            out["v"][k, links] += data.qvel[link_dof]
        mujoco.mj_step(model, data)
        load = force + data.qfrc_constraint[dof] - plant.inertia * data.qacc[dof]
        out["a"][k] = data.qacc[dof]
        if links.size:
            out["a"][k, links] += data.qacc[link_dof]
        if k % 256 == 0 and not np.abs(v).max() < _RUNAWAY:
            raise RanAwayError(f"a joint of the simulated {machine.name} ran away at {time:.3g} s")
    return Happened(Course(course.time, out["q"], out["v"], out["a"]), out["motor"], out["torque"])


def _prepared(machine: Machine, course: Course) -> tuple[Array, Array, int]:
    """What the controller knows of the URDF's bodies along the course.

    Returns:
        Torque (N, J), every few steps and in between a line; inertia (B, J, J) of blocks of so
        many steps, which makes the loop as fast at every joint.
    """
    model, data = machine.model, machine.model.createData()
    every, block = max(1, round(1e-3 / course.dt)), round(1e-2 / course.dt)
    rows = np.unique(np.append(np.arange(0, course.time.size, every), course.time.size - 1))
    known = np.array(
        [pin.rnea(model, data, course.q[k], course.v[k], course.a[k]).copy() for k in rows]
    )
    torque = np.stack([np.interp(course.time, course.time[rows], x) for x in known.T], axis=1)
    upper = np.triu([pin.crba(model, data, q).copy() for q in course.q[::block]])
    return torque, upper + np.transpose(np.triu(upper, 1), (0, 2, 1)), block
