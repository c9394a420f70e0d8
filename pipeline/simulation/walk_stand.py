"""Standing, walking and any other motion: a robot's demand through every actuator alternative.

What a model file's effects change in standing and walking. Bodies and ground change what is
demanded of the joints; so do springs and ripples, which act beside the actuators. They count in
every alternative, and so does what is found of the motor, which all of them share. Friction,
inertia and coupling of a drivetrain belong to the alternative they were found against: what was
found against a motor's data sheet alone is all that the machine's gears lose. Another alternative
has gears, and losses of their own in the catalogue; to add one to the other would count gears
twice, and to put one in place of the other would make a self-locking gear lock no more. So there
they do not count, and it is said.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult, HoldingResult
from actuators.energy.energy import Supply, supply
from actuators.reversals import split_at_reversals
from actuators.shaft import ShaftSeries
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.force_rules import PAPER, GroundForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand, motion_demand, segment_demand
from pipeline.machine.joint import Actuators, Drivetrains, JointModel
from pipeline.machine.machine import MachineModel, machine_of_robot
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.support import stability_margins, standing_posture
from pipeline.motion.walking import walking_motion
from pipeline.robot.kinematics import leg_posture
from pipeline.robot.robot import Robot
from pipeline.simulation.options import NOTHING_RETURNS, SAMPLES, Recovery
from pipeline.simulation.rigid_bodies import changed_model, outward

if TYPE_CHECKING:
    from pandas import DataFrame

#: The alternative that stays without losses.
IDEAL = "ideal"
#: What acts on sensors alone.
SENSORS = ("effort_offset", "effort_gain", "position_offset", "time_delay")
#: What moves the motor by so little, or changes so slowly, that one cycle does not see it.
LEFT_OUT = {
    "joint_elasticity": "the motor's own motion differs by the wind-up only",
    "backlash": "the motor's own motion differs by the gap only",
    "warming_friction": "friction is that of the temperature which its file states",
    "winding_heating": "one cycle is too short to warm a winding; numbers are for cold motors",
}


@dataclass(frozen=True)
class Effects:
    """A model file's effects, ready for standing and walking."""

    robot: Robot  #: With the bodies and the ground that the effects change.
    names: tuple[str, ...]  #: Of the effects in order.
    found_with: str  #: Alternative against which they were found; empty for none.
    apply: Callable[[MachineModel], MachineModel]  #: Puts them into a machine.
    _bare: MachineModel
    _machine: MachineModel
    warnings: tuple[str, ...] = ()  #: What of the model file a reader should know.

    @property
    def of_drivetrain(self) -> tuple[str, ...]:
        """Joints whose drivetrain the effects change."""
        pairs = zip(self._bare.actuators, self._machine.actuators, strict=True)
        return tuple(new.name for old, new in pairs if _drivetrain(old) != _drivetrain(new))

    def counts_in(self, alternative: str) -> bool:
        """Whether all that the effects change in actuators counts in an alternative.

        The ideal one has no losses by definition; there is nothing to report about it.
        """
        return alternative in (IDEAL, self.found_with) or not self.of_drivetrain

    def chain(self, actuators: Actuators) -> Actuators:
        """One alternative with the effects in it that count there; itself where none does."""
        if actuators.name == IDEAL:
            return actuators
        bare = machine_of_robot(self.robot, actuators)
        edited = self.apply(bare).actuators
        if not self.counts_in(actuators.name):
            edited = tuple(
                replace(new, elements=old.elements, output=(), coupled_to="", coupling=0.0)
                for old, new in zip(bare.actuators, edited, strict=True)
            )
        if all(
            _drivetrain(old) == _drivetrain(new) and old.motor is new.motor
            for old, new in zip(bare.actuators, edited, strict=True)
        ):
            return actuators
        return Drivetrains(actuators.name, edited)

    def chains(self, chains: Mapping[str, Actuators]) -> dict[str, Actuators]:
        """Every alternative with the effects in it."""
        return {name: self.chain(chain) for name, chain in chains.items()}

    def demand(self, segment: Segment, demand: JointDemand) -> JointDemand:
        """Demand of bodies and ground with springs, ripples, and feet that squeeze the ground."""
        torque = np.array(demand.torque)
        for k, actuator in enumerate(self._machine.actuators):
            torque[:, k] = actuator.drive_load(demand.position[:, k], torque[:, k])
        squeeze = self._machine.bodies.squeeze
        if squeeze and segment.stance:
            robot = self.robot
            standing = [[leg in segment.stance for leg in robot.leg_names]]
            force = np.zeros((segment.time.size, len(robot.leg_names), 3))
            force[..., 1] = squeeze * outward(self._machine.left, np.array(standing))
            q = robot.leg_positions(segment.configuration)
            part = leg_posture(robot.chains, q).force_torques(force)
            torque -= robot.layout.by_joint(part)
        return replace(demand, torque=torque)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What of the file does not hold, and which effects leave standing and walking be."""
        out = [*self.warnings]
        out += [
            f"{name} acts on a sensor: standing and walking stay as they are"
            for name in self.names
            if name in SENSORS
        ]
        out += [f"{n} is left out: {LEFT_OUT[n]}" for n in self.names if n in LEFT_OUT]
        if self.of_drivetrain:
            against = f"'{self.found_with}'" if self.found_with else "no actuator at all"
            out.append(
                f"what was found of the drivetrain of {', '.join(self.of_drivetrain)} was found "
                f"against {against} and counts there alone: other actuators have gears with losses "
                "of their own, to which it cannot be added"
            )
        return tuple(dict.fromkeys(out))


def _drivetrain(actuator: JointModel) -> tuple[object, ...]:
    """What stands between joint and motor."""
    elements = (*actuator.output, *actuator.elements)
    return (*map(id, elements), actuator.coupled_to, actuator.coupling)


def effects_on(
    robot: Robot,
    actuators: Actuators,
    apply: Callable[[MachineModel], MachineModel],
    names: tuple[str, ...],
    *,
    found_with: str | None = None,
    warnings: tuple[str, ...] = (),
) -> Effects:
    """Effects on a robot as its file states it; see `Effects` for what they hold.

    `actuators`: of the alternative they were found against, or of any with a motor; it counts as
    the former where `found_with` names none.

    Raises:
        LegwattError: An effect does not fit the robot.
    """
    bare = machine_of_robot(robot, actuators)
    machine = apply(bare)
    model = changed_model(machine.rigid, machine.bodies)
    edited = robot if model is robot.model else replace(robot, model=model)
    own = actuators.name if found_with is None else found_with
    return Effects(edited, names, own, apply, bare, machine, warnings)


#: From the demand of bodies and ground to that on the actuators.
Adjust = Callable[[Segment, JointDemand], JointDemand]


@dataclass(frozen=True)
class Standing:
    """The robot standing still."""

    segment: Segment  #: The posture.
    demand: JointDemand  #: Torques to hold, one sample.
    contacts: ContactForces  #: Ground forces, one sample.
    holding: Mapping[str, HoldingResult]  #: By alternative; arrays of shape (J,).


@dataclass(frozen=True)
class Walking:
    """The robot over one gait cycle, or another motion."""

    motion: Motion  #: The gait's, or the user's own.
    demand: MotionDemand  #: At the joints.
    margins: tuple[Array, ...]  #: Static stability by segment [m]; none on a fixed base.
    results: Mapping[str, ChainResult]  #: By alternative.
    supplies: Mapping[str, Supply]  #: What each alternative takes from the supply.


@dataclass(frozen=True, eq=False)
class Demand:
    """What a motion demands of the joints."""

    motion: Motion = field(repr=False)  #: Base and joints over time.
    #: Position, velocity, acceleration and torque by segment.
    joints: MotionDemand = field(repr=False)
    #: Names of the prismatic joints: metres and newtons, not radians.
    sliding: tuple[str, ...] = ()

    @cached_property
    def series(self) -> ShaftSeries:
        """The joints' side of the actuators, with a sample at every zero of a velocity."""
        return joint_series(self.joints)

    def frame(self) -> DataFrame:
        """Position, velocity, acceleration and torque over time, units in the column names."""
        from pipeline.simulation.tables import walking_joint_demand

        return walking_joint_demand(self.joints, self.sliding)


