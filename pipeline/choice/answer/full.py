"""Modes through full chains, drivers included, and how long a battery lasts.

The law of each driver takes the current that the chain gives: what it conducts and switches comes
before what flows back is split, its idle power after it, but on a bus that all share.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.chain import ChainResult
from actuators.energy.energy import integral
from actuators.energy.regeneration import BUS, supply_of
from actuators.supply.battery import Battery
from pipeline.choice.loads import Load
from pipeline.choice.parts.designs import Designs
from pipeline.choice.track import Account
from pipeline.machine.drivetrains import Drivetrains
from pipeline.machine.joint import JointModel, joints_of

Array = NDArray[np.float64]
#: Joints of each group, and their one design.
Built = Mapping[str, tuple[tuple[str, ...], Designs]]


@dataclass(frozen=True, eq=False)
class Full:
    """One mode of one robot."""

    load: Load  #: The mode.
    result: ChainResult  #: Of the chains.
    driver: Array  #: Mean of conduction and switching, (J,) [W].
    idle: Array  #: Of the drivers that are on, (J,) [W].
    on: Array  #: Drivers that are, (J,).
    power: Array  #: Mean out of the supply, idle power included, (J,) [W].
    dumped: Array  #: Mean that flows back and is lost, (J,); none on a bus [W].
    total: float  #: Mean of the robot out of the supply, with the hotel load [W].
    lost: float  #: Mean that the robot dumps [W].
    peak: float  #: Greatest of the robot out of the supply [W].


def through(load: Load, built: Built, account: Account) -> Full:
    """One mode through full chains.

    Args:
        load: The mode.
        built: What is at the joints.
        account: What is counted.
    """
    mode, names = load.mode, load.series.joints
    models: dict[str, JointModel] = {}
    for joints, design in built.values():
        chain = design.chain(0, engaged=not mode.stands or mode.hold == "brake")
        models |= {model.name: model for model in joints_of(chain, joints)}
    result = Drivetrains("answer", tuple(models[j] for j in names)).inverse(load.series)
    driver, idle, on = np.zeros(result.current.shape), np.zeros(len(names)), np.ones(len(names))
    for joints, design in built.values():
        at = [names.index(joint) for joint in joints]
        driver[:, at] = design.driver.loss(result.current[:, at], design.bus) - design.idle
        idle[at] = design.idle
        if not mode.drivers and design.locks(not mode.stands or mode.hold == "brake")[0]:
            on[at] = (result.current[:, at] != 0.0).any(axis=0)
    idle *= on
    flow, time = result.electrical_power + driver, load.series.time
    own = supply_of(flow, time, names, "fraction", account.recovered)
    power = own.supplied_energy / load.duration + idle
    dumped = own.dumped_energy / load.duration
    drawn = own.supplied.sum(axis=1) + idle.sum() + account.hotel
    total, lost = float(power.sum()) + account.hotel, float(dumped.sum())
    if account.policy == BUS:
        each = np.column_stack([flow + idle, np.full(len(time), account.hotel)])
        all_ = supply_of(each, time, (*names, "hotel"), BUS)
        total, lost = (
            float(x.sum()) / load.duration for x in (all_.supplied_energy, all_.dumped_energy)
        )
        drawn = all_.supplied.sum(axis=1)
    mean = integral(time, driver) / load.duration
    peak = float(drawn.max())
    return Full(load, result, mean, idle, on, power, dumped, total, lost, peak)


def lasting(battery: Battery, day: Sequence[Full], least: float) -> float:
    """How long a battery lasts in the modes of a day [h].

    Args:
        battery: When full.
        day: Every mode.
        least: Voltage below which a driver gives a motor less than it needs [V].
    """
    shares = np.array([full.load.mode.hours for full in day])
    power = np.array([full.total for full in day])
    peak = np.array(max(full.peak for full in day))
    return float(battery.hours(power, shares / shares.sum(), peak=peak, cut_off=least))
