"""All names that compete on a log, as columns of one linear regression.

Unknowns are absolute: a tolerance counts from the files, a coordinate of an effect from zero, so
that leaving one out is setting it to zero, whatever point the columns were linearised about.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from pipeline.effects.base import REACH, Effect, Place
from pipeline.effects.bodies.link_mass import AXES, AddedBody, LinkMass, last_links, point_mass
from pipeline.effects.drive.torque_ripple import TorqueRipple
from pipeline.effects.friction.presets import FrictionPreset
from pipeline.effects.registry import catalogue
from pipeline.identification.regression.design_matrix import DataSet, effect_columns, residual
from pipeline.identification.regression.normal_equations import solve_spd
from pipeline.identification.regression.problem import Problem
from pipeline.logs.prepared.measurement import TRAIN, VALIDATION

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Key = tuple[str, Place]
#: Orders of a ripple that compete at a joint.
_PEAKS = 4
#: Triples of neighbouring rows below which they do not give the noise.
_FOLLOWING = 50
_RIDGE = 1e-9
_TEN = len(AddedBody.coordinates)
#: Places about a link's joint from which that of a payload is looked for [m].
_AROUND = np.vstack([np.zeros(3), *(0.2 * np.eye(3)), *(-0.2 * np.eye(3))])


@dataclass(frozen=True, eq=False)
class Term:
    """An effect at a place with nonlinear parameters of its own.

    Attributes:
        effect: The effect.
        place: Where.
        shape: Its nonlinear parameters.
        columns: Of the pool, one per coordinate.
    """

    effect: Effect
    place: Place
    shape: Mapping[str, float]
    columns: Index

    @property
    def key(self) -> Key:
        """Effect and place."""
        return self.effect.name, self.place


@dataclass(frozen=True, eq=False)
class Channel:
    """Normal equations of one effort channel of one joint by block.

    Attributes:
        joint: Its number.
        ids: Columns of the pool that touch it, (n,).
        H: X^T X of every block, (B, n, n).
        h: X^T r, (B, n).
        s: r^T r, (B,).
        count: Independent samples, (B,).
        part: TRAIN or VALIDATION, (B,).
        number: Of the channel.
        effort: Mean square of the measured effort, in the noise's variance.
        noise: Of the highest frequencies in the bandwidth, taken as white there, in standard
            deviations of the floor; NaN where too few rows follow one another.
    """

    joint: int
    ids: Index
    H: Array
    h: Array
    s: Array
    count: Array
    part: NDArray[np.int8]
    number: int
    effort: float
    noise: float


@dataclass(frozen=True, eq=False)
class Pool:
    """The regression of everything that competes.

    Attributes:
        problem: About whose present model the columns are.
        terms: What competes, accepted effects first.
        size: Number of columns; tolerances first.
        channels: Normal equations of what may be learnt from.
        held: Values of tolerances and of accepted effects' coordinates in the present model.
    """

    problem: Problem
    terms: tuple[Term, ...]
    size: int
    channels: tuple[Channel, ...]
    held: Array

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
    for effect in payloads:
        for link, shape in _payloads(problem, terms, columns, held):
            at = _offer(problem, effect, (link,), shape, columns, terms, at)
    if ripples:
        rests = _rests(problem, columns, held)
        for effect in ripples:
            for j, joint in enumerate(problem.model.joints):
                for shape in _orders(problem, effect, j, rests):
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


def _absolute(
    problem: Problem, log: int, columns: Sequence[Mapping[int, Array]], held: Array
) -> dict[int, Array]:
    """Residual of the model without tolerances and accepted effects, by joint, (R, C)."""
    rest = residual(problem.data_sets[log], problem.predictions[log], problem.sigma)
    for k in np.flatnonzero(held).tolist():
        for j, x in columns[k].items():
            rest[j] = rest[j] + held[k] * x
    return rest


def _payloads(
    problem: Problem,
    terms: Sequence[Term],
    columns: Sequence[Sequence[Mapping[int, Array]]],
    held: Array,
) -> Iterator[tuple[str, dict[str, float]]]:
    """Where a point mass would be on each last link, beside any friction and beside none."""
    beside = list(range(len(problem.tolerances)))
    for term in terms:
        if isinstance(term.effect, FrictionPreset) or term.effect.name == "effort_offset":
            beside += term.columns.tolist()
    full = np.zeros(len(columns[0]))
    full[: held.size] = held
    model, n = problem.current, len(beside)
    prior = np.zeros(n)
    prior[: len(problem.tolerances)] = problem.precision[: len(problem.tolerances)]
    for link in last_links(model):
        H, h = np.zeros((n + _TEN, n + _TEN)), np.zeros(n + _TEN)
        for k, (data_set, own) in enumerate(zip(problem.data_sets, columns, strict=True)):
            added = effect_columns(
                data_set, problem.predictions[k], AddedBody(), (link,), {}, problem.sigma
            )
            every = [*(own[i] for i in beside), *added]
            rest = _absolute(problem, k, own, full)
            head = problem.head(k)
            for j in {j for column in added for j in column}:
                ids = [i for i, column in enumerate(every) if j in column]
                X = np.stack([every[i][j][head, 0] for i in ids])
                H[np.ix_(ids, ids)] += X @ X.T
                h[ids] += X @ rest[j][head, 0]
        for known in (n, len(problem.tolerances)):
            kept = np.concatenate([np.arange(known), np.arange(n, n + _TEN)])
            mass, *place = _point(H[np.ix_(kept, kept)], h[kept], prior[:known])
            if mass > 0.0:
                yield link, dict(zip(AXES, place, strict=True))


def _point(H: Array, h: Array, prior: Array) -> list[float]:
    """Mass [kg] and place [m] of the point mass by which a log is likeliest, (4,).

    Args:
        H: X^T X of what stands beside it and of ten inertial parameters.
        h: X^T r.
        prior: Precision of what stands beside it.
    """
    n = prior.size
    own = H[:n, :n] + np.diag(prior + 1e-6 * np.diag(H)[:n])
    taken = solve_spd(own, np.column_stack([H[:n, n:], h[:n]]))
    rest = np.column_stack([H[n:, n:], h[n:]]) - H[n:, :n] @ taken
    size, axes = np.linalg.eigh(0.5 * (rest[:, :-1] + rest[:, :-1].T))
    kept = size > 1e-9 * max(float(size[-1]), 1e-300)
    A = np.sqrt(size[kept])[:, None] * axes[:, kept].T
    b = axes[:, kept].T @ rest[:, -1] / np.sqrt(size[kept])

    def left(p: Array) -> Array:
        return np.asarray(A @ point_mass(p[0], p[1:]) - b)

    # Free of each other the ten parameters tell mass and first moment, where the log shows both.
    ten = axes[:, kept] @ (b / np.sqrt(size[kept]))
    starts = [[float(ten[0]), *(ten[1:4] / ten[0])]] if ten[0] > 0.0 else []
    for centre in _AROUND:
        unit = A @ point_mass(1.0, centre)
        starts.append([float(unit @ b) / max(float(unit @ unit), 1e-300), *centre])
    found = [least_squares(left, start, x_scale="jac") for start in starts if start[0] > 0.0]
    if not found:
        return [0.0] * 4
    best = min(found, key=lambda f: float(f.cost))
    return np.asarray(best.x).tolist()


def _channels(
    problem: Problem, columns: Sequence[Sequence[Mapping[int, Array]]], held: Array
) -> Iterator[Channel]:
    data_sets = problem.data_sets
    rests = [_absolute(problem, k, columns[k], held) for k in range(len(data_sets))]
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
            noise = _noise(data_sets, columns, rests, rich, (j, c), ids)
            yield Channel(
                j, ids, np.array(H), np.array(h), np.array(s), n, np.array(part), c, size, noise
            )


def saturated(H: Array, h: Array) -> tuple[Array, int]:
    """Least squares with every column, and how many directions they span."""
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    values, vectors = np.linalg.eigh(H / np.outer(scale, scale))
    kept = values > 1e-7 * max(float(values.max(initial=0.0)), 1e-300)
    x = vectors[:, kept] @ ((vectors[:, kept].T @ (h / scale)) / values[kept]) / scale
    return np.asarray(x), int(kept.sum())


def _noise(
    data_sets: Sequence[DataSet],
    columns: Sequence[Sequence[Mapping[int, Array]]],
    rests: Sequence[Mapping[int, Array]],
    x: Array,
    of: tuple[int, int],
    ids: Index,
) -> float:
    """Noise by second differences of what a fit of everything leaves, in floors.

    What goes with the motion changes little from row to row, so that of it next to nothing is left
    in r[k-1] - 2 r[k] + r[k+1]; of noise that is white up to the cut-off, with the correlation rho
    of neighbours that the low-pass gives it, the variance is (6 - 8 rho_1 + 2 rho_2) sigma^2.
    """
    (j, c), squares, count = of, 0.0, 0
    for data_set, own, rest in zip(data_sets, columns, rests, strict=True):
        m, rows = data_set.measurement, data_set.rows
        if rows.size < 3:
            continue
        r = rest[j][:, c].copy()
        for k, value in zip(ids, x, strict=True):
            if j in own[k]:
                r -= value * own[k][j][:, c]
        step = int(np.median(np.diff(rows)))
        rho = _correlation(m.kernel, step)
        gain = 6.0 - 8.0 * rho[0] + 2.0 * rho[1]
        good = m.mask[rows, j] & np.isin(m.part[rows], (TRAIN, VALIDATION))
        follows = np.diff(rows) == step
        inner = good[:-2] & good[1:-1] & good[2:] & follows[:-1] & follows[1:]
        second = (r[:-2] - 2.0 * r[1:-1] + r[2:])[inner] / data_set.weight
        squares += float(np.sum(second**2)) / gain
        count += int(inner.sum())
    return float(np.sqrt(squares / count)) if count > _FOLLOWING else float("nan")


def _correlation(kernel: Array | None, step: int) -> tuple[float, float]:
    """Correlation of white noise behind a low-pass over one and two steps."""
    if kernel is None:
        return 0.0, 0.0
    full = np.correlate(kernel, kernel, "full") / float(kernel @ kernel)
    middle = kernel.size - 1
    one, two = (full[middle + k * step] if k * step <= middle else 0.0 for k in (1, 2))
    return float(one), float(two)


def _rests(
    problem: Problem, columns: Sequence[Sequence[Mapping[int, Array]]], held: Array
) -> list[list[Array]]:
    """What each joint's own columns leave of its first channel, rows that may be learnt from."""
    full = np.zeros(len(columns[0]))
    full[: held.size] = held
    rests = [_absolute(problem, k, own, full) for k, own in enumerate(columns)]
    out = []
    for j in range(len(problem.model.joints)):
        ids = sorted({i for own in columns for i, c in enumerate(own) if j in c})
        X = [
            np.stack(
                [_row(own[i], j, problem.data_sets[k].rows.size)[problem.head(k)] for i in ids]
            )
            for k, own in enumerate(columns)
        ]
        r = [rest[j][problem.head(k), 0] for k, rest in enumerate(rests)]
        H = sum(x @ x.T for x in X)
        h = np.asarray(sum(a @ b for a, b in zip(X, r, strict=True)))
        x = solve_spd(H + _RIDGE * np.diag(np.diag(H)), h)
        out.append([b - x @ a for a, b in zip(X, r, strict=True)])
    return out