def joint_series(demand: MotionDemand, joints: Sequence[str] | None = None) -> ShaftSeries:
    """The joints' side of the actuators: segments in a row, split at velocity zeros."""
    names = tuple(joints or demand.joints)
    columns = [demand.joints.index(joint) for joint in names]
    time = np.concatenate([part.time for part in demand.segments])
    quantities = (
        np.concatenate([getattr(part, name)[:, columns] for part in demand.segments])
        for name in ("position", "velocity", "acceleration", "torque")
    )
    return split_at_reversals(ShaftSeries.at_joint(names, time, *quantities))


def stand(
    robot: Robot,
    chains: Mapping[str, Actuators],
    feet: tuple[str, ...] | None = None,
    adjust: Adjust | None = None,
    forces: GroundForces = PAPER,
) -> Standing:
    """Stand still on some legs, the robot file's by default, and hold; see `walk`.

    Raises:
        StanceError: A foot would have to pull or slide.
    """
    segment = standing_posture(robot, feet)
    demand, contacts = segment_demand(robot, segment, forces=forces)
    assert contacts is not None
    if adjust is not None:
        demand = adjust(segment, demand)
    torque, position = demand.torque[0], demand.position[0]
    holding = {name: chain.holding(torque, position) for name, chain in chains.items()}
    return Standing(segment, demand, contacts, holding)


