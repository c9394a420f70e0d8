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

from actuators.errors import LegwattError
from tests.blind.machines.machine import Course, Machine
from tests.blind.machines.plant import Plant

#: Step of the integration [s]; the shorter one where motors turn apart from their links.
STEPS: Final = (2.5e-4, 1e-4)
#: Frequency of the position loop [Hz], critically damped.
_LOOP: Final = 6.0
#: Of the oscillation of a link on its gear: damping ratio.
_LOSS: Final = 0.05
#: Frequency of the flanks that bound a play, about the link's own inertia [Hz].
_FLANK: Final = 80.0
_RUNAWAY: Final = 60.0  # [rad/s]
#: Terms of friction by which the level of dry friction changes.
_CHANGING: Final = ("excess", "driving", "driven", "asymmetry")


class RanAwayError(LegwattError):
    """A joint turned faster than any machine's."""


def step_of(plant: Plant) -> float:
    """Step of the integration [s]."""
    return STEPS[int(plant.parted.any())]


def engine() -> Any:
    """MuJoCo.

    Raises:
        LegwattError: It is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise LegwattError(f"the source 'mujoco' needs the development extra: {error}") from None
    return mujoco


def _built(machine: Machine, plant: Plant) -> Any:
    """The compiled model: bodies, rotors, and second joints where a motor turns apart."""
    mujoco = engine()
    spec = mujoco.MjSpec.from_string(machine.urdf)
    spec.option.timestep = step_of(plant)
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.compiler.autolimits = False
    spec.option.gravity = plant.model.gravity.linear
    # What every joint moves about its axis, in a bent posture [kg*m^2].
    bent = np.full(plant.model.nq, 0.3)
    moved = np.diag(pin.crba(plant.model, plant.model.createData(), bent)).tolist()
    for k, name in enumerate(machine.joints):
        joint, body = spec.joint(name), spec.body(f"link_{k + 1}")
        joint.limited = joint.actfrclimited = 0
        joint.armature, joint.frictionloss = plant.inertia[k], 0.0
        own = plant.model.inertias[plant.model.getJointId(name)]
        i = own.inertia
        body.mass, body.ipos, body.iquat = own.mass, own.lever, [1, 0, 0, 0]
        body.explicitinertial = True
        body.fullinertia = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]
        if not plant.parted[k]:
            continue
        hinge = mujoco.mjtJoint.mjJNT_HINGE
        link = body.add_joint(name=f"{name}_link", type=hinge, axis=joint.axis, pos=joint.pos)
        if plant.compliance[k] > 0:
            stiffness = 1.0 / plant.compliance[k]
            link.stiffness = [stiffness, 0, 0]
            link.damping = [2 * _LOSS * np.sqrt(stiffness * moved[k]), 0, 0]
        else:
            flank = moved[k] * (2 * np.pi * _FLANK) ** 2
            link.limited, link.range = 1, [-plant.play[k] / 2, plant.play[k] / 2]
            link.damping = [0.02 * np.sqrt(flank * moved[k]), 0, 0]
            link.solref_limit = [-flank / moved[k], -2 * np.sqrt(flank / moved[k])]
    model = spec.compile()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    return model


def run(machine: Machine, plant: Plant, course: Course) -> Course:
    """Let the machine follow a course that is planned at `step_of(plant)`.

    Raises:
        LegwattError: MuJoCo is missing.
        RanAwayError: A joint turned faster than any machine's.
    """
    mujoco = engine()
    model = _built(machine, plant)
    data = mujoco.MjData(model)
    dt = course.dt
    motors = [model.joint(name) for name in machine.joints]
    links = np.flatnonzero(plant.parted)
    parted = [model.joint(f"{machine.joints[k]}_link") for k in links]
    at, link_at = (np.array([j.qposadr[0] for j in x], np.intp) for x in (motors, parted))
    dof, link_dof = (np.array([j.dofadr[0] for j in x], np.intp) for x in (motors, parted))
    known, loop = machine.model.createData(), 2 * np.pi * _LOOP
    level_changes = plant.spots or any(getattr(plant, name).any() for name in _CHANGING)
    laws = [(j, begin(dt)) for j, begin in plant.extra]
    model.dof_frictionloss[dof] = plant.coulomb
    data.qpos[at], data.qvel[dof] = course.q[0], course.v[0]
    out = {name: np.empty_like(course.q) for name in ("q", "v", "a", "motor", "torque")}
    side, load = np.sign(course.v[0]), np.zeros(len(motors))
    for k, time in enumerate(course.time.tolist()):
        q, v = data.qpos[at].copy(), data.qvel[dof].copy()
        wanted = loop**2 * (course.q[k] - q) + 2 * loop * (course.v[k] - v)
        torque = pin.rnea(
            machine.model, known, course.q[k], course.v[k], course.a[k] + wanted
        ).copy()
        force = torque - plant.drag(v)
        for j, law in laws:
            force[j] += law(time, float(q[j]), float(v[j]))
        if level_changes:
            # At rest the level is that of the last motion's direction.
            side = np.where(np.abs(v) > 1e-4, np.sign(v), side)
            moving = np.where(np.abs(v) > 1e-4, v, 1e-9 * side)
            model.dof_frictionloss[dof] = plant.level(time, q, moving, load)
        data.qfrc_applied[dof] = force
        out["motor"][k], out["torque"][k], out["q"][k], out["v"][k] = q, torque, q, v
        out["q"][k, links] += data.qpos[link_at]
        out["v"][k, links] += data.qvel[link_dof]
        mujoco.mj_step(model, data)
        load = force + data.qfrc_constraint[dof] - plant.inertia * data.qacc[dof]
        out["a"][k] = data.qacc[dof]
        out["a"][k, links] += data.qacc[link_dof]
        if k % 256 == 0 and not np.abs(v).max() < _RUNAWAY:
            raise RanAwayError(f"a joint of the simulated {machine.name} ran away at {time:.3g} s")
    return Course(course.time, **out)
