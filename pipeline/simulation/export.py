"""A machine as found, for other tools: its bodies by link, its URDF put right, MJCF of MuJoCo.

Of bodies mass m and centre of mass c are told. Ends of their 95 % intervals: every parameter of the
edits by itself at the ends of its own interval, what it moves added up as squares.

A joint's drivetrain in the few numbers that other tools have for it, and what these leave out. The
laws of the drivetrain are asked along speeds from slow to fast, without load: of what it takes,

    f(v) = c sign(v) + d v + rest,

`c` (dry friction) and `d` (viscous friction) are carried over, in least squares without negative
ones. What has no number in these tools is told: effects of the model file, and laws of drives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree
from xml.etree.ElementTree import Comment, Element, SubElement

import numpy as np
import pinocchio as pin
from scipy.optimize import nnls

from actuators.arrays import Array
from actuators.chain import Chain
from actuators.errors import LegwattError, known, one_line
from actuators.shaft import ShaftSeries
from pipeline.columns import frame
from pipeline.effects.base import Values, effect_named, place_text
from pipeline.effects.model_file import Edit, apply_edits
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot import link_name
from pipeline.robot.urdf import INERTIA_KEYS, parse_elements, parse_urdf
from pipeline.simulation.machine import read_machine

if TYPE_CHECKING:
    from pandas import DataFrame

#: Relative difference that comes of turning and adding alone.
ROUNDING: Final = 1e-9
_NAMES: Final = np.array(["mass", "x", "y", "z"])
#: Comment beside what was replaced.
FOUND: Final = "as found in a log, see model.toml"


def of_bodies(edits: Sequence[Edit]) -> list[Edit]:
    """The edits that a URDF's inertial elements can carry."""
    return [edit for edit in edits if effect_named(edit.effect).place_kind == "link"]


def found_bodies(bare: MachineModel, edits: Sequence[Edit]) -> DataFrame:
    """Every body that edits change: those that differ first, then by the change of mass.

    `bare`: the machine before the edits.
    """
    rigid = bare.rigid
    rows: list[tuple[Any, ...]] = []
    own = of_bodies(edits)
    for joint in dict.fromkeys(bare.carrier(edit.place[0]) for edit in own):
        k = rigid.getJointId(joint)
        here = [edit for edit in own if bare.carrier(edit.place[0]) == joint]
        body = rigid.inertias[k]
        urdf = np.array([body.mass, *body.lever])
        found, low, high = spread(body, here)
        if low[0] <= 0.0:  # of what may weigh nothing the centre may lie anywhere
            low[1:], high[1:] = -np.inf, np.inf
        slack = ROUNDING * np.maximum(np.abs(urdf), np.abs(found))
        apart = (urdf < low - slack) | (urdf > high + slack)
        numbers = np.stack([urdf, found, low, high], axis=1).ravel().tolist()
        cells = (x if np.isfinite(x) else None for x in numbers)
        rows.append((link_name(rigid, k), *cells, "+".join(_NAMES[apart])))
    rows.sort(key=lambda row: (not row[-1], -abs(row[2] - row[1])))
    return frame("bodies", rows)


def spread(
    body: pin.Inertia, edits: Sequence[Edit], *, moment: bool = False
) -> tuple[Array, Array, Array]:
    """What edits make of a body, and the ends of its 95 % intervals.

    Returns:
        Mass [kg] and centre of mass [m], or first moment [kg*m] where asked, each (4,).
    """

    def after(values: Sequence[Values]) -> Array:
        four = _after(body, values)
        return four if moment else np.array([four[0], *_centre(four[0], four[1:])])

    best = [edit.values for edit in edits]
    found, down, up = after(best), np.zeros(4), np.zeros(4)
    for n, edit in enumerate(edits):
        for p in edit.parameters:
            values = ([*best[:n], best[n] | {p.name: x}, *best[n + 1 :]] for x in p.interval)
            moved = np.array([after(each) - found for each in values])
            down, up = np.hypot(down, moved.min(axis=0)), np.hypot(up, moved.max(axis=0))
    return found, found - down, found + up


def _after(body: pin.Inertia, edits: Sequence[Values]) -> Array:
    """Mass and first moment, (4,), of a body after edits with these values."""
    mass, moment = body.mass, body.mass * body.lever
    for p in edits:
        if "mx" in p:  # of the whole body
            mass, moment = p["mass"], np.array([p[name] for name in ("mx", "my", "mz")])
        elif "mass" not in p:  # the centre of mass displaced
            moment = moment + mass * np.array([p[axis] for axis in "xyz"])
        else:  # a point mass, at the centre of mass where no place is stated
            stated = np.array([p.get(axis, 0.0) for axis in "xyz"])
            place = _centre(mass, moment) if len(p) == 1 else stated
            mass, moment = mass + p["mass"], moment + p["mass"] * place
    return np.array([mass, *moment])


def _centre(mass: float, moment: Array) -> Array:
    return moment / mass if mass > 0 else np.zeros(3)


def corrected_urdf(
    text: str, where: str, bare: MachineModel, edits: Sequence[Edit], *, merged: bool = False
) -> str:
    """The text of a URDF, read from a file `where`, with the inertial elements that were found.

    Of links that are fixed to each other a motion determines the sum: the link that the joint
    carries gets all of it, and those fixed to it have no inertial element any more.

    `bare`: the machine before the edits. `merged`: also bodies that no edit changes.
    """
    own = of_bodies(edits)
    parsed = parse_urdf(text, where, floating=bare.robot.floating)
    old, new = bare.rigid, apply_edits(bare, own).rigid
    root = parse_elements(text, where)
    elements = {element.get("name"): element for element in root.iter("link")}
    changed = dict.fromkeys(bare.carrier(edit.place[0]) for edit in own)
    for joint in [*parsed.names][1:] if merged else changed:
        k = parsed.getJointId(joint)
        ten, before, after = (
            np.asarray(m.inertias[m.getJointId(joint)].toDynamicParameters())
            for m in (parsed, old, new)
        )
        for one in parsed.frames:
            if one.parentJoint == k and one.type == pin.FrameType.BODY:
                link = elements[str(one.name)]
                for spare in link.findall("inertial"):
                    link.remove(spare)
        # A load that the robot file states is in no URDF.
        body = pin.Inertia.FromDynamicParameters(ten + (after - before))
        if body.mass <= 0.0:
            continue
        inertial = SubElement(elements[link_name(parsed, k)], "inertial")
        inertial.append(ElementTree.Comment(f" {FOUND} "))
        # Digits that read back to the same numbers.
        place = " ".join(map(repr, body.lever.tolist()))
        SubElement(inertial, "origin", xyz=place, rpy="0 0 0")
        SubElement(inertial, "mass", value=repr(float(body.mass)))
        upper = body.inertia[np.triu_indices(3)].tolist()  # in the order of the keys
        moments = dict(zip(INERTIA_KEYS, map(repr, upper), strict=True))
        SubElement(inertial, "inertia", moments)
    return urdf_text(root)


def urdf_text(root: Element) -> str:
    """A URDF's text."""
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


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
    head = f"{edited.name} with what gap found ({one_line(model.name)}), not carried over:"
    lines = [head, *left]
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


def mjcf(machine: MachineModel, root: Element, numbers: Mapping[str, Numbers], comment: str) -> str:
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
