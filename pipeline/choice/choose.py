"""The choice: robots searched, three of them recomputed in full, what is not known drawn."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.errors import LegwattError
from actuators.supply import Battery
from pipeline.choice.evaluate import Demand
from pipeline.choice.groups import knee
from pipeline.choice.mission import Mode
from pipeline.choice.options import ChooseOptions, Problem, problem_of
from pipeline.choice.robots import FAMILIES, Robot, Robots, Search, demand_of
from pipeline.choice.shelf import combinations, listed_pairs
from pipeline.choice.standing import Envelope, envelope
from pipeline.choice.unknowns import MonteCarlo, monte_carlo
from pipeline.simulation.machine import Machine

logger = logging.getLogger("legwatt")

#: Answers by the option's word, as tables call them.
ANSWERS: Final = {"power": "least power", "knee": "knee", "mass": "lightest", "price": "cheapest"}
#: Robots that are drawn: answers, and those of the front and near it that take least.
_DRAWN: Final = 32
#: Rounds in which an answer may exceed a limit with the motion of its own mass, and go.
_ROUNDS: Final = 20


@dataclass(frozen=True, eq=False)
class Answer:
    """One robot of the front, recomputed with the motions that its own mass leads to."""

    robot: Robot
    demand: Demand
    full: Robots  #: The one robot, with detail.
    battery: Battery
    least_voltage: float  #: Of the supply, below which a motor gets less than it needs [V].

    @property
    def power(self) -> float:
        """Mean over the mission out of the supply [W]."""
        return float(self.full.power[0])

    @property
    def hours(self) -> float:
        """That a full battery lasts, its modes by turns [h]."""
        full, at = self.full, np.flatnonzero(self.full.shares)
        flows = [np.sum([own.series[m][0] for own in full.groups], axis=0) for m in at.tolist()]
        limits = {"peak": max(float(flow.max()) for flow in flows) + full.hotel}
        limits |= {"cut_off": self.least_voltage}
        return self.battery.hours(full.modes[0][at], full.shares[at], **limits)


@dataclass(frozen=True, eq=False)
class Chosen:
    """The answer."""

    wanted: ChooseOptions
    search: Search
    #: Least power, knee, lightest and, where prices are at hand, cheapest.
    answers: Mapping[str, Answer]
    front: Sequence[Robot]
    monte_carlo: MonteCarlo  #: Draws; the recommended robot is the first.
    envelope: Envelope | None

    @property
    def problem(self) -> Problem:
        """What stays the same."""
        return self.search.problem

    @property
    def name(self) -> str:
        """Of the answer that is recommended."""
        return ANSWERS[self.wanted.objective]

    @property
    def best(self) -> Answer:
        """The recommended one."""
        return self.answers[self.name]

    @property
    def hours(self) -> float:
        """Of the mission in a day [h]."""
        return sum(mode.hours for mode in self.problem.modes)


def choose(machine: Machine, modes: Sequence[Mode], wanted: ChooseOptions | None = None) -> Chosen:
    """Which motor, gear and brake for each group of joints, for the modes of a mission.

    Raises:
        LegwattError: A mode cannot be done, or no robot is within limits. Parts cannot be read.
    """
    wanted = wanted or ChooseOptions()
    problem = problem_of(machine, modes, wanted)
    listed = None if wanted.unlisted else listed_pairs(wanted.parts)
    pairs = combinations(problem.shelf, listed)
    if not pairs:
        raise LegwattError("no motor fits a gear that is left: widen only or kind, or add unlisted")
    demand = demand_of(problem, dict.fromkeys(problem.groups, problem.present))
    search = Search(problem, pairs, demand)
    logger.info("%d pairs of motor and gear for each of %d groups", len(pairs), len(problem.groups))
    search.run()
    answers, front = _answers(search, wanted)
    best = answers[ANSWERS[wanted.objective]]
    named = [best.robot, *(answer.robot for answer in answers.values())]
    spread = [front[i] for i in np.unique(np.linspace(0, len(front) - 1, _DRAWN // 2).astype(int))]
    drawn = [*dict.fromkeys([*named, *spread, *search.within[: _DRAWN // 2]])][:_DRAWN]
    over = envelope(search)
    families = over.robots if over else {}
    sides = [robot for name in FAMILIES[:2] for robot in families.get(name, ())]
    draws = monte_carlo(search, drawn, wanted.draws, sides)
    return Chosen(wanted, search, answers, front, draws, over)


def _answers(search: Search, wanted: ChooseOptions) -> tuple[dict[str, Answer], list[Robot]]:
    """The answers, each in full, and the front; what exceeds a limit in full is left out."""
    near: list[Answer] = []
    for _ in range(_ROUNDS):
        front = search.front()
        if not front:
            break
        power, mass = (np.array([search.known[r][k] for r in front]) for k in (0, 1))
        named = {"power": front[0], "knee": front[knee(power, mass)], "mass": front[-1]}
        priced = search.front(price=True)
        if wanted.objective == "price" and not priced:
            raise LegwattError("objective price: no robot has a price at hand for all of its parts")
        if priced:
            named["price"] = priced[-1]
        answers = {key: _in_full(search, robot) for key, robot in named.items()}
        over = [a for a in answers.values() if a.full.use[0] > 1.0]
        if not over:
            return {ANSWERS[key]: answer for key, answer in answers.items()}, front
        near += over
        for answer in over:
            own = search.known[answer.robot]
            search.known[answer.robot] = own._replace(use=float(answer.full.use[0]))
    full = min((a.full for a in near), key=lambda found: float(found.use[0]), default=None)
    raise LegwattError(search.closest(full))


def _in_full(search: Search, robot: Robot) -> Answer:
    """A robot with motions planned for its own mass."""
    problem = search.problem
    demand = demand_of(problem, problem.masses(robot), slopes=False)
    full = search.evaluated([robot], demand)
    numbers = search.shelf.numbers
    sheet = numbers[search.shelf.driver]
    least = sheet["least_voltage"].value if "least_voltage" in sheet else 0.0
    for own, design in zip(full.groups, full.parts, strict=True):
        volts = float((own.use["voltage"] * design.voltage).max())  # that it asks, without margin
        motor = numbers[design.parts[0][0]]
        share = math.sqrt(motor["current_of"].value) * sheet["voltage_share"].value
        least = max(least, volts / share)
    return Answer(robot, demand, full, problem.battery, least)
