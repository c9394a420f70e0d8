"""The Pinocchio model of a machine in the form in which regression takes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.identification.whole.errors import NotWholeError
from pipeline.logs.reading.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.rigid_bodies import changed_model

Array = NDArray[np.float64]
#: Relative difference that comes of turning and adding alone.
ROUNDING = 1e-9


def rigid_model(model: MachineModel) -> pin.Model:
    """Bodies of a machine on a fixed base, one coordinate per joint.

    Raises:
        NotWholeError: The base floats, or a joint is no column of the log.
    """
    if model.floating:
        raise NotWholeError("its base floats, and what the ground gives is no torque of a joint")
    rigid = changed_model(model.rigid, model.bodies)
    for k in range(1, rigid.njoints):
        if str(rigid.names[k]) not in model.joints:
            raise NotWholeError(f"joint '{rigid.names[k]}' is no column of the log")
    if any(rigid.joints[k].nq != 1 for k in range(1, rigid.njoints)):
        rigid = _turning(rigid)
    return rigid


def still_joints(model: MachineModel, logs: Sequence[Log]) -> dict[str, float]:
    """Joints whose effort no log tells and which stand still, to where they stand [rad, m].

    Raises:
        NotWholeError: One of them moves, or stands elsewhere in another log.
    """
    out = {}
    for k, name in enumerate(model.joints):
        if any(np.isfinite(log.effort.values[:, k]).any() for log in logs):
            continue
        q = np.concatenate([log.position[:, k] for log in logs])
        q = q[np.isfinite(q)]
        if q.size and float(np.ptp(q)) > 0.0:
            raise NotWholeError(f"joint '{name}' moves, and no log tells its effort")
        out[name] = float(q[0]) if q.size else 0.0
    return out


def held(rigid: pin.Model, still: Mapping[str, float]) -> tuple[pin.Model, dict[str, Array]]:
    """A model whose still joints are fixed, and what hangs on its other joints by them.

    Args:
        rigid: One coordinate per joint.
        still: Joint to where it stands [rad, m].

    Returns:
        The model, and the ten inertial parameters of held bodies, in the frame of the joint that
        carries them, by that joint.
    """
    if not still:
        return rigid, {}
    q = pin.neutral(rigid)
    for name, angle in still.items():
        q[rigid.joints[rigid.getJointId(name)].idx_q] = angle
    reduced = pin.buildReducedModel(rigid, [rigid.getJointId(n) for n in still], q)
    carried = {}
    for k in range(1, reduced.njoints):
        name = str(reduced.names[k])
        own = rigid.inertias[rigid.getJointId(name)].toDynamicParameters()
        more = reduced.inertias[k].toDynamicParameters() - own
        if np.abs(more).max() > ROUNDING * np.abs(own).max():
            carried[name] = more
    return reduced, carried


def _turning(rigid: pin.Model) -> pin.Model:
    """The same with angles in place of cosines and sines of joints without limits."""
    out, data = pin.Model(), rigid.createData()
    out.gravity = rigid.gravity
    pin.forwardKinematics(rigid, data, pin.neutral(rigid))
    for k in range(1, rigid.njoints):
        joint = rigid.joints[k]
        if joint.nq == 2 and joint.nv == 1:
            joint = pin.JointModelRevoluteUnaligned(np.asarray(data.joints[k].S)[3:])
        own = out.addJoint(
            int(rigid.parents[k]), joint, rigid.jointPlacements[k], str(rigid.names[k])
        )
        out.addJointFrame(own)  # reduction of a model without frames reads past their end
        out.appendBodyToJoint(own, rigid.inertias[k], pin.SE3.Identity())
    return out
