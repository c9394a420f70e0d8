"""What warming does: a motor's winding and magnets, and friction that falls as a gear warms.

Copper: R = R0 (1 + 0.00393 dT) (IEC 60028). Neodymium magnets lose about 0.11 % per kelvin, and
the torque constant with them. The temperature follows from one thermal node,

    time_constant d(dT)/dt = rise + thermal_resistance R I^2 - dT,    dT(0) = 0

with the warm winding's own R; where a sensor on the housing is read, a winding in balance with it
adds sensor_gain (T - 25 degC).

Friction of a robot's joint falls with its temperature, its viscous part about as exp(-T / T_0)
(Bittencourt and Gunnarsson, J. Dyn. Syst. Meas. Control 134(5), 2012, 051013). To first order

    torque = -(T - T_ref) (coulomb sgn(v) + viscous v)      on top of that at the reference
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from actuators.parameters import Numbers, number
from actuators.shaft import DCMotor

ZERO_CELSIUS: Final = 273.15  # [K]
COPPER: Final = 0.00393  # [1/K]
MAGNET: Final = -0.0011  # [1/K]
EXTREME: Final = 500.0  # warming or cooling beyond which neither law means anything [K]
REFERENCE: Final = 25.0  # temperature for which data sheets hold [degC]


@dataclass(frozen=True)
class Heating(Numbers):
    """The thermal node of one motor."""

    thermal_resistance: float = 0.0  #: Winding to surroundings [K/W].
    time_constant: float = number("", "positive", 10.0)  #: [s].
    #: Warming that is not the motor's own, reached after some time constants [K].
    rise: float = number(rule="signed")
    #: Warming of the winding over that of the housing's sensor [1].
    sensor_gain: float = number(rule="signed")

    def temperature_rise(self, time: Array, cold_loss: Array) -> Array:
        """Return dT (N,) [K] over increasing time (N,) [s] and R0 I^2 of the cold winding (N,) [W].

        With R = R0 (1 + COPPER dT) the node's equation stays linear in dT; it is stepped exactly
        for a current held over each interval. A warming beyond `EXTREME` counts as that.
        """
        own = self.thermal_resistance * cold_loss  # [K]
        step = np.diff(time) / self.time_constant
        decay = (1.0 - COPPER * own[:-1]) * step
        keep = np.exp(-decay)
        # (1 - exp(-x)) / x, which is one for no decay at all.
        small = np.abs(decay) < 1e-12
        blend = step * np.where(small, 1.0, -np.expm1(-decay) / np.where(small, 1.0, decay))
        drive = (blend * (self.rise + own[:-1])).tolist()
        level = 0.0
        result = [level]
        for factor, more in zip(keep.tolist(), drive, strict=True):
            level = factor * level + more
            result.append(level)
        return np.clip(result, -EXTREME, EXTREME)

    def sensed(self, temperature: Array) -> Array:
        """Return the part of dT (...) [K] that a sensor's temperature (...) [degC] implies."""
        return self.sensor_gain * (temperature - REFERENCE)


def warmed(motor: DCMotor, rise: Array) -> DCMotor:
    """Return the motor with winding and magnets warmer by `rise` (...) [K]."""
    return replace(
        motor,
        torque_constant=motor.torque_constant * (1.0 + MAGNET * rise),
        resistance=motor.resistance * (1.0 + COPPER * rise),
    )


@dataclass(frozen=True)
class Warming(Numbers):
    """By how much one joint's friction falls."""

    coulomb: float = 0.0  #: Dry friction per kelvin [N*m/K].
    viscous: float = 0.0  #: Viscous friction per kelvin [N*m*s/(rad*K)].
    #: Temperature at which nothing is taken off [K].
    reference: float = number("", "positive", 298.15)

    def torque(self, temperature: Array, direction: Array, velocity: Array) -> Array:
        """Return what comes on top at a temperature [degC] and direction, -1 to 1, (N,) [N*m]."""
        warmer = temperature + ZERO_CELSIUS - self.reference  # [K]
        return -warmer * (self.coulomb * direction + self.viscous * velocity)
