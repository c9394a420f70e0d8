"""Normal equations by block: everything that fitting, judging and resampling needs.

With the whitened residual r and columns X of the unknowns, each block b keeps H_b = X^T X,
h_b = X^T r and s_b = r^T r. The loss of any estimate on any set of blocks, the scatter of its
gradient over blocks (which tells significance in spite of autocorrelation) and every bootstrap
sample follow from these without going back to the rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.identification.regression.design_matrix import Bench

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BlockSums:
    """Normal equations of B blocks and n unknowns.

    Attributes:
        H: Shape (B, n, n).
        h: Shape (B, n).
        s: Shape (B,).
        count: Independent samples, shape (B,).
        part: Part of the data of each block, shape (B,).
        precision: Prior precision of the unknowns, shape (n,).
        mean: Where the prior is centred: minus what the model holds already, shape (n,).
    """

    H: Array
    h: Array
    s: Array
    count: Array
    part: NDArray[np.int8]
    precision: Array
    mean: Array

    def blocks(self, *parts: int) -> NDArray[np.intp]:
        """Numbers of the blocks of some parts of the data."""
        return np.flatnonzero(np.isin(self.part, parts))

    def solve(self, blocks: NDArray[np.intp], free: NDArray[np.intp] | None = None) -> Array:
        """Estimate of the unknowns from some blocks, the others than `free` at zero, (n,)."""
        n = self.h.shape[1]
        index = np.arange(n) if free is None else free
        A = self.H[np.ix_(blocks, index, index)].sum(axis=0) + np.diag(self.precision[index])
        out = np.zeros(n)
        pull = self.precision[index] * self.mean[index]
        out[index] = solve_spd(A, self.h[np.ix_(blocks, index)].sum(axis=0) + pull)
        return out

    def loss(self, theta: Array, blocks: NDArray[np.intp]) -> Array:
        """Squared residual by block at an estimate, shape (len(blocks),)."""
        H, h = self.H[blocks], self.h[blocks]
        value: Array = self.s[blocks] - 2 * h @ theta + np.einsum("i,bij,j->b", theta, H, theta)
        return np.maximum(value, 0.0)

    def covariance(
        self, theta: Array, blocks: NDArray[np.intp], free: NDArray[np.intp] | None = None
    ) -> Array:
        """Covariance of the estimate, the larger of model's and blocks' scatter, (f, f).

        The scatter of the gradient over blocks needs no independent samples within a block.
        """
        n = self.h.shape[1]
        index = np.arange(n) if free is None else free
        A = self.H[np.ix_(blocks, index, index)].sum(axis=0) + np.diag(self.precision[index])
        gradient = self.h[np.ix_(blocks, index)] - np.einsum(
            "bij,j->bi", self.H[np.ix_(blocks, index, np.arange(n))], theta
        )
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
class Stack:
    """Columns of n unknowns and the residual, joint by joint, for one log.

    Attributes:
        bench: The log.
        ids: By joint, numbers of the unknowns that touch it, shape (n_j,).
        X: By joint, their columns, shape (n_j, R, C).
        r: By joint, the residual, shape (R, C).
    """

    bench: Bench
    ids: Mapping[int, NDArray[np.intp]]
    X: Mapping[int, Array]
    r: Mapping[int, Array]


def make_stack(
    bench: Bench, columns: Sequence[Mapping[int, Array]], r: Mapping[int, Array]
) -> Stack:
    """Gather columns by joint."""
    ids: dict[int, NDArray[np.intp]] = {}
    X: dict[int, Array] = {}
    for j in r:
        touching = [k for k, column in enumerate(columns) if j in column]
        ids[j] = np.array(touching, dtype=np.intp)
        shape = (len(touching), *r[j].shape)
        X[j] = np.stack([columns[k][j] for k in touching]) if touching else np.empty(shape)
    return Stack(bench, ids, X, r)


def block_sums(stacks: Sequence[Stack], weights: Array, precision: Array, mean: Array) -> BlockSums:
    """Sum up the columns of several logs by block.

    Args:
        stacks: One per log, the same unknowns in each.
        weights: Of squared residuals, shape (J, C).
        precision: Prior precision, shape (n,).
        mean: Where the prior is centred, shape (n,).
    """
    n = precision.size
    total = sum(stack.bench.block_part.size for stack in stacks)
    H, h = np.zeros((total, n, n)), np.zeros((total, n))
    s, count = np.zeros(total), np.zeros(total)
    part = np.concatenate([stack.bench.block_part for stack in stacks])
    at = 0
    for stack in stacks:
        bench = stack.bench
        mask = bench.measurement.mask[bench.rows]
        channels = len(bench.measurement.channels)
        for b in range(bench.block_part.size):
            rows = slice(int(bench.edges[b]), int(bench.edges[b + 1]))
            for j, r in stack.r.items():
                ids, root = stack.ids[j], np.sqrt(weights[j])
                flat_r = (r[rows] * root).ravel()
                flat_X = (stack.X[j][:, rows] * root).reshape(ids.size, -1)
                H[at, ids[:, None], ids[None, :]] += flat_X @ flat_X.T
                h[at, ids] += flat_X @ flat_r
                s[at] += float(flat_r @ flat_r)
            count[at] = mask[rows].sum() * channels * bench.weight**2
            at += 1
    return BlockSums(H, h, s, count, part, precision, mean)
