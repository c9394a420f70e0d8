"""Today's actuators of the robot in the same day: what they draw, and which limits they meet."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.energy.energy import supply_of
from actuators.energy.limits import limit_rows
from actuators.supply import driver_of
from pipeline.choice.loads import loads_of
from pipeline.simulation.machine import IDEAL

if TYPE_CHECKING:
    from pipeline.choice.choose import Chosen


def today_rows(chosen: Chosen) -> Iterator[dict[str, Any]]:
    """A row of table ``answers`` for each drivetrain of the robot's file with a motor.

    Its bodies hold these actuators as they are; every joint has a driver of the choice that is on
    all day, and no brakes.
    """
    problem, shelf = chosen.problem, chosen.search.shelf
    if not problem.machine.motors.stated:
        return  # they are some robot's, not this one's
    loads = loads_of(problem.machine, problem.modes)
    hours = np.array([load.mode.hours for load in loads])
    sheet = {entry: number.value for entry, number in shelf.numbers[shelf.driver].items()}
    driver = driver_of(shelf.driver, sheet)
    for name, chain in problem.machine.chains().items():
        if name == IDEAL:
            continue
        power, use, where = np.zeros(len(loads)), -1.0, ""
        for m, load in enumerate(loads):
            result = chain.inverse(load.series)
            lost = driver.loss(result.current, shelf.voltage) - driver.idle
            flow = result.electrical_power + lost
            out = supply_of(flow, load.series.time, load.series.joints, problem.account.recovered)
            power[m] = out.supplied_energy.sum() / load.duration + problem.account.hotel
            power[m] += driver.idle * len(load.series.joints)
            for row in limit_rows(result):
                if np.isfinite(row.limit) and row.peak / row.limit > use:
                    use, where = row.peak / row.limit, f"{row.quantity} of {row.joint}"
                    where = f"motor's {where}, {load.mode.name}".replace("_", " ")
        mean = float(power @ hours / hours.sum())
        lasts = problem.battery.hours(power, hours / hours.sum())
        present = problem.present * sum(map(len, problem.groups.values()))
        nothing = dict.fromkeys(("power_low_W", "power_high_W", "price_EUR", "chance_within"))
        yield dict(
            answer=f"today: {name}",
            recommended=False,
            power_W=mean,
            battery_h=lasts,
            actuator_mass_kg=present,
            robot_mass_kg=problem.machine.edited.mass,
            nearest_limit=where,
            limit_use=use if where else None,
            design="as the robot's file has them",
            **nothing,
        )
