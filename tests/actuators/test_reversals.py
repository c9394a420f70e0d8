"""Where a series is split, against closed forms; no block changes its sign."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from tests.actuators.motions import series, split


def polynomial(time, coefficients):
    p = np.polynomial.Polynomial(coefficients)
    t = np.asarray(time, dtype=float)
    return p.integ()(t), p(t), p.deriv()(t), 2.0 * t


ROOT = 0.3 ** (1 / 3)
HALF, STEPS = [0.0, 0.5, 1.0], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


@pytest.mark.parametrize(
    ("time", "velocity", "times", "directions"),
    [
        ([0, 1], [-0.3, 0, 0, 1], [0, ROOT, ROOT, 1], [-1, -1, 1, 1]),  # the Hermite of a cubic
        (HALF, [-0.5, 1], [0, 0.5, 0.5, 1], [-1, -1, 1, 1]),  # on a sample
        ([0, 0.5 + 1e-14, 1], [-0.5, 1], [0, 0.5, 0.5, 1], [-1, -1, 1, 1]),  # but for rounding
        (HALF, [0.25, -1, 1], HALF, [1, 1, 1]),  # touches
        (HALF, [0, 1, -1], HALF, [1, 1, 1]),  # at both edges
        ([0, 0.5, 0.5, 1], [-0.5, 1], [0, 0.5, 0.5, 1], [-1, -1, 1, 1]),  # a break is there
    ],
)
def test_zeros_of_a_polynomial_become_breaks(time, velocity, times, directions):
    s = split(series(time, *polynomial(time, velocity)))
    np.testing.assert_allclose(s.time, times, rtol=1e-13)
    assert s.direction[:, 0].tolist() == directions
    assert not s.velocity[np.flatnonzero(np.diff(s.time) == 0.0), 0].any()


@pytest.mark.parametrize(
    ("time", "velocity", "times", "directions"),
    [
        (STEPS, [2, 0, 1, 0, -1, -1], [0, 1, 2, 3, 3, 4, 5], [1, 1, 1, 1, -1, -1, -1]),
        (STEPS, [1, 0, 0, 0, 1, 1], [0, 1, 1, 2, 3, 3, 4, 5], [1, 1, 0, 0, 0, 1, 1, 1]),  # rest
        ([0, 1, 1, 2], [1, 1, -1, -1], [0, 1, 1, 2], [1, 1, -1, -1]),  # a jump across a break
        ([0, 1, 2], [1e-10, -1e-10, 0], [0, 1, 2], [0, 0, 0]),  # at rest
        ([0, 1, 1, 2], [1, 0, 0, 0], [0, 1, 1, 2], [1, 1, 0, 0]),  # rest after motion
    ],
)
def test_samples_at_rest_and_jumps(time, velocity, times, directions):
    v = np.array(velocity, dtype=float)
    s = split(series(time, v, v, 0 * v, v))
    assert s.time.tolist() == times
    assert s.direction[:, 0].tolist() == directions


def test_at_a_break_the_other_joints_are_interpolated():
    """Velocity by its Hermite, exact for a cubic; acceleration and torque by a line."""
    t, cubic = np.array([0.0, 1.0, 2.0, 3.0]), [3.0, -1.0, 0.5, 1.0]
    first, other = polynomial(t, [-1.4, 1.0]), polynomial(t, cubic)
    s = split(series(t, *(np.column_stack(x) for x in zip(first, other, strict=True))))
    q, v, a, torque = polynomial([1.0, 2.0], cubic)
    at, u = s.time == s.time[2], 0.4
    assert at.sum() == 2
    np.testing.assert_allclose(s.velocity[at, 1], polynomial(1.4, cubic)[1], rtol=1e-13)
    np.testing.assert_allclose(s.acceleration[at, 1], (1 - u) * a[0] + u * a[1], rtol=1e-13)
    np.testing.assert_allclose(s.torque[at, 1], (1 - u) * torque[0] + u * torque[1], rtol=1e-13)
    reference = CubicHermiteSpline([1.0, 2.0], q, v)(1.4)
    np.testing.assert_allclose(s.position[at, 1], reference, rtol=1e-13)


@pytest.mark.parametrize(
    ("velocity", "acceleration", "sign"),
    [
        ([0.0, 0.0], [5.0, -5.0], 0.0),  # at rest, whatever acceleration its samples claim
        ([0.0, 1.0], [-9.0, 1.0], 1.0),  # starts from rest; its Hermite dips to the other side
        ([0.01, 0.01], [-5.0, 5.0], 1.0),  # moves; its Hermite dips below zero
    ],
)
def test_where_another_reverses_a_joint_stays_on_its_own_side(velocity, acceleration, sign):
    t = np.array([0.0, 1.0])
    v, a = np.column_stack((t - 0.3, velocity)), np.column_stack(([1.0, 1.0], acceleration))
    s = split(series(t, v, v, a, v + 1.0))
    assert s.time.size == 4
    assert (s.velocity[:, 1] * sign >= 0.0).all()
    assert set(s.direction[:, 1]) <= {0.0, sign}
