"""Noise floor of several logs together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from actuators.arrays import Array
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.tolerances import STRAINS
from pipeline.identification.results import UNCERTAINTIES
from pipeline.logs.prepared.measurement import TEST, TRAIN, VALIDATION, Measurement


def floor_of(measurements: Sequence[Measurement], *parts: int) -> Array:
    """Standard deviation of the noise, shape (J, C), of the logs with rows in some parts.

    Args:
        measurements: One per log.
        parts: Training and validation rows by default: test logs have no say, in this neither.
    """
    own = [m for m in measurements if np.isin(m.part, parts or (TRAIN, VALIDATION)).any()]
    return np.asarray(np.sqrt(np.mean([m.noise**2 for m in own or measurements], axis=0)))


def with_noise(
    measurements: Sequence[Measurement], noise: Mapping[str, Mapping[str, float]]
) -> tuple[Measurement, ...]:
    """Measurements whose noise is at least that of a model file, channel to joint to value."""
    out = []
    for m in measurements:
        level = m.noise.copy()
        for c, channel in enumerate(m.channels):
            for j, joint in enumerate(m.joints):
                level[j, c] = max(level[j, c], noise.get(channel, {}).get(joint, 0.0))
        out.append(replace(m, noise=level))
    return tuple(out)


def left_open(problem: Problem) -> Array:
    """Effort that may be otherwise by what no log has shown, one standard deviation, (J, C).

    Of what was estimated and is written (effects, refitted bodies) by the scatter of the estimates
    over blocks, of every other tolerance of a part by its stated size. On a joint's test rows,
    where it has any: another motion may ask for what the first did not show.
    """
    sums = problem.sums
    blocks = sums.blocks(TRAIN, VALIDATION)
    spread = sums.covariance(sums.solve(blocks), blocks)
    count, precision = len(problem.tolerances), problem.precision
    refitted = problem.uncertainty > UNCERTAINTIES[0]
    known = np.array(
        [n.kind in STRAINS and refitted for n in problem.tolerances]
        + [True] * (problem.names - count)
    )
    spread[~known, :] = spread[:, ~known] = 0.0
    prior = 1.0 / np.maximum(precision[:count], 1e-12)
    spread[np.arange(count), np.arange(count)] += np.where(known[:count], 0.0, prior)
    logs = [b.measurement for b in problem.data_sets]
    tested = np.any([m.mask[m.part == TEST].any(axis=0) for m in logs], axis=0)
    variance, rows = np.zeros(problem.sigma.shape), np.zeros(problem.sigma.shape)
    for matrix in problem.matrices:
        data_set = matrix.data_set
        head = problem.head(problem.data_sets.index(data_set))
        for j, X in matrix.X.items():
            part = data_set.parts[TEST] if tested[j] else head
            own = spread[np.ix_(matrix.ids[j], matrix.ids[j])]
            for c in range(X.shape[2]):
                x = X[:, part, c]
                variance[j, c] += float(np.sum(x * (own @ x))) / data_set.weight**2
            rows[j] += data_set.measurement.mask[data_set.rows[part], j].sum()
    return np.asarray(np.sqrt(np.maximum(variance, 0.0) / np.maximum(rows, 1.0)) * problem.sigma)
