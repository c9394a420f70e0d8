"""Today's actuators of the robot in the same day: what they draw, and which limits they meet."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.energy import duration, limit_rows, supply_of
from actuators.supply import driver_of
from pipeline.choice.loads import loads_of
from pipeline.columns import declared
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
    loads, joints = loads_of(problem.machine, problem.modes), problem.machine.robot.joints
    share = np.array([load.mode.hours for load in loads]) / chosen.hours
    driver = driver_of(shelf.driver, shelf.values(shelf.driver))
    always = problem.wanted.value("hotel", 0.0) + driver.idle * len(joints)  # [W]
    for name, chain in problem.machine.chains().items():
        if name == IDEAL:
            continue
        power, limits = np.full(len(loads), always), []
        for m, load in enumerate(loads):
            result = chain.inverse(load.series)
            flow = result.electrical_power + driver.loss(result.current, shelf.voltage)
            out = supply_of(flow - driver.idle, load.series.time, joints, problem.wanted.recovered)
            power[m] += out.supplied_energy.sum() / duration(load.series.time)
            limits += [
                (row.peak / row.limit, f"motor's {row.quantity} of {row.joint}, {load.mode.name}")
                for row in limit_rows(result)
                if np.isfinite(row.limit)
            ]
        use, where = max(limits, key=lambda found: found[0], default=(None, ""))
        yield dict.fromkeys(declared("answers")) | dict(
            answer=f"today: {name}",
            recommended=False,
            power_W=float(power @ share),
            more_power_W=float(power @ share) - chosen.best.power,
            battery_h=problem.battery.hours(power, share),
            actuator_mass_kg=problem.present * sum(map(len, problem.groups.values())),
            robot_mass_kg=problem.machine.edited.mass,
            nearest_limit=where.replace("_", " "),
            limit_use=use,
            chance_least=None,
            design="as the robot's file has them",
        )
