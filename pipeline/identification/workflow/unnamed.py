"""What has no name, as a table in the model file, so that the file predicts as well as anything.

What the model *as written* leaves at a joint is laid over its angle, its direction, its speed and
the way it came (plays that hysteresis is a sum of), one kind after another, as long as chunks of
the log that stay out are predicted better. Nothing of it hangs on time. How it is told: by the
share that each kind takes of what is left there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pandas import DataFrame

from actuators.arrays import Array
from pipeline.columns import frame
from pipeline.effects.model_file import Edit
from pipeline.identification.floor import floor_of
from pipeline.identification.general import KINDS, columns_of, knots_of
from pipeline.identification.settings import CHUNKS, SHARE, UNEXPLAINED
from pipeline.logs.log import TRAIN, VALIDATION, Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator

#: Prior standard deviations that are tried, of what is left at the joint.
_SCALES: Final = (0.03, 0.3, 3.0)
#: Rows per period of the low-pass's cut-off.
_PER_PERIOD: Final = 4.0


def unnamed(
    model: MachineModel, logs: Sequence[Log], source: str
) -> tuple[tuple[Edit, ...], DataFrame]:
    """Tables of the joints at which left-out chunks gain by one, and the shares that kinds take.

    Torque logs of fixed bases have any.

    Args:
        model: As written.
        logs: Those of which rows estimate.
        source: The logs and their hashes, in words.
    """
    edits, rows = [], []
    if logs[0].channels == ("torque",) and not model.floating:
        floor = floor_of(logs)[:, 0]
        left = [
            m.effort[..., 0] - m.smooth(Simulator(m).predict(model).effort[..., 0]) for m in logs
        ]
        for j, joint in enumerate(model.joints):
            kinds, table = _joint(logs, [rest[:, j] for rest in left], j, UNEXPLAINED * floor[j])
            rows += [(joint, kind, share) for kind, share in kinds.items()]
            if table:
                made = {"effect": "unnamed_torque", "place": (joint,), "level": "approximate"}
                edits.append(Edit.model_validate({**made, "source": source, "table": table}))
    return tuple(edits), frame("rest", rows)


def _joint(
    logs: Sequence[Log], left: Sequence[Array], j: int, noise: float
) -> tuple[dict[str, float], dict[str, list[float]]]:
    """Kinds of one joint with their shares, and the lists of its table.

    `left`: of every log; up to `noise` it is called noise, of which there is no table.
    """
    kept = []
    for m in logs:
        rows = np.flatnonzero(m.mask[:, j] & np.isin(m.part, (TRAIN, VALIDATION)))
        step = max(1, int(m.rate / (_PER_PERIOD * m.bandwidth))) if np.isfinite(m.bandwidth) else 1
        kept.append(rows[::step])
    y = np.concatenate([rest[rows] for rest, rows in zip(left, kept, strict=True)])
    if y.size < 2 * CHUNKS or np.sqrt(np.mean(y**2)) <= noise:
        return {}, {}
    chunk = (np.arange(y.size) * CHUNKS // y.size).astype(np.intp)
    size, least, scale = float(np.sqrt(np.mean(y**2))), float(y @ y), 0.0
    made = {}
    for kind in (k for k in KINDS if knots_of(logs, j, k)):
        every = zip(logs, columns_of(logs, j, kind), kept, strict=True)
        made[kind] = np.concatenate([m.smooth(x)[rows] for m, x, rows in every])
    chosen: dict[str, float] = {}
    while others := [k for k in made if k not in chosen]:
        tried = []
        for kind in others:
            X = np.hstack([made[k] for k in (*chosen, kind)])
            tried += [(_left_out(X, y, chunk, s * size), others.index(kind), s) for s in _SCALES]
        best, at, own = min(tried)
        if least - best < SHARE * float(y @ y):
            break
        chosen[others[at]], least, scale = (least - best) / float(y @ y), best, own
    if not chosen:
        return {}, {}
    X = np.hstack([made[k] for k in chosen])
    values = _ridge(X.T @ X, X.T @ y, size, scale * size)
    return chosen, _lists(logs, j, chosen, values)


def _lists(
    logs: Sequence[Log], j: int, kinds: Sequence[str] | dict[str, float], values: Array
) -> dict[str, list[float]]:
    """Lists of a table; kinds that share knots are brought to the finest."""
    angles = [knots_of(logs, j, k) for k in kinds if KINDS[k][1] == "angle"]
    finest = max(angles, key=len, default=())
    out: dict[str, list[float]] = {"angle": [*finest]} if finest else {}
    at = 0
    for kind in kinds:
        name, by, _ = KINDS[kind]
        knots = knots_of(logs, j, kind)
        own, at = values[at : at + len(knots)], at + len(knots)
        if by == "angle":
            own = np.interp(finest, knots, own) + np.array(out.get(name, 0.0))
        else:
            out[by] = [*knots]
        out[name] = own.tolist()
    return {name: [float(f"{x:.6g}") for x in values] for name, values in out.items()}


def _ridge(G: Array, h: Array, noise: float, scale: float) -> Array:
    return np.asarray(np.linalg.solve(G + (noise / scale) ** 2 * np.eye(h.size), h))


def _left_out(X: Array, y: Array, chunk: NDArray[np.intp], scale: float) -> float:
    """Sum of squares of every chunk by estimates from the others."""
    G, h, total = X.T @ X, X.T @ y, 0.0
    noise = float(np.sqrt(np.mean(y**2)))
    for c in np.unique(chunk):
        own = chunk == c
        x = _ridge(G - X[own].T @ X[own], h - X[own].T @ y[own], noise, scale)
        total += float(np.sum((y[own] - X[own] @ x) ** 2))
    return total
