"""Naming: effects compete, the best is added, the rest compete again for what is left.

Each round screens all candidates, tries the best few on *fit* and *choose*, and accepts at most
one. `verdict` holds every threshold. *prove* has no say: it is looked at when all is decided.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from pipeline.effects.base import REACH, Effect, Place
from pipeline.effects.drive.transmission_coupling import BareCoupling
from pipeline.effects.registry import catalogue, effect_named
from pipeline.identification import results as limits
from pipeline.identification.regression.problem import Accepted, Problem
from pipeline.identification.regression.refit import pruned, refit, runs_away
from pipeline.identification.selection.candidate import Trial, joint_gain, try_candidate
from pipeline.identification.selection.residual import errors
from pipeline.identification.selection.screen import Score, Screen, refine, score_all
from pipeline.logs.prepared.measurement import CHOOSE, FIT

Array = NDArray[np.float64]
Key = tuple[str, Place]
_TRIED = 8  # candidates tried in earnest per round
_PASSES = 2  # through all accepted effects, to choose each anew
_COUPLES = 0.1  # least ratio of a coupling that couples anything
#: Effects of a joint's own shaft: their coordinate, and that of a coupling that is the same.
_SHAFT = {
    "coulomb_friction": ("torque", "coulomb"),
    "viscous_friction": ("coefficient", "viscous"),
    "rotor_inertia": ("added", "inertia"),
}
_INFLATION = 10.0  # of gains, at most
_RESCALED = 1.15  # noise levels that differ by less are the same


@dataclass(frozen=True)
class Round:
    """One acceptance.

    Attributes:
        winner: The effect.
        trial: How it did.
        rivals: Effects at places that explain the log as well.
    """

    winner: Key
    trial: Trial
    rivals: tuple[Key, ...]


@dataclass(frozen=True, eq=False)
class Selection:
    """Effects accepted one after another.

    Attributes:
        problem: With all accepted effects.
        rounds: One per effect that is still accepted, in order of acceptance.
        first: Scores of the first round, by effect and place: every candidate once.
        last: Scores of the last round.
        trials: Best trial of each candidate tried in earnest.
        tried: Candidates screened, shapes not counted.
        nearest: What was added last though its case does not stand, where nothing better explains
            a large gap.
        enough: Whether no more effects than were allowed are needed.
    """

    problem: Problem
    rounds: tuple[Round, ...]
    first: tuple[Score, ...]
    last: tuple[Score, ...]
    trials: dict[Key, Trial]
    tried: int
    nearest: Key | None = None
    enough: bool = True

    def without_nearest(self) -> Selection:
        """The same where what came nearest is not offered after all."""
        problem = self.problem.with_accepted(self.problem.accepted[:-1])
        return replace(self, problem=problem, rounds=self.rounds[:-1], nearest=None)


def select(
    problem: Problem, *, most: int | None = None, without: Collection[str] = ()
) -> Selection:
    """Accept effects until none is needed any more.

    Args:
        problem: Without effects, its noise level decided.
        most: Effects at most; the answer says where more would be needed, and is not worked out.
        without: Names of effects that do not compete.
    """
    rounds: list[Round] = []
    trials: dict[Key, Trial] = {}
    first: tuple[Score, ...] = ()
    refused: set[Key] = set()
    made: list[Trial] = []
    problem = refit(problem)
    passed = {_names(problem)}
    while True:
        screen = Screen(problem)
        held = [(a.effect.name, a.place) for a in problem.accepted]
        scores = score_all(screen, offered(problem, without), skip=held)
        if not first:
            noise = problem.richest()
            if (noise > _RESCALED * problem.sigma).any():
                # The log holds more than noise and the catalogue: judge against what is left.
                problem = refit(problem.rescaled(noise))
                screen = Screen(problem)
                scores = score_all(screen, offered(problem, without), skip=held)
            first = tuple(scores)
        tried = len(first)
        if len(problem.accepted) >= limits.MOST_EFFECTS * len(problem.model.joints):
            break
        open_ = [s for s in scores if (s.effect.name, s.place) not in refused]
        open_ = [s for s in open_ if s.gain > 0.7 * least_gain(problem, s)]
        # A coupling brings a shaft with friction and inertia along: each joint's own come first.
        own = [s for s in open_ if not isinstance(s.effect, BareCoupling)]
        coupled = [s for s in open_ if isinstance(s.effect, BareCoupling)]
        made, good = _in_earnest(problem, screen, (own, coupled), tried)
        for t in made:
            trials.setdefault(t.key, t)
        if not good:
            break
        if most is not None and len(problem.accepted) >= most:
            return Selection(
                problem, tuple(rounds), first, tuple(scores), trials, tried, enough=False
            )
        winner = _preferred(problem, good)
        rivals = _rivals(problem, winner, made)
        added = _accepted(winner)
        candidate = _with(problem, added, passed)
        if candidate is None:
            refused.add(winner.key)
            continue
        rounds.append(Round(winner.key, winner, rivals))
        problem = candidate
        passed.add(_names(problem))
    problem, rounds = _reconsidered(problem, rounds, tried, without)
    problem, rounds = _dissolved(problem, rounds)
    nearest = None
    if (best := _nearest(problem, made)) is not None:
        nearest = best.key
        problem = problem.with_accepted([*problem.accepted, _accepted(best)])
        rounds.append(Round(best.key, best, ()))
    kept = {(a.effect.name, a.place) for a in problem.accepted}
    rounds = [r for r in rounds if r.winner in kept]
    return Selection(problem, tuple(rounds), first, tuple(scores), trials, tried, nearest)


def _with(problem: Problem, added: Accepted, passed: Collection[frozenset[Key]]) -> Problem | None:
    """The problem with one more effect, less what that makes superfluous; None if it cannot stay.

    Args:
        problem: Before.
        added: The effect.
        passed: What was accepted together before: of two effects each of which makes the other
            superfluous, both stay, which would take turns for ever.
    """
    both = refit(problem.with_accepted([*problem.accepted, added]).remasked())
    candidate = pruned(both)
    if _names(candidate) in passed:
        candidate = both
    now = _names(candidate)
    stays = (added.effect.name, added.place) in now and now not in passed
    return candidate if stays and not runs_away(candidate) else None


def _names(problem: Problem) -> frozenset[Key]:
    return frozenset((a.effect.name, a.place) for a in problem.accepted)


def offered(problem: Problem, without: Collection[str]) -> list[Effect]:
    """Effects that compete for what a problem leaves."""
    return [e for e in catalogue(problem.current()) if e.name not in without]


def _in_earnest(
    problem: Problem, screen: Screen, groups: Sequence[Sequence[Score]], tried: int
) -> tuple[list[Trial], list[Trial]]:
    """Candidates tried group by group until some are acceptable: all tried, and those."""
    made: list[Trial] = []
    for group in groups:
        tries = [try_candidate(problem, refine(screen, s)) for s in group[:_TRIED]]
        made += tries
        good = [t for t in tries if acceptable(problem, t, tried)]
        if good:
            return made, good
    return made, []


def _accepted(t: Trial) -> Accepted:
    shape = {k: v for k, v in t.score.shape.items() if k != REACH}
    return Accepted(t.score.effect, t.score.place, t.score.x, shape)


def _nearest(problem: Problem, made: Sequence[Trial]) -> Trial | None:
    """What comes nearest to an unexplained gap, though its case does not stand by itself."""
    squares, _ = errors(problem, (FIT, CHOOSE))
    excess = np.sqrt((squares / problem.floor**2).max(axis=1))
    out = []
    for t in made:
        likely = t.significance > float(chi2.isf(limits.NEAREST_ALARM, max(t.freedom, 1)))
        large = t.held_share > limits.NEAREST_SHARE and t.held_out > 0.0
        left = max((excess[j] for j in t.touched), default=0.0) > limits.UNEXPLAINED
        if likely and large and left:
            out.append(t)
    return max(out, key=lambda t: t.held_share, default=None)


def least_gain(problem: Problem, score: Score) -> float:
    """Gain that a candidate needs, before the noise's scale is looked at."""
    if score.effect.is_tolerance:
        return tolerance_gain(1)
    return limits.LEAST_GAIN


