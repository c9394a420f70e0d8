import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from tests.actuators.motions import harmonic, series, split


def polynomial(time, coefficients):
    p = np.polynomial.Polynomial(coefficients)
    t = np.asarray(time, dtype=float)
    return p.integ()(t), p(t), p.deriv()(t), 2.0 * t


def blocks(s):
    starts = [0, *(np.flatnonzero(np.diff(s.time) == 0.0) + 1)]
    return [slice(a, b) for a, b in zip(starts, [*starts[1:], len(s.time)], strict=True)]


def test_zero_between_samples_is_found_on_the_hermite():
    # v = t^3 - 0.3: the Hermite of a cubic is exact
    s = split(series([0, 1], *polynomial([0, 1], [-0.3, 0, 0, 1])))
    root = 0.3 ** (1 / 3)
    np.testing.assert_allclose(s.time, [0, root, root, 1], rtol=1e-14)
    assert s.velocity[1:3, 0].tolist() == [0.0, 0.0]
    assert s.direction[:, 0].tolist() == [-1, -1, 1, 1]
    np.testing.assert_allclose(s.torque[1:3, 0], 2 * root)


def test_zero_on_a_sample_is_doubled():
    t = [0.0, 0.5, 1.0]
    s = split(series(t, *polynomial(t, [-0.5, 1])))
    assert s.time.tolist() == [0.0, 0.5, 0.5, 1.0]
    assert s.direction[:, 0].tolist() == [-1, -1, 1, 1]


def test_zero_a_rounding_error_off_a_sample_snaps_to_it():
    t = [0.0, 0.5 + 1e-14, 1.0]
    s = split(series(t, *polynomial(t, [-0.5, 1])))
    assert s.time.size == 4
    assert s.velocity[1, 0] == s.velocity[2, 0] == 0.0


@pytest.mark.parametrize("off", [-1e-11, 1e-11], ids=["just before", "just after"])
def test_zero_closer_to_a_sample_than_time_resolves_is_on_it(off):
    """Fast enough that the sample's own speed is no rest: 10 nrad/s at 1000 rad/s^2."""
    t = np.array([0.0, 0.5, 1.0, 1.5])
    s = split(series(t, *polynomial(t, [-1000.0 * (0.5 - off), 1000.0])))
    assert s.time.tolist() == [0.0, 0.5, 0.5, 1.0, 1.5]
    assert s.velocity[1:3, 0].tolist() == [0.0, 0.0]
    assert s.velocity[[0, 3, 4], 0] == pytest.approx([-500.0, 500.0, 1000.0])
    assert s.direction[:, 0].tolist() == [-1, -1, 1, 1, 1]


def test_a_zero_after_a_touch_is_found():
    t = np.arange(6.0)
    v = np.array([2.0, 0.0, 1.0, 0.0, -1.0, -1.0])
    s = split(series(t, v, v, 0 * v, v))
    assert s.time.tolist() == [0, 1, 2, 3, 3, 4, 5]
    assert s.direction[:, 0].tolist() == [1, 1, 1, 1, -1, -1, -1]


def test_at_a_break_the_other_joints_are_interpolated():
    """Velocity by its Hermite, exact for a cubic; acceleration and torque by a line."""
    t = np.array([0.0, 1.0, 2.0, 3.0])
    first, other = polynomial(t, [-1.4, 1.0]), polynomial(t, [3.0, -1.0, 0.5, 1.0])
    s = split(series(t, *(np.column_stack(x) for x in zip(first, other, strict=True))))
    q, v, a, torque = polynomial([1.0, 2.0], [3.0, -1.0, 0.5, 1.0])
    at, u = s.time == s.time[2], 0.4
    assert at.sum() == 2
    np.testing.assert_allclose(s.time[at], 1.4, rtol=1e-14)
    np.testing.assert_allclose(s.velocity[at, 1], 3.0 - 1.4 + 0.5 * 1.4**2 + 1.4**3, rtol=1e-13)
    np.testing.assert_allclose(s.acceleration[at, 1], (1 - u) * a[0] + u * a[1], rtol=1e-13)
    np.testing.assert_allclose(s.torque[at, 1], (1 - u) * torque[0] + u * torque[1], rtol=1e-13)
    reference = CubicHermiteSpline([1.0, 2.0], q, v)(1.4)
    np.testing.assert_allclose(s.position[at, 1], reference, rtol=1e-13)


