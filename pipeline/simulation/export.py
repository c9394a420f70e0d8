"""A machine as other tools read it: MJCF of MuJoCo, or its URDF put right.

A joint's drivetrain in the few numbers that other tools have for it, and what these leave out. The
laws of the drivetrain are asked along speeds from slow to fast, without load: of what it takes,

    f(v) = c sign(v) + d v + rest,

`c` (dry friction) and `d` (viscous friction) are carried over, in least squares; what `rest` comes
to is reported, as are load, elasticity and everything else that these tools have no number for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree
from xml.etree.ElementTree import SubElement

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import LegwattError, closest, one_line
from actuators.shaft import ShaftSeries
from pipeline.effects.base import place_text
from pipeline.effects.model_file import apply_edits, read_model_file
from pipeline.logs.reading.mapping import load_mapping
from pipeline.machine.joint import JointModel
from pipeline.machine.machine import MachineModel, link_name
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_source import read_urdf
from pipeline.simulation.found_bodies import corrected_urdf
from pipeline.simulation.machine import base_model
from pipeline.simulation.rigid_bodies import changed_model

#: Joint to stiffness [N*m/rad] and damping [N*m*s/rad] of its servo.
Gains = Mapping[str, tuple[float, float]]
#: What a file of each kind has none of.
LEFT: Final = {
    "mjcf": ("meshes, collisions and contacts: bodies and joints alone are written",),
    "urdf": (
        "inertia of rotors: a URDF has no number for it; put it into the simulator's armature",
        "springs beside the drive",
        "gravity of a tilted stand",
    ),
}


def mjcf(
    machine: MachineModel, numbers: Sequence[JointNumbers], remarks: Sequence[str], gains: Gains
) -> str:
    """A MuJoCo model: bodies, joints with friction and inertia, driven by torque without a gain.

    MuJoCo writes numbers with six digits.

    Raises:
        LegwattError: MuJoCo is not installed, or refuses a body.
    """
    try:
        import mujoco
    except ImportError as error:
        raise LegwattError(
            f"MJCF is written by the package mujoco, which cannot be loaded ({one_line(error)}); "
            "install it (`pip install mujoco`), or use --to urdf"
        ) from None
    model = changed_model(machine.rigid, machine.bodies)
    spec = mujoco.MjSpec()
    spec.modelname, spec.compiler.degree = machine.name, False
    spec.comment = _comment(remarks)
    spec.option.gravity = model.gravity.linear
    own, bodies = {n.joint: n for n in numbers}, {0: spec.worldbody}
    for k in range(1, model.njoints):
        place, name = model.jointPlacements[k], str(model.names[k])
        turned = pin.Quaternion(place.rotation)
        bodies[k] = body = bodies[model.parents[k]].add_body(
            name=link_name(model, k),
            pos=place.translation,
            quat=[turned.w, turned.x, turned.y, turned.z],
        )
        inertia = model.inertias[k]
        if inertia.mass > 0:
            i = inertia.inertia
            body.mass, body.ipos, body.explicitinertial = inertia.mass, inertia.lever, True
            body.fullinertia = [i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]
        if model.joints[k].nv == 6:
            body.add_freejoint(name=name)
        elif name in own:
            _add_joint(mujoco, body, model, k, own[name])
    for n in numbers:
        drive = spec.add_actuator(name=n.joint, target=n.joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        if n.joint in gains:
            kp, kv = gains[n.joint]
            drive.set_to_position(kp=kp, kv=kv)
        if np.isfinite(n.effort):
            drive.forcerange, drive.forcelimited = [-n.effort, n.effort], True
    try:
        spec.compile()
    except ValueError as error:
        raise LegwattError(f"MuJoCo refuses the machine: {one_line(error)}") from None
    return str(spec.to_xml())


def _add_joint(mujoco: Any, body: Any, model: pin.Model, k: int, n: JointNumbers) -> None:
    """A joint of one degree of freedom, with what its drivetrain comes to."""
    own, data = model.joints[k], model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    column = pin.getJointJacobian(model, data, k, pin.ReferenceFrame.LOCAL)[:, own.idx_v]
    turns = np.linalg.norm(column[3:]) > 0.5
    joint = body.add_joint(
        name=n.joint,
        type=mujoco.mjtJoint.mjJNT_HINGE if turns else mujoco.mjtJoint.mjJNT_SLIDE,
        axis=column[3:] if turns else column[:3],
        frictionloss=n.friction,
        damping=[n.damping, 0, 0],  # over speed, its square and its cube
        armature=n.armature,
        stiffness=[n.stiffness, 0, 0],
        springref=n.rest,
    )
    if own.nq == 1:
        low, high = model.lowerPositionLimit[own.idx_q], model.upperPositionLimit[own.idx_q]
        if np.isfinite([low, high]).all() and low < high and max(-low, high) < 1e6:
            joint.range = [low, high]


def urdf(text: str, numbers: Sequence[JointNumbers], remarks: Sequence[str]) -> str:
    """A URDF with the friction of its joints."""
    builder = ElementTree.TreeBuilder(insert_comments=True)
    root = ElementTree.fromstring(text, ElementTree.XMLParser(target=builder))
    own = {n.joint: n for n in numbers}
    for joint in root.iter("joint"):
        found = own.get(joint.get("name", ""))
        if found is None:
            continue
        dynamics = joint.find("dynamics")
        dynamics = SubElement(joint, "dynamics") if dynamics is None else dynamics
        dynamics.set("friction", f"{found.friction:.9g}")
        dynamics.set("damping", f"{found.damping:.9g}")
    root.insert(0, ElementTree.Comment(_comment(remarks)))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _comment(remarks: Sequence[str]) -> str:
    """Lines as XML takes them in a comment."""
    return "\n" + "\n".join(line.replace("--", "- -") for line in remarks) + "\n"


@dataclass(frozen=True)
class Exported:
    """A file for another tool."""

    text: str  #: Its contents.
    left: tuple[str, ...]  #: What it cannot hold, in words.
    joints: int  #: How many joints it has.
    remarks: tuple[str, ...]  #: What of the files the machine comes from is odd.


def exported(
    model: Path,
    to: str,
    *,
    robot: Path | None = None,
    actuators: Path | None = None,
    mapping: Path | None = None,
) -> Exported:
    """Write the machine of a model file, with what was found on it, as one of the kinds of `LEFT`.

    `robot`: in place of the model file's. `actuators`: folder; the robot file's or the project's by
    default. `mapping`: mapping file whose ``[pd_gains]`` are the servos' gains.

    Raises:
        LegwattError: The model file or mapping cannot be used. The robot cannot be used, or MuJoCo
            is not there. The actuator cannot be used.
    """
    if to not in LEFT:
        raise LegwattError(f"'{one_line(to)}' is none of the formats; {closest(to, [*LEFT])}")
    file = read_model_file(model, actuators, robot)
    bare = base_model(file, actuators)
    machine = apply_edits(bare, file.edits)
    numbers = tuple(_numbers(machine, a) for a in machine.actuators)
    gains: Gains = {}
    if mapping is not None:
        pd = load_mapping(mapping).pd_gains
        if pd is None:
            raise LegwattError(f"{one_line(mapping.name)}: has no [pd_gains]")
        try:
            gains = pd.by_joint(machine.joints)
        except ValueError as error:
            raise LegwattError(f"{one_line(mapping.name)}: {error}") from None
    left = (*left_out(machine, numbers), *LEFT[to])
    found = [
        f"{e.effect} at {place_text(e.place)}: "
        + ", ".join(f"{p.name} {p.value:.6g} {p.unit}" for p in e.parameters)
        for e in file.edits
    ]
    head = f"{machine.name} with what gap found ({one_line(model.name)}):"
    remarks = [head, *(found or ["nothing"]), "Not carried over:", *left]
    if to == "mjcf":
        return Exported(mjcf(machine, numbers, remarks, gains), left, len(numbers), file.changed)
    own = file.robot.suffix.lower() == ".urdf"
    source = read_urdf(file.robot) if own else load_robot(load_robot_file(file.robot)).urdf
    text = urdf(corrected_urdf(source, str(file.robot), bare, file.edits), numbers, remarks)
    return Exported(text, left, len(numbers), file.changed)


#: Speed to which friction is asked where a joint has no limit [rad/s].
USUAL_SPEED: Final = 10.0
#: Slowest speed that is asked, over the largest.
_SLOWEST: Final = 0.01
_SPEEDS: Final = 100
#: Share of a law, and a torque [N*m], below which a remainder is rounding.
_ROUNDING: Final = 1e-6


@dataclass(frozen=True)
class JointNumbers:
    """What a joint's drivetrain comes to at the joint's side."""

    joint: str  #: Its name.
    friction: float  #: Dry friction [N*m].
    damping: float  #: Viscous friction [N*m*s/rad].
    armature: float  #: Inertia of rotor and gears [kg*m^2].
    stiffness: float  #: Of a spring beside the drive [N*m/rad].
    rest: float  #: Where that spring gives no torque [rad].
    effort: float  #: The joint's limit [N*m]; infinite for none.
    left: tuple[str, ...]  #: What these numbers leave out, in words.


def _numbers(machine: MachineModel, a: JointModel) -> JointNumbers:
    joint = machine.rigid.joints[machine.rigid.getJointId(a.name)]
    speed = float(machine.rigid.velocityLimit[joint.idx_v])
    speed = speed if 0.0 < speed < 1e3 else USUAL_SPEED
    v = np.linspace(_SLOWEST * speed, speed, _SPEEDS)
    forth, back = _torque(a, v), -_torque(a, -v)
    even = 0.5 * (forth + back)
    design = np.stack([np.ones_like(v), v], axis=1)
    c, d = np.linalg.lstsq(design, even, rcond=None)[0]
    if c < 0.0 or d < 0.0:  # the tools refuse them
        c, d = (0.0, max(float(v @ even / (v @ v)), 0.0)) if c < 0.0 else (float(even.mean()), 0.0)
    left = []
    missed = float(np.abs(even - c - d * v).max())
    if missed > _ROUNDING * max(1.0, float(np.abs(even).max())):
        left.append(
            f"friction bends with speed: up to {missed:.3g} N*m off below {speed:.3g} rad/s"
        )
    skew = float(np.abs(forth - back).max())
    if skew > _ROUNDING:
        left.append(f"friction differs by direction, by up to {skew:.3g} N*m")
    armature = float(_torque(a, v[-1:], acceleration=1.0)[0] - forth[-1])
    load = max(1.0, float(even.max()))
    rubbed = _torque(a, v[-1:], load=load)[0] - load - forth[-1]
    if abs(rubbed) > _ROUNDING:
        left.append(f"friction grows with load, by {rubbed / load:.3g} of it")
    stiffness, rest, odd = _spring(machine, a)
    limit = float(machine.rigid.effortLimit[joint.idx_v])
    left += odd
    if a.compliance:
        left.append(f"elasticity of the transmission, {1.0 / a.compliance:.4g} N*m/rad")
    if a.backlash:
        left.append(f"backlash of {a.backlash:.3g} rad")
    if a.coupled_to:
        left.append(f"its motor turns with {a.coupled_to}, too ({a.coupling:.4g} of it)")
    if a.heating is not None:
        left.append("warming of the motor")
    if a.warming is not None:
        left.append("friction that falls as it warms")
    if a.motor is not None:
        left.append("the motor's current, voltage and power")
    return JointNumbers(
        joint=a.name,
        friction=float(c),
        damping=float(d),
        armature=armature,
        stiffness=stiffness,
        rest=rest,
        effort=limit if 0.0 < limit < 1e6 else np.inf,
        left=tuple(left),
    )


def _torque(a: JointModel, v: Array, *, acceleration: float = 0.0, load: float = 0.0) -> Array:
    """What the motor gives at the joint side along steady speeds (N,) [rad/s], (N,) [N*m]."""
    side = ShaftSeries(
        joints=(a.name,),
        time=np.arange(v.size, dtype=np.float64),
        position=np.zeros((v.size, 1)),
        velocity=v[:, None],
        acceleration=np.full((v.size, 1), acceleration),
        torque=np.full((v.size, 1), load),
        direction=np.sign(v)[:, None],
    )
    whole = replace(a, coupled_to="")  # own bearings, too, where the motor turns with another joint
    return np.asarray(whole.at_motor(side).torque[:, 0] * a.ratio)


def _spring(machine: MachineModel, a: JointModel) -> tuple[float, float, tuple[str, ...]]:
    """Stiffness and rest of what depends on the position, and what that leaves out."""
    if not a.position_torques:
        return 0.0, 0.0, ()
    q = np.linspace(-np.pi, np.pi, 361)
    torque = a.drive_load(q, np.zeros_like(q))
    k, preload = np.polyfit(q, torque, 1)
    missed = float(np.abs(torque - k * q - preload).max())
    left = (f"ripple of up to {missed:.3g} N*m over the angle",) if missed > _ROUNDING else ()
    # Without a slope there is no spring, however far its rest would lie.
    if abs(k) < _ROUNDING:
        return 0.0, 0.0, (*left, f"a constant torque of {preload:.3g} N*m") if preload else left
    return float(k), float(-preload / k), left


def left_out(machine: MachineModel, numbers: Sequence[JointNumbers]) -> list[str]:
    """What the numbers of all joints leave out, joints with the same words together."""
    by: dict[str, list[str]] = {}
    for joint in numbers:
        for words in joint.left:
            by.setdefault(words, []).append(joint.joint)
    every = len(numbers)
    out = [
        f"{'all joints' if len(joints) == every > 1 else ', '.join(joints)}: {words}"
        for words, joints in by.items()
    ]
    sensors = [
        a.name
        for a in machine.actuators
        if a.encoder_offset or a.effort_offset or a.delay or a.gains
    ]
    if sensors:
        out.append(f"{', '.join(sensors)}: zeros, gains and delays are the sensors'")
    if machine.bodies.squeeze:
        out.append(f"feet that squeeze the ground, {machine.bodies.squeeze:.3g} N")
    return out
