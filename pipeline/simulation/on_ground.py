"""Torque at the joints that bodies, gravity and ground ask for along a measured motion.

The base of a walking robot moves as its standing feet let it (`equations.motion_of`). The ground's
forces are those that were measured, else those with the least tangential parts
(`pipeline.dynamics.contact_forces`).
"""

from __future__ import annotations

import numpy as np

from actuators.arrays import Array
from pipeline.dynamics.contact_forces import FeetOnGround
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot import inverse_dynamics
from pipeline.simulation.equations import Moved, motion_of
from pipeline.simulation.rigid_bodies import (
    changed_model,
    configuration,
    legs_are_separate,
    outward,
)


class RigidBodies:
    """Inverse dynamics of many models along one measured motion.

    What depends on the motion and the measured forces alone is computed once.
    """

    def __init__(self, measurement: Log) -> None:
        self.measurement = measurement
        self._moved: Moved | None = None
        self._measured: tuple[float, Array] | None = None

    def torque(self, machine: MachineModel, motion: tuple[Array, Array, Array]) -> Array:
        """Joint torques, shape (N, J) [N*m].

        `motion`: position, velocity and acceleration of the joints, each (N, J).
        """
        model = changed_model(machine.rigid, machine.bodies)
        q, v, a, joints = configuration(machine, model, motion)
        if machine.floating and machine.legs is not None:
            if self._moved is None:  # the measured motion, whatever an effect makes of it
                self._moved = motion_of(machine, self.measurement)
            base = self._moved.motion
            q[:, :7], v[:, :6], a[:, :6] = base[0][:, :7], base[1][:, :6], base[2][:, :6]
        generalised = inverse_dynamics(model, (q, v, a))
        if self._moved is None:
            return np.asarray(generalised[:, joints])
        return generalised[:, joints] - self._of_ground(machine, motion[0], generalised[:, :6])

    def _of_ground(self, machine: MachineModel, q: Array, wrench: Array) -> Array:
        """What the ground's forces put into the joints, shape (N, J) [N*m]."""
        m, squeeze = self.measurement, machine.bodies.squeeze
        # Measured forces ask for nothing of the bodies.
        measured = legs_are_separate(machine, m) and q is m.q
        if measured and self._measured is not None and self._measured[0] == squeeze:
            return self._measured[1]
        assert machine.legs is not None
        assert self._moved is not None
        assert self._moved.stance is not None
        stance = self._moved.stance
        feet = FeetOnGround(machine.legs, machine.legs.by_leg(q), stance.turn)
        force = np.full((*stance.standing.shape, 3), np.nan)
        if m.foot_force is not None:
            force[:] = m.foot_force
        if np.isnan(force).any():
            least = feet.least_tangential(wrench, stance.standing)
            force = np.where(np.isnan(force), least, force)
        if squeeze:
            force[..., 1] += squeeze * outward(machine.left, stance.standing)
        out = machine.legs.by_joint(feet.torque(force))
        if measured:
            self._measured = (squeeze, out)
        return out