def _row(column: Mapping[int, Array], joint: int, rows: int) -> Array:
    """A column's first channel at a joint, (R,); zero where it does not touch it."""
    return column[joint][:, 0] if joint in column else np.zeros(rows)


def _orders(
    problem: Problem, effect: TorqueRipple, joint: int, rests: Sequence[Sequence[Array]]
) -> list[dict[str, float]]:
    """Orders of the joint's angle that is left most of, none near another."""
    orders = effect.orders(problem.data_sets[0].measurement, joint)
    if orders.size == 0:
        return []
    power = np.zeros(orders.size)
    for k, data_set in enumerate(problem.data_sets):
        q = data_set.measurement.q[data_set.rows[problem.head(k)], joint]
        power += abs(_fourier(rests[joint][k], q, orders)) ** 2
    spacing = orders[1] - orders[0] if orders.size > 1 else 1.0
    out: list[float] = []
    for order in orders[np.argsort(power)[::-1]]:
        if all(abs(order - o) > 3 * spacing for o in out):
            out.append(float(order))
        if len(out) == _PEAKS:
            break
    return [{"order": o} for o in out]


def _fourier(rest: Array, q: Array, orders: Array) -> NDArray[np.complex128]:
    """sum_n rest exp(-i order q) for evenly spaced orders, by repeated rotation."""
    step = float(orders[1] - orders[0]) if orders.size > 1 else 1.0
    turn = np.exp(-1j * step * q)
    now = rest * np.exp(-1j * orders[0] * q)
    out = np.empty(orders.size, dtype=np.complex128)
    for k in range(orders.size):
        out[k] = now.sum()
        now = now * turn
    return out
