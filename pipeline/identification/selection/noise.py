"""Least squares with every column at once, and the noise that it leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from actuators.arrays import Array, Index
from pipeline.identification.regression.design_matrix import DataSet
from pipeline.logs.prepared.measurement import TRAIN, VALIDATION

#: Triples of neighbouring rows below which they do not give the noise.
_FOLLOWING = 50


def saturated(H: Array, h: Array) -> tuple[Array, int]:
    """Least squares with every column, and how many directions they span."""
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    values, vectors = np.linalg.eigh(H / np.outer(scale, scale))
    kept = values > 1e-7 * max(float(values.max(initial=0.0)), 1e-300)
    x = vectors[:, kept] @ ((vectors[:, kept].T @ (h / scale)) / values[kept]) / scale
    return np.asarray(x), int(kept.sum())


def fast_noise(
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
