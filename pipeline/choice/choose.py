"""The choice: groups searched one by one, mass fed back, winners drawn and recomputed in full."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from actuators.arrays import Array, Index
from actuators.errors import LegwattError
from actuators.supply import Battery
from pipeline.choice.asked import Asked, ChooseOptions, asked_of
from pipeline.choice.doubt import Design, Doubt, doubt, drawn, drawn_machines
from pipeline.choice.full import Full, through
from pipeline.choice.group import Found, merged
from pipeline.choice.loads import Load, loads_of
from pipeline.choice.missions.mission import Mode
from pipeline.choice.parts.designs import Designs
from pipeline.choice.parts.shelf import Shelf, combinations, listed_pairs
from pipeline.choice.search import Feedback
from pipeline.choice.settle import Robots
from pipeline.simulation.machine import Machine

logger = logging.getLogger("legwatt")

#: Rounds of mass fed back, at most; two or three settle it.
_ROUNDS: Final = 5
_POOL: Final = 8  # designs of each search, by score and by mass, among which a robot is settled
_SEARCHES: Final = 4  # of all designs, each with drawn values of all parts


@dataclass(frozen=True, eq=False)
class Chosen:
    """The answer."""

    asked: Asked
    wanted: ChooseOptions
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
    #: Least power, lightest and knee of the front of robots, with each one's own demand.
    picks: Mapping[str, tuple[Mapping[str, Design], Sequence[Load]]]
    #: What the first search, before mass was fed back, took the answer's power for [W].
    first: Mapping[str, float]

    @property
    def shelf(self) -> Shelf:
        """The parts."""
        return self.asked.shelf

    @property
    def hours(self) -> float:
        """Of the mission in a day [h]."""
        return sum(load.mode.hours for load in self.loads)

    @cached_property
    def battery(self) -> Battery:
        """Of the answer, at the highest voltage of its groups."""
        return self.asked.battery(self.answer)

    def designs(self, group: str) -> Designs:
        """The answer of one group, as one design."""
        return self.shelf.designs([self.answer[group]])

    @cached_property
    def day(self) -> list[Full]:
        """Every mode through the chains of the answer."""
        return self.through(self.answer, self.loads)

    def through(self, robot: Mapping[str, Design], loads: Sequence[Load]) -> list[Full]:
        """Every mode through full chains."""
        groups = self.asked.groups.items()
        built = {g: (joints, self.shelf.designs([robot[g]])) for g, joints in groups}
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

    def robots(self) -> tuple[Array, Array, Index]:
        """Front of robots: power with hotel load [W], mass [kg], design of each group."""
        power, mass, taken = fronts_merged(self.found)
        return power + self.wanted.account.hotel, mass, taken


def fronts_merged(found: Mapping[str, Found]) -> tuple[Array, Array, Index]:
    """Front of all robots of a search: power [W], mass [kg], design of each group."""
    return merged([(f.score[f.front], f.mass[f.front]) for f in found.values()])


def knee(power: Array, mass: Array) -> int:
    """The point of a front that lies furthest below the line between its ends, both scaled."""
    if len(power) < 3:
        return 0
    x, y = ((v - v.min()) / max(float(np.ptp(v)), 1e-300) for v in (mass, power))
    return int((x + y).argmin())


def choose(machine: Machine, modes: Sequence[Mode], wanted: ChooseOptions | None = None) -> Chosen:
    """Which motor, gear and brake for each group of joints, for the modes of a mission.

    Raises:
        LegwattError: A mode cannot be done, or no design is within limits. Parts cannot be read.
    """
    wanted = wanted or ChooseOptions()
    asked = asked_of(machine, modes, wanted)
    pairs = None if wanted.unlisted else listed_pairs(wanted.parts)
    every = combinations(asked.shelf, brakes=not wanted.no_brakes, pairs=pairs)
    if not every:
        raise LegwattError("no motor fits a gear that is left: widen only or kind, or add unlisted")
    designs = asked.shelf.designs(every)
    present = dict.fromkeys(asked.groups, asked.present)
    logger.info("the mission's demand")
    robots = Robots.about(asked, present)
    price = dict.fromkeys(asked.groups, Feedback())
    answer: dict[str, Design] = {}
    pool: dict[str, dict[Design, None]] = {g: {} for g in asked.groups}
    first: dict[str, float] = {}
    for turn in range(_ROUNDS):
        logger.info("%d designs for each of %d groups", len(every), len(asked.groups))
        found = asked.searched(designs, robots.loads, price)
        first = first or {g: float(f.power[f.finalists[0]]) for g, f in found.items()}
        for g, f in found.items():
            pool[g] |= dict.fromkeys(f.names([*f.finalists[:_POOL], *f.front[:_POOL]]))
        # With masses that are near, all designs with drawn values of all parts.
        for sheet in drawn(asked.shelf, every, _SEARCHES, seed=1).sheets if turn == 1 else ():
            others = asked.searched(asked.shelf.designs(every, sheet), robots.loads, price)
            for g, f in others.items():
                pool[g] |= dict.fromkeys(f.names(f.finalists[:_POOL]))
        start = answer or {g: f.names(f.finalists[:1])[0] for g, f in found.items()}
        better = robots.settled(start, pool)
        if better == answer:
            break
        answer = better
        robots = Robots.about(asked, asked.masses(answer))
        price = robots.prices(answer)
    robots.check(answer)
    found = asked.searched(designs, robots.loads, price)
    logger.info("draws over what no sheet prints")
    candidates = {
        g: list(dict.fromkeys([answer[g], *f.names(f.finalists), *pool[g]]))
        for g, f in found.items()
    }
    # Every group's candidates in draws of what is not printed, and of found effects.
    added, days = asked.added(robots.mass), []
    effects, machines = drawn_machines(asked.machine)
    for values, own in machines:
        loads = loads_of(own, asked.modes, added, along=robots.loads, spring=asked.spring)
        days.append((values, asked.demanded(loads)))
    together = list(dict.fromkeys(design for own in candidates.values() for design in own))
    sheets = drawn(asked.shelf, together, wanted.draws)
    doubts = {
        g: doubt(
            *(f.demanded, asked.shelf, candidates[g], asked.account, price[g], sheets),
            effects=effects,
            found=[(values, demanded[g]) for values, demanded in days],
        )
        for g, f in found.items()
    }
    # The best robot that can be driven back, and that locks.
    sides = {}
    for name, locked in (("reversible", False), ("irreversible", True)):
        best = {
            g: f.best(f.designs.locks(True) == locked, asked.account, price[g]) or answer[g]
            for g, f in found.items()
        }
        sides[name] = best, robots.at(asked.masses(best))
    power, mass, taken = fronts_merged(found)
    picks: dict[str, tuple[Mapping[str, Design], Sequence[Load]]] = {
        "least power": (answer, robots.loads)
    }
    for name, at in (("knee", knee(power, mass)), ("lightest", int(mass.argmin()))):
        which = zip(found.items(), taken[at], strict=True)
        picked = {g: f.names(f.front[[i]])[0] for (g, f), i in which}
        picks[name] = picked, robots.at(asked.masses(picked))
    return Chosen(
        *(asked, wanted, robots.loads, found, candidates, doubts, answer, sides, picks, first)
    )
