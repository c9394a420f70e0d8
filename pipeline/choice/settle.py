"""Mass fed back until it settles: no group's design can be replaced by a better one.

Along a motion the joint torques are affine in the masses of the actuators: with one demand, and one
more for each group with a nudge of mass at its joints, that of any masses follows. So a robot, a
design for each group, is counted in full with its own masses, limits included. Of the designs that
searches at some masses found, one group after the other takes the best, until none changes; then
motions and demand are made anew with the answer's masses, and searched again. A robot is replaced
only by a better one, so that this ends and cannot swing between two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.energy.regeneration import BUS
from pipeline.choice.doubt import Design
from pipeline.choice.loads import Load
from pipeline.choice.parts.designs import Designs
from pipeline.choice.search import Demanded, Feedback, shared
from pipeline.choice.track import Account

Array = NDArray[np.float64]
Answer = Mapping[str, Design]
NUDGE: Final = 0.1  # [kg]
#: Share by which a robot has to be better to replace another.
_BETTER: Final = 1e-6


@dataclass(frozen=True, eq=False)
class Robots:
    """Every robot's power, about the masses of one."""

    groups: Mapping[str, tuple[str, ...]]  #: Joints of each group.
    mass: Mapping[str, float]  #: Of one actuator of each group in `loads` [kg].
    loads: Sequence[Load]  #: The mission's demand.
    #: The same with `NUDGE` more at every joint of a group, along the same motions.
    nudged: Mapping[str, Sequence[Load]]
    account: Account  #: What is counted.
    #: A design in the middle of its ranges, then in draws of them.
    drawn: Callable[[Design], Designs]

    def at(self, mass: Mapping[str, float]) -> list[Load]:
        """The mission's demand with these masses of one actuator of each group [kg]."""
        loads = []
        for k, load in enumerate(self.loads):
            torque = load.series.torque.copy()
            for g, more in self.nudged.items():
                slope = (more[k].series.torque - load.series.torque) / NUDGE
                torque += (mass[g] - self.mass[g]) * slope
            loads.append(replace(load, series=replace(load.series, torque=torque)))
        return loads

    def demanded(self, mass: Mapping[str, float]) -> dict[str, Demanded]:
        """Every group's part of it."""
        loads = self.at(mass)
        return {g: Demanded.of(g, joints, loads) for g, joints in self.groups.items()}

    def cost(self, answer: Answer) -> tuple[float, float]:
        """Share of a limit used, 1 within all; mean power over the draws [W]."""
        designs = {g: self.drawn(design) for g, design in answer.items()}
        demanded = self.demanded({g: float(d.mass[0]) for g, d in designs.items()})
        power, use = 0.0, 1.0
        if self.account.policy == BUS:
            robots = [(demanded[g], own) for g, own in designs.items()]
            power += float(shared(robots, self.account)[1:].mean())
        for g, own in designs.items():
            power += float(demanded[g].power(own, self.account)[1:].mean())
            first = own.taken(np.zeros(1, dtype=np.intp))
            use = max(use, *(float(x[0]) for x in demanded[g].limits(first).values()))
        return use, power

    def settled(self, answer: Answer, pool: Mapping[str, Iterable[Design]]) -> dict[str, Design]:
        """The answer from which no design of the pool in one group leads to a better robot."""
        best, least, at = dict(answer), self.cost(answer), 0
        since = 0
        names = list(self.groups)
        while since < len(names):
            group, since = names[at % len(names)], since + 1
            for design in pool[group]:
                use, power = self.cost({**best, group: design})
                if use < least[0] or (use == least[0] and power < least[1] * (1.0 - _BETTER)):
                    best, least, since = {**best, group: design}, (use, power), 1
            at += 1
        return best

    def prices(self, answer: Answer) -> dict[str, Feedback]:
        """What the mass at each group's joints costs, about the answer."""
        designs = {g: self.drawn(design) for g, design in answer.items()}
        base = {g: Demanded.of(g, joints, self.loads) for g, joints in self.groups.items()}
        out = {}
        for g, joints in self.groups.items():
            others = 0.0
            for o in self.groups.keys() - {g}:
                more = Demanded.of(o, self.groups[o], self.nudged[g])
                rise = more.power(designs[o], self.account) - base[o].power(
                    designs[o], self.account
                )
                others += float(rise[1:].mean()) / NUDGE
            heavier = Demanded.of(g, joints, self.nudged[g])
            out[g] = Feedback(self.mass[g], others, heavier, NUDGE)
        return out
