"""Designs: motor x gear x brake as arrays of the numbers that their laws take.

A gear whose efficiency is half and less is a `hypoid` with flat wheel: 1 + c driving and 1 - c
driven, as friction has, and still without current from c = 1 on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from actuators.arrays import Array, Index, Mask


@dataclass(frozen=True, eq=False)
class Designs:
    """D designs; arrays (D,), SI, at the motor's shaft where nothing else is said."""

    #: Names of motor, gear and brake of each; empty for none.
    parts: tuple[tuple[str, str, str], ...]
    ratio: Array  #: n [1].
    load: Array  #: c, friction per transmitted torque [1].
    coulomb: Array  #: Dry friction [N*m].
    viscous: Array  #: [N*m*s/rad].
    inertia: Array  #: [kg*m^2].
    torque_constant: Array  #: k [N*m/A].
    resistance: Array  #: R [ohm].
    voltage: Array  #: That the driver can give to the motor without current [V].
    continuous_current: Array  #: Of motor and driver [A].
    peak_current: Array  #: Likewise [A].
    max_speed: Array  #: Of the motor [rad/s].
    gear_speed: Array  #: Of the gear's input, at most [rad/s].
    gear_continuous: Array  #: At its output, root mean square [N*m].
    gear_peak: Array  #: At its output, again and again [N*m].
    gear_momentary: Array  #: At its output, now and then [N*m].
    life_hours: Array  #: Of the gear at `life_torque` and `life_speed`; infinite if not rated [h].
    life_torque: Array  #: Rated torque at its output, of its catalogue's life [N*m].
    life_speed: Array  #: Rated speed of its input [rad/s].
    brake_torque: Array  #: With which the brake holds; 0 for none [N*m].
    brake_power: Array  #: That keeps it open [W].
    mass: Array  #: Of motor, gear, brake and driver [kg].
    price: Array  #: Of motor, gear and brake, NaN where one is not at hand [EUR].
    standstill: Array  #: Factor on the current that may flow at standstill, 1 with brushes [1].
    bus: Array  #: Voltage of the supply [V].
    bus_use: Array  #: Share of the driver's range of it that is used [1].
    driver_resistance: Array  #: In the motor's ampere [ohm].
    switching: Array  #: Of the driver, over bus voltage times current [1].
    idle: Array  #: Of the driver while it is on [W].

    def __len__(self) -> int:
        return len(self.parts)

    def taken(self, which: Index) -> Designs:
        """Those of these numbers."""
        arrays = {f.name: getattr(self, f.name)[which] for f in fields(self)[1:]}
        return Designs(tuple(self.parts[i] for i in which), **arrays)

    @classmethod
    def together(cls, some: Sequence[Designs]) -> Designs:
        """Several in a row."""
        parts = tuple(row for one in some for row in one.parts)
        names = [f.name for f in fields(cls)[1:]]
        return cls(parts, **{n: np.concatenate([getattr(d, n) for d in some]) for n in names})

    @property
    def switched(self) -> Array:
        """Switching loss over the magnitude of the motor's torque, (D,) [W/(N*m)]."""
        return np.asarray(self.switching * self.bus / self.torque_constant)

    def locks(self, engaged: bool) -> Mask:
        """Whether gear, or brake if engaged, hold what pushes from outside, (D,)."""
        return np.asarray((self.load >= 1.0) | ((self.brake_torque > 0.0) & engaged))
