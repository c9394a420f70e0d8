"""Step 3 in one call: name what is missing, with values, intervals, rivals and how sure.

Test rows have no say in any of it and are not looked at here: `written` holds the model file that
came of it against them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.effects.base import CHANNEL_UNITS
from pipeline.effects.registry import EFFECTS, effect_named
from pipeline.identification import results as limits
from pipeline.identification.regression.design_matrix import make_data_sets
from pipeline.identification.regression.floor import floor_of, left_open
from pipeline.identification.regression.intervals import bodies_of, estimates
from pipeline.identification.regression.normal_equations import solve_spd
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.refit import refit, tolerances_of
from pipeline.identification.results import UNCERTAINTIES, Candidate, Found, Member, Naming
from pipeline.identification.selection.pool import Key, Term
from pipeline.identification.selection.search import BODIES, CLOSE, Search, State
from pipeline.identification.selection.settle import Settled, settle, settle_without
from pipeline.logs.prepared.measurement import TRAIN, VALIDATION, Measurement
from pipeline.machine.machine import MachineModel
from pipeline.progress import Progress

Array = NDArray[np.float64]
#: Times the names compete anew without those that turned out to be idle.
_RENEWED: Final = 2


@dataclass(frozen=True)
class Rival:
    """What may stand in the place of a name.

    Attributes:
        key: Effect and place; None for nothing, or the URDF's bodies.
        behind: Logarithm of how much less likely the log is with it.
        sure: How many standard errors over blocks worse it predicts.
        richer: Whether it has more coordinates, so that it may predict as well by having the name
            in it.
    """

    key: Key | None
    behind: float
    sure: float
    richer: bool = False

    @property
    def excluded(self) -> bool:
        """Whether the log excludes it."""
        return self.behind > limits.EXCLUDED and (self.richer or self.sure > limits.SURE)


@dataclass(frozen=True, eq=False)
class Identified:
    """Naming with what it leads to.

    Attributes:
        naming: Results.
        settled: The set of names at its estimates.
    """

    naming: Naming
    settled: Settled

    @property
    def noise(self) -> Array:
        """Noise that no motion makes, by what everything together leaves, (J, C)."""
        return noise_of(self.settled)


def identify(
    model: MachineModel, measurements: Sequence[Measurement], progress: Progress | None = None
) -> Identified:
    """Name what the model lacks.

    Args:
        model: What the engineer has.
        measurements: Logs with parts, from `observe`.
        progress: To tell how far it is.

    Raises:
        NamingError: A part of the data has no usable row.
        ModelError: Model and logs do not fit.
    """
    start = Problem(model, make_data_sets(measurements), floor_of(measurements))
    channel = measurements[0].channels[0]
    judged, found = _best_judged(settle(start, progress), channel)
    settled = judged.settled
    naming = Naming(
        found=found,
        candidates=tuple(_candidates(judged, found)),
        tolerances=tolerances_of(settled.problem),
        tried=len({t.key for t in settled.first.pool.terms}) + 1,
        channel=channel,
        unit=CHANNEL_UNITS[channel],
        notes=tuple(judged.notes()),
    )
    return Identified(naming, settled)


def _best_judged(settled: Settled, channel: str) -> tuple[Judgement, tuple[Found, ...]]:
    """The names with how sure each is.

    Names that are suspected are closed and the others compete anew. What that leads to is the
    answer unless the log is less likely with the names that would then be written.
    """
    weights, idle = settled.search.weights, frozenset[Key]()
    best: tuple[float, Judgement, tuple[Found, ...]] | None = None
    for left in reversed(range(_RENEWED + 1)):
        judged = Judgement(settled)
        found = tuple(_found(judged, channel))
        more = frozenset(_key(f) for f in found if f.level == limits.SUSPECTED)
        search = Search(settled.pool, weights, more)
        evidence = search.left(settled.state).evidence - search.promised(settled.state)
        if best is None or evidence > best[0] - limits.EXCLUDED:
            best = evidence, judged, found
        if not more or not left:
            break
        idle |= more
        settled = settle_without(settled, idle)
    assert best is not None
    return best[1], best[2]


def _worse(losses: Array, others: Array) -> float:
    """By how many standard errors over blocks losses (B,) are larger than others."""
    d = losses - others
    error = float(np.sqrt(d.size) * d.std(ddof=1)) if d.size > 1 else np.inf
    return float(d.sum()) / max(error, 1e-12)


def _key(f: Found) -> Key:
    return BODIES if f.effect == BODIES[0] else f.key


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


@dataclass(eq=False)
class Judgement:
    """How sure every name of a settled set is."""

    settled: Settled

    @property
    def search(self) -> Search:
        """On columns about the estimates."""
        return self.settled.search

    @property
    def state(self) -> State:
        """The set."""
        return self.settled.state

    @property
    def refitted(self) -> bool:
        """Whether the URDF's bodies are not its own."""
        return self.state.uncertainty > UNCERTAINTIES[0]

    @cached_property
    def noise(self) -> Array:
        """Noise of the first channel, (J,)."""
        return sensor_noise(self.settled)[:, 0]

    @cached_property
    def losses(self) -> Array:
        """Of every block by estimates from others, (B,)."""
        return self.search.block_losses(self.state)

    def rivals(self, number: int | None) -> list[Rival]:
        """What may stand in the place of a term, or of refitted bodies (None), nothing first."""
        search, state = self.search, self.state
        if number is None:
            rest = search.at(state, UNCERTAINTIES[0])
        else:
            rest = search.without(state, number)
        out = [self._rival(None, rest)]
        own = None if number is None else search.pool.terms[number]
        if number is not None:
            for u in UNCERTAINTIES:
                if u > state.uncertainty:
                    other = search.pruned(search.at(rest, u))
                    if state.evidence - other.evidence < CLOSE:
                        out.append(self._rival(BODIES, other))
        gains = search.gains(rest)
        for k in np.argsort(-gains)[: limits.RIVALS]:
            term = search.pool.terms[k]
            if rest.evidence + gains[k] < state.evidence - CLOSE:
                break
            known = own is not None and _within(own, term)
            if not known and term.key not in [r.key for r in out]:
                out.append(self._rival(term.key, search.with_term(rest, int(k))))
        return out

    def _rival(self, key: Key | None, other: State) -> Rival:
        """How a set does against the one found."""
        sure = _worse(self.search.block_losses(other), self.losses)
        richer = sum(len(u) for _, u in other.terms) > sum(len(u) for _, u in self.state.terms)
        return Rival(key, self.state.evidence - other.evidence, sure, richer)

    def beside_curve(self, number: int) -> bool:
        """Whether a curve without a law stands at a name's joint over the same variable."""
        own = self.settled.pool.terms[number]
        return any(
            not t.effect.has_law
            and t.effect.signature == own.effect.signature
            and set(owners(t)) & set(owners(own))
            for t in (self.settled.pool.terms[k] for k in self.state.numbers)
        )

    def notes(self) -> Iterator[str]:
        """What has no name, in words."""
        terms = [self.settled.pool.terms[t] for t in self.state.numbers]
        names = dict.fromkeys(t.place[0] for t in terms if not t.effect.has_law)
        if names:
            yield (
                f"in {', '.join(names)} friction or a torque over position is left whose law is "
                "not in the catalogue"
            )


