"""Columns of the residual: what a change of the model by one unit adds to the equations of motion.

Bodies are Pinocchio's joint torque regressor; what acts at joints stands on their own rows.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from actuators.arrays import Array, Index
from pipeline.dynamics.residual import EquationsOfMotion


def body_columns(equations: EquationsOfMotion) -> Array:
    """Ten inertial parameters of every body in Pinocchio's order, shape (N, nv, 10 B)."""
    model = equations.model
    data = model.createData()
    out = np.empty((len(equations.torque), model.nv, 10 * (model.njoints - 1)))
    for k, (q, v, a) in enumerate(zip(*equations.motion, strict=True)):
        out[k] = pin.computeJointTorqueRegressor(model, data, q, v, a)
    return out


def at_joints(column: Array, joints: Index, nv: int) -> Array:
    """Columns (N, J) of joints on their own rows, shape (N, nv, J).

    `joints`: rows of the joints among the model's velocities, shape (J,).
    """
    n, count = column.shape
    out = np.zeros((n, nv, count))
    out[:, joints, np.arange(count)] = column
    return out
