"""Screening: how much each candidate could explain, all tolerances and accepted effects free.

With the unknowns B of the present problem (prior precision L) and a candidate's columns X,

    S = X^T X - X^T B (B^T B + L)^-1 B^T X,   g = X^T r - X^T B (B^T B + L)^-1 B^T r

and the fall of the penalised misfit is g^T S^-1 g: exact for the linearised problem, and cheap.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.effects.base import REACH, Effect, Place
from pipeline.effects.drive.torque_ripple import TorqueRipple
from pipeline.identification.regression.normal_equations import inverse_spd
from pipeline.identification.regression.problem import Problem
from pipeline.logs.prepared.measurement import CHOOSE, FIT

Array = NDArray[np.float64]
_PEAKS = 3  # orders of a ripple that are looked at closely
_SCAN_ROWS = 2500


@dataclass(frozen=True)
class Score:
    """What a candidate could explain on *fit* and *choose*.

    Attributes:
        effect: The effect.
        place: Where.
        shape: Its nonlinear parameters.
        gain: Fall of the penalised misfit.
        x: Coordinates, inside their signs.
        alone: Share of the columns that nothing else explains, the smallest direction [1].
        information: Inverse variance of the coordinates times their squared estimates.
    """

    effect: Effect
    place: Place
    shape: Mapping[str, float]
    gain: float
    x: Mapping[str, float]
    alone: float
    curvature: Array


class Screen:
    """Scores of candidates against one problem."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        sums = problem.sums()
        blocks = sums.blocks(FIT, CHOOSE)
        H, h = sums.H[blocks].sum(axis=0), sums.h[blocks].sum(axis=0)
        self._mean = sums.mean
        self._inverse = inverse_spd(H + np.diag(sums.precision))
        self.theta = self._inverse @ (h + sums.precision * sums.mean)

    def _fixed(self, absorbed: Sequence[int]) -> tuple[Array, Array, Array]:
        """What holding some unknowns T at nothing changes.

        With P = A^-1 the inverse becomes P - V Q V^T, V = P[:, T], Q = P[T, T]^-1, the estimate
        moves by -V Q d, d = theta_T - mean_T, and the penalised misfit rises by d^T Q d.

        Returns:
            V (n, t), Q (t, t) and d (t,).
        """
        T = np.array(absorbed, dtype=np.intp)
        V = self._inverse[:, T]
        Q: Array = np.asarray(np.linalg.inv(V[T]) if T.size else np.empty((0, 0)))
        return V, Q, np.asarray(self.theta[T] - self._mean[T])

    def reduced(
        self, columns: Sequence[Sequence[Mapping[int, Array]]], absorbed: Sequence[int] = ()
    ) -> tuple[Array, Array, Array, float]:
        """S (p, p), g (p,), the raw X^T X (p, p) of a candidate, columns per log, and a loss.

        The loss is what holding the absorbed tolerances at nothing costs.
        """
        V, Q, d = self._fixed(absorbed)
        p, n = len(columns[0]), self.theta.size
        XX, XB, Xr = np.zeros((p, p)), np.zeros((p, n)), np.zeros(p)
        for log, (stack, own) in enumerate(zip(self.problem.stacks(), columns, strict=True)):
            head = self.problem.head(log)
            for j in {j for column in own for j in column}:
                mine = np.array([k for k, column in enumerate(own) if j in column], dtype=np.intp)
                X = np.stack([own[k][j][head] for k in mine]).reshape(len(mine), -1)
                old = stack.X[j][:, head]
                XX[np.ix_(mine, mine)] += X @ X.T
                XB[np.ix_(mine, stack.ids[j])] += X @ old.reshape(old.shape[0], -1).T
                Xr[mine] += X @ stack.r[j][head].ravel()
        XV = XB @ V
        S = XX - XB @ self._inverse @ XB.T + XV @ Q @ XV.T
        g = Xr - XB @ self.theta + XV @ Q @ d
        return S, g, XX, float(d @ Q @ d)

    def score(self, effect: Effect, place: Place, shape: Mapping[str, float]) -> Score | None:
        """Score of one candidate; None where it does not change the prediction at all."""
        p = self.problem
        if not any(effect.shown(b.measurement, place, shape) for b in p.benches):
            return None
        columns = [p.columns(k, effect, place, shape) for k in range(len(p.benches))]
        if not any(column for per_log in columns for column in per_log):
            return None
        S, g, XX, lost = self.reduced(columns, p.absorbed(effect, place))
        gain, x = bounded_gain(S, g, XX, [c.signed for c in effect.coordinates])
        # What the tolerances that stand back had explained counts against the candidate.
        gain -= lost
        names = [c.name for c in effect.coordinates]
        alone = _alone(S, XX)
        for k, c in enumerate(effect.coordinates):
            if c.required and x[k] == 0.0:
                gain = 0.0
        if not effect.plausible(p.model, place, dict(zip(names, x, strict=True)), shape):
            gain = 0.0
        return Score(effect, place, shape, gain, dict(zip(names, x, strict=True)), alone, S)

    def ripple_orders(self, effect: TorqueRipple, joint: int) -> list[dict[str, float]]:
        """Orders at which the residual of a joint is periodic in its angle, the strongest ones."""
        p = self.problem
        power: Array | None = None
        orders = np.empty(0)
        for log, stack in enumerate(p.stacks()):
            bench = stack.bench
            if orders.size == 0:
                orders = effect.orders(bench.measurement, joint)
                if orders.size == 0:
                    return []
                power = np.zeros(orders.size)
            head = p.head(log)
            old = stack.X[joint][:, head, 0]
            rest = stack.r[joint][head, 0] - self.theta[stack.ids[joint]] @ old
            q = bench.measurement.q[bench.rows[head], joint]
            skip = max(1, rest.size // _SCAN_ROWS)
            rest, q = rest[::skip], q[::skip]
            assert power is not None
            power += np.abs(_fourier(rest, q, orders)) ** 2
        assert power is not None
        out: list[dict[str, float]] = []
        spacing = orders[1] - orders[0] if orders.size > 1 else 1.0
        for k in np.argsort(power)[::-1]:
            if all(abs(orders[k] - o["order"]) > 3 * spacing for o in out):
                out.append({"order": float(orders[k])})
            if len(out) == _PEAKS:
                break
        return out


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


def _alone(S: Array, XX: Array) -> float:
    """Smallest share of a combination of columns that nothing else explains."""
    raw = np.diag(XX)
    live = np.flatnonzero(raw > 1e-20 * raw.max(initial=1e-300))
    if live.size == 0:
        return 0.0
    scale = np.sqrt(raw[live])
    share = np.linalg.eigvalsh(S[np.ix_(live, live)] / np.outer(scale, scale))[0]
    return float(np.clip(share, 0.0, 1.0))


def bounded_gain(
    S: Array, g: Array, XX: Array, signed: Sequence[bool]
) -> tuple[float, NDArray[np.float64]]:
    """Largest fall of g^T x - ... with unsigned coordinates at least zero.

    Args:
        S: Reduced normal matrix, shape (p, p).
        g: Reduced gradient, shape (p,).
        XX: Normal matrix before reduction; directions of S below 1e-8 of it count as none.
        signed: Which coordinates may be negative.

    Returns:
        The gain and the coordinates, shape (p,).
    """
    n = g.size
    if not (np.isfinite(S).all() and np.isfinite(g).all()):
        return 0.0, np.zeros(n)
    raw = np.diag(XX)
    scale = np.sqrt(np.maximum(raw, 1e-300))
    live = raw > 1e-20 * raw.max(initial=1e-300)
    best, where = 0.0, np.zeros(n)
    for code in range(1, 2**n):
        free = [k for k in range(n) if code >> k & 1]
        if not live[free].all():
            continue
        M = S[np.ix_(free, free)] / np.outer(scale[free], scale[free])
        rhs = g[free] / scale[free]
        values, vectors = np.linalg.eigh(M)
        kept = values > 1e-8
        y = vectors[:, kept] @ ((vectors[:, kept].T @ rhs) / values[kept])
        x = y / scale[free]
        if any(not signed[k] and value < 0 for k, value in zip(free, x, strict=True)):
            continue
        gain = float(rhs @ y)
        if gain > best * (1 + 1e-12):
            best, where = gain, np.zeros(n)
            where[free] = x
    return best, where


def score_all(
    screen: Screen,
    effects: Sequence[Effect],
    skip: Sequence[tuple[str, Place]] = (),
    near: Place = (),
) -> list[Score]:
    """Best score of every effect at every place, the highest gain first.

    Args:
        screen: The problem.
        effects: To score.
        skip: Names and places to leave out.
        near: Only places that share a joint or link with this one; all by default.
    """
    p = screen.problem
    model = p.current()
    m = p.benches[0].measurement
    out = []
    for effect in effects:
        for place in effect.places(model, m):
            if (effect.name, place) in skip or (near and not set(near) & set(place)):
                continue
            if isinstance(effect, TorqueRipple):
                shapes = screen.ripple_orders(effect, model.index(place[0]))
            else:
                shapes = effect.shapes(model, m, place)
            if effect.reaches != (1.0,):
                shapes = [{**shape, REACH: r} for shape in shapes for r in effect.reaches]
            scores = [s for shape in shapes if (s := screen.score(effect, place, shape))]
            if scores:
                out.append(max(scores, key=lambda s: s.gain))
    return sorted(out, key=lambda s: -s.gain)


def refine(screen: Screen, score: Score, rounds: int = 4) -> Score:
    """Improve a candidate's shape by a shrinking search."""
    factor = 0.5
    for _ in range(rounds):
        for shape in score.effect.refined(score.shape, factor):
            other = screen.score(score.effect, score.place, shape)
            if other and other.gain > score.gain:
                score = other
        factor *= 0.5
    return score