def owners(term: Term) -> tuple[str, ...]:
    """Joints that a term names."""
    return tuple(p.partition("__")[0] for p in term.place)


def _within(a: Term, b: Term) -> bool:
    """Whether a name is another or a special case of it at the same place.

    What has the name in it explains as much; a special case has to be excluded like any other name.
    """
    return a.key == b.key or (a.effect.name in b.effect.contains and a.place == b.place)


def _found(judged: Judgement, channel: str) -> Iterator[Found]:
    """The names of a set, those that do most first."""
    problem, search, state = judged.settled.problem, judged.search, judged.state
    sized = estimates(problem, channel)
    numbers: list[int | None] = [*state.numbers]
    if judged.refitted:
        numbers.append(None)
    rivals = {n: judged.rivals(n) for n in numbers}
    order = sorted(numbers, key=lambda n: -rivals[n][0].behind)
    present = State((), UNCERTAINTIES[0])
    before = _errors(search, present)
    for place, number in enumerate(order, start=1):
        if number is None:
            present = replace(present, uncertainty=state.uncertainty)
        else:
            used = next(u for t, u in state.terms if t == number)
            present = replace(present, terms=(*present.terms, (number, used)))
        after = _errors(search, present)
        joints = _joints(judged, number)
        # A curve's coordinates stand in for each other: each may be nothing, not all of them.
        certain = (
            number is None
            or sized[number].certain
            or not judged.settled.pool.terms[number].effect.has_law
        )
        level, reason = _level(judged, number, rivals[number], joints, certain)
        open_ = tuple(r.key for r in rivals[number] if r.key is not None and not r.excluded)
        a = None if number is None else problem.accepted[number]
        effect = effect_named(BODIES[0]) if a is None else a.effect
        yield Found(
            order=place,
            effect=effect.name,
            place=tuple(problem.model.links) if a is None else a.place,
            parameters=() if number is None else sized[number].parameters,
            rivals=open_,
            valid_before=_rms(before, joints),
            valid_after=_rms(after, joints),
            unit=CHANNEL_UNITS[channel],
            noise_floor=float(np.sqrt(np.mean(problem.floor[joints, 0] ** 2))),
            excitation=effect.excitation,
            level=level,
            reason=reason,
            members=_members(problem, level) if number is None else (),
        )
        before = after


