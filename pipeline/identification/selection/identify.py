"""Step 3 in one call: name what is missing, with values, intervals, rivals and how sure.

Test rows have no say in any of it and are not looked at here: `written` holds the model file that
came of it against them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import CHANNEL_UNITS
from pipeline.effects.registry import effect_named, told_apart
from pipeline.identification import results as limits
from pipeline.identification.regression.design_matrix import make_data_sets
from pipeline.identification.regression.floor import floor_of, left_open
from pipeline.identification.regression.intervals import bodies_of, estimates
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.refit import refit, tolerances_of
from pipeline.identification.results import UNCERTAINTIES, Candidate, Found, Member, Naming
from pipeline.identification.selection.confidence import (
    Confidence,
    joints_of,
    level_of,
    rms,
    sensor_noise,
    validation_errors,
    words_of,
)
from pipeline.identification.selection.evidence import BODIES, State
from pipeline.identification.selection.pool import Key
from pipeline.identification.selection.search import Search
from pipeline.identification.selection.settle import Settled, settle, settle_without
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

#: Times the names compete anew without those that turned out to be idle.
_RENEWED: Final = 2


@dataclass(frozen=True, eq=False)
class Identified:
    """Naming with what it leads to."""

    naming: Naming  #: Results.
    settled: Settled  #: The set of names at its estimates.

    @property
    def noise(self) -> Array:
        """Noise that no motion makes, by what everything together leaves, (J, C)."""
        return np.hypot(sensor_noise(self.settled), left_open(self.settled.problem))


def identify(model: MachineModel, measurements: Sequence[Measurement]) -> Identified:
    """Name what the model lacks.

    Args:
        model: What the engineer has.
        measurements: Logs with parts, from `observe`.

    Raises:
        LegwattError: A part of the data has no usable row. Model and logs do not fit.
    """
    start = Problem(model, make_data_sets(measurements), floor_of(measurements))
    channel = measurements[0].channels[0]
    confidence, found = _surest(settle(start), channel)
    settled = confidence.settled
    naming = Naming(
        found=found,
        candidates=tuple(_candidates(confidence, found)),
        tolerances=tolerances_of(settled.problem),
        tried=len({t.key for t in settled.first.pool.terms}) + 1,
        channel=channel,
        unit=CHANNEL_UNITS[channel],
        notes=tuple(confidence.notes()),
    )
    return Identified(naming, settled)


def _surest(settled: Settled, channel: str) -> tuple[Confidence, tuple[Found, ...]]:
    """The names with how sure each is.

    Names that are suspected are closed and the others compete anew. What that leads to is the
    answer unless the log is less likely with the names that would then be written.
    """
    weights, idle = settled.search.weights, frozenset[Key]()
    best: tuple[float, Confidence, tuple[Found, ...]] | None = None
    for left in reversed(range(_RENEWED + 1)):
        confidence = Confidence(settled)
        found = tuple(_found(confidence, channel))
        suspected = [f for f in found if f.level == limits.SUSPECTED]
        more = frozenset(BODIES if f.effect == BODIES[0] else f.key for f in suspected)
        search = Search(settled.pool, weights, more)
        evidence = search.left(settled.state).evidence - search.promised(settled.state)
        if best is None or evidence > best[0] - limits.EXCLUDED:
            best = evidence, confidence, found
        if not more or not left:
            break
        idle |= more
        settled = settle_without(settled, idle)
    assert best is not None
    return best[1], best[2]


def estimated_alone(named: Identified, found: Sequence[Found]) -> tuple[Found, ...]:
    """Effects with values and intervals as they are without the others that were found.

    What is left out of a model takes its part of the log with it: beside a friction that is not
    there, what was named with it has other values.

    Args:
        named: From `identify`.
        found: Some of what was found, in its order.
    """
    problem = named.settled.problem
    keys = {f.key for f in found}
    bodies = any(f.effect == BODIES[0] for f in found)
    kept = [a for a in problem.accepted if (a.effect.name, a.place) in keys]
    if len(kept) == len(problem.accepted) and bodies == (problem.uncertainty > UNCERTAINTIES[0]):
        return tuple(found)
    spread = problem.uncertainty if bodies else UNCERTAINTIES[0]
    again = refit(problem.judged(spread, problem.weights).with_accepted(kept))
    sized = dict(
        zip(
            [(a.effect.name, a.place) for a in again.accepted],
            estimates(again, named.naming.channel),
            strict=True,
        )
    )
    out = []
    for f in found:
        if f.effect == BODIES[0]:
            out.append(replace(f, members=_members(again, f.level)))
        else:
            out.append(replace(f, parameters=sized[f.key].parameters))
    return tuple(out)


def _found(confidence: Confidence, channel: str) -> Iterator[Found]:
    """The names of a set, those that do most first."""
    problem, search, state = confidence.settled.problem, confidence.search, confidence.state
    sized = estimates(problem, channel)
    numbers: list[int | None] = [*state.numbers]
    if confidence.refitted:
        numbers.append(None)
    rivals = {n: confidence.rivals(n) for n in numbers}
    order = sorted(numbers, key=lambda n: -rivals[n][0].behind)
    present = State((), UNCERTAINTIES[0])
    before = validation_errors(search, present)
    for place, number in enumerate(order, start=1):
        if number is None:
            present = replace(present, uncertainty=state.uncertainty)
        else:
            used = next(u for t, u in state.terms if t == number)
            present = replace(present, terms=(*present.terms, (number, used)))
        after = validation_errors(search, present)
        joints = joints_of(confidence, number)
        # A curve's coordinates stand in for each other: each may be nothing, not all of them.
        certain = (
            number is None
            or sized[number].certain
            or not confidence.settled.pool.terms[number].effect.has_law
        )
        level, reason = level_of(confidence, number, rivals[number], joints, certain)
        open_ = tuple(r.key for r in rivals[number] if r.key is not None and not r.excluded)
        a = None if number is None else problem.accepted[number]
        effect = effect_named(BODIES[0]) if a is None else a.effect
        yield Found(
            order=place,
            effect=effect.name,
            place=tuple(problem.model.links) if a is None else a.place,
            parameters=() if number is None else sized[number].parameters,
            rivals=open_,
            valid_before=rms(before, joints),
            valid_after=rms(after, joints),
            unit=CHANNEL_UNITS[channel],
            noise_floor=float(np.sqrt(np.mean(problem.floor[joints, 0] ** 2))),
            level=level,
            reason=reason,
            members=_members(problem, level) if number is None else (),
        )
        before = after


def _members(problem: Problem, level: str) -> tuple[Member, ...]:
    """Refitted bodies, link by link."""
    return tuple(Member((link,), ten, level) for link, ten in bodies_of(problem).items())


def _candidates(confidence: Confidence, found: Sequence[Found]) -> Iterator[Candidate]:
    """Every name once: those found, what comes close to one of them, then all others."""
    first, search, state = confidence.settled.first, confidence.search, confidence.state
    nothing = first.valid(State((), UNCERTAINTIES[0]))
    alone = _best_by_name(first, first.gains(nothing))
    beside = _best_by_name(search, search.gains(state))
    kept = {f.key: f for f in found}
    close = {r: f for f in found for r in f.rivals}
    unit = CHANNEL_UNITS[confidence.settled.problem.data_sets[0].measurement.channels[0]]
    base = validation_errors(first, nothing)
    names = dict.fromkeys([*kept, *(r for r in close if r[1] or r == BODIES), *alone])
    for key in names:
        effect, place = key
        f = kept.get(key)
        gain = alone.get(key, float("nan"))
        if f is not None:
            verdict, reason = limits.ACCEPTED, f.reason or "nothing else explains the log as well"
        elif key in close:
            verdict = limits.INDISTINGUISHABLE + words_of(close[key].key)
            reason = told_apart(close[key].effect, effect)
        elif gain == -np.inf:
            verdict, reason = limits.NOT_IDENTIFIABLE, "its estimate is nothing that can be"
        else:
            verdict = limits.REJECTED
            reason = _rejected(gain, beside.get(key, -np.inf))
            reason = limits.IDLE if key in search.closed else reason
        joints = [j for j, n in enumerate(confidence.settled.problem.model.joints) if n in place]
        yield Candidate(
            effect=effect,
            place=place,
            before=f.valid_before if f else rms(base, joints or range(base.size)),
            after=f.valid_after if f else float("nan"),
            unit=unit,
            identifiable=gain != -np.inf,
            verdict=verdict,
            reason=reason,
            gain=gain if np.isfinite(gain) else 0.0,
        )


def _rejected(gain: float, beside: float) -> str:
    if gain <= 0.0:
        return "the log is no more likely with it"
    if beside == -np.inf:
        return "the effects found leave nothing for it"
    return f"with the effects found it makes the log less likely, by {-beside:.1f} (ln)"


def _best_by_name(search: Search, gains: Array) -> Mapping[Key, float]:
    out: dict[Key, float] = {}
    for term, gain in zip(search.pool.terms, gains, strict=True):
        out[term.key] = max(out.get(term.key, -np.inf), float(gain))
    return out
