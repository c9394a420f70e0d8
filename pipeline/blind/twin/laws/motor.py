"""DC motor with copper that warms, magnets that weaken and iron that saturates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.twin.plant import COPPER, MAGNET, Heating, Plant

Array = NDArray[np.float64]


class Motors:
    """All motors of a plant, stepped in time.

    The current loop is ideal inside what the supply allows: current is what the torque command
    asks of the data sheet's torque constant, clipped where R I + k w would leave the supply.
    """

    def __init__(self, plant: Plant, dt: float) -> None:
        machine = plant.machine
        self._ratio = machine.ratio
        self._nominal = machine.ratio * machine.torque_constant  # [N*m/A] at the joint
        self._supply = machine.supply
        self._peak = machine.peak_current
        self._k = plant.torque_constant
        self._r = plant.resistance
        self._saturates = bool(np.isfinite(plant.saturation_current).any())
        self._saturation = plant.saturation_current
        self._heating: Heating | None = plant.heating
        self._dt = dt
        self.temperature_rise = np.zeros(self._k.shape)  # [K]

    def step(self, command: Array, velocity: Array) -> tuple[Array, Array, Array]:
        """One step.

        Args:
            command: Torque asked for, at the joint [N*m], shape (J,).
            velocity: Of the motors, at the joint [rad/s], shape (J,).

        Returns:
            Torque at the joint before any friction [N*m], current [A] and voltage [V].
        """
        k, r = self._k, self._r
        if self._heating is not None:
            k = k * (1 + MAGNET * self.temperature_rise)
            r = r * (1 + COPPER * self.temperature_rise)
        back_emf = k * (self._ratio * velocity)  # [V]
        current = command / self._nominal
        current = np.minimum(current, np.minimum((self._supply - back_emf) / r, self._peak))
        current = np.maximum(current, np.maximum((-self._supply - back_emf) / r, -self._peak))
        torque = k * self._ratio * current
        if self._saturates:
            torque = torque / (1 + (current / self._saturation) ** 2)
        if self._heating is not None:
            h = self._heating
            target = h.rise + h.thermal_resistance * r * current**2  # [K]
            self.temperature_rise = self.temperature_rise + (self._dt / h.time_constant) * (
                target - self.temperature_rise
            )
        return torque, current, r * current + back_emf
