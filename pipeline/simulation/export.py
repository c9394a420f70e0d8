"""A machine as other tools read it: MJCF of MuJoCo, or its URDF put right.

A joint's drivetrain in the few numbers that other tools have for it, and what these leave out. The
laws of the drivetrain are asked along speeds from slow to fast, without load: of what it takes,

    f(v) = c sign(v) + d v + rest,

`c` (dry friction) and `d` (viscous friction) are carried over, in least squares without negative
ones; what `rest` comes to is reported, as are load, elasticity and everything else that these tools
have no number for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Comment, SubElement

import numpy as np
from scipy.optimize import nnls

from actuators.arrays import Array
from actuators.chain import Chain
from actuators.errors import LegwattError, known, one_line
from actuators.shaft import ShaftSeries
from pipeline.effects.base import place_text
from pipeline.logs.mapping import load_mapping
from pipeline.machine.machine import MachineModel
from pipeline.simulation.found_bodies import corrected_urdf, urdf_elements, urdf_text
from pipeline.simulation.machine import read_machine
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
#: Speed to which friction is asked where a joint has no limit [rad/s].
USUAL_SPEED: Final = 10.0
#: Share of a law, and a torque [N*m], below which a remainder is rounding.
_ROUNDING: Final = 1e-6


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
    known("none of the formats is", to, LEFT)
    loaded = read_machine(robot, model=model, actuators=actuators, tolerant=True)
    file = loaded.stated_file if loaded.model_file is None else loaded.model_file
    machine = replace(loaded, alternative=file.alternative, before=loaded)
    edited = machine.model
    each = {a.name: joint_numbers(edited, a) for a in edited.actuators}
    numbers = {joint: own for joint, (own, _) in each.items()}
    gains: Gains = {}
    if mapping is not None:
        pd = load_mapping(mapping).pd_gains
        try:
            gains = pd.by_joint(edited.joints) if pd is not None else {}
        except ValueError as error:
            raise LegwattError(f"{one_line(mapping.name)}: {error}") from None
        if pd is None:
            raise LegwattError(f"{one_line(mapping.name)}: has no [pd_gains]")
    left = (*left_out(edited, {joint: words for joint, (_, words) in each.items()}), *LEFT[to])
    found = [
        f"{e.effect} at {place_text(e.place)}: "
        + ", ".join(f"{p.name} {p.value:.6g} {p.unit}" for p in e.parameters)
        for e in file.edits
    ]
    head = f"{edited.name} with what gap found ({one_line(model.name)}):"
    lines = [head, *(found or ["nothing"]), "Not carried over:", *left]
    comment = "\n" + "\n".join(line.replace("--", "- -") for line in lines) + "\n"
    source = (machine.urdf, str(machine.path), machine.bare_model, file.edits)
    text = corrected_urdf(*source, merged=to == "mjcf")
    text = urdf(text, numbers, comment)
    if to == "mjcf":
        text = mjcf(edited, text, numbers, comment, gains)
    return Exported(text, left, len(numbers), file.changed)


#: Of a joint at its own side: dry `friction` [N*m], `damping` [N*m*s/rad], `armature` (inertia of
#: rotor and gears) [kg*m^2], `stiffness` [N*m/rad] and `rest` [rad] of a spring beside the drive,
#: its limit `effort` [N*m], infinite for none.
Numbers = dict[str, float]


def joint_numbers(machine: MachineModel, a: Chain) -> tuple[Numbers, list[str]]:
    """What a joint's drivetrain comes to, and what that leaves out, in words."""
    joint = machine.rigid.joints[machine.rigid.getJointId(a.name)]
    limit, speed = (
        float(x[joint.idx_v]) for x in (machine.rigid.effortLimit, machine.rigid.velocityLimit)
    )
    speed = speed if 0.0 < speed < 1e3 else USUAL_SPEED
    v = np.linspace(0.01 * speed, speed, 100)
    forth, back = _torque(a, v), -_torque(a, -v)
    even = 0.5 * (forth + back)
    (c, d), _ = nnls(np.stack([np.ones_like(v), v], axis=1), even)
    missed = float(max(np.abs(side - c - d * v).max() for side in (forth, back)))
    armature = float(_torque(a, v[-1:], acceleration=1.0)[0] - forth[-1])
    load = max(1.0, float(even.max()))
    rubbed = float(_torque(a, v[-1:], load=load)[0] - load - forth[-1])
    q = np.linspace(-np.pi, np.pi, 361)
    beside = a.drive_load(q, np.zeros_like(q))
    k, preload = np.polyfit(q, beside, 1)
    if abs(k) < _ROUNDING:  # without a slope there is no spring, however far its rest would lie
        k, preload = 0.0, 0.0
    ripple = float(np.abs(beside - k * q - preload).max())
    bent = missed > _ROUNDING * max(1.0, float(even.max()))
    turns = f"its motor turns with {a.coupled_to}, too ({a.coupling:.4g} of it)"
    sensors = a.encoder_offset or a.effort_offset or a.delay or a.gains
    words = {
        f"friction bends with speed or direction, by up to {missed:.3g} N*m": bent,
        f"friction grows with load, by {rubbed / load:.3g} of it": abs(rubbed) > _ROUNDING,
        f"torque of up to {ripple:.3g} N*m over the angle": ripple > _ROUNDING,
        f"elasticity of the transmission, {a.compliance:.4g} rad/(N*m)": a.compliance,
        f"backlash of {a.backlash:.3g} rad": a.backlash,
        turns: a.coupled_to,
        "warming of the motor": a.heating,
        "friction that falls as it warms": a.warming,
        "the motor's current, voltage and power": a.motor,
        "zeros, gains and delays of its sensors": sensors,
    }
    numbers = {
        **{"friction": float(c), "damping": float(d), "armature": armature},
        **{"stiffness": float(k), "rest": float(-preload / k) if k else 0.0},
        "effort": limit if 0.0 < limit < 1e6 else np.inf,
    }
    return numbers, [text for text, applies in words.items() if applies]


