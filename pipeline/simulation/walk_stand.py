"""What standing, walking and any other motion give: the results, arrays by drivetrain option."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult, HoldingResult
from actuators.energy.energy import Supply
from actuators.reversals import split_at_reversals
from actuators.shaft import ShaftSeries
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand
from pipeline.motion.motion import Motion, Segment

if TYPE_CHECKING:
    from pandas import DataFrame

#: The drivetrain option that stays without losses.
IDEAL: Final = "ideal"


@dataclass(frozen=True)
class Standing:
    """The robot standing still."""

    segment: Segment  #: The posture.
    demand: JointDemand  #: Torques to hold, one sample.
    contacts: ContactForces  #: Ground forces, one sample.
    holding: Mapping[str, HoldingResult]  #: By drivetrain option; arrays of shape (J,).


@dataclass(frozen=True)
class Walking:
    """The robot over one gait cycle, or another motion."""

    motion: Motion  #: The gait's, or the user's own.
    demand: MotionDemand  #: At the joints.
    margins: tuple[Array, ...]  #: Static stability by segment [m]; none on a fixed base.
    results: Mapping[str, ChainResult]  #: By drivetrain option.
    supplies: Mapping[str, Supply]  #: What each drivetrain option takes from the supply.


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
