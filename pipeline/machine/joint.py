"""One joint's drivetrain and sensors: laws in a row, springs beside them, and their answers.

Everything is referred to the joint side: the motor's angle is divided by the ratio, its torque
multiplied with it. A joint at q that demands the torque tau of its drivetrain gets it from

    load    sigma = tau + springs and ripples at q        `drive_load`
    motion  theta = q + compliance sigma + (backlash / 2) tanh(sigma / crossing)    `deflection`
    motor   the elements in a row                         `at_motor`, `holding`

and what coupled motors carry comes on top (`Drivetrains`, the one place where joints meet). Motors
may turn with other joints, too: with motor angles theta = C q at the joint side the power
that motors give is the power that joints take, for any motion, so that tau = C^T sigma: a motor
that also turns with another joint carries a part of that joint's torque (virtual work). Its
friction is its own: it acts between motor and frame, and does work on theta.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np

from actuators.arrays import Array, least_magnitude
from actuators.chain import Chain, ChainResult, HoldingResult, held, moved
from actuators.elements.element import Element, gearing
from actuators.elements.heating import Heating, Warming, warmed
from actuators.elements.position_torque import PositionTorque
from actuators.errors import LegwattError
from actuators.shaft import BY_JOINT, DCMotor, ShaftSeries

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
        return float(np.asarray(gearing(self.elements)))

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
            LegwattError: The model has no motor here.
        """
        if self.motor is None:
            raise LegwattError(
                f"joint '{self.name}': no motor; name the drivetrain option as alternative"
            )
        return warmed(self.motor, rise)

    @property
    def chain(self) -> Chain:
        """Elements and motor as a chain, whose losses are reported element by element.

        Raises:
            LegwattError: The model has no motor here.
        """
        if self.motor is None:
            raise LegwattError(f"joint '{self.name}': no motor, so that its chain has no end")
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


@dataclass(frozen=True, eq=False)
class Drivetrains:
    """One drivetrain per joint; `inverse` and `holding` answer as a chain for all joints does."""

    name: str  #: Of the alternative.
    joints: tuple[JointModel, ...]  #: In the order of the columns.

    @cached_property
    def coupling(self) -> Array:
        """C of theta = C q: turns of each motor at its joint's side per turn of each joint."""
        at = {joint.name: k for k, joint in enumerate(self.joints)}
        out = np.eye(len(self.joints))
        for k, joint in enumerate(self.joints):
            if joint.coupled_to:
                out[k, at[joint.coupled_to]] += joint.coupling
        return out

    @cached_property
    def _shares(self) -> Array:
        """C^-1: sigma = C^-T tau, in rows tau C^-1."""
        return np.asarray(np.linalg.inv(self.coupling), dtype=np.float64)

    @cached_property
    def coupled(self) -> bool:
        """Whether a motor turns with another joint, too."""
        return any(joint.coupled_to for joint in self.joints)

    def turned(self, joint: int, motion: Array) -> Array:
        """Motion of a joint's motor at the joint side, theta = C q, (...).

        `motion`: position, velocity or acceleration of all joints (..., J).
        """
        row = self.coupling[joint]
        return np.asarray(motion[..., row != 0.0] @ row[row != 0.0])

    def load(self, joint: int, demand: Callable[[int], Array]) -> Array:
        """What one drivetrain supplies at the joint side, sigma of tau = C^T sigma, (...) [N*m].

        `demand`: torque (...) [N*m] asked of a joint, by column.
        """
        column = self._shares[:, joint]
        return np.asarray(sum(column[k] * demand(k) for k in np.flatnonzero(column).tolist()))

    def carried(self, joint: int, motor: Array) -> Array:
        """What other joints' motors bring to a joint besides its own, (...) [N*m].

        `motor`: torque of all motors brought to their joint side (..., J) [N*m].
        """
        column = self.coupling[:, joint] - np.eye(len(self.joints))[joint]
        return np.asarray(motor[..., column != 0.0] @ column[column != 0.0])

    @cached_property
    def _groups(self) -> list[tuple[Chain, list[int]]]:
        """Chains with the joints that share them."""
        groups: dict[object, tuple[Chain, list[int]]] = {}
        for k, joint in enumerate(self.joints):
            key = (*map(id, joint.path), id(joint.motor))
            groups.setdefault(key, (joint.chain, []))[1].append(k)
        return list(groups.values())

    def inverse(self, joint: ShaftSeries) -> ChainResult:
        """Return everything the drivetrains need; a loss that a joint does not have is zero there.

        `joint`: series at all joints, in their order; see `Chain.inverse`.
        """
        if len(self._groups) == 1 and not self.coupled:
            return replace(self._groups[0][0].inverse(joint), chain=self.name)
        motors, lost = joint, dict[str, Array]()
        if self.coupled:
            torque = np.array(joint.torque)
            for k, own in enumerate(self.joints):
                side = joint.at(k)
                for element in own.apart:  # does not turn with the motor
                    loss = element.loss(side)
                    if loss is not None:
                        total = lost.setdefault(element.name, np.zeros_like(torque))
                        total[:, k] += loss[:, 0]
                    side = element.inverse(side)
                torque[:, k] = side.torque[:, 0]
            motion = (x @ self.coupling.T for x in (joint.position, joint.velocity))
            turned = (*motion, joint.acceleration @ self.coupling.T, torque @ self._shares)
            motors = ShaftSeries.at_joint(joint.joints, joint.time, *turned)
        parts = [
            (columns, chain.inverse(motors.of([joint.joints[k] for k in columns])))
            for chain, columns in self._groups
        ]
        merged = _merged(self.name, joint, parts)
        return replace(merged, losses={**lost, **merged.losses})

    def holding(self, torque: Array, position: Array | None = None) -> HoldingResult:
        """Return what holds joint torques at standstill; see `Chain.holding`.

        `torque`: (..., J) [N*m]. `position`: (..., J) [rad].
        """
        asked = np.array(torque, dtype=float)
        for k, own in enumerate(self.joints):
            if own.apart:  # its friction carries what it can
                at = None if position is None else position[..., k]
                asked[..., k] = least_magnitude(*held(own.apart, asked[..., k], asked[..., k], at))
        load = asked @ self._shares if self.coupled else asked
        at = position @ self.coupling.T if position is not None and self.coupled else position
        out = {one.name: np.empty_like(asked) for one in fields(HoldingResult)}
        for chain, columns in self._groups:
            result = chain.holding(load[..., columns], None if at is None else at[..., columns])
            for name, values in out.items():
                values[..., columns] = getattr(result, name)
        return HoldingResult(**out)