@pytest.mark.parametrize("acceleration", [0.0, 5.0])
def test_a_joint_at_rest_stays_so_where_another_reverses(acceleration):
    """Whatever acceleration its samples claim: between two samples at rest there is no motion."""
    t = np.array([0.0, 1.0])
    v = np.column_stack((t - 0.3, 0 * t))
    a = np.column_stack((0 * t + 1.0, np.array([acceleration, -acceleration])))
    s = split(series(t, v, v, a, v + 1.0))
    assert s.time.size == 4
    assert not s.velocity[:, 1].any()
    assert not s.direction[:, 1].any()


def test_a_joint_that_starts_from_rest_moves_to_its_own_side_only():
    """Its Hermite dips to the other side where another joint reverses."""
    t = np.array([0.0, 1.0])
    v = np.column_stack((t - 0.3, np.array([0.0, 1.0])))
    a = np.column_stack((0 * t + 1.0, np.array([-9.0, 1.0])))
    s = split(series(t, v, v, a, v))
    assert (s.velocity[:, 1] >= 0.0).all()


def test_touching_zero_and_edges_need_no_break():
    t = [0.0, 0.5, 1.0]
    s = split(series(t, *polynomial(t, [0.25, -1, 1])))  # (t - 0.5)^2
    assert s.time.tolist() == t
    assert (s.direction == 1.0).all()
    t = [0.0, 0.5, 1.0]
    s = split(series(t, *polynomial(t, [0, 1, -1])))  # t (1 - t): zeros at both ends
    assert s.time.tolist() == t


def test_break_already_there_stays_single():
    t = [0.0, 0.5, 0.5, 1.0]
    s = split(series(t, *polynomial(t, [-0.5, 1])))
    assert s.time.tolist() == t
    assert s.direction[:, 0].tolist() == [-1, -1, 1, 1]


def test_jump_of_sign_across_a_break_is_no_zero():
    s = series([0.0, 1.0, 1.0, 2.0], [0] * 4, [1, 1, -1, -1], [0] * 4, [0] * 4)
    assert split(s).time.tolist() == s.time.tolist()


def test_joints_that_reverse_at_one_instant_share_a_break():
    a = polynomial([0, 1], [-0.3, 1])
    s = split(series([0, 1], *(np.column_stack([x, -2 * x, x + 0 * x]) for x in a)))
    assert s.time.size == 4
    assert not s.velocity[1:3].any()


def test_joints_that_reverse_in_one_interval_at_different_instants():
    a, b = polynomial([0, 1], [-0.3, 1]), polynomial([0, 1], [0.7, -1])
    s = split(series([0, 1], *(np.column_stack(x) for x in zip(a, b, strict=True))))
    np.testing.assert_allclose(s.time, [0, 0.3, 0.3, 0.7, 0.7, 1])
    np.testing.assert_allclose(s.velocity[1], [0.0, 0.4])
    assert s.direction[:, 0].tolist() == [-1, -1, 1, 1, 1, 1]
    assert s.direction[:, 1].tolist() == [1, 1, 1, 1, -1, -1]


def test_stay_at_rest_inside_a_block_is_cut_out():
    t = np.arange(6.0)
    v = np.array([1, 0, 0, 0, 1, 1.0])
    s = split(series(t, v, v, 0 * v, v))
    assert s.time.tolist() == [0, 1, 1, 2, 3, 3, 4, 5]
    assert s.direction[:, 0].tolist() == [1, 1, 0, 0, 0, 1, 1, 1]


def test_hermite_overshoot_of_another_joint_keeps_its_sign():
    # joint 1 is positive at both samples, its Hermite dips below zero where joint 0 reverses
    s = series(
        [0, 1], np.zeros((2, 2)), [[-1, 0.01], [1, 0.01]], [[2, -5], [2, 5]], np.ones((2, 2))
    )
    s = split(s)
    assert (s.velocity[:, 1] >= 0.0).all()
    assert (s.direction[:, 1] == 1.0).all()


@given(st.integers(0, 10**6), st.integers(2, 200))
def test_no_block_changes_its_sign(seed, samples):
    s = split(harmonic(samples, joints=4, seed=seed))
    assert (np.diff(s.time) >= 0).all()
    for block in blocks(s):
        v = s.velocity[block]
        assert not ((v > 1e-9).any(axis=0) & (v < -1e-9).any(axis=0)).any()
        assert (s.direction[block] == s.direction[block][0]).all()
    again = split(s)
    np.testing.assert_array_equal(again.time, s.time)


def test_large_time_stamps():
    s = harmonic(50, joints=2, seed=3)
    late = series(s.time + 1.7e9, s.position, s.velocity, s.acceleration, s.torque)
    assert split(late).time.size == pytest.approx(split(s).time.size, abs=2)
