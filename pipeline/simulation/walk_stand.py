"""Standing, walking and any other motion: a robot's demand through every drivetrain option."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult, HoldingResult
from actuators.energy.energy import Supply, supply
from actuators.reversals import split_at_reversals
from actuators.shaft import ShaftSeries
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.force_rules import PAPER, GroundForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand, motion_demand, segment_demand
from pipeline.machine.drivetrains import Actuators
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.support import stability_margins, standing_posture
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot
from pipeline.simulation.options import USUAL, WalkOptions

if TYPE_CHECKING:
    from pandas import DataFrame

#: The alternative that stays without losses.
IDEAL: Final = "ideal"
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

    def __str__(self) -> str:
        """What moves, for how long, and the largest torque of every joint."""
        frame = self.frame().filter(like="__torque_").abs().max()
        most = frame.nlargest(7).to_string(float_format="{:.4g}".format)
        joints = len(self.joints.joints)
        return f"demand of {joints} joints over {self.joints.duration:.4g} s; largest:\n{most}"


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
    options: WalkOptions = USUAL,
    *,
    adjust: Adjust | None = None,
    forces: GroundForces = PAPER,
) -> MotionDemand:
    """What a motion demands of the actuators; see `walk` for the arguments."""
    demand = motion_demand(robot, motion, forces=forces, quasi_static=options.quasi_static)
    if adjust is None:
        return demand
    pairs = zip(motion.segments, demand.segments, strict=True)
    return replace(demand, segments=tuple(adjust(segment, part) for segment, part in pairs))


def walk(
    robot: Robot,
    chains: Mapping[str, Actuators],
    options: WalkOptions = USUAL,
    *,
    motion: Motion | None = None,
    adjust: Adjust | None = None,
    forces: GroundForces = PAPER,
) -> Walking:
    """Walk one cycle of the robot file's gait, or move as given.

    Args:
        robot: The robot, with a floating base where it walks.
        chains: By drivetrain option.
        options: How it walks.
        motion: In place of the gait, for example from `pipeline.simulation.own_motion`.
        adjust: Changes the demand on the actuators; see `pipeline.simulation.effects`.
        forces: How the ground's forces are chosen.

    Raises:
        StanceError: A foot would have to pull or slide.
    """
    motion = motion or walking_motion(robot, samples=options.samples)
    demand = demand_along(robot, motion, options, adjust=adjust, forces=forces)
    series = joint_series(demand)
    results = {name: chain.inverse(series) for name, chain in chains.items()}
    steady = motion.segments if robot.floating else ()
    margins = tuple(stability_margins(robot, segment) for segment in steady)
    supplies = {name: supply(r, options.regeneration) for name, r in results.items()}
    return Walking(motion, demand, margins, results, supplies)
