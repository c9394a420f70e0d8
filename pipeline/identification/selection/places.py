"""Where names with a place or order of their own are looked for: payloads and ripples."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from actuators.arrays import Array
from pipeline.effects.bodies import AXES, AddedBody, last_links, point_mass
from pipeline.effects.motor import TorqueRipple
from pipeline.identification.regression.design_matrix import effect_columns, residual
from pipeline.identification.regression.normal_equations import solve_spd
from pipeline.identification.regression.problem import Problem

#: Orders of a ripple that compete at a joint.
_PEAKS = 4
_RIDGE = 1e-9
_TEN = len(AddedBody.coordinates)
#: Places about a link's joint from which that of a payload is looked for [m].
_AROUND = np.vstack([np.zeros(3), *(0.2 * np.eye(3)), *(-0.2 * np.eye(3))])


def absolute(
    problem: Problem, log: int, columns: Sequence[Mapping[int, Array]], held: Array
) -> dict[int, Array]:
    """Residual of the model without tolerances and accepted effects, by joint, (R, C)."""
    rest = residual(problem.data_sets[log], problem.predictions[log], problem.sigma)
    for k in np.flatnonzero(held).tolist():
        for j, x in columns[k].items():
            rest[j] = rest[j] + held[k] * x
    return rest


def payload_places(
    problem: Problem,
    beside: Sequence[int],
    columns: Sequence[Sequence[Mapping[int, Array]]],
    held: Array,
) -> Iterator[tuple[str, dict[str, float]]]:
    """Where a point mass would be on each last link, with any of some columns and with none.

    Args:
        problem: With data sets and present model.
        beside: Numbers of the columns that may stand in addition to it, tolerances first.
        columns: Of every log.
        held: Values of the first columns in the present model.
    """
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
            rest = absolute(problem, k, own, full)
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


def rests_by_joint(
    problem: Problem, columns: Sequence[Sequence[Mapping[int, Array]]], held: Array
) -> list[list[Array]]:
    """What each joint's own columns leave of its first channel, rows that may be learnt from."""
    full = np.zeros(len(columns[0]))
    full[: held.size] = held
    rests = [absolute(problem, k, own, full) for k, own in enumerate(columns)]
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


def ripple_orders(
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
