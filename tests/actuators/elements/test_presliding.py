"""Dry friction that rises over a travel after a reversal: Dahl's law, its limits, its breaks."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuators.elements.element import Friction
from actuators.presliding import presliding
from tests.actuators.motions import series, split


def swing(rate=400.0, seconds=4.0):
    """Angle and speed of a motion that reverses many times, some of them after small travels."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    q = 0.02 * np.sin(3.0 * t) + 0.004 * np.sin(17.0 * t + 0.4)
    v = 0.06 * np.cos(3.0 * t) + 0.068 * np.cos(17.0 * t + 0.4)
    return t, q, v


def test_the_sense_is_that_of_dahls_differential_equation():
    travel = 0.003
    t, q, v = swing(rate=4000.0)
    sense = presliding(t, q, np.sign(v), travel)

    def slope(now, s):
        speed = 0.06 * np.cos(3.0 * now) + 0.068 * np.cos(17.0 * now + 0.4)
        return (np.sign(speed) - s) * abs(speed) / travel

    exact = solve_ivp(slope, (t[0], t[-1]), [np.sign(v[0])], t_eval=t, max_step=1e-3, rtol=1e-8)
    assert np.abs(np.diff(np.sign(v))).sum() / 2 > 8
    assert sense.min() < -0.5 < 0.5 < sense.max()
    np.testing.assert_allclose(sense, exact.y[0], atol=2e-3)


def test_a_gap_in_time_forgets_what_was():
    """Behind it the sense is the direction as told; before it nothing changes."""
    t, q, v = swing()
    late, at = t.copy(), 700
    late[at:] += 3.0
    direction = np.sign(v)
    whole, parted = (presliding(x, q, direction, 0.05) for x in (t, late))
    np.testing.assert_array_equal(parted[:at], whole[:at])
    assert parted[at] == direction[at] != pytest.approx(whole[at], abs=0.1)
    alone = presliding(t[at:], q[at:], direction[at:], 0.05)
    np.testing.assert_allclose(parted[at:], alone, atol=1e-12)


def test_where_a_series_is_split_at_a_reversal_the_sense_goes_on():
    """A doubled sample has the same angle: friction that has not slid yet does not jump there."""
    t, q, v = swing()
    whole = series(t, q, v, np.gradient(v, t), 0 * v)
    side = split(whole)
    assert side.time.size > t.size
    law = Friction("dry", travel=0.01, coulomb=1.0)
    there = np.interp(t, side.time, law.added(side)[:, 0])
    np.testing.assert_allclose(there, law.added(whole)[:, 0], atol=0.01)
