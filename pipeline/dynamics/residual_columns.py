"""Columns of the residual: what a change of the model by one unit adds to the equations of motion.

Bodies are Pinocchio's joint torque regressor; friction, drag, gain and delay have a closed form at
the joint that they act on; an encoder's zero and a tilt are central differences of the residual.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np
import pinocchio as pin

from actuators.arrays import Array, Index
from pipeline.dynamics.residual import EquationsOfMotion

_STEP: Final = 1e-4  # of a central difference [rad]


def body_columns(equations: EquationsOfMotion) -> Array:
    """Ten inertial parameters of every body in Pinocchio's order, shape (N, nv, 10 B)."""
    model = equations.model
    data = model.createData()
    out = np.empty((len(equations.torque), model.nv, 10 * (model.njoints - 1)))
    for k, (q, v, a) in enumerate(zip(*equations.motion, strict=True)):
        out[k] = pin.computeJointTorqueRegressor(model, data, q, v, a)
    return out


def joint_columns(
    v: Array, a: Array, *, sign: Array, load: Array, rate: Array, slow: Array
) -> dict[str, Array]:
    """Laws with a closed form, each (N, J): the torque at a joint by its own coefficient of one.

    Args:
        v: Speed [rad/s].
        a: Acceleration [rad/s^2].
        sign: Expected sign of friction, -1 to 1.
        load: Torque that the joint carries, the model's or the measured one at the bandwidth [N*m].
        rate: Its rate of change [N*m/s].
        slow: Speed over which Stribeck friction falls, shape (J,) [rad/s].
    """
    return {
        "viscous": v,
        "coulomb": sign,
        "stribeck": sign * np.exp(-((v / slow) ** 2)),
        "drag": v * np.abs(v),
        "load": np.abs(load) * sign,
        "rotor": a,
        "offset": np.ones_like(v),
        "gain": load,
        "delay": -rate,
    }


def at_joints(column: Array, joints: Index, nv: int) -> Array:
    """Columns (N, J) of joints on their own rows, shape (N, nv, J).

    `joints`: rows of the joints among the model's velocities, shape (J,).
    """
    n, count = column.shape
    out = np.zeros((n, nv, count))
    out[:, joints, np.arange(count)] = column
    return out


def tilt_columns(equations: EquationsOfMotion) -> Array:
    """Roll and pitch of the ground or stand [rad], shape (N, nv, 2).

    The residual is linear in gravity: the columns are exact.
    """
    out = []
    for axis in np.eye(3)[:2]:
        turned = equations.model.copy()
        turned.gravity.linear = np.cross(equations.model.gravity.linear, axis)
        still = equations.model.copy()
        still.gravity.linear = np.zeros(3)
        pair = (replace(equations, model=m).rigid for m in (turned, still))
        out.append(next(pair) - next(pair))
    return np.stack(out, axis=-1)


def zero_columns(build: Callable[[Array], EquationsOfMotion], positions: Array) -> Array:
    """Zeros of the joints' encoders, shape (N, nv, J) [N*m/rad].

    The residual is made anew with every position moved, the feet's places and the base's motion
    with it, while the ground's forces stay those that fit best.

    Args:
        build: Equations of motion by joint positions.
        positions: As logged, shape (N, J) [rad].
    """
    forces = build(positions).forces()
    out = []
    for unit in np.eye(positions.shape[1]):
        ends = []
        for step in (_STEP, -_STEP):
            moved = build(positions + step * unit)
            r = moved.residual
            if moved.feet is not None:
                beyond = forces - moved.feet.known
                r = r + np.einsum("nfi,nf->ni", moved.feet.rows, beyond)
            ends.append(r)
        out.append((ends[1] - ends[0]) / (2 * _STEP))
    return np.stack(out, axis=-1)
