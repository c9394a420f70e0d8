"""The set of names that explains a log best, at its own estimates.

A search on columns about the files' model says where to look. Each of its answers is estimated
anew with all nonlinearities (Gauss-Newton). From the likeliest of these points the columns are made
anew and the search goes on, a few times at most. Of all points visited the one with the most
evidence at its estimates is the answer.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import REACH
from pipeline.identification.regression.design_matrix import Accepted
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.refit import refit
from pipeline.identification.results import UNCERTAINTIES
from pipeline.identification.selection.common import with_common_laws
from pipeline.identification.selection.evidence import State, noise_weights
from pipeline.identification.selection.pool import Key, Pool, make_pool
from pipeline.identification.selection.search import Search

logger = logging.getLogger("legwatt")

#: Times an answer is looked at again about its own estimates, at most.
_ROUNDS: Final = 3
#: Shares of the way to linear estimates that a nonlinear fit may start from.
_SHARES: Final = (1.0, 0.3, 0.1, 0.0)
#: Points from which the search goes on: the common laws of all joints, where blocks find any, and
#: the answers of the first search that are likeliest at their own estimates.
_STARTS: Final = 2


@dataclass(frozen=True, eq=False)
class Settled:
    """A set of names at its estimates."""

    problem: Problem  #: With the names as accepted effects and the uncertainty of the URDF.
    search: Search  #: On columns about these estimates.
    state: State  #: The names there.
    first: Search  #: The search about the files' model.

    @property
    def pool(self) -> Pool:
        """The columns."""
        return self.search.pool


def settle(problem: Problem) -> Settled:
    """The best set of names of all that a log was compared with.

    Args:
        problem: Without effects.
    """
    logger.info("letting all names compete")
    first = Search(make_pool(problem))
    points: list[Settled] = []
    common = with_common_laws(problem, first.noise)
    if common is not None:
        logger.info("estimating %d names of laws that are common to joints", len(common.accepted))
        points.append(_best_near(common, first))
    starts = {s: _estimated(problem, first, s) for s in dict.fromkeys(_starts(first))}
    for state in sorted(starts, key=lambda s: -starts[s][0])[: _STARTS - len(points)]:
        if any(names_of(first, state) == names_of(p.search, p.state) for p in points):
            continue
        logger.info("estimating %d effects together", len(state.terms))
        points.append(_best_near(starts[state][1], first))
    return _likeliest(points)


def _likeliest(points: Sequence[Settled]) -> Settled:
    """The point with the most evidence at its estimates, all judged by the least noise of any."""
    weights = np.max([p.search.weights for p in points], axis=0)
    searches = [Search(p.pool, weights) for p in points]
    evidence = [
        s.valid(p.state).evidence - s.promised(p.state)
        for s, p in zip(searches, points, strict=True)
    ]
    return points[int(np.argmax(evidence))]


def _starts(search: Search) -> Iterator[State]:
    """Answers about the files' model, from bodies that are known to bodies that may be anything.

    By laws first, and with curves from the start: one name of a curve stands in the way of several
    laws, and a law far from the machine's in the way of a curve.
    """
    for laws_first in (True, False):
        for u in UNCERTAINTIES[::2]:
            held = search.climbed(State((), u), (), laws_first)
            state = search.climbed(held, UNCERTAINTIES, laws_first)
            yield State(tuple(sorted(state.terms)), state.uncertainty)
            if u == UNCERTAINTIES[0]:
                yield State(tuple(sorted(held.terms)), held.uncertainty)


def _estimated(problem: Problem, search: Search, state: State) -> tuple[float, Problem]:
    """A state's evidence by its likelihood at estimates of its own, and the estimates.

    About a model that is far off, columns promise what no estimate reaches.
    """
    problem = problem.judged(state.uncertainty, search.noise)
    problem = refit(_started(problem, search, state))
    return search.reached(state, problem.cost()), problem


def _best_near(problem: Problem, first: Search) -> Settled:
    """The best point that estimates of an answer lead to."""
    points: list[Settled] = []
    for left in reversed(range(_ROUNDS)):
        pool = make_pool(problem)
        search = Search(pool, noise_weights(pool, estimated=True), first.closed)
        here = search.valid(as_accepted(search))
        points.append(Settled(problem, search, here, first))
        state = search.climbed(here, search.uncertainties) if left else here
        if (
            names_of(search, state) == names_of(search, here)
            or _likeliest(points) is not points[-1]
        ):
            break
        _, problem = _estimated(problem, search, state)
    return _likeliest(points)


def settle_without(settled: Settled, closed: frozenset[Key]) -> Settled:
    """The best set that the other names lead to where some are closed."""
    search = Search(settled.pool, settled.search.weights, closed)
    state = search.climbed(search.left(settled.state), search.uncertainties)
    _, near = _estimated(settled.problem, search, state)
    return replace(_best_near(near, search), first=settled.first)


def names_of(search: Search, state: State) -> tuple[frozenset[Key], float]:
    """Names of a state and its uncertainty of the URDF."""
    return frozenset(search.pool.terms[t].key for t in state.numbers), state.uncertainty


def _started(problem: Problem, search: Search, state: State) -> Problem:
    """The problem at linear estimates, or a share of the way to them where all leads astray."""
    held, accepted = estimated(search, state)
    present = {(a.effect.name, a.place): a.x for a in problem.accepted}
    tried = []
    for share in _SHARES:
        on_the_way = []
        for a in accepted:
            now = present.get((a.effect.name, a.place), {})
            x = {k: now.get(k, 0.0) + share * (v - now.get(k, 0.0)) for k, v in a.x.items()}
            on_the_way.append(replace(a, x=x))
        between = problem.held + share * (held - problem.held)
        tried.append(problem.with_accepted(on_the_way, problem.inside(between)))
    return min(tried, key=Problem.cost)


def as_accepted(search: Search) -> State:
    """The set of a problem's accepted effects."""
    problem = search.pool.problem
    terms = []
    for number, a in enumerate(problem.accepted):
        coordinates = enumerate(a.effect.coordinates)
        used = tuple(k for k, c in coordinates if c.signed or a.x[c.name] != 0.0)
        terms += [(number, used)] if used else []
    return State(tuple(terms), problem.uncertainty)


def estimated(search: Search, state: State) -> tuple[Array, list[Accepted]]:
    """Tolerances (n,) in their sigmas and effects of a state, by its linear problem."""
    _, _, x, _ = search.solve(state)
    out, at = [], search.pool.base
    for number, used in state.terms:
        term = search.pool.terms[number]
        values = dict.fromkeys((c.name for c in term.effect.coordinates), 0.0)
        for k in used:
            values[term.effect.coordinates[k].name] = float(x[at])
            at += 1
        shape = {name: value for name, value in term.shape.items() if name != REACH}
        out.append(Accepted(term.effect, term.place, values, shape))
    return x[: search.pool.base], out
