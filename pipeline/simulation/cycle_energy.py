"""What a walking cycle and three seconds of standing cost, by leg and robot; static stability.

And what effects change of it: energy per cycle and break-even, with and without them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from actuators.arrays import Array
from actuators.chain import HoldingResult
from actuators.energy.energy import BUS, Supply, split_integral
from pipeline.column import column
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand
from pipeline.machine.joint import Actuators
from pipeline.motion.gait import gait_of
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.walk_stand import Adjust, Effects, stand, walk

Legs = Mapping[str, Sequence[str]]
#: Account of the joints outside the legs, which are held.
HELD = "held joints"
#: Time over which the paper adds up standing energy: that of one gait cycle [s].
STANDING_TIME = 3.0
#: Samples per half period of the gait: energies within 1 % and a fraction of a second.
SAMPLES = 151
PAIR = ("reversible", "irreversible")


@dataclass(frozen=True)
class Cost:
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


def energy_change(
    robot: Robot, chains: Mapping[str, Actuators], effects: Effects, known: Effects | None = None
) -> EnergyChange:
    """Walk and stand with and without effects, but those `known`, which count on both sides.

    Raises:
        StanceError: With the effects a foot would have to pull.
    """
    period = gait_of(robot.spec).period
    if known is None:
        before = _costs(robot, chains, None)
    else:
        before = _costs(known.robot, known.chains(chains), known.demand)
    complete = {name: chain for name, chain in chains.items() if effects.counts_in(name)}
    after = _costs(effects.robot, effects.chains(complete), effects.demand)
    return EnergyChange(before, after, crossing(before, period), crossing(after, period))


def _costs(robot: Robot, chains: Mapping[str, Actuators], adjust: Adjust | None) -> dict[str, Cost]:
    walking = walk(robot, chains, samples=SAMPLES, adjust=adjust)
    standing = stand(robot, chains, adjust=adjust)
    legs = [leg for leg in robot.spec.legs if leg.station == "middle"] or robot.spec.legs
    middle = [robot.joints.index(joint) for leg in legs for joint in leg.joints]
    out = {}
    for name in chains:
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
    if extra <= 0 or saved <= 0:
        return math.nan
    return extra / (extra + saved)


@dataclass(frozen=True)
class StandingEnergy:
    """What a leg takes to stand."""

    table: ClassVar = "standing_energy"
    alternative: str = column("actuator alternative")
    leg: str = column("leg; those not among the standing feet are lifted")
    energy_J: float = column("electrical energy of the leg in 3 s", "J")


@dataclass(frozen=True)
class LegEnergy:
    """What a leg, or the robot, takes per cycle."""

    table: ClassVar = "walking_energy"
    alternative: str = column("actuator alternative")
    leg: str = column("leg, or the robot as a whole")
    electrical_J: float = column("energy drawn from the supply per cycle", "J", "electrical energy")
    ratio_to_ideal: float | None = column(
        "over that of the ideal actuator", "1", "ratio to the ideal"
    )


@dataclass(frozen=True)
class RobotEnergy:
    """What the robot takes per cycle, and which phase of its legs takes it."""

    table: ClassVar = "robot_energy"
    alternative: str = column("actuator alternative")
    energy_per_cycle_J: float = column("energy drawn from the supply per cycle", "J")
    average_power_W: float = column("over one cycle", "W")
    cost_of_transport: float | None = column("average power over weight times speed", "1")
    support_share: float | None = column(
        "share of joints while their foot supports; empty on a bus", "1", "share of support"
    )
    transfer_share: float | None = column(
        "share of joints while their foot is in the air", "1", "share of transfer"
    )
    dumped_J: float = column(
        "electrical energy per cycle that flows back and is lost", "J", "returned and lost"
    )


@dataclass(frozen=True)
class Stability:
    """How far from tipping and sliding the robot is on one set of standing feet."""

    table: ClassVar = "walking_stability"
    segment: str = column("which feet support")
    least_margin_m: float = column("centre of mass to nearest edge of the support polygon", "m")
    at_time_s: float = column("instant of the least margin", "s")
    least_normal_force_N: float = column("lightest load on a supporting foot", "N")
    greatest_friction_needed: float = column("largest tangential over normal force", "1")
    foot_of_greatest_friction: str = column("leg that needs it")


@dataclass(frozen=True)
class QuasiStaticTorque:
    """What the links' inertia adds to the torque of a joint."""

    table: ClassVar = "quasi_static_torque"
    about: ClassVar = "Full inverse dynamics against gravity and contact alone."
    joint: str = column("joint")
    peak_torque_full_Nm: float = column("largest magnitude with all inertial terms", "N*m")
    peak_torque_quasi_static_Nm: float = column("without the links' inertial terms", "N*m")
    largest_difference_Nm: float = column("largest difference at one instant", "N*m")


@dataclass(frozen=True)
class QuasiStaticEnergy:
    """What the links' inertia adds to the energy of a leg."""

    table: ClassVar = "quasi_static_energy"
    about: ClassVar = "Reflected rotor inertia stays in the actuator chain in both."
    alternative: str = column("actuator alternative")
    leg: str = column("leg, or the robot as a whole")
    full_J: float = column("electrical energy per cycle with all inertial terms", "J")
    quasi_static_J: float = column("without the links' inertial terms", "J")
    relative_difference: float | None = column("quasi-static over full, less one", "1")


