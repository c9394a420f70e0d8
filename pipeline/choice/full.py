"""Modes through full chains, drivers included, and how long a battery lasts.

The law of each driver takes the current that the chain gives: what it conducts and switches comes
before what flows back is split, its idle power after it, but on a bus that all share.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult
from actuators.energy.energy import BUS, integral, supply_of
from actuators.supply import Battery
from pipeline.choice.loads import Load
from pipeline.choice.parts.designs import Designs
from pipeline.choice.track import Account
from pipeline.machine.joint import Drivetrains, JointModel, joints_of

#: Joints of each group, and their one design.
Built = Mapping[str, tuple[tuple[str, ...], Designs]]


@dataclass(frozen=True, eq=False)
class Full:
    """One mode of one robot."""

    load: Load  #: The mode.
    result: ChainResult  #: Of the chains.
    driver: Array  #: Mean of conduction and switching, (J,) [W].
    idle: Array  #: Of the drivers that are on, (J,) [W].
    power: Array  #: Mean out of the supply, idle power included, (J,) [W].
    dumped: Array  #: Mean that flows back and is lost, (J,); none on a bus [W].
    total: float  #: Mean of the robot out of the supply, with the hotel load [W].
    lost: float  #: Mean that the robot dumps [W].
    peak: float  #: Greatest of the robot out of the supply [W].


def through(load: Load, built: Built, account: Account) -> Full:
    """One mode through full chains, with what is built at the joints."""
    mode, names, time = load.mode, load.series.joints, load.series.time
    models: dict[str, JointModel] = {}
    for joints, design in built.values():
        chain = design.chain(0, engaged=mode.engaged)
        models |= {model.name: model for model in joints_of(chain, joints)}
    result = Drivetrains("answer", tuple(models[j] for j in names)).inverse(load.series)
    driver, idle, on = np.zeros(result.current.shape), np.zeros(len(names)), np.ones(len(names))
    for joints, design in built.values():
        at = [names.index(joint) for joint in joints]
        driver[:, at] = design.driver.loss(result.current[:, at], design.bus) - design.idle
        idle[at] = design.idle
        if not mode.drivers and design.locks(mode.engaged)[0]:
            on[at] = (result.current[:, at] != 0.0).any(axis=0)
    idle *= on
    flow = result.electrical_power + driver
    own = supply_of(flow, time, names, "fraction", account.recovered)
    power = own.supplied_energy / load.duration + idle
    dumped = own.dumped_energy / load.duration
    drawn = own.supplied.sum(axis=1) + idle.sum() + account.hotel
    total, lost = float(power.sum()) + account.hotel, float(dumped.sum())
    if account.policy == BUS:
        each = np.column_stack([flow + idle, np.full(len(time), account.hotel)])
        bus = supply_of(each, time, (*names, "hotel"), BUS)
        total = float(bus.supplied_energy.sum()) / load.duration
        lost = float(bus.dumped_energy.sum()) / load.duration
        drawn = bus.supplied.sum(axis=1)
    mean = integral(time, driver) / load.duration
    return Full(load, result, mean, idle, power, dumped, total, lost, float(drawn.max()))


def lasting(battery: Battery, day: Sequence[Full], least: float) -> float:
    """How long a full battery lasts in the modes of a day [h].

    Below the least voltage [V] a driver gives a motor less than it needs.
    """
    shares = np.array([full.load.mode.hours for full in day])
    power = np.array([full.total for full in day])
    peak = np.array(max(full.peak for full in day))
    return float(battery.hours(power, shares / shares.sum(), peak=peak, cut_off=least))
