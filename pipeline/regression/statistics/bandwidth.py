"""Up to which frequency a rigid model has anything to say.

Above some frequency a machine is no chain of rigid bodies: it bends, its sensors lag, and
subtracting the model makes the torque's error larger. The band kept is the one in which the richest
model, fitted without any colour of noise, takes away most of the torque's power.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.regression.laws.bodies import Bodies
from pipeline.regression.laws.design import Design
from pipeline.regression.laws.friction import TRAVELS, general_terms
from pipeline.regression.preprocess import Rows, Run, rows, spectra

Array = NDArray[np.float64]


def prepare(
    runs: Sequence[Run],
    model: pin.Model,
    cutoff: float | None = None,
    most: float = float("inf"),
) -> Rows:
    """Rows of a regression, the cut-off found from noise and from what a rigid model explains.

    Args:
        runs: Training recordings.
        model: By the URDF.
        cutoff: [Hz], where it is known.
        most: Largest cut-off: beyond what will be compared nothing need be fitted [Hz].
    """
    if cutoff is not None:
        return rows(runs, cutoff)
    wide = rows(runs)
    if wide.cutoff > most:
        wide = rows(runs, most)
    narrow = explained_band(wide, model)
    return wide if narrow >= wide.cutoff else rows(runs, narrow)


def explained_band(wide: Rows, model: pin.Model) -> float:
    """Frequency up to which the richest model takes power away, at most the cut-off [Hz]."""
    residual = rich_residual(wide, model)
    ends = [*wide.start[1:], len(wide.time)]
    parts = list(zip(wide.start, ends, strict=True))
    parts = [p for p in parts if p[1] - p[0] >= 16]
    f, before = spectra([wide.tau[a:b] for a, b in parts], wide.rate)
    _, after = spectra([residual[a:b] for a, b in parts], wide.rate)
    scale = residual.var(axis=0) + 1e-300
    gain = ((before - after) / scale).sum(axis=1)
    total = np.cumsum(gain[f <= wide.cutoff])
    edge = float(f[: total.size][int(np.argmax(total))])
    # A band too narrow for the motion itself is no band.
    return min(wide.cutoff, max(edge + f[1], 4 * f[1]))


def rich_residual(wide: Rows, model: pin.Model) -> Array:
    """Torque less bodies near the URDF and friction of any shape, joints weighted by residual."""
    design, bodies = Design.of(model, wide), Bodies.of(model)
    columns = design.columns(design.load(bodies.nominal), ())
    joints = wide.tau.shape[1]
    # A reversal takes a travel: as a jump it would put power into a band where there is none.
    sliding = [f"sliding{way}@{k}" for k in range(len(TRAVELS)) for way in ("", "_load")]
    names = [*general_terms(), *sliding, "rotor"]
    nb = bodies.nominal.size
    level = wide.tau.std(axis=0) + 1e-12
    residual = wide.tau
    for _ in range(3):
        size = nb + joints * len(names)
        gram, moment = np.zeros((size, size)), np.zeros(size)
        matrices = []
        for j in range(joints):
            x = np.column_stack([design.bodies[:, j], *(columns.local[j][t] for t in names)])
            at = np.r_[np.arange(nb), nb + j * len(names) + np.arange(len(names))]
            gram[np.ix_(at, at)] += x.T @ x / level[j] ** 2
            moment[at] += x.T @ wide.tau[:, j] / level[j] ** 2
            matrices.append((x, at))
        gram[:nb, :nb] += bodies.metric
        moment[:nb] += bodies.metric @ bodies.centre
        scale = 1 / np.sqrt(np.diag(gram) + 1e-12)
        scaled = gram * np.outer(scale, scale) + 1e-9 * np.eye(size)
        sizes = scale * np.linalg.solve(scaled, scale * moment)
        residual = wide.tau - np.column_stack([x @ sizes[at] for x, at in matrices])
        level = residual.std(axis=0) + 1e-12
    return residual