#: Who answers for all joints of a machine: one chain that they share, or a drivetrain for each.
Actuators = Chain | Drivetrains


def drivetrains_of(actuators: Actuators, names: Sequence[str]) -> Drivetrains:
    """A drivetrain per joint."""
    if isinstance(actuators, Drivetrains):
        return actuators
    return Drivetrains(actuators.name, joints_of(actuators, tuple(names)))


def _merged(
    name: str, joint: ShaftSeries, parts: Sequence[tuple[list[int], ChainResult]]
) -> ChainResult:
    """The results of some columns each as one result of all columns."""

    def whole(value: Callable[[ChainResult], Array | None]) -> Array:
        out = np.zeros(joint.torque.shape)
        for columns, result in parts:
            own = value(result)
            if own is not None:
                out[:, columns] = own
        return out

    def shaft(side: Callable[[ChainResult], ShaftSeries]) -> ShaftSeries:
        columns = {n: whole(lambda r, n=n: getattr(side(r), n)) for n in BY_JOINT}  # type: ignore[misc]
        return ShaftSeries(joints=joint.joints, time=joint.time, **columns)

    def by_element(rows: Callable[[ChainResult], Mapping[str, Array]]) -> dict[str, Array]:
        names = dict.fromkeys(itertools.chain(*(rows(result) for _, result in parts)))
        return {n: whole(lambda r, n=n: rows(r).get(n)) for n in names}  # type: ignore[misc]

    first = parts[0][1]
    *inner, motor = first.shafts
    # Shafts that all of them have, and the motors' whatever they are called.
    shared = [stage for stage in inner if all(stage in result.shafts for _, result in parts)]
    shafts = {stage: shaft(lambda r, stage=stage: r.shafts[stage]) for stage in shared}  # type: ignore[misc]
    losses = by_element(lambda r: r.losses)
    copper = tuple(first.losses)[-1]
    losses[copper] = losses.pop(copper)  # last
    motors = {k: m for columns, r in parts for k, m in zip(columns, r.motors, strict=True)}
    return ChainResult(
        chain=name,
        shafts={**shafts, motor: shaft(lambda r: r.motor)},
        losses=losses,
        stored=by_element(lambda r: r.stored),
        current=whole(lambda r: r.current),
        voltage=whole(lambda r: r.voltage),
        electrical_power=whole(lambda r: r.electrical_power),
        motors=tuple(motors[k] for k in range(len(motors))),
    )