def _level(
    judged: Judgement,
    number: int | None,
    rivals: Sequence[Rival],
    joints: Sequence[int],
    certain: bool,
) -> tuple[str, str]:
    """How far a name is to be trusted, and why not further."""
    nothing, *others = rivals
    search, state = judged.search, judged.state
    less = search.at(state, UNCERTAINTIES[0]) if number is None else search.without(state, number)
    left, before = (_rms(_errors(search, x), joints) for x in (state, less))
    if nothing.sure < limits.SURE and left > before:
        return limits.SUSPECTED, limits.IDLE_NAME
    if nothing.behind <= 0.0 or not certain:
        return limits.SUSPECTED, limits.NOTHING
    open_ = [r for r in others if not r.excluded]
    if open_:
        words = "; ".join(_words(r.key) for r in open_ if r.key)
        return limits.APPROXIMATE, f"{words} would explain the log as well"
    if not nothing.excluded:
        return limits.APPROXIMATE, "parts of the log disagree whether it is there"
    if number is not None and not judged.settled.pool.terms[number].effect.has_law:
        return limits.APPROXIMATE, limits.SHAPELESS
    if number is not None and judged.beside_curve(number):
        return limits.APPROXIMATE, limits.BESIDE
    if (_errors(search, state) > limits.UNEXPLAINED * judged.noise)[joints].any():
        return limits.APPROXIMATE, limits.MORE_LEFT
    return limits.CONFIRMED, ""


def _words(key: Key) -> str:
    effect, place = key
    return f"{effect} at {' with '.join(place)}" if place else effect


def _joints(judged: Judgement, number: int | None) -> list[int]:
    """Joints at which a name acts, of those with rows."""
    model, pool = judged.settled.problem.model, judged.settled.pool
    seen = sorted({c.joint for c in pool.channels})
    if number is None:
        return seen
    named = [model.index(p) for p in owners(pool.terms[number]) if p in model.joints]
    columns = set(pool.terms[number].columns.tolist())
    touched = sorted({c.joint for c in pool.channels if columns & set(c.ids.tolist())})
    return [j for j in named if j in seen] or touched or seen


