"""Break-even of the day: the best that can be driven back against the best that locks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.choice.answer.break_even import Cost, break_even
from pipeline.choice.answer.tables import words
from pipeline.choice.choose import Chosen
from reports.tables.choice import SideRow


def side_rows(chosen: Chosen) -> list[SideRow]:
    """Both, in full chains; none if the day has no standing or no motion, or both are one.

    The power of all modes that move, and of all that stand, keeps its mean while their shares
    change; each robot carries its own actuators.
    """
    hours = np.array([load.mode.hours for load in chosen.loads])
    stands = np.array([load.mode.stands for load in chosen.loads])
    (one, _), (two, _) = chosen.sides.values()
    if stands.all() or not stands.any() or one == two:
        return []
    share = float(hours[stands].sum() / hours.sum())
    rows, costs = [], []
    for name, (robot, loads) in chosen.sides.items():
        power = np.array([full.total for full in chosen.through(robot, loads)])
        moving, standing = (
            Cost(float(power[at] @ hours[at] / hours[at].sum()), 0.0) for at in (~stands, stands)
        )
        costs.append((moving, standing))
        demanded = chosen.asked.demanded(loads)
        designs = {g: chosen.shelf.designs([design]) for g, design in robot.items()}
        limits = [demanded[g].limits(design) for g, design in designs.items()]
        mass = sum(float(d.mass[0]) * len(demanded[g].joints) for g, d in designs.items())
        row = SideRow(
            candidate=name,
            moving_W=moving.power,
            standing_W=standing.power,
            power_W=(1.0 - share) * moving.power + share * standing.power,
            actuator_mass_kg=mass,
            limit_use=max(float(use[0]) for own in limits for use in own.values()),
            standing_share=share,
            break_even=None,
            design="; ".join(f"{g}: {words(robot[g])}" for g in designs),
        )
        rows.append(row)
    even = break_even(costs[0], costs[1], 0.0)
    return [replace(row, break_even=even) for row in rows]
