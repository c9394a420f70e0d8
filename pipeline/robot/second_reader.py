"""A URDF as a second, independent reader has it: every link where Pinocchio puts it.

Two parsers that share no code rarely read an axis, an order of angles or a mimic joint wrongly in
the same way.
"""

from __future__ import annotations

import io
from typing import Final

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import one_line
from pipeline.robot.urdf_check import Finding

#: By which two placements may differ: rounding of both readers, in lengths of a metre and radians.
_ALIKE: Final = 1e-6
_POSTURES: Final = 5
Placements = dict[str, Array]


def check_second_reader(urdf: str, where: str) -> Finding:
    """Whether yourdfpy puts every link where Pinocchio does, in postures drawn at random.

    Args:
        urdf: The URDF's text.
        where: Its file, for the finding.
    """
    name = "read alike by a second reader"
    draw = np.random.default_rng(0)
    try:
        for _ in range(_POSTURES):
            turn = draw.uniform(-1.0, 1.0, 1000)
            own, other = placed_by_pinocchio(urdf, turn), placed_by_yourdfpy(urdf, turn)
            for link in own.keys() & other.keys():
                if np.abs(own[link] - other[link]).max() > _ALIKE:
                    detail = f"link '{link}' lies elsewhere for Pinocchio than for yourdfpy"
                    return Finding(where, name, False, detail)
    except Exception as error:  # of a library that reads what another one refused to
        detail = f"one of the two cannot read it ({one_line(error)[:80]})"
        return Finding(where, name, True, detail, note=True)
    return Finding(where, name, True, f"{len(own)} links in {_POSTURES} postures")


def placed_by_pinocchio(urdf: str, turn: Array) -> Placements:
    """Placement of every link in the root's frame, homogeneous (4, 4) [m].

    `turn`: position of each joint that moves, in alphabetical order of their names [rad, m].
    """
    model = pin.buildModelFromXML(urdf)
    data, velocity = model.createData(), np.zeros(model.nv)
    names = sorted(model.names[1:])
    for joint, angle in zip(names, turn, strict=False):
        velocity[model.joints[model.getJointId(joint)].idx_v] = angle
    pin.framesForwardKinematics(model, data, pin.integrate(model, pin.neutral(model), velocity))
    frames = ((f.name, k) for k, f in enumerate(model.frames) if f.type == pin.FrameType.BODY)
    return {name: data.oMf[k].homogeneous for name, k in frames}


def placed_by_yourdfpy(urdf: str, turn: Array) -> Placements:
    """The same, as yourdfpy reads it; mimic joints are set like any other."""
    import yourdfpy

    robot = yourdfpy.URDF.load(
        io.BytesIO(urdf.encode()), build_scene_graph=False, load_meshes=False
    ).robot
    moving = sorted(joint.name for joint in robot.joints if joint.type != "fixed")
    angle = dict(zip(moving, turn.tolist(), strict=False))
    into = {joint.child: joint for joint in robot.joints}

    def placed(link: str) -> Array:
        if link not in into:
            return np.eye(4)
        joint = into[link]
        origin = np.eye(4) if joint.origin is None else np.asarray(joint.origin)
        axis = np.array([1.0, 0.0, 0.0]) if joint.axis is None else np.asarray(joint.axis)
        moved, q = np.eye(4), angle.get(joint.name, 0.0)
        if joint.type == "prismatic":
            moved[:3, 3] = q * axis
        elif joint.type in ("revolute", "continuous"):
            moved[:3, :3] = pin.exp3(q * axis)
        return np.asarray(placed(joint.parent) @ origin @ moved)

    return {link.name: placed(link.name) for link in robot.links}
