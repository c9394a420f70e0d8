"""A MuJoCo model of a machine: bodies, joints with friction and inertia, actuators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from pipeline.machine.machine import MachineModel, link_name
from pipeline.simulation.export.joints import JointNumbers, bodies_of

#: What a MuJoCo model of this export has none of.
LEFT: Final = ("meshes, collisions and contacts: bodies and joints alone are written",)


def mjcf(
    machine: MachineModel,
    numbers: Sequence[JointNumbers],
    remarks: Sequence[str],
    gains: Mapping[str, tuple[float, float]] | None = None,
) -> str:
    """Write a machine as MJCF, with remarks at its top.

    `gains`: joint to stiffness [N*m/rad] and damping [N*m*s/rad] of its servo; a joint without is
    driven by torque.
    """
    model = bodies_of(machine)
    root = ElementTree.Element("mujoco", model=machine.name)
    root.append(
        ElementTree.Comment("\n" + "\n".join(r.replace("--", "- -") for r in remarks) + "\n")
    )
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    ElementTree.SubElement(root, "option", gravity=_text(model.gravity.linear))
    world = ElementTree.SubElement(root, "worldbody")
    joints = {n.joint: n for n in numbers}
    bodies: dict[int, ElementTree.Element] = {0: world}
    for k in range(1, model.njoints):
        parent = bodies[model.parents[k]]
        bodies[k] = _body(parent, model, k, joints.get(str(model.names[k])))
    actuators = ElementTree.SubElement(root, "actuator")
    for n in numbers:
        limits = {"forcerange": _text([-n.effort, n.effort])} if np.isfinite(n.effort) else {}
        common = {"name": n.joint, "joint": n.joint, **limits}
        if gains and n.joint in gains:
            kp, kv = gains[n.joint]
            own = {"kp": f"{kp:.9g}", "kv": f"{kv:.9g}"}
            ElementTree.SubElement(actuators, "position", common | own)
        else:
            ElementTree.SubElement(actuators, "motor", common)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _body(
    parent: ElementTree.Element, model: pin.Model, k: int, numbers: JointNumbers | None
) -> ElementTree.Element:
    """A body with its joint, in the frame of that joint."""
    place, inertia, joint = model.jointPlacements[k], model.inertias[k], model.joints[k]
    quaternion = pin.Quaternion(place.rotation)
    body = ElementTree.SubElement(
        parent,
        "body",
        name=link_name(model, k),
        pos=_text(place.translation),
        quat=_text([quaternion.w, quaternion.x, quaternion.y, quaternion.z]),
    )
    name = str(model.names[k])
    if joint.nv == 6:
        ElementTree.SubElement(body, "freejoint", name=name)
    elif numbers is not None:
        _joint(body, model, k, numbers)
    if inertia.mass > 0:
        i = inertia.inertia
        ElementTree.SubElement(
            body,
            "inertial",
            mass=f"{inertia.mass:.12g}",
            pos=_text(inertia.lever),
            fullinertia=_text([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]]),
        )
    return body


def _joint(body: ElementTree.Element, model: pin.Model, k: int, n: JointNumbers) -> None:
    joint = model.joints[k]
    data = model.createData()
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
    kind = "hinge" if turns else "slide"
    axis = _text(column[3:] if turns else column[:3])
    ElementTree.SubElement(body, "joint", {"name": n.joint, "type": kind, "axis": axis} | given)


def _text(numbers: Array | Sequence[float]) -> str:
    return " ".join(f"{float(x) + 0.0:.12g}" for x in numbers)
