"""Which law: the simplest that predicts blocks that did not fit it as well as the best named one.

As well is within one standard error; none of them is the law where a curve predicts better than all
beyond chance.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from pipeline.regression.laws.coupling import TERMS, Coupling
from pipeline.regression.laws.friction import BESIDE, LAWS, QUADRANT, SIGNED, Law, general_terms
from pipeline.regression.statistics.gram import Key
from pipeline.regression.statistics.solve import Eliminated, Fit, beyond_chance, compare

Array = NDArray[np.float64]
Folds = Sequence[NDArray[np.intp]]

#: Share of what two separate actions would gain that one and the same must reach.
SAME = 0.9
#: At which a curve predicts better than every law with a name by chance.
CHANCE = 0.05
#: Friction per load that no law exceeds: no load could drive the shaft.
MOST_SHARE = 0.9
#: What a joint is told when no law of the catalogue comes near the general member.
UNNAMED = Law("a law that is not in the catalogue", general_terms())
#: The richest law whose every size has a name: what the general member departs from.
LOADED = next(law for law in LAWS if law.terms == ("coulomb", "viscous", "load"))


@dataclass(frozen=True)
class Choice:
    """Law of one joint.

    Attributes:
        law: The simplest within one standard error, or `UNNAMED`.
        beside: Terms beside friction.
        short: How much better the general member predicts, in standard errors of the difference.
        best: The named law that predicts best, whatever its size; none where none is allowed.
    """

    law: Law
    beside: tuple[str, ...]
    short: float
    best: Law | None = None

    @property
    def terms(self) -> tuple[str, ...]:
        """All terms of the joint."""
        return (*self.law.terms, *self.beside)

    def keys(self, joint: int) -> list[Key]:
        """Columns of the joint."""
        return [(str(joint), t) for t in self.terms]


#: The general member, and friction by quadrant of power.
ANYTHING = Law("anything", (*general_terms(), QUADRANT))


def general(quadrant: bool = True) -> Choice:
    """Everything at once: what other joints are allowed while one is looked at.

    Args:
        quadrant: Whether friction may differ by quadrant of power.
    """
    return Choice(ANYTHING if quadrant else UNNAMED, BESIDE, 0.0)


def choose_law(
    fit: Fit,
    folds: Folds,
    weight: Array,
    joint: int,
    common: Sequence[Key],
    barred: Collection[Key] = (),
) -> Choice:
    """Law of one joint beside everything else.

    Args:
        fit: Regressions.
        folds: Blocks left out together.
        weight: How often every block was drawn, (B,).
        joint: Which.
        common: Columns of the other joints and of couplings.
        barred: Terms that are not allowed.
    """
    names = [t for law in LAWS for t in law.terms]
    names = list(dict.fromkeys([*names, *UNNAMED.terms, *BESIDE]))
    at = {name: k for k, name in enumerate(names)}
    own = fit.system.index([(str(joint), t) for t in names])
    eliminated = Eliminated(fit, folds, weight, fit.columns(common), own)

    def use(terms: Sequence[str]) -> list[int]:
        return [at[t] for t in terms]

    allowed = tuple(t for t in BESIDE if (str(joint), t) not in barred)
    beside = _beside(eliminated, at, weight, allowed)
    top = eliminated.losses(use((*UNNAMED.terms, *beside)))
    found: list[tuple[Law, Array]] = []
    for law in LAWS:
        if any((str(joint), t) in barred for t in law.terms):
            continue
        sizes = eliminated.sizes(use((*law.terms, *beside)))
        if not all(possible(t, x) for t, x in zip(law.terms, sizes, strict=False)):
            continue
        found.append((law, eliminated.losses(use((*law.terms, *beside)))))
    if not found:
        return Choice(UNNAMED, beside, np.inf, None)
    first, best = min(found, key=lambda c: float(weight @ c[1]))
    mean, error = compare(best, top, weight)
    if mean > _limit(weight) * error:
        return Choice(UNNAMED, beside, np.inf, first)
    near = []
    for law, loss in found:
        mean, error = compare(loss, best, weight)
        if mean <= error:
            near.append((law.shapes, float(weight @ loss), law, loss))
    _, _, law, loss = min(near, key=lambda x: x[:2])
    mean, error = compare(loss, top, weight)
    return Choice(law, beside, mean / max(error, 1e-300), first)


def _limit(weight: Array) -> float:
    """Standard errors beyond which one model predicts better than another, `CHANCE` apart."""
    blocks = int((weight > 0).sum())
    return float(scipy.stats.t.ppf(1 - CHANCE, max(blocks - 1, 1)))


def possible(term: str, size: float) -> bool:
    """Whether friction takes energy out, and per load less than the load."""
    if term.partition("@")[0] in ("load", "driving", "driven", "motor") and size >= MOST_SHARE:
        return False
    return size > 0 or term in SIGNED


def _beside(
    eliminated: Eliminated, at: Mapping[str, int], weight: Array, allowed: tuple[str, ...]
) -> tuple[str, ...]:
    """Offset and rotor inertia, each kept where blocks that did not fit want it beyond chance."""
    rich = [at[t] for t in UNNAMED.terms]
    kept = list(allowed)
    for term in reversed(allowed):
        rest = [t for t in kept if t != term]
        with_it = [*rich, *(at[t] for t in kept)]
        size = eliminated.sizes(with_it)[len(rich) + kept.index(term)]
        mean, error = compare(
            eliminated.losses([*rich, *(at[t] for t in rest)]), eliminated.losses(with_it), weight
        )
        if mean <= _limit(weight) * error or (size < 0 and term not in SIGNED):
            kept = rest
    return tuple(kept)


def choose_laws(
    fit: Fit,
    folds: Folds,
    weight: Array,
    start: Sequence[Choice],
    shared: Sequence[Key],
    passes: int,
    barred: Collection[Key] = (),
) -> list[Choice]:
    """Laws of all joints in turn, each beside what the others have, until nothing changes."""
    now = list(start)
    for _ in range(passes):
        before = list(now)
        for j in range(len(now)):
            others = [k for i, c in enumerate(now) if i != j for k in c.keys(i)]
            now[j] = choose_law(fit, folds, weight, j, [*others, *shared], barred)
        if [c.terms for c in now] == [c.terms for c in before]:
            break
    return now


def upgrade(
    fit: Fit,
    folds: Folds,
    weight: Array,
    choices: Sequence[Choice],
    shared: Sequence[Key],
    barred: Collection[Key] = (),
) -> list[Choice]:
    """Forward and swap steps until the best is no better than the whole model beyond chance.

    A joint's law may stop one standard error short of its best; many joints' shortcomings add up.
    A step gives one joint a richer law, or gives or takes its offset or rotor inertia.
    """

    def losses(now: Sequence[Choice]) -> Array:
        keys = [k for j, c in enumerate(now) for k in c.keys(j)]
        return fit.losses(folds, weight, fit.columns([*keys, *shared]))

    uniform = [
        losses([_unnamed(c, j, beside, barred) for j, c in enumerate(choices)])
        for beside in ((), ("rotor",), BESIDE)
    ]
    now = list(choices)
    loss = losses(now)
    best = min([*uniform, loss], key=lambda x: float(weight @ x))
    while True:
        mean, error = compare(loss, best, weight)
        if mean <= _limit(weight) * error:
            return now
        trials = []
        for j, c in enumerate(now):
            for step in _steps(c):
                named = () if step.law is UNNAMED else step.law.terms
                if any((str(j), t) in barred for t in (*named, *step.beside)):
                    continue
                trial = [*now[:j], step, *now[j + 1 :]]
                trials.append((losses(trial), trial))
        if not trials:
            return now
        new, trial = min(trials, key=lambda x: float(weight @ x[0]))
        if weight @ new >= weight @ loss:
            return now
        loss, now = new, trial


def _unnamed(c: Choice, joint: int, beside: Sequence[str], barred: Collection[Key]) -> Choice:
    """The general member at a joint, with what is allowed beside it."""
    allowed = tuple(t for t in beside if (str(joint), t) not in barred)
    return replace(c, law=UNNAMED, beside=allowed)


def _steps(c: Choice) -> list[Choice]:
    """What a joint may become in one step."""
    out = []
    for law in (c.best, LOADED, UNNAMED):
        if law is not None and law is not c.law and law.shapes > c.law.shapes:
            out.append(replace(c, law=law, short=np.inf if law is UNNAMED else 0.0))
    for term in BESIDE:
        if term in c.beside:
            out.append(replace(c, beside=tuple(t for t in c.beside if t != term)))
        else:
            out.append(replace(c, beside=tuple(t for t in BESIDE if t in (*c.beside, term))))
    return out


def find_coupling(
    fit: Fit,
    folds: Folds,
    weight: Array,
    joints: Sequence[Choice],
    have: Sequence[Key],
    candidates: Sequence[Coupling],
    error_rate: float,
) -> Coupling | None:
    """The coupling that predicts best, if chance would not.

    A motor that turns with another joint acts on both with one and the same torque. What helps on
    one of the two only, or by another size there, is something else at that joint.

    Args:
        fit: Regressions whose system has the halves of all candidates.
        folds: Blocks left out together.
        weight: How often every block was drawn, (B,).
        joints: What every joint has.
        have: Columns of what was found before.
        candidates: Couplings looked at.
        error_rate: Chance that one of all candidates passes where none is there.
    """
    common: list[Key] = [k for j, c in enumerate(joints) for k in c.keys(j)]
    common += have
    own = fit.system.index([("shared", n) for c in candidates for n in c.half_names])
    eliminated = Eliminated(fit, folds, weight, fit.columns(common), own)
    without = eliminated.losses([])
    rate = error_rate / max(len(candidates), 1)
    best: tuple[float, Coupling] | None = None
    for k, c in enumerate(candidates):
        first = 2 * len(TERMS) * k
        both = np.zeros((len(own), len(TERMS)))
        for t in range(len(TERMS)):
            both[first + 2 * t : first + 2 * t + 2, t] = 1.0
        # What would give energy counts for nothing.
        both = both[:, eliminated.mixed_sizes(both) > 0]
        if not both.shape[1] or min(eliminated.mixed_sizes(both)) < 0:
            continue
        coupled = eliminated.mixed(both)
        mean, _ = compare(without, coupled, weight)
        if (best is not None and mean <= best[0]) or not beyond_chance(without, coupled, rate):
            continue
        halves = range(first, first + 2 * len(TERMS))
        apart = eliminated.losses(halves)
        sides = [eliminated.losses(halves[side::2]) for side in (0, 1)]
        enough = mean >= SAME * compare(without, apart, weight)[0]
        if enough and all(beyond_chance(one, apart, error_rate) for one in sides):
            best = (mean, c)
    return None if best is None else best[1]
