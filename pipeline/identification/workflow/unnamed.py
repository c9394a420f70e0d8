"""What has no name, as a table in the model file, so that the file predicts as well as anything.

What the model *as written* leaves at a joint is laid over its angle, its direction, its speed and
the way it came (plays that hysteresis is a sum of), one kind after another, as long as chunks of
the log that stay out are predicted better. Nothing of it hangs on time. How it is told: by the
share that each kind takes of what is left there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from pandas import DataFrame

from actuators.arrays import Array, Index
from pipeline.columns import frame
from pipeline.effects.model_file import Edit
from pipeline.identification.design import DataSet, Equation, make_design
from pipeline.identification.general import KINDS, General, general_terms
from pipeline.identification.settings import CHUNKS, SHARE, UNEXPLAINED
from pipeline.machine.machine import MachineModel

#: Prior standard deviations that are tried, of what is left at the joint.
_SCALES: Final = (0.03, 0.3, 3.0)


def unnamed(
    model: MachineModel, data_sets: Sequence[DataSet], floor: Array, source: str
) -> tuple[tuple[Edit, ...], DataFrame]:
    """Tables of the joints at which left-out chunks gain by one, and the shares that kinds take.

    Torque logs of fixed bases have any.

    Args:
        model: As written.
        data_sets: Rows of the logs.
        floor: Standard deviation of the noise, shape (J, C).
        source: The logs and their hashes, in words.
    """
    edits, rows = [], []
    if data_sets[0].measurement.channels == ("torque",) and not model.robot.floating:
        for j, joint in enumerate(model.joints):
            design = make_design(model, data_sets, general_terms(model, data_sets, j))
            made: dict[General, Index] = {}
            for t, columns in zip(design.terms, design.columns, strict=True):
                assert isinstance(t.effect, General)
                made[t.effect] = columns
            for e in (e for e in design.equations if e.joint == j):
                shares, values = _chosen(e, made, UNEXPLAINED * float(floor[j, 0]))
                rows += [(joint, one.kind, share) for one, share in shares.items()]
                if shares:
                    table = _lists({one: values[made[one]] for one in shares})
                    own = {"effect": "unnamed_torque", "place": (joint,), "level": "approximate"}
                    edits.append(Edit.model_validate({**own, "source": source, "table": table}))
    return tuple(edits), frame("rest", rows)


def _chosen(
    e: Equation, made: Mapping[General, Index], noise: float
) -> tuple[dict[General, float], Array]:
    """Kinds with the share that each takes of what is left at a joint, and values of all columns.

    `noise`: what is left up to it is called noise, of which there is no table.
    """
    chosen: dict[General, float] = {}
    _, _, total, count = e.total
    size, least, scale = float(np.sqrt(total / max(count, 1.0))), total, 0.0
    every = np.concatenate([*made.values(), np.empty(0, int)])
    if count < 2 * CHUNKS or size <= noise:
        return {}, np.zeros(every.size)
    while others := [one for one in made if one not in chosen]:
        tried = []
        for one in others:
            ids = np.concatenate([made[k] for k in (*chosen, one)])
            tried += [(_left_out(e, ids, 1.0 / s), others.index(one), s) for s in _SCALES]
        best, first, wide = min(tried)
        if least - best < SHARE * total:
            break
        chosen[others[first]], least, scale = (least - best) / total, best, wide
    values = np.zeros(every.size)
    if chosen:
        ids = np.concatenate([made[one] for one in chosen])
        at, G, h = np.searchsorted(e.ids, ids), e.total[0], e.total[1]
        values[ids] = _ridge(G[np.ix_(at, at)], h[at], 1.0 / scale)
    return chosen, values


def _lists(tables: Mapping[General, Array]) -> dict[str, list[float]]:
    """Lists of a table; kinds that share knots are brought to the finest."""
    finest = max((t.knots for t in tables if KINDS[t.kind][1] == "angle"), key=len, default=())
    out: dict[str, Array] = {"angle": np.array(finest)} if finest else {}
    for one, values in tables.items():
        name, by, _ = KINDS[one.kind]
        if by == "angle":
            out[name] = np.interp(finest, one.knots, values) + out.get(name, 0.0)
        else:
            out |= {by: np.array(one.knots), name: values}
    return {name: [float(f"{x:.6g}") for x in values] for name, values in out.items()}


def _ridge(G: Array, h: Array, narrow: float) -> Array:
    """Estimates where the prior is so many times narrower than the noise is wide."""
    return np.asarray(np.linalg.solve(G + narrow**2 * np.eye(h.size), h))


def _left_out(e: Equation, ids: Index, narrow: float) -> float:
    """Sum of squares of every chunk by estimates of some columns from the others."""
    own = np.searchsorted(e.ids, ids)
    G, h, s = e.sums[0][:, own][:, :, own], e.sums[1][:, own], e.sums[2]
    left = 0.0
    for c in range(CHUNKS):
        x = _ridge(G.sum(axis=0) - G[c], h.sum(axis=0) - h[c], narrow)
        left += float(s[c] - 2.0 * h[c] @ x + x @ G[c] @ x)
    return left
