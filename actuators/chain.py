"""A chain of elements from the joint to the supply, and its answers in motion and at rest."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from actuators.arrays import Array, Scalars, least_magnitude
from actuators.elements.element import Element, gearing
from actuators.errors import LegwattError, known
from actuators.shaft import DCMotor, ShaftSeries

JOINT_STAGE: Final = "out"
SUPPLY_STAGE: Final = "el"


@dataclass(frozen=True, eq=False)
class HoldingResult:
    """What holds given joint torques at standstill; arrays have the shape of the joint torques."""

    low: Array  #: Least motor torque that holds [N*m].
    high: Array  #: Greatest motor torque that holds [N*m].
    motor_torque: Array  #: The one of least magnitude between them [N*m].
    current: Array  #: [A].
    voltage: Array  #: [V].
    power: Array  #: Electrical power, of the motor and of what elements draw themselves [W].


@dataclass(frozen=True, eq=False)
class ChainResult:
    """What a chain needs for a motion."""

    chain: str  #: The chain's name.
    shafts: Mapping[str, ShaftSeries]  #: Series at every named stage, from `out` to the motor's.
    #: Dissipated power by element (N, J) [W], copper loss of the motor last.
    losses: Mapping[str, Array]
    stored: Mapping[str, Array]  #: Rate of stored energy by element (N, J) [W].
    current: Array  #: (N, J) [A].
    voltage: Array  #: (N, J) [V].
    electrical_power: Array  #: From the supply to motor and elements (N, J) [W].
    motors: tuple[DCMotor, ...]  #: One per joint.

    @property
    def joint(self) -> ShaftSeries:
        """The series at the joint."""
        return self.shafts[JOINT_STAGE]

    @property
    def motor(self) -> ShaftSeries:
        """The series at the motor's air gap."""
        return tuple(self.shafts.values())[-1]

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of the stages from `out` to `el`."""
        return (*self.shafts, SUPPLY_STAGE)

    def stage_power(self, stage: str) -> Array:
        """Return the power towards the joint at one of the stages, (N, J) [W]."""
        return self.electrical_power if stage == SUPPLY_STAGE else self.shafts[stage].power


@dataclass(frozen=True, eq=False)
class Chain:
    """An actuator: elements in order from the joint to the motor, and the motor.

    Raises:
        LegwattError: A name stands twice, a stage names no element, or the shaft has no name.
    """

    name: str  #: Name of the alternative.
    elements: tuple[Element, ...]  #: From the joint to the motor.
    motor: DCMotor  #: The converter at the end.
    #: Stage name to the element whose motor side it is, for the stages between `out` and `el`; the
    #: last one is at the motor.
    stages: Mapping[str, str]

    def __post_init__(self) -> None:
        names = [e.name for e in self.elements] + [self.motor.name]
        if twice := [name for name in names if names.count(name) > 1]:
            raise LegwattError(f"{self.name}: element '{twice[0]}' stands twice: rename one")
        at = [name for name in names[:-1] if name in self.stages.values()]
        if [*self.stages.values()] != at or {JOINT_STAGE, SUPPLY_STAGE} & set(self.stages):
            raise LegwattError(
                f"{self.name}: stages must follow elements, in order, and not be named out or el"
            )
        if not at or at[-1] != names[-2]:
            raise LegwattError(f"{self.name}: name the stage after the last element")

    @property
    def ratio(self) -> Scalars:
        """Motor speed over joint speed."""
        return gearing(self.elements)

    def element(self, name: str) -> Element:
        """Return an element by name.

        Raises:
            LegwattError: There is none of that name.
        """
        elements = {e.name: e for e in self.elements}
        return elements[known("no element", name, elements, self.name)]

    def replaced(self, element: Element) -> Chain:
        """Return a chain in which the element of the same name is this one; see `element`."""
        old = self.element(element.name)
        return replace(self, elements=tuple(element if e is old else e for e in self.elements))

    def inverse(self, joint: ShaftSeries) -> ChainResult:
        """Return everything the chain needs for a motion, best split by `split_at_reversals`.

        Samples of a joint at rest (`direction` zero) get the holding torque of least magnitude
        at every stage: no power flows through a standing shaft, only R I^2 into the motor.
        """
        at_rest = joint.direction == 0.0
        standing = bool(at_rest.any())
        low = high = joint.torque
        stage_after = {element: stage for stage, element in self.stages.items()}
        shafts = {JOINT_STAGE: joint}
        losses: dict[str, Array] = {}
        stored: dict[str, Array] = {}
        drawn = np.zeros_like(joint.torque)
        side = shown = joint
        for element in self.elements:
            if (loss := element.loss(shown)) is not None:
                losses[element.name] = loss
            if (rate := element.stored(shown)) is not None:
                stored[element.name] = rate
            drawn += element.drawn(shown.torque, shown.velocity, shown.direction)
            shown = motor_side = element.inverse(side)
            if standing:
                low, high = element.holding(low, high, side.position)
                held = np.where(at_rest, least_magnitude(low, high), motor_side.torque)
                shown = motor_side.with_torque(held)
            if element.name in stage_after:
                shafts[stage_after[element.name]] = shown
            side = motor_side
        last = tuple(shafts.values())[-1]
        current = self.motor.current(last.torque)
        voltage = self.motor.voltage(current, last.velocity)
        losses[self.motor.name] = self.motor.copper_loss(current)
        power = voltage * current + drawn
        motors = (self.motor,) * len(joint.joints)
        return ChainResult(self.name, shafts, losses, stored, current, voltage, power, motors)

    def holding(self, torque: Array, position: Array | None = None) -> HoldingResult:
        """Return what holds joint torques at standstill.

        Each element maps the interval of torques that hold; the motor supplies the one of least
        magnitude. This one rule gives Tables IV to VI and the zeros of the irreversible actuator.

        Args:
            torque: (..., J) [N*m].
            position: Of the joints (..., J) [rad]; a chain without springs needs none.

        Raises:
            LegwattError: An element's torque depends on the position, and it is not stated.
        """
        low = high = np.asarray(torque, dtype=float)
        drawn, still = np.zeros_like(low), np.zeros_like(low)
        for element in self.elements:
            drawn += element.drawn(least_magnitude(low, high), still, still)
            low, high = held((element,), low, high, position)
            position = None if position is None else position * element.gearing
        motor_torque = least_magnitude(low, high)
        current = self.motor.current(motor_torque)
        voltage = self.motor.voltage(current, still)
        return HoldingResult(low, high, motor_torque, current, voltage, voltage * current + drawn)


def moved(elements: Iterable[Element], joint: ShaftSeries) -> ShaftSeries:
    """Return what a row of elements, from the joint to the motor, needs at its motor side."""
    side = joint
    for element in elements:
        side = element.inverse(side)
    return side


def held(
    elements: Iterable[Element], low: Array, high: Array, position: Array | None = None
) -> tuple[Array, Array]:
    """Return which torques at the motor side of a row of elements hold a load at standstill.

    Torques (...) [N*m], position of the joint side (...) [rad]; see `Chain.holding`.
    """
    for element in elements:
        low, high = element.holding(low, high, position)
        position = None if position is None else position * element.gearing
    return low, high
