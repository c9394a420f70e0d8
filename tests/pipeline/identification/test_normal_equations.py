"""Normal equations by block against least squares on the rows themselves."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.identification.regression.intervals import _draws
from pipeline.identification.regression.normal_equations import BlockSums
from pipeline.logs.prepared.measurement import TEST, TRAIN

Array = NDArray[np.float64]
BLOCKS, ROWS, UNKNOWNS = 80, 50, 3
THETA = np.array([1.0, -2.0, 0.5])
EVERY = np.arange(BLOCKS)


def rows(sigma: float) -> tuple[Array, Array]:
    """Columns (B, R, n) and residuals (B, R) with white noise."""
    rng = np.random.default_rng(4)
    X = rng.normal(size=(BLOCKS, ROWS, UNKNOWNS)) * [1.0, 2.0, 0.5]
    return X, X @ THETA + sigma * rng.normal(size=(BLOCKS, ROWS))


def sums_of(X: Array, r: Array, precision: float = 0.0, mean: float = 0.0) -> BlockSums:
    return BlockSums(
        np.einsum("brn,brm->bnm", X, X),
        np.einsum("brn,br->bn", X, r),
        np.sum(r**2, axis=1),
        np.full(BLOCKS, float(ROWS)),
        np.full(BLOCKS, TRAIN, dtype=np.int8),
        np.full(UNKNOWNS, precision),
        np.full(UNKNOWNS, mean),
    )


def test_estimate_and_losses_are_those_of_the_rows() -> None:
    X, r = rows(1.0)
    sums = sums_of(X, r)
    x = sums.solve(EVERY)
    flat = X.reshape(-1, UNKNOWNS)
    assert x == pytest.approx(np.linalg.lstsq(flat, r.ravel(), rcond=None)[0])
    assert sums.loss(x, EVERY) == pytest.approx(np.sum((r - X @ x) ** 2, axis=1))
    assert sums.blocks(TEST).size == 0


@pytest.mark.parametrize("sigma", [1.0, 3.0])
def test_intervals_are_as_wide_as_white_noise_makes_them(sigma: float) -> None:
    X, r = rows(sigma)
    sums = sums_of(X, r)
    wanted = sigma * np.sqrt(np.diag(np.linalg.inv(sums.H.sum(axis=0))))
    assert _draws(sums).std(axis=0) == pytest.approx(wanted, rel=0.25)
    covariance = sums.covariance(sums.solve(EVERY), EVERY)
    assert np.sqrt(np.diag(covariance)) == pytest.approx(wanted, rel=0.2)


def test_intervals_are_no_narrower_than_what_is_left_allows() -> None:
    # What is left is alike in all blocks: their scatter is nothing.
    X, _ = rows(0.0)
    left = np.random.default_rng(5).normal(size=(BLOCKS, ROWS))
    for x, e in zip(X, left, strict=True):
        e -= x @ np.linalg.lstsq(x, e, rcond=None)[0]
    left *= 2.0 / left.std()
    sums = sums_of(X, X @ THETA + left)
    wanted = 2.0 * np.sqrt(np.diag(np.linalg.inv(sums.H.sum(axis=0))))
    assert _draws(sums).std(axis=0) == pytest.approx(wanted, rel=0.1)
