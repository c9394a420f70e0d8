"""The choice: groups searched one by one, mass fed back, winners drawn and recomputed in full."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from actuators.elements.position_torque import ParallelSpring
from actuators.supply.battery import Battery
from pipeline.choice.answer.full import Full, through
from pipeline.choice.asked import asked_of
from pipeline.choice.doubt import Design, Doubt
from pipeline.choice.group import Found, merged
from pipeline.choice.loads import Load
from pipeline.choice.missions.mission import Mode
from pipeline.choice.parts.designs import Designs
from pipeline.choice.parts.shelf import Shelf, combinations
from pipeline.choice.search import Feedback
from pipeline.choice.wanted import Wanted
from pipeline.progress import Progress

if TYPE_CHECKING:
    from pipeline.api.machine import Machine

Array = NDArray[np.float64]
#: Rounds of mass fed back, at most; two or three settle it.
_ROUNDS: Final = 5
_POOL: Final = 8  # designs of each search, by score and by mass, among which a robot is settled


@dataclass(frozen=True, eq=False)
class Chosen:
    """The answer."""

    machine: Machine  #: The robot.
    wanted: Wanted  #: What was asked.
    loads: Sequence[Load]  #: The mission's modes, with the answer's masses in the robot.
    found: Mapping[str, Found]  #: The search of each group.
    #: Designs of each group that are drawn: the answer, the best by the middle of every range, and
    #: those among which the answer settled.
    candidates: Mapping[str, list[Design]]
    doubts: Mapping[str, Doubt]  #: Draws over the candidates of each group.
    answer: Mapping[str, Design]  #: Design of each group.
    #: The best of each group that can be driven back, ``reversible``, and that locks by a gear or a
    #: closed brake, ``irreversible``; the answer's where none is within limits. Each with its own
    #: demand.
    sides: Mapping[str, tuple[Mapping[str, Design], Sequence[Load]]]
    #: What the first search, before mass was fed back, took the answer's power for [W].
    first: Mapping[str, float]
    present: float  #: Mass of an actuator that the bodies hold already [kg].
    spring: ParallelSpring | None  #: Beside the actuators of all joints; None without any.
    shelf: Shelf  #: The parts.
    battery: Battery  #: Of the answer, at the highest voltage of its groups.

    @property
    def hours(self) -> float:
        """Of the mission in a day [h]."""
        return sum(load.mode.hours for load in self.loads)

    def designs(self, group: str) -> Designs:
        """The answer of one group, as one design."""
        return self.shelf.designs([self.answer[group]])

    @cached_property
    def day(self) -> list[Full]:
        """Every mode through the chains of the answer."""
        return self.through(self.answer, self.loads)

    def through(self, robot: Mapping[str, Design], loads: Sequence[Load]) -> list[Full]:
        """Every mode through full chains."""
        built = {
            g: (f.demanded.joints, self.shelf.designs([robot[g]])) for g, f in self.found.items()
        }
        return [through(load, built, self.wanted.account) for load in loads]

    @property
    def least_voltage(self) -> float:
        """Of the supply, below which a driver stops or gives a motor less than it needs [V]."""
        sheet = self.shelf.numbers[self.shelf.driver]
        out = sheet["least_voltage"].value if "least_voltage" in sheet else 0.0
        for g, f in self.found.items():
            design = self.designs(g)
            use = f.demanded.limits(design)["voltage"] * design.bus
            out = max(out, float(use[0]))
        return out

    def robots(self) -> tuple[Array, Array, NDArray[np.intp]]:
        """Front of robots: power with hotel load [W], mass [kg], design of each group."""
        fronts = [(f.score[f.front], f.mass[f.front]) for f in self.found.values()]
        power, mass, taken = merged(fronts)
        return power + self.wanted.account.hotel, mass, taken


def choose(
    machine: Machine,
    modes: Sequence[Mode],
    wanted: Wanted | None = None,
    progress: Progress | None = None,
) -> Chosen:
    """Which motor, gear and brake for each group of joints.

    Args:
        machine: From `load`.
        modes: Of the mission.
        wanted: What is searched and counted.
        progress: Told of each step.

    Raises:
        PipelineError: A mode cannot be done, or no design is within limits.
        ActuatorError: Parts cannot be read.
    """
    wanted = wanted or Wanted()
    told = progress.step if progress else lambda words: None
    asked = asked_of(machine, modes, wanted)
    every = combinations(asked.shelf, brakes=wanted.brakes)
    designs = asked.shelf.designs(every)
    if any("=" not in text for text in wanted.springs):
        wanted = replace(wanted, springs=asked.springs(designs, wanted.springs))
        asked = asked_of(machine, modes, wanted)
    told("the mission's demand")
    robots = asked.robots(dict.fromkeys(asked.groups, asked.present))
    price = dict.fromkeys(asked.groups, Feedback())
    answer: dict[str, Design] = {}
    pool: dict[str, dict[Design, None]] = {g: {} for g in asked.groups}
    first: dict[str, float] = {}
    for turn in range(_ROUNDS):
        told(f"{len(every)} designs for each of {len(asked.groups)} groups, round {turn + 1}")
        found = asked.searched(designs, robots.loads, price)
        first = first or {g: float(f.power[f.finalists[0]]) for g, f in found.items()}
        for g, f in found.items():
            pool[g] |= dict.fromkeys(_named(f, [*f.finalists[:_POOL], *f.front[:_POOL]]))
        if turn == 1:  # with masses that are near
            for g, f in asked.drawn(every, robots.loads, price):
                pool[g] |= dict.fromkeys(_named(f, f.finalists[:_POOL]))
        start = answer or {g: _named(f, f.finalists)[0] for g, f in found.items()}
        better = robots.settled(start, pool)
        if better == answer:
            break
        answer = better
        robots = asked.robots(asked.masses(answer))
        price = robots.prices(answer)
    asked.check(answer, robots)
    found = asked.searched(designs, robots.loads, price)
    told("draws over what no sheet prints")
    candidates = {g: _candidates(answer[g], f, pool[g]) for g, f in found.items()}
    doubts = asked.doubts(found, candidates, price, wanted.draws, robots)
    return Chosen(
        *(machine, wanted, robots.loads, found, candidates, doubts, answer),
        *(asked.sides(answer, found, price, robots), first, asked.present),
        spring=asked.spring,
        shelf=asked.shelf,
        battery=asked.battery(answer),
    )


def _candidates(answer: Design, found: Found, pool: Iterable[Design]) -> list[Design]:
    return list(dict.fromkeys([answer, *_named(found, found.finalists), *pool]))


def _named(found: Found, which: Sequence[int] | NDArray[np.intp]) -> list[Design]:
    return [found.designs.parts[i] for i in found.looked[which]]
