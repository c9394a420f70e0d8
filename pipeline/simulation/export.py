"""A machine as other tools read it: MJCF of MuJoCo, or its URDF put right.

A joint's drivetrain in the few numbers that other tools have for it, and what these leave out. The
laws of the drivetrain are asked along speeds from slow to fast, without load: of what it takes,

    f(v) = c sign(v) + d v + rest,

`c` (dry friction) and `d` (viscous friction) are carried over, in least squares without negative
ones. What has no number in these tools is told: effects of the model file, and laws of drives.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Comment, Element, SubElement

import numpy as np
from scipy.optimize import nnls

from actuators.arrays import Array
from actuators.chain import Chain
from actuators.errors import LegwattError, known, one_line
from actuators.shaft import ShaftSeries
from pipeline.effects.base import place_text
from pipeline.machine.machine import MachineModel
from pipeline.robot.urdf_source import parse_elements
from pipeline.simulation.found_bodies import corrected_urdf, of_bodies, urdf_text
from pipeline.simulation.machine import read_machine

_DRIVE: Final = (
    "friction that is not dry and viscous: what bends with speed, grows with load or falls with "
    "warmth; current, voltage and heat of motors; errors of sensors"
)
#: What a file of each kind has none of.
LEFT: Final = {
    "mjcf": (_DRIVE, "meshes, collisions and contacts: bodies and joints alone are written"),
    "urdf": (
        _DRIVE,
        "inertia of rotors: a URDF has no number for it; put it into the simulator's armature",
        "springs beside the drive, and gravity of a tilted stand",
    ),
}
#: Effects whose numbers go along, with those of bodies.
CARRIED: Final = (
    *("coulomb_friction", "viscous_friction", "rotor_inertia"),
    *("parallel_spring", "base_tilt"),
)
#: Speed to which friction is asked where a joint has no limit [rad/s].
USUAL_SPEED: Final = 10.0
#: Stiffness below which a slope is rounding [N*m/rad].
_ROUNDING: Final = 1e-6


def exported(
    model: Path, to: str, *, robot: Path | None = None, actuators: Path | None = None
) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """Write the machine of a model file, with what was found on it, as one of the kinds of `LEFT`.

    `robot`: in place of the model file's. `actuators`: folder; the robot file's or the project's by
    default.

    Returns:
        The text, what it cannot hold, and which files are no longer those of the model file.

    Raises:
        LegwattError: The model file, robot or actuator cannot be used, or MuJoCo is not there.
    """
    known("none of the formats is", to, LEFT)
    loaded = read_machine(robot, model=model, actuators=actuators, tolerant=True)
    file = loaded.stated_file if loaded.model_file is None else loaded.model_file
    machine = replace(loaded, alternative=file.alternative, before=loaded)
    edited = machine.model
    numbers = {a.name: joint_numbers(edited, a) for a in edited.actuators}
    whole = [e for e in file.edits if e.effect not in CARRIED and not of_bodies([e])]
    left = (*(f"{e.effect} at {place_text(e.place)}" for e in whole), *LEFT[to])
    found = [
        f"{e.effect} at {place_text(e.place)}: "
        + ", ".join(f"{p.name} {p.value:.6g} {p.unit}" for p in e.parameters)
        for e in file.edits
    ]
    head = f"{edited.name} with what gap found ({one_line(model.name)}):"
    lines = [head, *(found or ["nothing"]), "Not carried over:", *left]
    comment = "\n" + "\n".join(line.replace("--", "- -") for line in lines) + "\n"
    source = (machine.robot.urdf, str(machine.path), machine.bare_model, file.edits)
    root = parse_elements(corrected_urdf(*source, merged=to == "mjcf"), str(machine.path))
    for joint in root.iter("joint"):
        if one := numbers.get(joint.get("name", "")):
            dynamics = joint.find("dynamics")
            dynamics = SubElement(joint, "dynamics") if dynamics is None else dynamics
            for name in ("friction", "damping"):
                dynamics.set(name, f"{one[name]:.9g}")
    if to == "mjcf":
        return mjcf(edited, root, numbers, comment), left, file.changed
    root.insert(0, Comment(comment))
    return urdf_text(root), left, file.changed


#: Of a joint at its own side: dry `friction` [N*m], `damping` [N*m*s/rad], `armature` (inertia of
#: rotor and gears) [kg*m^2], `stiffness` [N*m/rad] and `rest` [rad] of a spring beside the drive.
Numbers = dict[str, float]


def joint_numbers(machine: MachineModel, a: Chain) -> Numbers:
    """What a joint's drivetrain comes to."""
    joint = machine.rigid.joints[machine.rigid.getJointId(a.name)]
    limit = float(machine.rigid.velocityLimit[joint.idx_v])
    speed = limit if 0.0 < limit < 1e3 else USUAL_SPEED
    v = np.linspace(0.01 * speed, speed, 100)
    taken = 0.5 * (_torque(a, v) - _torque(a, -v))
    (c, d), _ = nnls(np.stack([np.ones_like(v), v], axis=1), taken)
    armature = _torque(a, v[-1:], acceleration=1.0)[0] - _torque(a, v[-1:])[0]
    q = np.linspace(-np.pi, np.pi, 361)
    k, preload = np.polyfit(q, a.drive_load(q, np.zeros_like(q)), 1).tolist()
    sprung = abs(k) > _ROUNDING  # without a slope there is no spring
    spring = {"stiffness": k * sprung, "rest": -preload / k if sprung else 0.0}
    return {"friction": float(c), "damping": float(d), "armature": float(armature), **spring}


def _torque(a: Chain, v: Array, acceleration: float = 0.0) -> Array:
    """What the motor gives at the joint side along steady speeds (N,) [rad/s], (N,) [N*m]."""
    column = np.ones((v.size, 1))
    motion = (0.0 * column, v[:, None], acceleration * column, 0.0 * column)
    time = np.arange(v.size, dtype=np.float64)
    side = ShaftSeries((a.name,), time, *motion, np.sign(v)[:, None])
    whole = replace(a, coupled_to="")  # own bearings, too, where the motor turns with another joint
    return np.asarray(whole.at_motor(side).torque[:, 0] * a.ratio)


def mjcf(
    machine: MachineModel,
    root: Element,
    numbers: Mapping[str, Numbers],
    comment: str,
) -> str:
    """A MuJoCo model: its URDF's bodies and joints, driven by torque without a gain.

    MuJoCo writes numbers with six digits. `root`: of the URDF with friction and bodies in it.
    """
    try:
        import mujoco
    except ImportError as error:
        raise LegwattError(
            f"MJCF is written by the package mujoco, which cannot be loaded ({one_line(error)}); "
            "install it (`pip install mujoco`), or write a URDF"
        ) from None
    for link in root.iter("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            link.remove(shape)
    SubElement(SubElement(root, "mujoco"), "compiler", fusestatic="false")
    try:
        spec = mujoco.MjSpec.from_string(urdf_text(root))
        spec.modelname, spec.comment = machine.name, comment
        spec.option.gravity = machine.rigid.gravity.linear
        if machine.robot.floating:
            spec.worldbody.first_body().add_freejoint(name="root_joint")
        for name, own in numbers.items():
            joint = spec.joint(name)
            joint.armature, joint.springref = own["armature"], own["rest"]
            joint.stiffness = [own["stiffness"], 0, 0]
            spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        spec.compile()
    except ValueError as error:
        raise LegwattError(f"MuJoCo refuses the machine: {one_line(error)}") from None
    return str(spec.to_xml())
