"""Break-even of the day: the best that can be driven back against the best that locks."""

from __future__ import annotations

import numpy as np

from pipeline.choice.answer.break_even import Cost, break_even
from pipeline.choice.answer.tables import words
from pipeline.choice.choose import Chosen
from pipeline.choice.search import Demanded
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
    costs: list[tuple[Cost, Cost]] = []
    for robot, loads in chosen.sides.values():
        power = np.array([full.total for full in chosen.through(robot, loads)])
        moving, standing = (
            Cost(float(power[at] @ hours[at] / hours[at].sum()), 0.0) for at in (~stands, stands)
        )
        costs.append((moving, standing))
    even = break_even(costs[0], costs[1], 0.0)
    share = float(hours[stands].sum() / hours.sum())
    joints = {g: len(f.demanded.joints) for g, f in chosen.found.items()}
    return [
        SideRow(
            candidate=name,
            moving_W=moving.power,
            standing_W=standing.power,
            power_W=(1.0 - share) * moving.power + share * standing.power,
            actuator_mass_kg=sum(
                float(chosen.shelf.designs([robot[g]]).mass[0]) * n for g, n in joints.items()
            ),
            limit_use=max(
                float(x[0])
                for g, f in chosen.found.items()
                for x in Demanded.of(g, f.demanded.joints, loads)
                .limits(chosen.shelf.designs([robot[g]]))
                .values()
            ),
            standing_share=share,
            break_even=even,
            design="; ".join(f"{g}: {words(robot[g])}" for g in joints),
        )
        for (name, (robot, loads)), (moving, standing) in zip(
            chosen.sides.items(), costs, strict=True
        )
    ]
