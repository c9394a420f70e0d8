"""Mass fed back until it settles: no group's design can be replaced by a better one.

Along a motion the joint torques are affine in the masses of the actuators: with one demand, and one
more for each group with a nudge of mass at its joints, that of any masses follows. A robot is
replaced only by a better one, so that this ends and cannot swing between two.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import cycle
from typing import Final

import numpy as np

from actuators.energy.energy import BUS
from actuators.errors import LegwattError
from pipeline.choice.asked import Asked
from pipeline.choice.doubt import Design
from pipeline.choice.loads import Load, loads_of
from pipeline.choice.search import Feedback, shared

Answer = Mapping[str, Design]
NUDGE: Final = 0.1  # [kg]
#: Share by which a robot has to be better to replace another.
_BETTER: Final = 1e-6


@dataclass(frozen=True, eq=False)
class Robots:
    """Every robot's power, about the masses of one."""

    asked: Asked
    mass: Mapping[str, float]  #: Of one actuator of each group in `loads` [kg].
    loads: Sequence[Load]  #: The mission's demand.
    #: The same with `NUDGE` more at every joint of a group, along the same motions.
    nudged: Mapping[str, Sequence[Load]]

    @classmethod
    def about(cls, asked: Asked, mass: Mapping[str, float]) -> Robots:
        """All robots about masses of one actuator of each group [kg]."""
        added, common = asked.added(mass), (asked.machine, asked.modes)
        loads = loads_of(*common, added, spring=asked.spring)
        nudged = {}
        for g, joints in asked.groups.items():
            heavier = added | {j: added[j] + NUDGE for j in joints}
            nudged[g] = loads_of(*common, heavier, along=loads, spring=asked.spring)
        return cls(asked, mass, loads, nudged)

    def at(self, mass: Mapping[str, float]) -> list[Load]:
        """The mission's demand with these masses of one actuator of each group [kg]."""
        loads = []
        for k, load in enumerate(self.loads):
            torque = load.series.torque.copy()
            for g, more in self.nudged.items():
                slope = (more[k].series.torque - load.series.torque) / NUDGE
                torque += (mass[g] - self.mass[g]) * slope
            loads.append(replace(load, series=load.series.with_torque(torque)))
        return loads

    def cost(self, answer: Answer) -> tuple[float, float]:
        """Share of a limit used, 1 within all; mean power over the draws [W]."""
        account = self.asked.account
        designs = {g: self.asked.draws(design) for g, design in answer.items()}
        demanded = self.asked.demanded(self.at({g: float(d.mass[0]) for g, d in designs.items()}))
        power, use = 0.0, 1.0
        if account.policy == BUS:
            robots = [(demanded[g], own) for g, own in designs.items()]
            power += float(shared(robots, account)[1:].mean())
        for g, own in designs.items():
            power += float(demanded[g].power(own, account)[1:].mean())
            first = own.taken(np.zeros(1, dtype=np.intp))
            use = max(use, *(float(x[0]) for x in demanded[g].limits(first).values()))
        return use, power

    def settled(self, answer: Answer, pool: Mapping[str, Iterable[Design]]) -> dict[str, Design]:
        """The answer from which no design of the pool in one group leads to a better robot."""
        best, least, since = dict(answer), self.cost(answer), 0
        for group in cycle(self.asked.groups):
            since += 1
            for design in pool[group]:
                use, power = self.cost({**best, group: design})
                if use < least[0] or (use == least[0] and power < least[1] * (1.0 - _BETTER)):
                    best, least, since = {**best, group: design}, (use, power), 1
            if since == len(self.asked.groups):
                break
        return best

    def prices(self, answer: Answer) -> dict[str, Feedback]:
        """What the mass at each group's joints costs, about the answer."""
        account = self.asked.account
        designs = {g: self.asked.draws(design) for g, design in answer.items()}
        base = self.asked.demanded(self.loads)
        out = {}
        for g in self.asked.groups:
            heavier, others = self.asked.demanded(self.nudged[g]), 0.0
            for o, own in designs.items():
                if o == g:
                    continue
                rise = heavier[o].power(own, account) - base[o].power(own, account)
                others += float(rise[1:].mean()) / NUDGE
            out[g] = Feedback(self.mass[g], others, heavier[g], NUDGE)
        return out

    def check(self, answer: Answer) -> None:
        """An answer's limits with its own masses and motions.

        Raises:
            LegwattError: One is exceeded: none was found that stays within all.
        """
        for g, demanded in self.asked.demanded(self.loads).items():
            limits = demanded.limits(self.asked.shelf.designs([answer[g]]))
            worst = max(limits, key=lambda name: float(limits[name][0]))
            if limits[worst][0] > 1.0:
                raise LegwattError(
                    f"no robot found that stays within limits with its own actuators' mass: group "
                    f"'{g}' with {self.mass[g]:.3g} kg a joint takes {limits[worst][0]:.3g} "
                    f"of its {worst}; add lighter or stronger parts, or state --present"
                )
