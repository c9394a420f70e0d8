"""The Pinocchio model of a machine in the form in which regression takes it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from pipeline.identification.whole.errors import NotWholeError
from pipeline.machine.machine import MachineModel
from pipeline.simulation.rigid_bodies import changed_model


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
        out.appendBodyToJoint(own, rigid.inertias[k], pin.SE3.Identity())
    return out