def tolerance_gain(freedom: int) -> float:
    """Gain beyond which a tolerance counts as exceeded."""
    chance = chi2.sf(limits.TOLERANCE_SIGMAS**2, 1)
    return float(chi2.isf(chance, freedom))


def acceptable(problem: Problem, t: Trial, tried: int) -> bool:
    """Whether a candidate's case stands by itself."""
    tolerance = t.score.effect.tolerance(problem.model, t.score.place)
    size = sum((t.score.x[k] / s) ** 2 for k, s in tolerance.items())
    alarm = float(chi2.isf(limits.FALSE_ALARM / max(tried, 1), max(t.freedom, 1)))
    if tolerance and size < tolerance_gain(len(tolerance)):
        return False
    if t.score.effect.is_tolerance:
        alarm = float(chi2.isf(limits.TOLERANCE_ALARM / max(tried, 1), max(t.freedom, 1)))
        # Tolerances explain a part already: the rest has to exceed them, and by its own size.
        least = tolerance_gain(max(t.freedom, 1))
        return t.gain > least and t.significance > alarm and t.held_out > 0.0
    # Of an effect that many joints feel a share of one of them is asked.
    share = limits.LEAST_SHARE * t.expected / max(len(t.touched), 1)
    least = max(limits.LEAST_GAIN * t.scale, share)
    return t.gain > least and t.held_out > 0.0 and t.significance > alarm


def _threshold(t: Trial) -> float:
    """Difference of gains below which two explanations count as equally good.

    Where blocks scatter more than noise lets them, so do gains.
    """
    inflation = max(1.0, t.gain / max(t.significance, 1e-9)) if t.significance > 0 else 1.0
    inflation = 1.0 if t.score.effect.is_tolerance else min(inflation, _INFLATION)
    return max(limits.RIVAL_GAIN * inflation * max(t.scale, 1.0), limits.RIVAL_SHARE * t.gain)


