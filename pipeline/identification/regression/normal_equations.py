"""Normal equations by block: everything that fitting, judging and resampling needs.

With the whitened residual r and columns X of the unknowns, each block b keeps H_b = X^T X,
h_b = X^T r and s_b = r^T r. The loss of any estimate on any set of blocks, the scatter of its
gradient over blocks (which gives significance in spite of autocorrelation) and every bootstrap
sample follow from these without going back to the rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from pipeline.identification.regression.design_matrix import DataSet


@dataclass(frozen=True, eq=False)
class BlockSums:
    """Normal equations of B blocks and n unknowns."""

    H: Array  #: Shape (B, n, n).
    h: Array  #: Shape (B, n).
    s: Array  #: Shape (B,).
    count: Array  #: Independent samples, shape (B,).
    part: NDArray[np.int8]  #: Part of the data of each block, shape (B,).
    precision: Array  #: Prior precision of the unknowns, shape (n,).
    mean: Array  #: Where the prior is centred: minus what the model holds already, shape (n,).

    def blocks(self, *parts: int) -> NDArray[np.intp]:
        """Numbers of the blocks of some parts of the data."""
        return np.flatnonzero(np.isin(self.part, parts))

    def solve(self, blocks: NDArray[np.intp]) -> Array:
        """Estimate of the unknowns from some blocks, (n,)."""
        A = self.H[blocks].sum(axis=0) + np.diag(self.precision)
        return solve_spd(A, self.h[blocks].sum(axis=0) + self.precision * self.mean)

    def loss(self, theta: Array, blocks: NDArray[np.intp]) -> Array:
        """Squared residual by block at an estimate, shape (len(blocks),)."""
        H, h = self.H[blocks], self.h[blocks]
        value: Array = self.s[blocks] - 2 * h @ theta + np.einsum("i,bij,j->b", theta, H, theta)
        return np.maximum(value, 0.0)

    def covariance(self, theta: Array, blocks: NDArray[np.intp]) -> Array:
        """Covariance of the estimate, the larger of model's and blocks' scatter, (n, n).

        The scatter of the gradient over blocks needs no independent samples within a block.
        """
        A = self.H[blocks].sum(axis=0) + np.diag(self.precision)
        gradient = self.h[blocks] - np.einsum("bij,j->bi", self.H[blocks], theta)
        inverse = inverse_spd(A)
        b = blocks.size
        scatter = gradient.T @ gradient * (b / max(b - 1, 1))
        robust = inverse @ scatter @ inverse
        # A direction cannot be known better than white noise of sigma would allow.
        grow = np.sqrt(np.maximum(1.0, np.diag(robust) / np.maximum(np.diag(inverse), 1e-300)))
        return inverse * np.outer(grow, grow)


def solve_spd(A: Array, b: Array) -> Array:
    """Solution with a positive semidefinite matrix, scaled and slightly regularised.

    An unknown that nothing depends on comes out as zero.
    """
    diagonal = np.diag(A)
    live = diagonal > 1e-30 * max(float(diagonal.max(initial=0.0)), 1e-300)
    d = np.sqrt(np.where(live, diagonal, 1.0))
    scaled = A / np.outer(d, d)
    scaled[~live, :] = 0.0
    scaled[:, ~live] = 0.0
    scaled[np.diag_indices_from(scaled)] = np.where(live, np.diag(scaled) + 1e-10, 1.0)
    rhs = np.where(live if b.ndim == 1 else live[:, None], b, 0.0)
    rhs = rhs / (d if b.ndim == 1 else d[:, None])
    result = np.linalg.solve(scaled, rhs)
    return np.asarray(result / (d if b.ndim == 1 else d[:, None]))


def inverse_spd(A: Array) -> Array:
    """Inverse of a positive semidefinite matrix; see `solve_spd`."""
    inverse = solve_spd(A, np.eye(A.shape[0]))
    return 0.5 * (inverse + inverse.T)


@dataclass(frozen=True, eq=False)
class DesignMatrix:
    """Columns of n unknowns and the residual, joint by joint, for one log."""

    data_set: DataSet  #: The log.
    #: By joint, numbers of the unknowns that touch it, shape (n_j,).
    ids: Mapping[int, NDArray[np.intp]]
    X: Mapping[int, Array]  #: By joint, their columns, shape (n_j, R, C).
    r: Mapping[int, Array]  #: By joint, the residual, shape (R, C).


def make_design_matrix(
    data_set: DataSet, columns: Sequence[Mapping[int, Array]], r: Mapping[int, Array]
) -> DesignMatrix:
    """Gather columns by joint."""
    ids: dict[int, NDArray[np.intp]] = {}
    X: dict[int, Array] = {}
    for j in r:
        touching = [k for k, column in enumerate(columns) if j in column]
        ids[j] = np.array(touching, dtype=np.intp)
        shape = (len(touching), *r[j].shape)
        X[j] = np.stack([columns[k][j] for k in touching]) if touching else np.empty(shape)
    return DesignMatrix(data_set, ids, X, r)


def block_sums(
    matrices: Sequence[DesignMatrix], weights: Array, precision: Array, mean: Array
) -> BlockSums:
    """Sum up the columns of several logs by block.

    Args:
        matrices: One per log, the same unknowns in each.
        weights: Of squared residuals, shape (J, C).
        precision: Prior precision, shape (n,).
        mean: Where the prior is centred, shape (n,).
    """
    n = precision.size
    total = sum(matrix.data_set.block_part.size for matrix in matrices)
    H, h = np.zeros((total, n, n)), np.zeros((total, n))
    s, count = np.zeros(total), np.zeros(total)
    part = np.concatenate([matrix.data_set.block_part for matrix in matrices])
    at = 0
    for matrix in matrices:
        data_set = matrix.data_set
        mask = data_set.measurement.mask[data_set.rows]
        channels = len(data_set.measurement.channels)
        for b in range(data_set.block_part.size):
            rows = slice(int(data_set.edges[b]), int(data_set.edges[b + 1]))
            for j, r in matrix.r.items():
                ids, root = matrix.ids[j], np.sqrt(weights[j])
                flat_r = (r[rows] * root).ravel()
                flat_X = (matrix.X[j][:, rows] * root).reshape(ids.size, -1)
                H[at, ids[:, None], ids[None, :]] += flat_X @ flat_X.T
                h[at, ids] += flat_X @ flat_r
                s[at] += float(flat_r @ flat_r)
            count[at] = mask[rows].sum() * channels * data_set.weight**2
            at += 1
    return BlockSums(H, h, s, count, part, precision, mean)
