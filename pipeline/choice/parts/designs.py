"""Designs: every compatible motor x gear x brake as arrays of the numbers that their laws take.

A motor without a gear of its own goes on every gear; one that is sold with its gear goes alone. One
rule per kind turns sheets into numbers, `actuators.loading.converted`. A gear whose efficiency is
half and less is a `hypoid` with flat wheel: its law has 1 + c driving and 1 - c driven, as that of
friction has, and stands still without current from c = 1 on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from actuators.chain import Chain
from actuators.elements.element import Element
from actuators.elements.friction import Friction
from actuators.elements.holding_brake import HoldingBrake
from actuators.elements.hypoid import Hypoid
from actuators.elements.inertia import Inertia
from actuators.elements.motor import DCMotor
from actuators.elements.ratio import Ratio
from actuators.loading.build import WINDING
from actuators.supply.driver import Driver

Array = NDArray[np.float64]


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
    gear_peak: Array  #: At its output [N*m].
    brake_torque: Array  #: With which the brake holds; 0 for none [N*m].
    brake_power: Array  #: That keeps it open [W].
    mass: Array  #: Of motor, gear, brake and driver [kg].
    winding_to_housing: Array  #: [K/W].
    housing_to_ambient: Array  #: [K/W].
    winding_time: Array  #: Thermal time constant [s].
    housing_time: Array  #: Likewise [s].
    winding_limit: Array  #: Permitted temperature [K].
    bus: Array  #: Voltage of the supply [V].
    bus_use: Array  #: Share of the driver's range of it that is used [1].
    driver_resistance: Array  #: In the motor's ampere [ohm].
    switching: Array  #: Of the driver, over bus voltage times current [1].
    idle: Array  #: Of the driver while it is on [W].

    def __len__(self) -> int:
        return len(self.parts)

    def taken(self, which: NDArray[np.intp]) -> Designs:
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
    def driver(self) -> Driver:
        """The losses of their drivers."""
        return Driver("driver", self.driver_resistance, self.idle, self.switching)

    @property
    def ohmic(self) -> Array:
        """Loss of winding and driver over the motor's torque squared, (D,) [W/(N*m)^2]."""
        both = self.resistance + self.driver_resistance
        return np.asarray(both / self.torque_constant**2)

    @property
    def switched(self) -> Array:
        """Switching loss over the magnitude of the motor's torque, (D,) [W/(N*m)]."""
        return np.asarray(self.switching * self.bus / self.torque_constant)

    @property
    def theta(self) -> Array:
        """Coefficients of the five series in the motor's torque, (D, 5); see `search`."""
        n = self.ratio
        columns = (1 / n, self.load / n, self.coulomb, self.viscous * n, self.inertia * n)
        return np.stack(columns, axis=1)

    def locks(self, engaged: bool) -> NDArray[np.bool_]:
        """Whether gear or brake hold what pushes from outside, (D,); then a driver may be off.

        Args:
            engaged: Whether brakes are closed.
        """
        return np.asarray((self.load >= 1.0) | ((self.brake_torque > 0.0) & engaged))

    def chain(self, i: int, *, engaged: bool = True) -> Chain:
        """One design as a chain.

        Args:
            i: Its number.
            engaged: Whether its brake holds at standstill; open it draws its power there, too.
        """
        ratio, load = float(self.ratio[i]), float(self.load[i])
        gear: tuple[Element, ...] = (Ratio(name="transmission", ratio=ratio),)
        if load >= 1.0:
            gear = (
                Hypoid(name="transmission", ratio=ratio, pinion_angle=np.pi / 4, friction=load),
            )
            load = 0.0
        elements: tuple[Element, ...] = (
            *gear,
            Friction(
                name="friction",
                coulomb=self.coulomb[i],
                load=load,
                viscous=self.viscous[i],
            ),
        )
        if self.brake_power[i]:
            power = float(self.brake_power[i])
            held = (float(self.brake_torque[i]), power, 0.0) if engaged else (0.0, power, power)
            elements += (HoldingBrake("brake", *held),)
        elements += (Inertia(name="rotor", inertia=self.inertia[i]),)
        motor = DCMotor(
            WINDING,
            self.torque_constant[i],
            self.resistance[i],
            self.max_speed[i],
            self.voltage[i],
            self.continuous_current[i],
            self.peak_current[i],
        )
        name = " + ".join(part for part in self.parts[i] if part)
        return Chain(name, elements, motor, MappingProxyType({"m": "rotor"}))
