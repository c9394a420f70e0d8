"""Inverse dynamics by MuJoCo, which shares no code with Pinocchio, from the same URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.dynamics.contact_forces import ContactForces
from pipeline.motion.motion import Segment
from pipeline.robot.robot import Robot

Array = np.ndarray
_FREE = "base_free"


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
    impossible = _put_aside(root)
    spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
    spec.body(robot.spec.base_link).add_freejoint(name=_FREE)
    model = spec.compile()
    for link, inertia in impossible.items():
        moments, axes = np.linalg.eigh(inertia)
        axes[:, 0] *= np.linalg.det(axes)  # a rotation, not a reflection
        body = model.body(link)
        body.inertia[:] = moments
        model.body_sameframe[body.id] = 0  # the compiler took its axes for the link's
        mujoco.mju_mat2Quat(body.iquat, np.ascontiguousarray(axes).ravel())
    model.dof_damping[:] = model.dof_armature[:] = model.dof_frictionloss[:] = 0.0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    model.opt.gravity[:] = robot.model.gravity.linear
    return model


def _put_aside(root: ET.Element) -> dict[str, Array]:
    """Inertias that no body has alone, which MuJoCo refuses, in the link's axes.

    A camera that is part of a heavier body may have one. In the text others take their place.
    """
    found = {}
    for link in root.findall("link"):
        inertial = link.find("inertial")
        inertia = None if inertial is None else inertial.find("inertia")
        if inertial is None or inertia is None:
            continue
        xx, yy, zz, xy, xz, yz = (
            float(inertia.get(key, "0")) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        )
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        moments = np.linalg.eigvalsh(matrix)
        if moments[0] + moments[1] >= moments[2]:
            continue
        origin = inertial.find("origin")
        angles = "0 0 0" if origin is None else origin.get("rpy", "0 0 0")
        turn = Rotation.from_euler("xyz", [float(a) for a in angles.split()]).as_matrix()
        found[str(link.get("name"))] = turn @ matrix @ turn.T
        inertia.attrib = {"ixx": "1", "iyy": "1", "izz": "1", "ixy": "0", "ixz": "0", "iyz": "0"}
    return found


def joint_torque(robot: Robot, segment: Segment, ground: ContactForces) -> tuple[Array, Array]:
    """Torque that a motion with given ground forces asks of the joints, and of the base.

    Args:
        robot: The robot.
        segment: The motion, in Pinocchio's coordinates.
        ground: Forces of the ground, of which the world's components count.

    Returns:
        Joint torques in the order of `robot.joints`, shape (N, J) [N*m], and what is left over on
        the base, shape (N, 6) [N, N*m]: nothing, where the ground carries the robot.
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
