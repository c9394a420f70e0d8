"""Columns that are not what their names say: the simplest reading by which a motion explains them.

One hypothesis after another is held against the log; see `explaining`. The one that takes most is
taken where it takes more than models that are wrong can give away, and the search goes on from
there. A right log costs one fit: what could be gained at all is too little.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np

from actuators.arrays import Array, Mask
from pipeline.logs.columns.explaining import (
    CAUSES,
    LEAST,
    MOST,
    RATIOS,
    Bodies,
    Causes,
    Explaining,
    Hypothesis,
    Reading,
    Score,
    as_named,
    of_efforts,
    of_positions,
)

#: Fall of the score from which a reading counts, in units of minus twice a log-likelihood.
ENOUGH: Final = 20.0
#: Score within which causes count as alike, of which the simplest, the first of `CAUSES`, is taken.
ALIKE: Final = 10.0
#: Share of an effort that may be left, root mean square, where a hypothesis is to explain it ...
WELL: Final = 0.5
#: ... and share of what was left before: 22 in place of 24 % is no reason to accuse a column.
HALVED: Final = 0.5
#: Factor by which an effort in its right unit may differ from what the model as given asks for.
SAME_SIZE: Final = 3.0
#: Hypotheses about positions that are tried with all bodies open, and any whose size is refined.
_TRIED: Final = 4
_STEPS: Final = 8
#: Force on an end over what it may carry, one standard deviation; the least over all weight.
_PUSHED: Final = 10.0
_CARRIED_AT_LEAST: Final = 0.1
#: Turns of the search for a size, each over a third of the one before.
_REFINED: Final = 5


class Along(Protocol):
    """Logs of one machine, and what its model says along other readings of their positions.

    Rough: on few rows, with nothing but the scale of its bodies open.
    """

    def effort(self, late: float, *, rough: bool) -> Array:
        """Efforts as logged, of columns taken to be late by some time [s], shape (N, J)."""

    def mask(self, reading: Reading, *, rough: bool) -> Mask:
        """Rows that count, shape (N, J)."""

    def bodies(self, reading: Reading, *, rough: bool) -> Bodies:
        """By the model."""

    @property
    def causes(self) -> Causes:
        """What may be wrong with columns of these logs."""


@dataclass(frozen=True, eq=False)
class Mended:
    """What the search found."""

    #: Hypotheses, one after the other, and by how much each lowers the score.
    steps: tuple[tuple[Hypothesis, float], ...]
    before: Array  #: Share of each joint's effort that is left as logged, shape (J,).
    after: Array  #: ... and with all steps.
    #: By how much it falls where the ends of the machine are pushed up from outside, if that
    #: explains more than any reading; else zero.
    pushed: float = 0.0


def search(along: Along, as_logged: Bodies) -> Mended:
    """Find the reading of a log's columns that its motion asks for.

    Args:
        along: Logs and model.
        as_logged: What the model says along the motion as its columns are named.
    """
    one = _Search(along, as_logged)
    reading, score = one.reading, one.now
    before, pushed = score.share, one.pushed()
    steps: list[tuple[Hypothesis, float]] = []
    while len(steps) < _STEPS and score.room(one.independent, one.floor) >= ENOUGH:
        found = one.step(reading, score)
        if pushed >= max(ENOUGH, 0.0 if found is None else found.gain):
            return Mended((), before, score.share, pushed)
        if found is None or found.gain < ENOUGH:
            break
        pushed = 0.0
        steps.append((found.hypothesis, found.gain))
        reading, score = found.hypothesis.reading, found.score
    return Mended(tuple(steps), before, score.share)


@dataclass(frozen=True, eq=False)
class _Tried:
    """A hypothesis, its score, what it gains, and that without a floor."""

    hypothesis: Hypothesis
    score: Score
    gain: float
    sharp: float


class _Search:
    """Scores of readings; models along motions are kept while they are asked for."""

    def __init__(self, along: Along, as_logged: Bodies) -> None:
        self._along = along
        self.reading = as_named(as_logged.base.shape[1])
        model = Explaining(as_logged, along.mask(self.reading, rough=False))
        self._models = {(self.reading.motion, False): model}
        model.count_independent(self._effort(self.reading, rough=False))
        self.independent, self.floor = model.independent, model.bodies.floor
        self._live = tuple(model.joints)
        self.now = model.score(self._effort(self.reading, rough=False))

    def _effort(self, r: Reading, *, rough: bool) -> Array:
        efforts = [
            self._along.effort(float(late), rough=rough)[:, k]
            for k, late in zip(r.effort_of, r.late, strict=True)
        ]
        return np.stack(efforts, axis=1) * r.effort_factor

    def _model(self, r: Reading, *, rough: bool) -> Explaining:
        key = (r.motion, rough)
        if key not in self._models:
            bodies = self._along.bodies(r, rough=rough)
            model = Explaining(bodies, self._along.mask(r, rough=rough))
            model.independent = self.independent
            self._models[key] = model
        return self._models[key]

    def pushed(self) -> float:
        """What forces that push several ends up, as feet on the ground, gain over the reading."""
        model = self._model(self.reading, rough=False)
        ends = model.bodies.ends
        if ends.size < 2 or self.now.room(self.independent, self.floor) < ENOUGH:
            return 0.0
        spread, least = model.bodies.spread.copy(), model.bodies.least.copy()
        for what in ends + np.arange(4)[:, None]:  # the mass, then its moments
            spread[what], least[what] = _PUSHED * spread[what], -np.inf
        freed = Explaining(replace(model.bodies, spread=spread, least=least), model.mask)
        freed.independent = self.independent
        score = freed.score(self._effort(self.reading, rough=False))
        up = np.sum(score.x[ends] < -_CARRIED_AT_LEAST) >= 2
        return self.now.gain(score, self.independent) if up else 0.0

    def _try(self, h: Hypothesis, now: Score, *, rough: bool = False) -> _Tried:
        near = None if h.reading.motion != self.reading.motion or rough else now
        score = self._model(h.reading, rough=rough).score(
            self._effort(h.reading, rough=rough), near
        )
        gains = (now.gain(score, self.independent, sharp=sharp) for sharp in (False, True))
        return _Tried(h, score, *gains)

    def step(self, start: Reading, now: Score) -> _Tried | None:
        """The simplest hypothesis that explains about as much as the best, its size refined."""
        odd = np.flatnonzero(now.share > self.floor).tolist()
        least = self._try(Hypothesis("", (), start), now, rough=True).score
        causes, live = self._along.causes, self._live
        rough = [self._try(h, least, rough=True) for h in of_positions(start, live, odd, causes)]
        first = self._models[self.reading.motion, False]
        self._models = {
            k: v for k, v in self._models.items() if v is first or k == (start.motion, False)
        }
        every = [*of_efforts(start, live, odd, causes), *(t.hypothesis for t in _first(rough))]
        tried = [self._try(h, now) for h in every if self._sensible(h)]
        good = [t for t in tried if self._explains(t, now)]
        # Sizes were tried in large steps: the first few are refined before they are compared.
        known = {*causes.units, *causes.ratios} - {*RATIOS}
        refined = [self._refined(h, start, now, known) for h in _first(good)]
        refined = [t for t in refined if self._explains(t, now)]
        if not refined:
            return None
        most = max(t.gain for t in refined)
        best = {t.hypothesis.cause: t for t in sorted(refined, key=lambda t: t.gain)}
        return next(best[c] for c in CAUSES if c in best and best[c].gain > most - ALIKE)

    def _sensible(self, h: Hypothesis) -> bool:
        """Whether an effort in another unit is about as large as the model as given asks for."""
        if h.cause != "scale":
            return True
        model, y = self._model(h.reading, rough=False), self._effort(h.reading, rough=False)
        sizes = np.array(
            [
                np.sqrt(np.mean(x[model.mask[:, j], j] ** 2))
                for j in h.joints
                for x in (y, model.bodies.base)
            ]
        )
        ratio = np.maximum(sizes[::2], 1e-300) / np.maximum(sizes[1::2], 1e-300)
        return bool((np.abs(np.log(ratio)) < np.log(SAME_SIZE)).all())

    @staticmethod
    def _explains(t: _Tried, now: Score) -> bool:
        """Whether a hypothesis leaves little of its joints' efforts, and far less than before."""
        which = list(t.hypothesis.joints)
        before, after = (float(np.mean(s.share[which] ** 2)) for s in (now, t.score))
        return after < min(WELL**2, HALVED**2 * before)

    def _refined(self, best: _Tried, start: Reading, now: Score, known: Set[float]) -> _Tried:
        """With the size that explains most; one that is a unit's or a gear's stays."""
        cause, size = best.hypothesis.cause, best.hypothesis.size
        if cause not in _STEP or size in known:
            return best
        step, factor = _STEP[cause], cause in ("scale", "position_scale")
        for _ in range(_REFINED):
            size = best.hypothesis.size
            sizes = (size * step, size / step) if factor else (size + step, size - step)
            possible = [s for s in sizes if not factor or LEAST < max(s, 1.0 / s) < MOST]
            others = (self._try(best.hypothesis.resized(s, start), now) for s in possible)
            best = max((best, *others), key=lambda t: t.sharp)
            step = step**0.5 if factor else 0.5 * step
        return best


#: First step of the search for a size: half of what lies between two that were tried.
_STEP: Final = {"scale": 1.5, "late": 0.02, "position_scale": 1.3, "position_zero": 0.25}


def _first(tried: Iterable[_Tried]) -> list[_Tried]:
    """The best few, of each cause and place the best."""
    best: dict[tuple[str, Sequence[int]], _Tried] = {}
    for t in sorted(tried, key=lambda t: -t.gain):
        best.setdefault((t.hypothesis.cause, t.hypothesis.joints), t)
    return list(best.values())[:_TRIED]