def _preferred(problem: Problem, good: Sequence[Trial]) -> Trial:
    """The best candidate; of a family the most specific member that does as well."""
    winner = max(good, key=lambda t: t.gain)
    accepted = {(a.effect.name, a.place) for a in problem.accepted}
    near = [t for t in good if winner.gain - t.gain < _threshold(winner)]

    def cost(t: Trial) -> tuple[int, float]:
        # What takes the place of an accepted special case costs one effect less.
        absorbs = any((name, t.score.place) in accepted for name in t.score.effect.contains)
        return t.freedom - (2 if absorbs else 0), -t.gain

    return min(near, key=cost)


def _rivals(problem: Problem, winner: Trial, made: Sequence[Trial]) -> tuple[Key, ...]:
    """Candidates that explain the same part of the log as well as the winner."""
    out = []
    for t in made:
        if t is winner or winner.gain - t.gain >= _threshold(winner):
            continue
        if _related(winner.score.effect, t.score.effect) and winner.score.place == t.score.place:
            continue
        shared = winner.gain + t.gain - joint_gain(problem, [winner.score, t.score])
        # What gains much beside the winner explains something else.
        if t.gain > 0.5 * winner.gain and shared > 0.5 * t.gain:
            out.append(t.key)
    return tuple(out)


def _related(a: Effect, b: Effect) -> bool:
    """Whether one is a special case of the other."""
    return a.name in b.contains or b.name in a.contains


def _reconsidered(
    problem: Problem, rounds: Sequence[Round], tried: int, without: Collection[str]
) -> tuple[Problem, list[Round]]:
    """With every effect chosen anew while the others stay: what came early was judged alone.

    A single effect is only held against its own special cases: all others it has met already.
    """
    chosen = {r.winner: r for r in rounds}
    for _ in range(_PASSES):
        changed = False
        for number, a in enumerate(problem.accepted):
            key = (a.effect.name, a.place)
            others = [o for k, o in enumerate(problem.accepted) if k != number]
            rest = refit(problem.with_accepted(others))
            screen = Screen(rest)
            made = [
                try_candidate(rest, refine(screen, s)) for s in _again(screen, a, others, without)
            ]
            good = [t for t in made if acceptable(rest, t, tried)]
            if not good:
                continue
            best = _preferred(rest, good)
            if best.key in chosen and (best.key != key or best.score.effect is a.effect):
                continue
            accepted = [*others[:number], _accepted(best), *others[number:]]
            candidate = refit(rest.with_accepted(accepted))
            if runs_away(candidate):
                continue
            problem, changed = candidate, True
            del chosen[key]
            chosen[best.key] = Round(best.key, best, _rivals(rest, best, made))
        if not changed:
            break
    order = [(a.effect.name, a.place) for a in problem.accepted]
    return problem, [chosen[key] for key in order if key in chosen]


def _dissolved(problem: Problem, rounds: Sequence[Round]) -> tuple[Problem, list[Round]]:
    """With the joint's own friction and inertia in place of a coupling that couples nothing.

    A coupling brings a shaft along; where its ratio is next to none the shaft is the joint's own.
    """
    out = list(rounds)
    for a in problem.accepted:
        if not isinstance(a.effect, BareCoupling) or abs(a.shape["ratio"]) > _COUPLES:
            continue
        others = {(o.effect.name, o.place): o for o in problem.accepted if o is not a}
        parts = {}
        for name, (coordinate, own) in _SHAFT.items():
            key = (name, a.place[:1])
            if a.x[own] > 0.0:
                held = others[key].x[coordinate] if key in others else 0.0
                parts[key] = Accepted(effect_named(name), key[1], {coordinate: held + a.x[own]}, {})
        accepted = []
        for o in problem.accepted:
            key = (o.effect.name, o.place)
            if o is a:
                accepted += [part for k, part in parts.items() if k not in others]
            else:
                accepted.append(parts.get(key, o))
        problem = pruned(refit(problem.with_accepted(accepted)))
        old = next(r for r in out if r.winner == (a.effect.name, a.place))
        new = [replace(old, winner=key, rivals=()) for key in parts if key not in others]
        out = [r for r in out if r is not old] + new
    return problem, out


def _again(
    screen: Screen, a: Accepted, others: Sequence[Accepted], without: Collection[str]
) -> list[Score]:
    """What may stand in the place of an accepted effect, itself among it."""
    held = [(o.effect.name, o.place) for o in others]
    problem = screen.problem
    if others:
        scores = score_all(screen, offered(problem, without), skip=held, near=a.place)
        return [s for s in scores[:_TRIED] if s.gain > 0.7 * least_gain(problem, s)]
    every = [(a.effect, a.shape), *((effect_named(name), {}) for name in a.effect.contains)]
    scored = [screen.score(effect, a.place, shape) for effect, shape in every]
    return [s for s in scored if s is not None and s.gain > 0.0]
