"""Torque at the joints that bodies, gravity and ground ask for along a measured motion.

The base of a walking robot moves as its standing feet let it (`equations.motion_of`). The ground's
forces are those that were measured, else those with the least tangential parts
(`pipeline.dynamics.contact_forces`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.dynamics.contact_forces import FeetOnGround
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot import Robot, inverse_dynamics
from pipeline.simulation.equations import Moved, motion_of


class RigidBodies:
    """Inverse dynamics of many models along one measured motion.

    What depends on the motion and the measured forces alone is computed once.
    """

    def __init__(self, measurement: Log) -> None:
        self.measurement = measurement
        self._moved: Moved | None = None
        self._measured: tuple[float, Array, Array] | None = None

    def torque(self, machine: MachineModel, motion: tuple[Array, Array, Array]) -> Array:
        """Joint torques, shape (N, J) [N*m].

        `motion`: position, velocity and acceleration of the joints, each (N, J).
        """
        robot = machine.robot
        q, v, a = robot.configuration(motion[0]), *map(robot.tangent, motion[1:])
        if robot.floating:
            if self._moved is None:  # the measured motion, whatever an effect makes of it
                self._moved = motion_of(machine, self.measurement)
            base = self._moved.motion
            q[:, :7], v[:, :6], a[:, :6] = base[0][:, :7], base[1][:, :6], base[2][:, :6]
        generalised = inverse_dynamics(machine.rigid, (q, v, a))
        if self._moved is None:
            return np.asarray(generalised[:, robot.velocity_index])
        of_ground = self._of_ground(machine, motion[0], generalised[:, :6])
        return generalised[:, robot.velocity_index] - of_ground

    def _of_ground(self, machine: MachineModel, q: Array, wrench: Array) -> Array:
        """What the ground's forces put into the joints, shape (N, J) [N*m]."""
        m, squeeze = self.measurement, machine.bodies.squeeze
        # Measured forces ask for nothing of the bodies.
        measured = m.foot_force is not None and not np.isnan(m.foot_force[0]).any()
        made = self._measured if measured else None
        if made is not None and made[0] == squeeze and made[1] is q:
            return made[2]
        assert self._moved is not None
        assert self._moved.stance is not None
        stance = self._moved.stance
        legs = machine.robot.chains
        feet = FeetOnGround(legs, legs.by_leg(q), stance.turn)
        force = np.full((*stance.standing.shape, 3), np.nan)
        if m.foot_force is not None:
            force[:] = m.foot_force
        if np.isnan(force).any():
            least = feet.least_tangential(wrench, stance.standing)
            force = np.where(np.isnan(force), least, force)
        if squeeze:
            force[..., 1] += squeeze * outward(machine.robot, stance.standing)
        out = legs.by_joint(feet.torque(force))
        if measured:
            self._measured = (squeeze, q, out)
        return out


def outward(robot: Robot, standing: NDArray[np.generic]) -> Array:
    """Share of each standing foot in a lateral force of one newton per side, (n, F).

    `standing`: which feet stand, (n, F).
    """
    own = np.array([leg.side == "left" for leg in robot.spec.legs])
    out = np.zeros(standing.shape)
    for side, sign in ((own, 1.0), (~own, -1.0)):
        part = (standing * side).astype(float)
        out += sign * part / np.maximum(part.sum(axis=1, keepdims=True), 1.0)
    return out
