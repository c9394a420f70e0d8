"""The choice: robots searched, three of them recomputed in full, what is not known drawn."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.energy import Battery
from actuators.errors import LegwattError
from actuators.loading.parts import listed_pairs
from pipeline.choice.evaluate import Demand
from pipeline.choice.mission import Mode
from pipeline.choice.options import ChooseOptions, Problem, problem_of
from pipeline.choice.robots import FAMILIES, Robot, Robots, Search, demand_of, knee
from pipeline.choice.shelf import Design, combinations
from pipeline.choice.standing import Envelope, envelope
from pipeline.choice.unknowns import MonteCarlo, monte_carlo
from pipeline.simulation.machine import Machine

logger = logging.getLogger("legwatt")

#: Answers by the option's word, as tables call them.
ANSWERS: Final = {"power": "least power", "knee": "knee", "mass": "lightest", "price": "cheapest"}
#: Rounds in which an answer may exceed a limit with the motion of its own mass, and go, and that
#: after which robots are searched anew, with motions for the mass of the one that was recommended.
_ROUNDS, _ANEW = 30, 2
#: Round from which on what uses as much of a limit as those that exceeded it goes with them.
_NARROWED: Final = 20
_TRIED: Final = 12  # robots beyond a limit by little in the search, with motions of their own mass


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
        peak = max(float(flow.max()) for flow in flows) + full.hotel
        power, shares = full.modes[0][at], full.shares[at]
        return self.battery.hours(power, shares, peak=peak, cut_off=self.least_voltage)


Answers = Mapping[str, Answer]


@dataclass(frozen=True, eq=False)
class Chosen:
    """The answer."""

    wanted: ChooseOptions
    search: Search
    #: Least power, knee, lightest and, where prices are at hand, cheapest.
    answers: Answers
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


def choose(machine: Machine, modes: Sequence[Mode], wanted: ChooseOptions | None = None) -> Chosen:
    """Which motor, gear and brake for each group of joints, for the modes of a mission.

    Raises:
        LegwattError: A mode cannot be done, or no robot is within limits. Parts cannot be read.
    """
    wanted = wanted or ChooseOptions()
    problem = problem_of(machine, modes, wanted)
    listed = None if wanted.unlisted else listed_pairs(wanted.parts)
    pairs = combinations(problem.shelf, listed)
    logger.info("%d pairs of motor and gear for each of %d groups", len(pairs), len(problem.groups))
    search, answers, front = _searched(problem, pairs)
    named = [answers[ANSWERS[wanted.objective]].robot, *(own.robot for own in answers.values())]
    over = envelope(search)
    sides = [r for name in FAMILIES[:2] for r in (over.robots if over else {}).get(name, ())]
    draws = monte_carlo(search, [*named, *front, *sides], wanted.draws)
    return Chosen(wanted, search, answers, front, draws, over)


def _searched(problem: Problem, pairs: Sequence[Design]) -> tuple[Search, Answers, list[Robot]]:
    """The search whose answers keep all limits in full, these, and the front.

    A search follows motions planned for one mass. What exceeds limits with its own is left out;
    what exceeds them by little in the search alone, and would be an end of the front, is taken in.
    """
    full, rounds, tried = dict[Robot, Answer](), 0, 0
    mass = dict.fromkeys(problem.groups, problem.present)
    search = Search(problem, pairs, demand_of(problem, mass)).run()
    while rounds < _ROUNDS:
        search.learn([*full])
        for robot, own in full.items():
            search.known[robot] = search.known[robot]._replace(use=float(own.full.use[0]))
        front = search.front()
        answers = _answers(search, front, full) if front else {}
        near = [robot for robot in search.near if robot not in full]
        if over := [own.robot for own in answers.values() if own.full.use[0] > 1.0]:
            rounds += 1
            if rounds > _NARROWED:
                search.most = np.nextafter(min(search.known[robot].use for robot in over), 0.0)
            if rounds == _ANEW:
                mass = problem.masses(answers[ANSWERS[problem.wanted.objective]].robot)
                search = Search(problem, pairs, demand_of(problem, mass)).run()
        elif near and tried < _TRIED:
            tried += 1
            full[near[0]] = _in_full(search, near[0])
        elif front:
            return search, answers, front
        else:
            break
    every = (own.full for own in full.values())
    raise LegwattError(search.closest(min(every, key=lambda own: own.use[0], default=None)))


def _answers(search: Search, front: Sequence[Robot], known: dict[Robot, Answer]) -> Answers:
    """The robots to choose from, each in full, as some are `known` so."""
    power, mass = (np.array([search.known[r][k] for r in front]) for k in (0, 1))
    named = {"power": front[0], "knee": front[knee(power, mass)], "mass": front[-1]}
    priced = search.front(price=True)
    if search.problem.wanted.objective == "price" and not priced:
        raise LegwattError("objective price: no robot has a price at hand for all of its parts")
    if priced:
        named["price"] = priced[-1]
    for robot in named.values():
        known[robot] = known.get(robot) or _in_full(search, robot)
    full = {ANSWERS[key]: known[robot] for key, robot in named.items()}
    for key, lighter in (("knee", "lightest"), ("least power", "knee")):  # each by its own motion
        full[key] = min(full[key], full[lighter], key=lambda own: own.power)
    return full


def _in_full(search: Search, robot: Robot) -> Answer:
    """A robot with motions planned for its own mass."""
    problem = search.problem
    demand = demand_of(problem, problem.masses(robot), slopes=False)
    full = search.evaluated([robot], demand)
    values = search.shelf.values
    sheet = values(search.shelf.driver)
    least = sheet.get("least_voltage", 0.0)
    for own, design in zip(full.groups, full.parts, strict=True):
        volts = float((own.use["voltage"] * design.voltage).max())  # that it asks, without margin
        share = math.sqrt(values(design.parts[0][0])["current_of"]) * sheet["voltage_share"]
        least = max(least, volts / share)
    return Answer(robot, demand, full, problem.battery, least)