def leg_joints(spec: RobotSpec) -> dict[str, tuple[str, ...]]:
    """Each leg's joints, and those outside the legs together."""
    legs = {leg.name: leg.joints for leg in spec.legs}
    held = tuple(joint for joint, _ in spec.held)
    return legs | {HELD: held} if held else legs


def standing_energies(
    demand: JointDemand, holding: Mapping[str, HoldingResult], legs: Legs
) -> list[StandingEnergy]:
    """Energy of each leg in three seconds of standing, by alternative."""
    return [
        StandingEnergy(
            name,
            leg,
            sum(float(result.power[demand.joints.index(j)]) for j in joints) * STANDING_TIME,
        )
        for name, result in holding.items()
        for leg, joints in legs.items()
    ]


def leg_energies(supply: Supply, legs: Legs) -> dict[str, float]:
    """Electrical energy per cycle of each leg and of the robot [J].

    On a shared bus one leg's return feeds another, so only the robot has an energy of its own.
    """
    energy = dict(zip(supply.accounts, supply.supplied_energy.tolist(), strict=True))
    total = {"robot": float(sum(energy.values()))}
    if BUS in energy:
        return total
    return {leg: sum(energy[j] for j in joints) for leg, joints in legs.items()} | total


def walking_energies(supplies: Mapping[str, Supply], legs: Legs, ideal: str) -> list[LegEnergy]:
    """Energy per cycle by alternative and leg, and its ratio to the ideal actuator's."""
    base = leg_energies(supplies[ideal], legs) if ideal in supplies else {}
    return [
        LegEnergy(name, leg, energy, energy / base[leg] if base.get(leg, 0.0) > 0 else None)
        for name, supply in supplies.items()
        for leg, energy in leg_energies(supply, legs).items()
    ]


def robot_energies(
    demand: MotionDemand, supplies: Mapping[str, Supply], legs: Legs, weight: float, speed: float
) -> list[RobotEnergy]:
    """Average power, cost of transport, and how support and transfer share the energy.

    `weight`: of the robot [N]. `speed`: of walking [m/s].
    """
    rows = []
    for name, supply in supplies.items():
        energy = float(supply.supplied_energy.sum())
        power = energy / demand.duration  # [W]
        transport = power / (weight * speed) if speed else None
        support = transfer = None
        if BUS not in supply.accounts and None not in demand.contacts:
            stood = 0.0  # of the joints of legs while they stand [J]
            for contacts in filter(None, demand.contacts):
                # The segment's own rows: of the doubled stamps at its ends, the ones inside it.
                first = int(np.searchsorted(supply.time, contacts.time[0], side="left"))
                last = int(np.searchsorted(supply.time, contacts.time[-1], side="right"))
                columns = [supply.accounts.index(j) for leg in contacts.stance for j in legs[leg]]
                drawn = supply.electrical[first:last][:, columns]
                forward, reverse = split_integral(supply.time[first:last], drawn)
                stood += float((forward - supply.recovered * reverse).sum())
            support = stood / energy
            transfer = 1 - support - leg_energies(supply, legs).get(HELD, 0.0) / energy
        dumped = float(supply.dumped_energy.sum())
        rows.append(RobotEnergy(name, energy, power, transport, support, transfer, dumped))
    return rows


def stability(demand: MotionDemand, margins: Sequence[Array]) -> list[Stability]:
    """Static margin, lightest foot and friction needed, per segment."""
    rows = []
    for part, contacts, margin in zip(demand.segments, demand.contacts, margins, strict=True):
        assert contacts is not None
        normal = contacts.normal_force[:, [leg in contacts.stance for leg in contacts.legs]]
        at, needed = int(margin.argmin()), contacts.friction_needed
        rows.append(
            Stability(
                part.segment,
                float(margin[at]),
                float(part.time[at]),
                float(normal.min()),
                float(np.nanmax(needed)),
                contacts.legs[int(np.nanargmax(needed)) % needed.shape[1]],
            )
        )
    return rows


def quasi_static_torques(full: MotionDemand, static: MotionDemand) -> list[QuasiStaticTorque]:
    """What the links' inertial terms change at each joint."""
    one, two = (np.concatenate([part.torque for part in d.segments]) for d in (full, static))
    peaks = (np.abs(torque).max(axis=0) for torque in (one, two, one - two))
    return [QuasiStaticTorque(*row) for row in zip(full.joints, *peaks, strict=True)]


def quasi_static_energies(
    full: Mapping[str, Supply], static: Mapping[str, Supply], legs: Legs
) -> list[QuasiStaticEnergy]:
    """What the links' inertial terms change in each leg."""
    rows = []
    for name, supply in full.items():
        other = leg_energies(static[name], legs)
        for leg, energy in leg_energies(supply, legs).items():
            change = (other[leg] - energy) / energy if energy else None
            rows.append(QuasiStaticEnergy(name, leg, energy, other[leg], change))
    return rows
