"""One joint's drivetrain and sensors: laws in a row, springs beside them, and their answers.

Everything is referred to the joint side: the motor's angle is divided by the ratio, its torque
multiplied with it. A joint at q that demands the torque tau of its drivetrain gets it from

    load    sigma = tau + springs and ripples at q        `drive_load`
    motion  theta = q + compliance sigma + (backlash / 2) tanh(sigma / crossing)    `deflection`
    motor   the elements in a row                         `at_motor`, `holding`

and from what coupled motors carry, which `pipeline.machine.drivetrains` adds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from actuators.arrays import Array
from actuators.chain import Chain, held, moved
from actuators.elements.element import Element
from actuators.elements.heating import Heating, warm_resistance, warm_torque_constant
from actuators.elements.motor import DCMotor
from actuators.elements.position_torque import PositionTorque
from actuators.elements.warming import Warming
from actuators.shaft import ShaftSeries
from pipeline.logs.errors import ModelError

_LEAST_CROSSING = 1e-9  # [N*m]
_MOTOR_STAGE = "m"


@dataclass(frozen=True, eq=False)
class JointModel:
    """One joint's actuator and sensors."""

    name: str  #: Of the joint.
    #: From the joint to the motor; those that effects add stand first.
    elements: tuple[Element, ...] = ()
    #: The converter; None where the log's torque is the actuator's, as of a bare URDF.
    motor: DCMotor | None = None
    #: Torques that depend on the joint's position alone.
    position_torques: tuple[PositionTorque, ...] = ()
    compliance: float = 0.0  #: Of the transmission [rad/(N*m)].
    backlash: float = 0.0  #: Whole width [rad].
    crossing: float = 0.0  #: Torque over which the joint passes from one flank to the other [N*m].
    coupled_to: str = ""  #: Joint with which this one's motor also turns; empty without.
    #: Turns of the motor, at the joint side, per turn of that other joint [1].
    coupling: float = 0.0
    heating: Heating | None = None  #: Thermal node of the motor; None for a motor that stays cold.
    #: How its friction falls with its temperature; None where it does not.
    warming: Warming | None = None
    encoder_offset: float = 0.0  #: The position sensor reads high by this [rad].
    effort_offset: float = 0.0  #: The effort sensor reads high by this, in the unit of its channel.
    delay: float = 0.0  #: The effort channels lag behind the position by this [s].
    #: Channel to how many times what it should its column reads; once where absent.
    gains: Mapping[str, float] = field(default_factory=dict)
    #: Names of shafts to the elements they follow, as a chain has them; the last one is the
    #: motor's.
    stages: Mapping[str, str] = field(default_factory=dict)
    #: Elements of the joint's own bearings and seals, nearest to it: they turn with the joint
    #: alone, also where its motor turns with another joint, too.
    output: tuple[Element, ...] = ()

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
        """Motor speed over joint speed."""
        return math.prod(float(np.asarray(element.gearing)) for element in self.elements)

    @property
    def is_elastic(self) -> bool:
        """Whether motor and joint turn apart from one another, by elasticity or backlash."""
        return self.compliance != 0.0 or self.backlash != 0.0

    def with_element(self, element: Element, *, at_motor: bool = False) -> JointModel:
        """The same with an element more, at the joint's or the motor's shaft; names made unique."""
        named = self._renamed(element)
        elements = (*self.elements, named) if at_motor else (named, *self.elements)
        return replace(self, elements=elements)

    def with_output(self, element: Element) -> JointModel:
        """The same with an element more that turns with the joint alone; names made unique."""
        return replace(self, output=(self._renamed(element), *self.output))

    def _renamed(self, element: Element) -> Element:
        taken = {e.name for e in (*self.output, *self.elements)}
        name, k = element.name, 2
        while name in taken:
            name, k = f"{element.name}_{k}", k + 1
        return replace(element, name=name)

    def drive_load(self, position: Array, torque: Array) -> Array:
        """What the drivetrain has to supply with springs and ripples beside it, (...) [N*m].

        `position`: of the joint (...) [rad]. `torque`: demanded by bodies and ground (...) [N*m].
        """
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

    def holding(self, low: Array, high: Array, position: Array) -> tuple[Array, Array]:
        """Motor torques that hold a load between `low` and `high` (...) [N*m] at standstill.

        `low`: least load (...) [N*m]. `high`: greatest load (...) [N*m]. `position`: of the joint
        (...) [rad].
        """
        return held(self.path, low, high, position)

    def warm(self, rise: Array) -> DCMotor:
        """The motor with its winding warmer than the data sheet's by `rise` (...) [K].

        Raises:
            ModelError: The model has no motor here.
        """
        if self.motor is None:
            raise ModelError(f"joint '{self.name}': no motor; name the actuator with --alternative")
        constant = float(np.asarray(self.motor.torque_constant))
        resistance = float(np.asarray(self.motor.resistance))
        return replace(
            self.motor,
            torque_constant=warm_torque_constant(constant, rise),
            resistance=warm_resistance(resistance, rise),
        )

    @property
    def chain(self) -> Chain:
        """Elements and motor as a chain, whose losses are reported element by element.

        Raises:
            ModelError: The model has no motor here.
        """
        if self.motor is None:
            raise ModelError(f"joint '{self.name}': no motor, so that its chain has no end")
        *inner, last = self.stages or (_MOTOR_STAGE,)
        # The motor's stage stays at the motor: behind an element that was added there.
        stages = {stage: self.stages[stage] for stage in inner}
        return Chain(self.name, self.path, self.motor, stages | {last: self.path[-1].name})


def joints_of(chain: Chain | None, names: tuple[str, ...]) -> tuple[JointModel, ...]:
    """A joint model per name, all with the same actuator.

    `chain`: the actuator; None where a log's torque is the actuator's own at the joint side.
    """
    if chain is None:
        return tuple(map(JointModel, names))
    return tuple(JointModel(n, chain.elements, chain.motor, stages=chain.stages) for n in names)
