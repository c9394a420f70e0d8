"""All names that compete on a log, as columns of one linear regression.

Unknowns are absolute: a tolerance counts from the files, a coordinate of an effect from zero, so
that leaving one out is setting it to zero, whatever point the columns were linearised about.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Index
from pipeline.effects.base import REACH, Effect, Place
from pipeline.effects.bodies import LinkMass
from pipeline.effects.friction import FrictionPreset
from pipeline.effects.motor import TorqueRipple
from pipeline.effects.registry import catalogue
from pipeline.identification.regression.problem import Problem
from pipeline.identification.selection.places import (
    absolute,
    payload_places,
    rests_by_joint,
    ripple_orders,
)
from pipeline.identification.selection.residual import fast_noise, saturated
from pipeline.logs.prepared.measurement import TRAIN, VALIDATION

Key = tuple[str, Place]


@dataclass(frozen=True, eq=False)
class Term:
    """An effect at a place with nonlinear parameters of its own."""

    effect: Effect  #: The effect.
    place: Place  #: Where.
    shape: Mapping[str, float]  #: Its nonlinear parameters.
    columns: Index  #: Of the pool, one per coordinate.

    @property
    def key(self) -> Key:
        """Effect and place."""
        return self.effect.name, self.place


@dataclass(frozen=True, eq=False)
class Channel:
    """Normal equations of one effort channel of one joint by block."""

    joint: int  #: Its number.
    ids: Index  #: Columns of the pool that touch it, (n,).
    H: Array  #: X^T X of every block, (B, n, n).
    h: Array  #: X^T r, (B, n).
    s: Array  #: r^T r, (B,).
    count: Array  #: Independent samples, (B,).
    part: NDArray[np.int8]  #: TRAIN or VALIDATION, (B,).
    number: int  #: Of the channel.
    effort: float  #: Mean square of the measured effort, in the noise's variance.
    #: Of the highest frequencies in the bandwidth, taken as white there, in standard deviations of
    #: the floor; NaN where too few rows follow one another.
    noise: float


@dataclass(frozen=True, eq=False)
class Pool:
    """The regression of everything that competes."""

    problem: Problem  #: About whose present model the columns are.
    terms: tuple[Term, ...]  #: What competes, accepted effects first.
    size: int  #: Number of columns; tolerances first.
    channels: tuple[Channel, ...]  #: Normal equations of what may be learnt from.
    held: Array  #: Values of tolerances and of accepted effects' coordinates in the present model.

    @property
    def base(self) -> int:
        """Number of tolerances."""
        return len(self.problem.tolerances)

    def total(self, weights: Array) -> tuple[Array, Array]:
        """X^T X (P, P) and X^T r (P,) of all blocks, every channel with a weight."""
        H, h = np.zeros((self.size, self.size)), np.zeros(self.size)
        for channel, w in zip(self.channels, weights, strict=True):
            H[np.ix_(channel.ids, channel.ids)] += w * channel.H.sum(axis=0)
            h[channel.ids] += w * channel.h.sum(axis=0)
        return H, h

    def parts(self, columns: Index, weights: Array, split: Index) -> tuple[Array, Array]:
        """The same of some columns by part, (K, n, n) and (K, n); `split` (B,) counts from 0."""
        where = np.full(self.size, -1)
        where[columns] = np.arange(columns.size)
        K = int(split.max()) + 1
        H, h = np.zeros((K, columns.size, columns.size)), np.zeros((K, columns.size))
        for channel, w in zip(self.channels, weights, strict=True):
            mine = np.flatnonzero(where[channel.ids] >= 0)
            at = where[channel.ids[mine]]
            for k in range(K):
                rows = split == k
                whole = channel.H[rows].sum(axis=0)
                H[k][np.ix_(at, at)] += w * whole[np.ix_(mine, mine)]
                h[k][at] += w * channel.h[rows].sum(axis=0)[mine]
        return H, h


def make_pool(problem: Problem, effects: Sequence[Effect] | None = None) -> Pool:
    """Everything that competes, about the present model.

    Args:
        problem: With the effects accepted so far.
        effects: To offer; the whole catalogue by default.
    """
    model = problem.current
    offered = catalogue(model) if effects is None else effects
    base = len(problem.tolerances)
    terms: list[Term] = []
    columns: list[list[dict[int, Array]]] = [
        [*problem.tolerance_columns(k), *problem.accepted_columns(k)]
        for k in range(len(problem.data_sets))
    ]
    at = base
    for a in problem.accepted:
        n = len(a.effect.coordinates)
        terms.append(Term(a.effect, a.place, a.shape, np.arange(at, at + n)))
        at += n
    held = np.zeros(at)
    held[:base] = problem.held
    held[base:] = [a.x[c.name] for a in problem.accepted for c in a.effect.coordinates]
    ripples: list[TorqueRipple] = []
    payloads: list[LinkMass] = []
    for effect in offered:
        if isinstance(effect, LinkMass):
            payloads.append(effect)
        if isinstance(effect, TorqueRipple):
            ripples.append(effect)
            continue
        for place, shape in _forms(problem, effect):
            at = _offer(problem, effect, place, shape, columns, terms, at)
    beside = list(range(base))
    for term in terms:
        if isinstance(term.effect, FrictionPreset) or term.effect.name == "effort_offset":
            beside += term.columns.tolist()
    for effect in payloads:
        for link, shape in payload_places(problem, beside, columns, held):
            at = _offer(problem, effect, (link,), shape, columns, terms, at)
    if ripples:
        rests = rests_by_joint(problem, columns, held)
        for effect in ripples:
            for j, joint in enumerate(problem.model.joints):
                for shape in ripple_orders(problem, effect, j, rests):
                    at = _offer(problem, effect, (joint,), shape, columns, terms, at)
    full = np.zeros(at)
    full[: held.size] = held
    channels = tuple(_channels(problem, columns, full))
    return Pool(problem, tuple(terms), at, channels, full)


def _forms(problem: Problem, effect: Effect) -> Iterator[tuple[Place, dict[str, float]]]:
    model, m = problem.current, problem.data_sets[0].measurement
    for place in effect.places(model, m):
        for shape in effect.shapes(model, m, place):
            for reach in effect.reaches:
                yield place, shape if reach == 1.0 else {**shape, REACH: reach}


def _offer(
    problem: Problem,
    effect: Effect,
    place: Place,
    shape: dict[str, float],
    columns: list[list[dict[int, Array]]],
    terms: list[Term],
    at: int,
) -> int:
    """Append a term and its columns, where it changes the prediction; the next free column."""
    if any((t.effect, t.place, t.shape) == (effect, place, shape) for t in terms):
        return at  # accepted
    if not any(effect.shown(b.measurement, place, shape) for b in problem.data_sets):
        return at
    own = [problem.columns(k, effect, place, shape) for k in range(len(problem.data_sets))]
    if not all(any(per_log[c] for per_log in own) for c in range(len(effect.coordinates))):
        return at
    for per_log, more in zip(columns, own, strict=True):
        per_log += more
    n = len(effect.coordinates)
    terms.append(Term(effect, place, shape, np.arange(at, at + n)))
    return at + n


def _channels(
    problem: Problem, columns: Sequence[Sequence[Mapping[int, Array]]], held: Array
) -> Iterator[Channel]:
    data_sets = problem.data_sets
    rests = [absolute(problem, k, columns[k], held) for k in range(len(data_sets))]
    for j in range(len(problem.model.joints)):
        ids = np.array(sorted({k for own in columns for k, c in enumerate(own) if j in c}), int)
        for c in range(problem.sigma.shape[1]):
            H, h, s, count, part, effort = [], [], [], [], [], []
            for data_set, own, rest in zip(data_sets, columns, rests, strict=True):
                m = data_set.measurement
                X = np.stack(
                    [own[k][j][:, c] if j in own[k] else np.zeros(data_set.rows.size) for k in ids]
                )
                good = m.mask[data_set.rows, j]
                for b in np.flatnonzero(np.isin(data_set.block_part, (TRAIN, VALIDATION))):
                    rows = slice(int(data_set.edges[b]), int(data_set.edges[b + 1]))
                    x, r = X[:, rows], rest[j][rows, c]
                    H.append(x @ x.T)
                    h.append(x @ r)
                    s.append(float(r @ r))
                    part.append(data_set.block_part[b])
                    count.append(good[rows].sum() * data_set.weight**2)
                    seen = m.effort[data_set.rows[rows], j, c][good[rows]] / problem.sigma[j, c]
                    effort.append(float(np.sum(seen**2)) * data_set.weight**2)
            n = np.array(count)
            if n.sum() == 0:
                continue
            size = float(np.sum(effort) / n.sum())
            rich = saturated(np.sum(H, axis=0), np.sum(h, axis=0))[0]
            noise = fast_noise(data_sets, columns, rests, rich, (j, c), ids)
            yield Channel(
                j, ids, np.array(H), np.array(h), np.array(s), n, np.array(part), c, size, noise
            )
