"""A motor whose winding and magnets warm up.

Copper: R = R0 (1 + 0.00393 dT) (IEC 60028). Neodymium magnets lose about 0.11 % per kelvin, and
the torque constant with them. The temperature follows from one thermal node,

    time_constant d(dT)/dt = rise + thermal_resistance R I^2 - dT,    dT(0) = initial

Where a sensor on the housing is read, a winding in balance with it adds sensor_gain (T - 25 degC):
both rise in proportion to the loss, the winding by the larger thermal resistance.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import FloatArray, require, require_non_negative

COPPER: Final = 0.00393  # [1/K]
MAGNET: Final = -0.0011  # [1/K]
REFERENCE: Final = 25.0  # temperature for which data sheets hold [degC]


@dataclass(frozen=True)
class Heating:
    """The thermal node of one motor.

    Attributes:
        thermal_resistance: Winding to surroundings [K/W].
        time_constant: [s].
        rise: Warming that is not the motor's own, reached after some time constants [K].
        initial: Warmer than the data sheet's temperature when the log starts [K].
        sensor_gain: Warming of the winding over that of the housing's sensor [1].
    """

    thermal_resistance: float = 0.0
    time_constant: float = 10.0
    rise: float = 0.0
    initial: float = 0.0
    sensor_gain: float = 0.0

    def __post_init__(self) -> None:
        require_non_negative("heating", thermal_resistance=self.thermal_resistance)
        require(self.time_constant > 0.0, "heating", "time_constant must be > 0")

    def temperature_rise(self, time: FloatArray, copper_loss: FloatArray) -> FloatArray:
        """Return dT (N,) [K] over time (N,) [s], strictly increasing, for a loss (N,) [W].

        The node's equation is stepped exactly for a target held over each interval.
        """
        target = self.rise + self.thermal_resistance * copper_loss
        blend = 1.0 - np.exp(-np.diff(time) / self.time_constant)
        result = np.empty_like(target)
        level = self.initial
        result[0] = level
        for k in range(blend.size):
            level += blend[k] * (target[k] - level)
            result[k + 1] = level
        return result

    def sensed(self, temperature: FloatArray) -> FloatArray:
        """Return the part of dT (...) [K] that a sensor at some temperature (...) [degC] tells."""
        return self.sensor_gain * (temperature - REFERENCE)


def warm_resistance(resistance: float, rise: FloatArray) -> FloatArray:
    """Return the winding's resistance (N,) [ohm] warmed by `rise` (N,) [K]."""
    return resistance * (1.0 + COPPER * rise)


def warm_torque_constant(torque_constant: float, rise: FloatArray) -> FloatArray:
    """Return the torque constant (N,) [N*m/A] with magnets warmed by `rise` (N,) [K]."""
    return torque_constant * (1.0 + MAGNET * rise)
