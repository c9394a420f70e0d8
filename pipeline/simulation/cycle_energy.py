"""What a walking cycle and standing cost, by leg, and what effects change of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from actuators.energy.energy import BUS, Supply, split_integral
from pipeline.dynamics.joint_demand import MotionDemand
from pipeline.motion.gait import gait_of
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine

Legs = Mapping[str, Sequence[str]]
#: Account of the joints outside the legs, which are held.
HELD = "held joints"
#: Time over which the paper adds up standing energy: that of one gait cycle [s].
STANDING_TIME = 3.0
#: Samples per half period of the gait: energies within 1 % and a fraction of a second.
SAMPLES = 151
PAIR = ("reversible", "irreversible")


class Cost(NamedTuple):
    """Energies with one alternative."""

    cycle: float  #: Electrical energy of one gait cycle, whole robot [J].
    standing: float  #: Electrical power, standing as the robot file says, whole robot [W].
    middle_cycle: float  #: Of the middle legs alone, on which the paper's break-even rests [J].
    middle_standing: float  #: Likewise [W].


@dataclass(frozen=True)
class EnergyChange:
    """Before and after effects."""

    before: Mapping[str, Cost]  #: By alternative.
    after: Mapping[str, Cost]  #: By alternative; of those alone in which all the effects count.
    #: Fraction of time standing above which the irreversible actuator uses less in the middle legs
    #: (Fig. 21 of the paper); NaN where there is none.
    break_even_before: float
    break_even_after: float  #: The same with the effects.


def energy_change(before: Machine, after: Machine) -> EnergyChange:
    """Walk and stand without and with effects.

    Raises:
        StanceError: With the effects a foot would have to pull.
    """
    names, edits = [*before.catalog.alternatives], after.effects
    counted = [name for name in names if edits is None or edits.counts_in(name)]
    old, new = costs(before, names), costs(after, counted)
    period = gait_of(before.robot.spec).period
    return EnergyChange(old, new, crossing(old, period), crossing(new, period))


def costs(machine: Machine, names: Sequence[str]) -> dict[str, Cost]:
    """Energies of a machine with some of its drivetrain options."""
    chains = machine.chains(*names) if names else {}
    walking, standing = machine.walking(samples=SAMPLES).walk(chains), machine.stand(chains)
    robot = machine.robot
    legs = [leg for leg in robot.spec.legs if leg.station == "middle"] or robot.spec.legs
    middle = [robot.joints.index(joint) for leg in legs for joint in leg.joints]
    out = {}
    for name in names:
        energy, power = walking.supplies[name].supplied_energy, standing.holding[name].power
        out[name] = Cost(*(float(x.sum()) for x in (energy, power, energy[middle], power[middle])))
    return out


def crossing(costs: Mapping[str, Cost], period: float) -> float:
    """The break-even of the alternatives of `PAIR`; NaN without one of them, too."""
    if any(name not in costs for name in PAIR):
        return math.nan
    reversible, irreversible = (costs[name] for name in PAIR)
    extra = (irreversible.middle_cycle - reversible.middle_cycle) / period  # [W]
    saved = reversible.middle_standing - irreversible.middle_standing  # [W]
    return break_even(extra, saved)


def break_even(extra: float, saved: float) -> float:
    """Fraction of time standing at which two actuators cost the same; above it the second pays.

    (1 - f) extra = f saved (Fig. 21 of the paper), with what the second one costs more walking and
    less standing for as long [J, or W]; NaN where it does not do both.
    """
    return extra / (extra + saved) if extra > 0 and saved > 0 else math.nan


def leg_joints(spec: RobotSpec) -> dict[str, tuple[str, ...]]:
    """Each leg's joints, and those outside the legs together."""
    legs = {leg.name: leg.joints for leg in spec.legs}
    held = tuple(joint for joint, _ in spec.held)
    return legs | {HELD: held} if held else legs


def leg_energies(supply: Supply, legs: Legs) -> dict[str, float]:
    """Electrical energy per cycle of each leg and of the robot [J].

    On a shared bus one leg's return feeds another, so only the robot has an energy of its own.
    """
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