def _torque(a: Chain, v: Array, *, acceleration: float = 0.0, load: float = 0.0) -> Array:
    """What the motor gives at the joint side along steady speeds (N,) [rad/s], (N,) [N*m]."""
    column = np.ones((v.size, 1))
    side = ShaftSeries(
        joints=(a.name,),
        time=np.arange(v.size, dtype=np.float64),
        position=0.0 * column,
        velocity=v[:, None],
        acceleration=acceleration * column,
        torque=load * column,
        direction=np.sign(v)[:, None],
    )
    whole = replace(a, coupled_to="")  # own bearings, too, where the motor turns with another joint
    return np.asarray(whole.at_motor(side).torque[:, 0] * a.ratio)


def left_out(machine: MachineModel, left: Mapping[str, Sequence[str]]) -> list[str]:
    """What is left out at each joint, joints with the same words together."""
    by: dict[str, list[str]] = {}
    for joint, text in ((joint, text) for joint, words in left.items() for text in words):
        by.setdefault(text, []).append(joint)
    whole = {text: len(joints) == len(left) > 1 for text, joints in by.items()}
    out = [f"{'all joints' if whole[t] else ', '.join(joints)}: {t}" for t, joints in by.items()]
    if machine.bodies.squeeze:
        out.append(f"feet that squeeze the ground, {machine.bodies.squeeze:.3g} N")
    return out


def mjcf(
    machine: MachineModel, text: str, numbers: Mapping[str, Numbers], comment: str, gains: Gains
) -> str:
    """A MuJoCo model: its URDF's bodies and joints, driven by torque without a gain.

    MuJoCo writes numbers with six digits. `text`: of the URDF with friction and bodies in it.

    Raises:
        LegwattError: MuJoCo is not installed, or refuses a body.
    """
    try:
        import mujoco
    except ImportError as error:
        raise LegwattError(
            f"MJCF is written by the package mujoco, which cannot be loaded ({one_line(error)}); "
            "install it (`pip install mujoco`), or write a URDF"
        ) from None
    root = urdf_elements(text)
    for link in root.iter("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            link.remove(shape)
    SubElement(SubElement(root, "mujoco"), "compiler", fusestatic="false")
    try:
        spec = mujoco.MjSpec.from_string(urdf_text(root))
        spec.modelname, spec.comment = machine.name, comment
        spec.option.gravity = changed_model(machine.rigid, machine.bodies).gravity.linear
        if machine.floating:
            spec.worldbody.first_body().add_freejoint(name="root_joint")
        for name, own in numbers.items():
            joint = spec.joint(name)
            joint.armature, joint.springref = own["armature"], own["rest"]
            joint.stiffness = [own["stiffness"], 0, 0]
            drive = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            if name in gains:
                kp, kv = gains[name]
                drive.set_to_position(kp=kp, kv=kv)
            if np.isfinite(own["effort"]):
                drive.forcerange, drive.forcelimited = [-own["effort"], own["effort"]], True
        spec.compile()
    except ValueError as error:
        raise LegwattError(f"MuJoCo refuses the machine: {one_line(error)}") from None
    return str(spec.to_xml())


def urdf(text: str, numbers: Mapping[str, Numbers], comment: str) -> str:
    """A URDF with the friction of its joints."""
    root = urdf_elements(text)
    for joint in root.iter("joint"):
        own = numbers.get(joint.get("name", ""))
        if own is not None:
            dynamics = joint.find("dynamics")
            dynamics = SubElement(joint, "dynamics") if dynamics is None else dynamics
            for name in ("friction", "damping"):
                dynamics.set(name, f"{own[name]:.9g}")
    root.insert(0, Comment(comment))
    return urdf_text(root)
