"""Noise: order, level, whiteness; rows near reversal."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.signal

from pipeline.regression.laws.friction import sense
from pipeline.regression.statistics.noise import colour, weights
from tests.pipeline.regression.arms import arm


def coloured(n: int = 20000) -> np.ndarray:
    white = np.random.default_rng(0).standard_normal(n)
    return scipy.signal.lfilter([1.0], [1.0, -0.8], white)


def test_coloured_noise_is_whitened_to_unit_variance() -> None:
    x = coloured()
    c = colour(x, [(0, len(x))])
    z = c.whiten(x)
    assert z.std() == pytest.approx(1.0, abs=0.05)
    assert abs(np.corrcoef(z[1:], z[:-1])[0, 1]) < 0.1


def test_correlation_counts_rows_that_say_the_same() -> None:
    # (1 + a) / (1 - a) for a first-order process.
    x = coloured(200000)
    assert colour(x, [(0, len(x))]).correlation == pytest.approx(9.0, rel=0.25)


def test_white_noise_needs_no_filter() -> None:
    x = np.random.default_rng(2).standard_normal(5000)
    assert colour(x, [(0, 2500), (2500, 5000)]).memory == 0


def test_rows_whose_sign_is_in_doubt_weigh_less_and_none_is_lost() -> None:
    v = np.array([0.0, 0.01, 1.0])
    felt = sense(v, 0.01)
    w = weights(felt.doubt, friction=1.0, level=0.1)
    assert 0 < w[0] < w[1] < w[2] == pytest.approx(1.0)


def test_columns_that_jump_go_through_the_filter_of_the_torque() -> None:
    from pipeline.regression.laws.design import Design
    from pipeline.regression.preprocess import Run, low_pass, rows

    t = np.arange(0, 20, 0.005)
    q = np.sin(2 * np.pi * 0.4 * t)[:, None]
    v = 0.8 * np.pi * np.cos(2 * np.pi * 0.4 * t)[:, None]
    r = rows([Run(t, q, np.sign(v))], cutoff=8.0)
    design = Design.of(arm(1), r)
    column = design.columns(np.zeros_like(r.fine[1]), ()).local[0]["coulomb"]
    inner = slice(20, -20)
    np.testing.assert_allclose(column[inner], r.tau[inner, 0], atol=0.08)
    np.testing.assert_allclose(r.tau[:, 0], low_pass(np.sign(v), 200.0, 8.0)[:: r.every, 0])
