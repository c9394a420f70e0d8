"""How a machine stands and walks, with the options of `walk`, and what it costs by leg."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from actuators.arrays import Array
from actuators.chain import ChainResult, HoldingResult
from actuators.checked import Number, Table
from actuators.energy import BUS, Supply, recovery, split_integral
from actuators.reversals import split_at_reversals
from actuators.shaft import ShaftSeries
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand
from pipeline.motion.motion import Motion, Segment
from pipeline.motion.walking import DEFAULT_SAMPLES
from pipeline.robot.robot_file import RobotSpec

if TYPE_CHECKING:
    from pandas import DataFrame

    from pipeline.simulation.machine import Machine

#: The drivetrain option that stays without losses.
IDEAL: Final = "ideal"


#: Every joint's energy is then within 0.7 % of the limit of fine sampling, on every transfer path.
LEAST_SAMPLES: Final = 51
#: A cycle of a robot of 18 joints then takes some 7 GB of memory.
MOST_SAMPLES: Final = 100_000


def _known(text: object) -> str:
    recovery(str(text))
    return str(text)


class WalkOptions(Table):
    """Options of standing and walking; names and defaults are the command line's.

    One more is a field here and its use in `pipeline.simulation.machine`.
    """

    noun = "option"
    samples: int = Field(
        default=DEFAULT_SAMPLES,
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


@dataclass(frozen=True, eq=False)
class Demand(MotionDemand):
    """What a motion demands of the joints."""

    motion: Motion = field(repr=False)  #: Base and joints over time: a gait's, or the user's own.
    #: Names of the prismatic joints: metres and newtons, not radians.
    sliding: tuple[str, ...]

    @cached_property
    def series(self) -> ShaftSeries:
        """The joints' side of the actuators, with a sample at every zero of a velocity."""
        return joint_series(self)

    def frame(self) -> DataFrame:
        """Position, velocity, acceleration and torque over time, units in the column names."""
        from pipeline.simulation.tables import walking_joint_demand

        return walking_joint_demand(self)

    def __str__(self) -> str:
        """What moves, for how long, and the largest torque of every joint."""
        frame = self.frame().filter(like="__torque_").abs().max()
        most = frame.nlargest(7).to_string(float_format="{:.4g}".format)
        return f"demand of {len(self.joints)} joints over {self.duration:.4g} s; largest:\n{most}"


@dataclass(frozen=True)
class Walking:
    """The robot over one gait cycle, or another motion."""

    demand: Demand  #: At the joints.
    margins: tuple[Array, ...]  #: Static stability by segment [m]; none on a fixed base.
    results: Mapping[str, ChainResult]  #: By drivetrain option.
    supplies: Mapping[str, Supply]  #: What each drivetrain option takes from the supply.


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


Legs = Mapping[str, Sequence[str]]
#: Account of the joints outside the legs, which are held.
HELD: Final = "held joints"
#: Account of the joints of a robot without legs.
JOINTS: Final = "joints"
#: Time over which the paper adds up standing energy: that of one gait cycle [s].
STANDING_TIME: Final = 3.0
#: Samples per half period of the gait: energies within 1 % and a fraction of a second.
COST_SAMPLES: Final = 151


def energy_change(before: Machine, after: Machine) -> DataFrame:
    """Electrical energy of a gait cycle [J] and power standing [W], without and with effects.

    A row per drivetrain option; not a number after where not all of the effects count.
    """
    import pandas

    out = pandas.DataFrame(index=[*before.catalog.alternatives])
    for machine, after_it in ((before, ""), (after, "_after")):
        every = machine.chains().items()
        chains = {n: c for n, c in every if machine.counts_in(n) or not after_it}
        walking, standing = (
            machine.walking(samples=COST_SAMPLES).walk(chains),
            machine.stand(chains),
        )
        drawn = {n: s.supplied_energy.sum() for n, s in walking.supplies.items()}
        out[f"cycle_J{after_it}"] = pandas.Series(drawn, dtype=float)
        held = {n: h.power.sum() for n, h in standing.holding.items()}
        out[f"standing_W{after_it}"] = pandas.Series(held, dtype=float)
    return out


def break_even(extra: float, saved: float) -> float:
    """Fraction of time standing at which two actuators cost the same; above it the second pays.

    (1 - f) extra = f saved (Fig. 21 of the paper), with what the second one costs more walking and
    less standing for as long [J, or W]; NaN where it does not do both.
    """
    return extra / (extra + saved) if extra > 0 and saved > 0 else math.nan


def leg_joints(spec: RobotSpec) -> dict[str, tuple[str, ...]]:
    """Each leg's joints, and those outside the legs together."""
    legs = {leg.name: leg.joints for leg in spec.legs}
    held = tuple(spec.held)
    return legs | {HELD if legs else JOINTS: held} if held else legs


def leg_energies(supply: Supply, legs: Legs) -> dict[str, float]:
    """Electrical energy per cycle of each leg and of the robot [J]; on a bus of that alone."""
    energy = dict(zip(supply.accounts, supply.supplied_energy.tolist(), strict=True))
    total = {"robot": float(sum(energy.values()))}
    if BUS in energy:
        return total
    return {leg: sum(energy[j] for j in joints) for leg, joints in legs.items()} | total


def support_energy(demand: MotionDemand, supply: Supply, legs: Legs) -> float | None:
    """Electrical energy of the legs' joints while their feet stand [J]; None on a shared bus."""
    if BUS in supply.accounts or None in demand.contacts:
        return None
    stood = 0.0
    for contacts in filter(None, demand.contacts):
        # The segment's own rows: of the doubled stamps at its ends, the ones inside it.
        first = int(np.searchsorted(supply.time, contacts.time[0], side="left"))
        last = int(np.searchsorted(supply.time, contacts.time[-1], side="right"))
        columns = [supply.accounts.index(j) for leg in contacts.stance for j in legs[leg]]
        drawn = supply.electrical[first:last][:, columns]
        forward, reverse = split_integral(supply.time[first:last], drawn)
        stood += float((forward - supply.recovered * reverse).sum())
    return stood