def demand_along(
    robot: Robot,
    motion: Motion,
    *,
    quasi_static: bool = False,
    adjust: Adjust | None = None,
    forces: GroundForces = PAPER,
) -> MotionDemand:
    """What a motion demands of the actuators; see `walk` for the arguments."""
    demand = motion_demand(robot, motion, forces=forces, quasi_static=quasi_static)
    if adjust is None:
        return demand
    pairs = zip(motion.segments, demand.segments, strict=True)
    return replace(demand, segments=tuple(adjust(segment, part) for segment, part in pairs))


def walk(
    robot: Robot,
    chains: Mapping[str, Actuators],
    *,
    samples: int = SAMPLES,
    motion: Motion | None = None,
    quasi_static: bool = False,
    returned: Recovery = NOTHING_RETURNS,
    adjust: Adjust | None = None,
    forces: GroundForces = PAPER,
) -> Walking:
    """Walk one cycle of the robot file's gait, or move as given.

    Args:
        robot: The robot, with a floating base where it walks.
        chains: By alternative.
        samples: Per half period of the gait.
        motion: In place of the gait, for example from `pipeline.simulation.own_motion`.
        quasi_static: Leave out the links' inertial terms.
        returned: What becomes of returned energy; nothing by default.
        adjust: Changes the demand on the actuators; see `pipeline.simulation.walk_stand`.
        forces: How the ground's forces are chosen.

    Raises:
        StanceError: A foot would have to pull or slide.
    """
    motion = motion or walking_motion(robot, samples=samples)
    demand = demand_along(robot, motion, quasi_static=quasi_static, adjust=adjust, forces=forces)
    series = joint_series(demand)
    results = {name: chain.inverse(series) for name, chain in chains.items()}
    steady = motion.segments if robot.floating else ()
    return Walking(
        motion,
        demand,
        tuple(stability_margins(robot, segment) for segment in steady),
        results,
        {name: supply(result, *returned) for name, result in results.items()},
    )
