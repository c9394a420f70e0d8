"""The driver (servo amplifier) between bus and motor: its losses, and the voltage it leaves.

Of the bus's direct current it makes the motor's. Two transistors at a time carry the current from
terminal to terminal, in a bridge for a brushed motor and on average in one of three phases, where
each phase flows through one: 3 I_rms^2 R_on = 2 R_on x 1.5 I_rms^2. In the motor's own ampere
(`actuators.loading.converted`, c = 1, 0.75 or 1.5) conduction costs 2 c R_on I^2 as the winding
costs c R I^2. Hard switching costs in proportion to voltage and current, 1/2 U I (t_r + t_f) f
(Mohan, Undeland and Robbins, Power Electronics, chapter 2); gate drivers and logic cost the same at
any current.

    loss = idle + 2 c R_on I^2 + switching U |I|            at the bus, positive
    |U_motor| <= voltage_share U - 2 c R_on |I|
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from actuators.arrays import Array, Numbers, Scalars


@dataclass(frozen=True, eq=False)
class Driver(Numbers):
    """One driver; numbers may be arrays that broadcast against current and voltage.

    Raises:
        UnphysicalElementError: A loss is negative or not finite, or a limit not positive.
    """

    rules: ClassVar = {
        "voltage_share": "positive",
        **dict.fromkeys(("continuous_current", "peak_current", "most_voltage"), "limit"),
    }
    name: str  #: Of the part.
    resistance: Scalars = 0.0  #: In series with the winding, 2 c R_on [ohm].
    #: Power while it is enabled, whatever the current [W]; none while it is off.
    idle: Scalars = 0.0
    switching: Scalars = 0.0  #: Loss over bus voltage times current [1].
    voltage_share: Scalars = 1.0  #: Greatest motor voltage over bus voltage, without current [1].
    continuous_current: Scalars = math.inf  #: Permissible root mean square current [A].
    peak_current: Scalars = math.inf  #: Permissible instantaneous current [A].
    least_voltage: Scalars = 0.0  #: Of the bus, below which it switches off [V].
    most_voltage: Scalars = math.inf  #: Of the bus [V].

    def loss(self, current: Array, bus: Scalars) -> Array:
        """Return the power that the enabled driver turns into heat, (...) [W], not negative.

        The bus [V] supplies it in addition to the motor's, whichever way its current (...) [A]
        flows.
        """
        size = np.abs(current)
        return self.idle + self.resistance * size * size + self.switching * bus * size
