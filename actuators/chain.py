"""A drivetrain: elements from the joint to the supply, and its answers in motion and at rest."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from actuators.arrays import Array, least_magnitude
from actuators.elements.element import Element, Friction, gearing
from actuators.elements.heating import Heating, Warming
from actuators.elements.position_torque import PositionTorque
from actuators.errors import LegwattError
from actuators.shaft import DCMotor, ShaftSeries

JOINT_STAGE: Final = "out"
SUPPLY_STAGE: Final = "el"
MOTOR_STAGE: Final = "m"  # where nothing else names the motor's shaft
_LEAST_CROSSING: Final = 1e-9  # [N*m]


@dataclass(frozen=True, eq=False)
class HoldingResult:
    """What holds given joint torques at standstill; arrays have the shape of the joint torques."""

    low: Array  #: Least motor torque that holds [N*m].
    high: Array  #: Greatest motor torque that holds [N*m].
    motor_torque: Array  #: The one of least magnitude between them [N*m].
    current: Array  #: [A].
    voltage: Array  #: [V].
    power: Array  #: Electrical power [W].


@dataclass(frozen=True, eq=False)
class ChainResult:
    """What a chain needs for a motion."""

    shafts: Mapping[str, ShaftSeries]  #: Series at every named stage, from `out` to the motor's.
    losses: Mapping[str, Array]  #: Power by element (N, J) [W], the motor's copper loss last.
    stored: Mapping[str, Array]  #: Rate of stored energy by element (N, J) [W].
    current: Array  #: (N, J) [A].
    voltage: Array  #: (N, J) [V].
    electrical_power: Array  #: From the supply to the motor (N, J) [W].
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
    def powers(self) -> dict[str, Array]:
        """Power towards the joint at every stage from `out` to `el`, (N, J) [W]."""
        shafts = {stage: series.power for stage, series in self.shafts.items()}
        return {**shafts, SUPPLY_STAGE: self.electrical_power}


@dataclass(frozen=True, eq=False)
class Chain:
    """The drivetrain of one joint, or of all that are alike: elements, motor, sensors.

    Everything is referred to the joint side: the motor's angle is divided by the ratio, its torque
    multiplied with it. A joint at q that demands the torque tau of its drivetrain gets it from

        load    sigma = tau + springs and ripples at q        `drive_load`
        motion  theta = q + compliance sigma + (backlash / 2) tanh(sigma / crossing)  `deflection`
        motor   the elements in a row                         `at_motor`, `held`

    Raises:
        LegwattError: A name stands twice.
    """

    name: str  #: Of the drivetrain option, or of the joint.
    #: From the joint to the motor; those that effects add stand first.
    elements: tuple[Element, ...] = ()
    #: The converter at the end; None where a log's torque is the actuator's, as of a bare URDF.
    motor: DCMotor | None = None
    #: Stage to the element whose motor side it is, between `out` and `el`; the last at the motor.
    stages: Mapping[str, str] = field(default_factory=dict)
    #: Bearings and seals that turn with the joint alone, also where its motor turns with another.
    output: tuple[Element, ...] = ()
    position_torques: tuple[PositionTorque, ...] = ()  #: At the joint.
    compliance: float = 0.0  #: Of the transmission [rad/(N*m)].
    backlash: float = 0.0  #: Whole width [rad].
    crossing: float = 0.0  #: Torque over which the joint passes from one flank to the other [N*m].
    coupled_to: str = ""  #: Joint with which this one's motor also turns; empty without.
    coupling: float = 0.0  #: Turns of the motor, at the joint side, per turn of that one [1].
    heating: Heating | None = None  #: Thermal node of the motor; None for a motor that stays cold.
    warming: Warming | None = None  #: How its friction falls with its temperature.
    encoder_offset: float = 0.0  #: The position sensor reads high by this [rad].
    effort_offset: float = 0.0  #: The effort sensor reads high by this, in the unit of its channel.
    delay: float = 0.0  #: The effort channels lag behind the position by this [s].
    #: Channel to how many times what it should its column reads; once where absent.
    gains: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        whole = [e.name for e in (*self.output, *self.elements, self.motor) if e]
        if twice := [name for name in whole if whole.count(name) > 1]:
            raise LegwattError(f"{self.name}: element '{twice[0]}' stands twice: rename one")

    @property
    def path(self) -> tuple[Element, ...]:
        """Elements that turn with the motor: all of them, unless it turns with another joint."""
        return self.elements if self.coupled_to else (*self.output, *self.elements)

    @property
    def apart(self) -> tuple[Element, ...]:
        """Elements that do not turn with the motor."""
        return self.output if self.coupled_to else ()

    @property
    def ratio(self) -> float:
        """Motor speed over joint speed, the same for all of its joints."""
        return float(np.asarray(gearing(self.elements)))

    @property
    def is_elastic(self) -> bool:
        """Whether motor and joint turn apart from one another, by elasticity or backlash."""
        return self.compliance != 0.0 or self.backlash != 0.0

    @property
    def driven(self) -> DCMotor:
        """The motor; a LegwattError where there is none."""
        if self.motor is None:
            raise LegwattError(
                f"joint '{self.name}': no motor; name the drivetrain option as alternative"
            )
        return self.motor

    def with_element(self, element: Element, *, at_motor: bool = False) -> Chain:
        """The same with an element more, at the joint's or the motor's shaft; names made unique.

        Shares of the load are of what comes to the shaft, in whatever order its friction is added.
        """
        named = self._renamed(element)
        if not at_motor:
            behind = isinstance(named, Friction) and not named.of_load
            loaded = [isinstance(e, Friction) and e.of_load for e in self.elements]
            at = [*loaded, False].index(False) if behind else 0
            return replace(self, elements=(*self.elements[:at], named, *self.elements[at:]))
        last = dict.fromkeys([*self.stages][-1:], named.name)  # stays at the motor
        return replace(self, elements=(*self.elements, named), stages={**self.stages, **last})

    def with_output(self, element: Element) -> Chain:
        """The same with an element more that turns with the joint alone; names made unique."""
        return replace(self, output=(self._renamed(element), *self.output))

    def _renamed(self, element: Element) -> Element:
        taken = {e.name for e in (*self.output, *self.elements)}
        name, k = element.name, 2
        while name in taken:
            name, k = f"{element.name}_{k}", k + 1
        return replace(element, name=name)

    def drive_load(self, position: Array, torque: Array) -> Array:
        """What the drivetrain supplies at a position (...) [rad], springs included, (...) [N*m]."""
        for law in self.position_torques:
            torque = torque + law.torque(position)
        return torque

    def deflection(self, load: Array) -> Array:
        """Motor angle less joint angle at the joint side under a load (...) [N*m], (...) [rad]."""
        deflection: Array = self.compliance * load
        if self.backlash:
            flank = np.tanh(load / max(self.crossing, _LEAST_CROSSING))
            deflection = deflection + 0.5 * self.backlash * flank
        return deflection

    def at_motor(self, side: ShaftSeries) -> ShaftSeries:
        """What the motor's shaft needs for a motion and load at the joint side (inverse)."""
        return moved(self.path, side)

    def inverse(self, joint: ShaftSeries) -> ChainResult:
        """Return everything the chain needs for a motion, best split by `split_at_reversals`.

        Samples at rest (`direction` zero) get the holding torque of least magnitude at every stage.
        """
        at_rest = joint.direction == 0.0
        standing = bool(at_rest.any())
        low = high = joint.torque
        motor, path = self.driven, self.path
        stages = self.stages or {MOTOR_STAGE: path[-1].name}
        stage_after = {element: stage for stage, element in stages.items()}
        shafts = {JOINT_STAGE: joint}
        losses: dict[str, Array] = {}
        stored: dict[str, Array] = {}
        side = shown = joint
        for element in path:
            if (loss := element.loss(shown)) is not None:
                losses[element.name] = loss
            if (rate := element.stored(shown)) is not None:
                stored[element.name] = rate
            shown = motor_side = element.inverse(side)
            if standing:
                low, high = element.holding(low, high, side.position)
                held = np.where(at_rest, least_magnitude(low, high), motor_side.torque)
                shown = motor_side.with_torque(held)
            if element.name in stage_after:
                shafts[stage_after[element.name]] = shown
            side = motor_side
        last = tuple(shafts.values())[-1]
        current = motor.current(last.torque)
        voltage = motor.voltage(current, last.velocity)
        losses[motor.name] = motor.copper_loss(current)
        motors = (motor,) * len(joint.joints)
        power = voltage * current
        return ChainResult(shafts, losses, stored, current, voltage, power, motors)

    def holding(self, torque: Array, position: Array | None = None) -> HoldingResult:
        """Return what holds joint torques (..., J) [N*m] at standstill.

        Each element maps the interval of torques that hold; the motor supplies the one of least
        magnitude. This one rule gives Tables IV to VI and the zeros of the irreversible actuator.
        A LegwattError where a spring needs the position (..., J) [rad] and it is not stated.
        """
        load = np.asarray(torque, dtype=float)
        low, high = held(self.path, load, load, position)
        motor_torque = least_magnitude(low, high)
        current = self.driven.current(motor_torque)
        voltage = self.driven.voltage(current, np.zeros_like(low))
        return HoldingResult(low, high, motor_torque, current, voltage, voltage * current)


def moved(elements: Iterable[Element], joint: ShaftSeries) -> ShaftSeries:
    """Return what a row of elements, from the joint to the motor, needs at its motor side."""
    for element in elements:
        joint = element.inverse(joint)
    return joint


def held(
    elements: Iterable[Element], low: Array, high: Array, position: Array | None = None
) -> tuple[Array, Array]:
    """Return which torques (...) [N*m] behind elements hold a load; see `Chain.holding`."""
    for element in elements:
        low, high = element.holding(low, high, position)
        position = None if position is None else position * element.gearing
    return low, high