def _errors(search: Search, state: State) -> Array:
    """RMS validation error of the first channel by estimates from training rows, (J,), or NaN."""
    pool = search.pool
    columns = search.columns(state)
    part = (pool.channels[0].part != TRAIN).astype(np.intp)
    H, h = pool.parts(columns, search.weights, part)
    prior = np.diag(search.precision(columns, state.uncertainty))
    x = solve_spd(H[0] + prior, h[0])
    full = np.zeros(pool.size)
    full[columns] = x
    out = np.full(len(pool.problem.model.joints), np.nan)
    for c in pool.channels:
        rows = c.part == VALIDATION
        if c.number or c.count[rows].sum() == 0:
            continue
        own = full[c.ids]
        loss = c.s[rows].sum() - 2.0 * c.h[rows].sum(axis=0) @ own
        loss += own @ c.H[rows].sum(axis=0) @ own
        out[c.joint] = np.sqrt(max(loss, 0.0) / c.count[rows].sum())
    return out * pool.problem.sigma[:, 0]


def _rms(errors: Array, joints: Sequence[int]) -> float:
    """Over those of some joints that are known; NaN without any."""
    known = errors[list(joints)]
    known = known[np.isfinite(known)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")


def _members(problem: Problem, level: str) -> tuple[Member, ...]:
    """Refitted bodies, link by link."""
    return tuple(Member((link,), ten, level) for link, ten in bodies_of(problem).items())


def _candidates(judged: Judgement, found: Sequence[Found]) -> Iterator[Candidate]:
    """Every name once: those found, what comes close to one of them, then all others."""
    first, search, state = judged.settled.first, judged.search, judged.state
    nothing = first.valid(State((), UNCERTAINTIES[0]))
    alone = _best_by_name(first, first.gains(nothing))
    beside = _best_by_name(search, search.gains(state))
    kept = {f.key: f for f in found}
    close = {r: f for f in found for r in f.rivals}
    unit = CHANNEL_UNITS[judged.settled.problem.data_sets[0].measurement.channels[0]]
    base = _errors(first, nothing)
    names = dict.fromkeys([*kept, *(r for r in close if r[1] or r == BODIES), *alone])
    for key in names:
        effect, place = key
        f = kept.get(key)
        gain = alone.get(key, float("nan"))
        if f is not None:
            verdict, reason = limits.ACCEPTED, f.reason or "nothing else explains the log as well"
        elif key in close:
            verdict = limits.INDISTINGUISHABLE + _words(close[key].key)
            reason = f"a motion that {EFFECTS[effect].excitation} would decide"
        elif gain == -np.inf:
            verdict, reason = limits.NOT_IDENTIFIABLE, "its estimate is nothing that can be"
        else:
            verdict = limits.REJECTED
            reason = _rejected(gain, beside.get(key, -np.inf))
            reason = limits.IDLE if key in search.closed else reason
        joints = [j for j, n in enumerate(judged.settled.problem.model.joints) if n in place]
        yield Candidate(
            effect=effect,
            place=place,
            before=f.valid_before if f else _rms(base, joints or range(base.size)),
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


def sensor_noise(settled: Settled) -> Array:
    """Standard deviation of the noise, (J, C).

    The sensors' own, or what a fit of everything together leaves at the highest frequencies where
    that is more.
    """
    out = settled.problem.floor.copy()
    for c in settled.first.pool.channels:
        if np.isfinite(c.noise):
            out[c.joint, c.number] *= max(1.0, c.noise)
    return out


def noise_of(settled: Settled) -> Array:
    """Standard deviation of what no effect explains, (J, C): noise and what is left open."""
    return np.hypot(sensor_noise(settled), left_open(settled.problem))
