"""A machine as other tools read it: MJCF of MuJoCo, URDF, gains of a ROS 2 controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import closest, one_line
from pipeline.effects.model_file import apply_edits, read_model_file
from pipeline.logs.errors import MappingError, ModelFileError
from pipeline.logs.reading.mapping import load_mapping
from pipeline.machine.machine import MachineModel, link_name
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_source import read_urdf
from pipeline.simulation.export.joints import (
    JointNumbers,
    bodies_of,
    found_text,
    joint_numbers,
    left_out,
)
from pipeline.simulation.files import base_model
from pipeline.simulation.found_bodies import corrected_urdf

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
    "ros2_control": (
        "dry friction: the controller has no term for it; its integral gain stands in, slowly",
        "inertia and bodies: the controller knows no model",
        "springs beside the drive",
    ),
}


def mjcf(
    machine: MachineModel, numbers: Sequence[JointNumbers], remarks: Sequence[str], gains: Gains
) -> str:
    """A MuJoCo model: bodies, joints with friction and inertia, driven by torque without a gain."""
    model = bodies_of(machine)
    root = Element("mujoco", model=machine.name)
    root.append(_comment(remarks))
    SubElement(root, "compiler", angle="radian", autolimits="true")
    SubElement(root, "option", gravity=_text(model.gravity.linear))
    joints = {n.joint: n for n in numbers}
    bodies: dict[int, Element] = {0: SubElement(root, "worldbody")}
    for k in range(1, model.njoints):
        bodies[k] = _body(bodies[model.parents[k]], model, k, joints.get(str(model.names[k])))
    actuators = SubElement(root, "actuator")
    for n in numbers:
        limits = {"forcerange": _text([-n.effort, n.effort])} if np.isfinite(n.effort) else {}
        common = {"name": n.joint, "joint": n.joint, **limits}
        if n.joint in gains:
            kp, kv = gains[n.joint]
            SubElement(actuators, "position", common | {"kp": f"{kp:.9g}", "kv": f"{kv:.9g}"})
        else:
            SubElement(actuators, "motor", common)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _body(parent: Element, model: pin.Model, k: int, numbers: JointNumbers | None) -> Element:
    """A body with its joint, in the frame of that joint."""
    place, inertia, name = model.jointPlacements[k], model.inertias[k], str(model.names[k])
    quaternion = pin.Quaternion(place.rotation)
    turned = _text([quaternion.w, quaternion.x, quaternion.y, quaternion.z])
    at = {"name": link_name(model, k), "pos": _text(place.translation), "quat": turned}
    body = SubElement(parent, "body", at)
    if model.joints[k].nv == 6:
        SubElement(body, "freejoint", name=name)
    elif numbers is not None:
        SubElement(body, "joint", _joint(model, k, numbers))
    if inertia.mass > 0:
        i = inertia.inertia
        SubElement(
            body,
            "inertial",
            mass=f"{inertia.mass:.12g}",
            pos=_text(inertia.lever),
            fullinertia=_text([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]),
        )
    return body


def _joint(model: pin.Model, k: int, n: JointNumbers) -> dict[str, str]:
    """Attributes of a joint of one degree of freedom."""
    joint, data = model.joints[k], model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    column = pin.getJointJacobian(model, data, k, pin.ReferenceFrame.LOCAL)[:, joint.idx_v]
    turns = np.linalg.norm(column[3:]) > 0.5
    numbers = {
        "frictionloss": n.friction,
        "damping": n.damping,
        "armature": n.armature,
        "stiffness": n.stiffness,
        "springref": n.rest,
    }
    given = {key: f"{value:.9g}" for key, value in numbers.items() if value}
    if joint.nq == 1:
        low, high = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        if np.isfinite([low, high]).all() and low < high and max(-low, high) < 1e6:
            given["range"] = _text([low, high])
    kind, axis = ("hinge", column[3:]) if turns else ("slide", column[:3])
    return {"name": n.joint, "type": kind, "axis": _text(axis)} | given


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
    root.insert(0, _comment(remarks))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def ros2_control(numbers: Sequence[JointNumbers], remarks: Sequence[str], gains: Gains) -> str:
    """Parameters of a `joint_trajectory_controller` with an effort interface; no gain is zero.

    It commands, by its documentation, ``ff_velocity_scale v_goal + p e + d de/dt``: viscous
    friction is what the first term makes up for.
    """
    lines = [*(f"# {r}" for r in remarks), "joint_trajectory_controller:", "  ros__parameters:"]
    lines.append("    joints:")
    lines += [f"      - {n.joint}" for n in numbers]
    lines += ["    command_interfaces:", "      - effort", "    state_interfaces:"]
    lines += ["      - position", "      - velocity", "    gains:"]
    for n in numbers:
        kp, kd = gains.get(n.joint, (0.0, 0.0))
        lines += [f"      {n.joint}:", f"        p: {float(kp)!r}", "        i: 0.0"]
        lines += [f"        d: {float(kd)!r}", f"        ff_velocity_scale: {_double(n.damping)}"]
        if np.isfinite(n.effort):
            lines += [f"        u_clamp_max: {_double(n.effort)}"]
            lines += [f"        u_clamp_min: {_double(-n.effort)}"]
    return "\n".join(lines) + "\n"


def _comment(remarks: Sequence[str]) -> Element[Any]:
    return ElementTree.Comment("\n" + "\n".join(r.replace("--", "- -") for r in remarks) + "\n")


def _double(x: float) -> str:
    """A number with its point: ROS 2 refuses a whole one where it expects a double."""
    return repr(float(f"{x:.9g}") + 0.0)


def _text(numbers: Array | Sequence[float]) -> str:
    return " ".join(f"{float(x) + 0.0:.12g}" for x in numbers)


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
        GapError: The model file or mapping cannot be used.
        PipelineError: The robot cannot be used.
        ActuatorError: The actuator cannot be used.
    """
    if to not in LEFT:
        raise ModelFileError(f"'{one_line(to)}' is none of the formats; {closest(to, [*LEFT])}")
    file = read_model_file(model, actuators, robot)
    bare = base_model(file, actuators)
    machine = apply_edits(bare, file.edits)
    numbers = joint_numbers(machine)
    gains = _gains(mapping, machine.joints) if mapping is not None else {}
    left = (*left_out(machine, numbers), *LEFT[to])
    remarks = [
        f"{machine.name} with what gap found ({one_line(model.name)}):",
        *(found_text(file.edits) or ["nothing"]),
        "Not carried over:",
        *left,
    ]
    if to == "mjcf":
        text = mjcf(machine, numbers, remarks, gains)
    elif to == "ros2_control":
        text = ros2_control(numbers, remarks, gains)
    else:
        source = _urdf_of(file.robot)
        found = corrected_urdf(source, str(file.robot), bare, file.edits)
        text = urdf(found, numbers, remarks)
    return Exported(text, left, len(numbers), file.changed)


def _urdf_of(robot: Path) -> str:
    if robot.suffix.lower() == ".urdf":
        return read_urdf(robot)
    return load_robot(load_robot_file(robot)).urdf


def _gains(mapping: Path, joints: tuple[str, ...]) -> Gains:
    pd = load_mapping(mapping).pd_gains
    if pd is None:
        raise MappingError(f"{one_line(mapping.name)}: has no [pd_gains]")
    try:
        return pd.by_joint(joints)
    except ValueError as error:
        raise MappingError(f"{one_line(mapping.name)}: {error}") from None
