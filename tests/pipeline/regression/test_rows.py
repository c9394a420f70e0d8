"""Rows: what sensors get wrong taken out, ends trimmed, the sense of friction over a travel."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.presliding import presliding
from pipeline.regression.preprocess import EDGE, Rows, Run, inner, low_pass, rows

RATE, CUTOFF = 200.0, 8.0


def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles (N, 2) [rad] and torques (N, 2) [N*m], far below the cut-off."""
    q = np.column_stack([np.sin(2 * np.pi * 0.4 * t + 0.1), 0.5 * np.cos(2 * np.pi * 0.7 * t)])
    tau = np.column_stack([3.0 * np.cos(2 * np.pi * 0.9 * t), np.sin(2 * np.pi * 0.5 * t) + 2.0])
    return q, tau


def of(delay: float = 0.0, begin: float = 0.0) -> Run:
    t = begin + np.arange(0, 10, 1 / RATE)
    return Run(t, motion(t)[0], motion(t - delay)[1])


@pytest.fixture(scope="module")
def straight() -> Rows:
    return rows([of(), of(begin=20.0)], cutoff=CUTOFF)


NONE, ONCE = np.zeros(2), np.ones(2)


def test_nothing_wrong_leaves_the_rows(straight: Rows) -> None:
    same = straight.corrected(NONE, ONCE, NONE)
    np.testing.assert_array_equal(same.q, straight.q)
    np.testing.assert_allclose(same.tau, straight.tau, atol=1e-14)


@pytest.mark.parametrize("late", [(0.02, 0.0), (-0.013, 0.031)])
def test_a_torque_that_came_late_comes_back(straight: Rows, late: tuple[float, float]) -> None:
    parts = [of(), of(begin=20.0)]
    for run, begin in zip(parts, (0.0, 20.0), strict=True):
        for j, d in enumerate(late):
            run.tau[:, j] = of(d, begin).tau[:, j]
    seen = rows(parts, cutoff=CUTOFF)
    back = seen.corrected(NONE, ONCE, np.array(late))
    assert np.abs(seen.tau - straight.tau).max() > 0.1
    np.testing.assert_allclose(back.tau, straight.tau, atol=5e-3)
    np.testing.assert_array_equal(back.q, straight.q)


def test_a_zero_comes_off_every_angle_and_no_speed(straight: Rows) -> None:
    out = straight.corrected(np.array([0.2, -0.1]), ONCE, NONE)
    np.testing.assert_allclose(straight.q - out.q, np.tile([0.2, -0.1], (len(out.q), 1)))
    np.testing.assert_allclose(straight.fine[0] - out.fine[0] - [0.2, -0.1], 0.0, atol=1e-12)
    np.testing.assert_array_equal(out.fine[1], straight.fine[1])
    np.testing.assert_array_equal(out.v, straight.v)


def test_a_scale_divides_the_torque_of_its_joint(straight: Rows) -> None:
    out = straight.corrected(NONE, np.array([0.75, 1.0]), NONE)
    np.testing.assert_allclose(out.tau[:, 0] * 0.75, straight.tau[:, 0], atol=1e-12)
    np.testing.assert_allclose(out.tau[:, 1], straight.tau[:, 1], atol=1e-12)


def test_corrections_are_all_of_the_rows_as_logged(straight: Rows) -> None:
    """A second correction is not one of the first."""
    first = straight.corrected(NONE, 2.0 * ONCE, np.array([0.05, 0.0]))
    again = straight.corrected(NONE, ONCE, NONE)
    assert not np.allclose(first.tau, straight.tau)
    np.testing.assert_allclose(again.tau, straight.tau, atol=1e-14)


def test_a_period_of_the_cut_off_at_either_end_of_a_run_is_no_row(straight: Rows) -> None:
    edge = EDGE / CUTOFF
    for k, begin in enumerate((0.0, 20.0)):
        own = straight.time[straight.start[k] :] if k else straight.time[: straight.start[1]]
        assert own[0] == pytest.approx(begin + edge, abs=1 / RATE)
        assert begin + 10.0 - own[-1] >= edge - 1 / RATE
        assert own[-1] > begin + 10.0 - edge - (straight.every + 1) / RATE


def test_what_a_filter_invents_at_the_ends_is_not_among_the_rows() -> None:
    """A run that begins and ends amid its motion: its acceleration is right wherever it counts."""
    t = np.arange(0.37, 8.9, 1 / RATE)
    w = 2 * np.pi * 0.8
    q = np.column_stack([np.sin(w * t)] * 2)
    r = rows([Run(t, q, 0 * q)], cutoff=4.0)
    error = np.abs(r.a[:, 0] + w**2 * np.sin(w * r.time)) / w**2
    assert error.max() < 0.04
    whole = np.abs(r.fine[2][:, 0] + w**2 * np.sin(w * t)) / w**2
    assert whole.max() > 2 * error.max()


@pytest.mark.parametrize("n", [4, 7, 40])
def test_of_a_short_run_half_is_kept_at_least(n: int) -> None:
    assert len(inner(np.arange(n), 1000, 1)) >= n // 2


def test_thin_and_filtered_rows_are_those_of_the_run_itself(straight: Rows) -> None:
    fine = straight.fine_tau
    np.testing.assert_allclose(straight.thin(fine), straight.tau, atol=1e-14)
    m = straight.fine_start[1]
    expected = inner(low_pass(fine[:m], RATE, CUTOFF), straight.edge, straight.every)
    np.testing.assert_allclose(straight.filtered(fine)[: straight.start[1]], expected, atol=1e-12)


def test_friction_over_a_travel_begins_anew_in_every_run(straight: Rows) -> None:
    slid = straight.slid(0, 0.3)
    m = straight.fine_start[1]
    for part, q in ((slid[:m], straight.fine[0][:m, 0]), (slid[m:], straight.fine[0][m:, 0])):
        way = np.sign(q[1] - q[0])
        own = presliding(np.arange(len(q)) / RATE, q, np.full(len(q), way), 0.3)
        np.testing.assert_allclose(part, own, atol=1e-12)


def test_begun_the_other_way_it_forgets_so_after_some_travels(straight: Rows) -> None:
    one, other = (straight.slid(0, 0.05, begun=b) for b in (1.0, -1.0))
    gone = np.abs(np.cumsum(np.abs(np.diff(straight.fine[0][:, 0], prepend=0.0)))) > 1.0
    first = slice(0, straight.fine_start[1])
    assert abs(one[0] - other[0]) == 2.0
    np.testing.assert_allclose(one[first][gone[first]], other[first][gone[first]], atol=1e-6)


def test_a_shaft_of_its_own_may_be_given_by_its_angles(straight: Rows) -> None:
    angle = straight.fine[0][:, 1]
    np.testing.assert_array_equal(straight.slid(angle, 0.01), straight.slid(1, 0.01))
