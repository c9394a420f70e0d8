"""Noise: order, level, whiteness; rows near reversal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from pipeline.regression.laws.design import Design, Ways, folds_of, turns_of
from pipeline.regression.laws.friction import TRAVELS, sense
from pipeline.regression.preprocess import Rows, Run, low_pass, rows
from pipeline.regression.statistics.noise import Colour, colour, weights
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
    t = np.arange(0.0013, 20, 0.005)  # no sample on a reversal, where the sign is anyone's
    q = np.sin(2 * np.pi * 0.4 * t)[:, None]
    v = 0.8 * np.pi * np.cos(2 * np.pi * 0.4 * t)[:, None]
    r = rows([Run(t, q, np.sign(v))], cutoff=8.0)
    design = Design.of(arm(1), r)
    column = design.columns(np.zeros_like(r.fine[1]), ()).local[0]["coulomb"]
    inner = slice(20, -20)
    np.testing.assert_allclose(column[inner], r.tau[inner, 0], atol=0.08)
    np.testing.assert_allclose(r.tau, r.thin(low_pass(np.sign(v), 200.0, 8.0)))


def test_noise_below_a_frequency_is_the_integral_of_its_spectrum() -> None:
    """A first-order process: 1 / (1 - 2 a cos w + a^2), by its integral in closed form."""
    a, level, rate = 0.8, 0.5, 100.0
    c = Colour(np.array([a]), level * np.sqrt(1 - a**2), level, 9.0)
    for frequency in (2.0, 5.0, 20.0, 40.0):
        w = 2 * np.pi * frequency / rate
        share = 2 / np.pi * np.arctan((1 + a) / (1 - a) * np.tan(w / 2))
        assert c.below(frequency, rate) == pytest.approx(level * np.sqrt(share), rel=0.02)
    assert c.below(50.0, rate) == pytest.approx(level)


def test_noise_below_a_frequency_is_what_a_sharp_filter_leaves_of_it() -> None:
    x = coloured(200000)
    c = colour(x, [(0, len(x))])
    spectrum = np.fft.rfft(x)
    spectrum[np.fft.rfftfreq(len(x), 1 / 100.0) > 5.0] = 0.0
    left = np.fft.irfft(spectrum, len(x)).std()
    assert c.below(5.0, 100.0) == pytest.approx(left, rel=0.1)
    # Taken for white it would be far less.
    assert left > 1.5 * c.level * np.sqrt(5.0 / 50.0)


def test_white_noise_below_a_frequency_is_its_share_of_the_band() -> None:
    c = Colour(np.zeros(0), 2.0, 2.0, 1.0)
    assert c.below(12.5, 100.0) == pytest.approx(2.0 * np.sqrt(0.25), rel=0.01)


@pytest.fixture(scope="module")
def turning() -> Rows:
    """A joint that turns back every 1.25 s, one recording."""
    t = np.arange(0.0013, 20, 0.005)
    w = 2 * np.pi * 0.4
    return rows([Run(t, np.sin(w * t)[:, None], np.cos(w * t)[:, None])], cutoff=8.0)


def test_the_sense_of_friction_is_in_doubt_near_a_reversal_and_not_far_from_it(turning) -> None:
    design = Design.of(arm(1), turning)
    columns = design.columns(np.zeros_like(turning.fine[1]), ())
    doubt = columns.doubt[:, 0]
    speed = np.abs(turning.v[:, 0]) / np.abs(turning.v[:, 0]).max()
    assert doubt[speed < 0.05].min() > 10 * doubt[speed > 0.9].max() > 0
    later = turning.time > 1.0  # before, the filter still sees how the run began
    assert doubt[later & (speed > 0.9)].max() < 1e-3
    assert (doubt >= 0).all()


def test_doubt_is_the_variance_between_neighbouring_travels() -> None:
    a, b, c = (np.array([x, 1.0]) for x in (0.9, 0.5, -0.1))
    near = dict(zip(TRAVELS[:3], (a, b, c), strict=True))
    far = dict.fromkeys(TRAVELS[3:], np.array([-1.0, 1.0]))
    ways = Ways({**near, **far}, dict.fromkeys(TRAVELS, np.zeros(2)))
    shape = Design.of(arm(1), _short()).shapes[0]
    jump = ways.doubt(np.ones(2), shape)
    np.testing.assert_allclose(jump, [1.1**2, 0.0])
    slid = ways.doubt(b, replace(shape, travel=TRAVELS[1]))
    np.testing.assert_allclose(slid, [0.6**2, 0.0])
    first = ways.doubt(a, replace(shape, travel=TRAVELS[0]))
    np.testing.assert_allclose(first, [0.4**2, 0.0])


def test_doubt_knows_that_a_run_may_have_begun_the_other_way() -> None:
    same = dict.fromkeys(TRAVELS, np.ones(2))
    ways = Ways(same, {d: np.array([2.0 * d, 0.0]) for d in TRAVELS})
    shape = replace(Design.of(arm(1), _short()).shapes[0], travel=TRAVELS[3])
    np.testing.assert_allclose(ways.doubt(np.ones(2), shape), [(2.0 * TRAVELS[3]) ** 2, 0.0])


def _short() -> Rows:
    t = np.arange(0, 4, 0.005)
    return rows([Run(t, np.sin(t)[:, None], np.cos(t)[:, None])], cutoff=8.0)


@pytest.mark.parametrize("blocks", [4, 6, 23])
def test_folds_in_turn_hold_every_block_once_and_no_two_neighbours(blocks: int) -> None:
    folds = turns_of(blocks)
    assert sorted(np.concatenate(folds).tolist()) == list(range(blocks))
    assert all((np.diff(f) > 1).all() for f in folds)
    assert len(folds) == min(blocks, 6)
    # Parts of the motion are the other way to leave blocks out.
    assert all((np.diff(f) == 1).all() for f in folds_of(blocks))
