"""The permanent-magnet DC motor as a converter of electrical into mechanical power (Fig. 5).

I = torque / k        U = R I + k velocity        P = U I = torque velocity + R I^2
"""

import math
from dataclasses import dataclass
from typing import ClassVar

from actuators.arrays import Array, Numbers, Scalars, require


@dataclass(frozen=True, eq=False)
class DCMotor(Numbers):
    """Conversion only: rotor friction and inertia are elements of their own.

    Raises:
        UnphysicalElementError: A constant or limit is not positive, or the peak current is below
            the continuous one.

    Note:
        Inductance is left out: with 0.08 mH and 0.3 ohm it matters below a millisecond.
    """

    rules: ClassVar = {
        "torque_constant": "positive",
        **dict.fromkeys(("max_speed", "supply_voltage"), "limit"),
        **dict.fromkeys(("continuous_current", "peak_current"), "limit"),
    }
    name: str  #: Names the row of its copper loss.
    #: k, of torque per current and of voltage per speed [N*m/A = V*s/rad].
    torque_constant: Scalars
    resistance: Scalars  #: R of the winding at its working temperature [ohm].
    max_speed: float = math.inf  #: Permissible speed [rad/s].
    supply_voltage: float = math.inf  #: Voltage at hand [V].
    continuous_current: float = math.inf  #: Permissible root mean square current [A].
    peak_current: float = math.inf  #: Permissible instantaneous current [A].
    mass: float = 0.0  #: [kg]; no law uses it, and 0 says that no file states it.
    #: Standard deviation of k as its file states it, relative [1].
    torque_constant_spread: float = 0.0
    resistance_spread: float = 0.0  #: Of R likewise [1].

    def __post_init__(self) -> None:
        super().__post_init__()
        apart = self.peak_current >= self.continuous_current
        require(apart, self.name, "peak_current must not be below continuous_current")

    def current(self, torque: Array) -> Array:
        """Return the current (...) [A] for an air-gap torque [N*m]."""
        return torque / self.torque_constant

    def voltage(self, current: Array, velocity: Array) -> Array:
        """Return the voltage at the terminals (...) [V]."""
        return self.resistance * current + self.torque_constant * velocity

    def copper_loss(self, current: Array) -> Array:
        """Return R I^2, (...) [W]."""
        return self.resistance * current * current
