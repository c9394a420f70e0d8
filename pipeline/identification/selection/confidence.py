"""How sure every name of a set is: against nothing, against rivals, and by what is left."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from actuators.arrays import Array
from pipeline.identification import results as limits
from pipeline.identification.regression.normal_equations import solve_spd
from pipeline.identification.results import UNCERTAINTIES
from pipeline.identification.selection.evidence import BODIES, State
from pipeline.identification.selection.pool import Key, Term
from pipeline.identification.selection.search import CLOSE, Search
from pipeline.identification.selection.settle import Settled
from pipeline.logs.prepared.measurement import TRAIN, VALIDATION


@dataclass(frozen=True)
class Rival:
    """What may stand in the place of a name."""

    key: Key | None  #: Effect and place; None for nothing, or the URDF's bodies.
    behind: float  #: Logarithm of how much less likely the log is with it.
    sure: float  #: How many standard errors over blocks worse it predicts.
    #: Whether it has more coordinates, so that it may predict as well by having the name in it.
    richer: bool = False

    @property
    def excluded(self) -> bool:
        """Whether the log excludes it."""
        return self.behind > limits.EXCLUDED and (self.richer or self.sure > limits.SURE)


@dataclass(eq=False)
class Confidence:
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
            # A special case of a name has to be excluded like any other.
            known = own is not None and (
                own.key == term.key
                or (own.effect.name in term.effect.contains and own.place == term.place)
            )
            if not known and term.key not in [r.key for r in out]:
                out.append(self._rival(term.key, search.with_term(rest, int(k))))
        return out

    def _rival(self, key: Key | None, other: State) -> Rival:
        """How a set does against the one found."""
        # By how many standard errors over blocks its losses are larger.
        d = self.search.block_losses(other) - self.losses
        error = float(np.sqrt(d.size) * d.std(ddof=1)) if d.size > 1 else np.inf
        sure = float(d.sum()) / max(error, 1e-12)
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


def level_of(
    confidence: Confidence,
    number: int | None,
    rivals: Sequence[Rival],
    joints: Sequence[int],
    certain: bool,
) -> tuple[str, str]:
    """How far a name is to be trusted, and why not further.

    Args:
        confidence: In the set of which it is one.
        number: Of its term; None for the bodies.
        rivals: From `Confidence.rivals`.
        joints: At which it acts.
        certain: Whether its estimate differs from nothing.
    """
    search, state = confidence.search, confidence.state
    less = search.at(state, UNCERTAINTIES[0]) if number is None else search.without(state, number)
    errors = validation_errors(search, state)
    farther = rms(errors, joints) > rms(validation_errors(search, less), joints)  # not of NaN
    return graded(
        rivals,
        closer=not farther,
        certain=certain,
        law=number is None or confidence.settled.pool.terms[number].effect.has_law,
        beside_curve=number is not None and confidence.beside_curve(number),
        more_left=bool((errors > limits.UNEXPLAINED * confidence.noise)[list(joints)].any()),
    )


def graded(
    rivals: Sequence[Rival],
    *,
    closer: bool,
    certain: bool,
    law: bool,
    beside_curve: bool,
    more_left: bool,
) -> tuple[str, str]:
    """Level of a name and the reason why it is none higher.

    Args:
        rivals: Nothing first.
        closer: Whether the model with it is closer to the validation rows.
        certain: Whether its estimate differs from nothing.
        law: Whether it is a law and no curve.
        beside_curve: Whether a curve stands at its joint over the same variable.
        more_left: Whether more than noise is left at its joints.
    """
    nothing, *others = rivals
    if nothing.sure < limits.SURE and not closer:
        return limits.SUSPECTED, limits.IDLE_NAME
    if nothing.behind <= 0.0 or not certain:
        return limits.SUSPECTED, limits.NOTHING
    open_ = [words_of(r.key) for r in others if r.key and not r.excluded]
    if open_:
        return limits.APPROXIMATE, f"{'; '.join(open_)} would explain the log as well"
    reasons = {
        "parts of the log disagree whether it is there": not nothing.excluded,
        limits.SHAPELESS: not law,
        limits.BESIDE: beside_curve,
        limits.MORE_LEFT: more_left,
    }
    reason = next((words for words, holds in reasons.items() if holds), "")
    return (limits.APPROXIMATE if reason else limits.CONFIRMED), reason


def words_of(key: Key) -> str:
    """An effect and its place."""
    effect, place = key
    return f"{effect} at {' with '.join(place)}" if place else effect


def joints_of(confidence: Confidence, number: int | None) -> list[int]:
    """Joints at which a name acts, of those with rows."""
    model, pool = confidence.settled.problem.model, confidence.settled.pool
    seen = sorted({c.joint for c in pool.channels})
    if number is None:
        return seen
    named = [model.index(p) for p in owners(pool.terms[number]) if p in model.joints]
    columns = set(pool.terms[number].columns.tolist())
    touched = sorted({c.joint for c in pool.channels if columns & set(c.ids.tolist())})
    return [j for j in named if j in seen] or touched or seen


def validation_errors(search: Search, state: State) -> Array:
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


def rms(errors: Array, joints: Sequence[int]) -> float:
    """Over those of some joints that are known; NaN without any."""
    known = errors[list(joints)]
    known = known[np.isfinite(known)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")


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
