"""How a machine stands and walks, declared once, and what it gives: arrays by drivetrain option."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from actuators.arrays import Array
from actuators.chain import ChainResult, HoldingResult
from actuators.checked import Number, Table
from actuators.energy.energy import Supply, recovery
from actuators.reversals import split_at_reversals
from actuators.shaft import ShaftSeries
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand
from pipeline.motion.motion import Motion, Segment

if TYPE_CHECKING:
    from pandas import DataFrame

#: The drivetrain option that stays without losses.
IDEAL: Final = "ideal"


#: Every joint's energy is then within 0.7 % of the limit of fine sampling, on every transfer path.
LEAST_SAMPLES: Final = 51
#: A cycle of a robot of 18 joints then takes some 7 GB of memory.
MOST_SAMPLES: Final = 100_000
SAMPLES: Final = 751


def _known(text: object) -> str:
    recovery(str(text))
    return str(text)


class WalkOptions(Table):
    """Options of standing and walking; names and defaults are the command line's."""

    noun = "option"
    samples: int = Field(
        default=SAMPLES,
        ge=LEAST_SAMPLES,
        le=MOST_SAMPLES,
        description="per half period of the gait",
    )
    quasi_static: bool = Field(default=False, description="leave out the links' inertial terms")
    regeneration: Annotated[str, BeforeValidator(_known)] = Field(
        default="none",
        description="what becomes of electrical energy that motors return: none (it is lost), bus "
        "(other motors use it at that instant), or the fraction that is used again, e.g. 0.5",
    )
    forces: Literal["least_tangential", "least_torque"] = Field(
        default="least_tangential",
        description="how the ground's forces are chosen: least_tangential (the paper's rule) or "
        "least_torque (joint torques squared)",
    )
    friction_coefficient: Annotated[Number, Field(gt=0)] | None = Field(
        default=None,
        description="greatest tangential over normal force of a foot; gait.friction_coefficient, "
        "else no limit, by default",
    )
    #: CSV file or DataFrame of time, joint positions and contacts; README.md has its columns.
    motion: Any = Field(
        default=None,
        description="CSV to move by instead of the gait: time_s, JOINT__position_rad and, unless "
        "the base is fixed, LEG__contact (0 or 1); base__x_m to base__yaw_rad where known",
    )


USUAL: Final = WalkOptions()


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
