"""What a walking cycle and standing cost, by leg, and what effects change of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from actuators.energy.energy import BUS, Supply, split_integral
from pipeline.dynamics.joint_demand import MotionDemand
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine

if TYPE_CHECKING:
    from pandas import DataFrame

Legs = Mapping[str, Sequence[str]]
#: Account of the joints outside the legs, which are held.
HELD = "held joints"
#: Account of the joints of a robot without legs.
JOINTS = "joints"
#: Time over which the paper adds up standing energy: that of one gait cycle [s].
STANDING_TIME = 3.0
#: Samples per half period of the gait: energies within 1 % and a fraction of a second.
SAMPLES = 151


def energy_change(before: Machine, after: Machine) -> DataFrame:
    """Electrical energy of a gait cycle [J] and power standing [W], without and with effects.

    A row per drivetrain option; not a number after where not all of the effects count.
    """
    import pandas

    out = pandas.DataFrame(index=[*before.catalog.alternatives])
    for machine, after_it in ((before, ""), (after, "_after")):
        edits, every = machine.effects, machine.chains().items()
        chains = {n: c for n, c in every if edits is None or edits.counts_in(n) or not after_it}
        walking, standing = machine.walking(samples=SAMPLES).walk(chains), machine.stand(chains)
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
    held = tuple(joint for joint, _ in spec.held)
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
