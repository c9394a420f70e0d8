"""Winding and housing against closed forms, the single node and a general integrator."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuators.elements.heating import COPPER
from actuators.elements.two_body import REFERENCE_K, TwoBody

RE40 = TwoBody(1.93, 4.65, 42.8, 809.0)


@pytest.mark.parametrize("copper", [0.0, 5.0, 20.0])
def test_a_day_of_one_mode_is_the_balance_of_the_warm_winding(copper):
    """Its loss leaves through both resistances: a fixed point of R(T), by iteration."""
    other, ambient, rise = 2.0, 310.0, 0.0
    for _ in range(200):
        warm = copper * (1 + COPPER * (ambient + rise - REFERENCE_K))
        rise = warm * (1.93 + 4.65) + other * 4.65
    day = RE40.day(np.array([3600.0]), np.array([copper]), other, ambient=ambient)
    assert (day.peak, day.winding[0]) == pytest.approx((ambient + rise, ambient + rise))
    assert day.housing[0] == pytest.approx(ambient + 4.65 * (warm + other))


def test_it_runs_away_from_the_loss_on_at_which_nothing_balances_it():
    losses = np.array([0.999, 1.001]) / (COPPER * (1.93 + 4.65))
    day = RE40.day(np.array([100.0, 20.0]), np.stack([losses, losses], axis=1))
    assert day.runs_away.tolist() == [False, True]
    assert np.isinf(day.resistance[1]).all()


def integrated(body, seconds, copper, other, ambient, rounds):
    """Last round by a general integrator: time, winding, housing."""
    cw = body.winding_time / body.winding_to_housing
    ch = body.housing_time / body.housing_to_ambient

    def slope(_, x, p, h):
        through = (x[0] - x[1]) / body.winding_to_housing
        warm = p * (1 + COPPER * (x[0] - REFERENCE_K))
        return [
            (warm - through) / cw,
            (h + through - (x[1] - ambient) / body.housing_to_ambient) / ch,
        ]

    state = [ambient, ambient]
    for _ in range(rounds):
        parts = []
        for d, p, h in zip(seconds, copper, other, strict=True):
            exact = {"method": "LSODA", "rtol": 1e-9, "atol": 1e-9}
            told = np.linspace(0, d, 1001)
            solved = solve_ivp(slope, (0, d), state, args=(p, h), t_eval=told, **exact)
            state = solved.y[:, -1]
            parts.append(solved.y)
    return parts


def test_a_round_of_modes_is_that_of_a_general_integrator():
    seconds, copper, other = np.array([60.0, 400.0, 25.0]), (25.0, 1.0, 0.0), (2.0, 0.5, 9.0)
    parts = integrated(RE40, seconds, copper, other, 300.0, rounds=30)
    day = RE40.day(seconds, np.array(copper), np.array(other), ambient=300.0)
    mean = [np.trapezoid(y, dx=1e-3, axis=1) for y in parts]
    assert day.winding == pytest.approx([m[0] for m in mean], abs=2e-3)
    assert day.housing == pytest.approx([m[1] for m in mean], abs=2e-3)
    assert day.peak == pytest.approx(max(y[0].max() for y in parts), abs=2e-3)
    assert np.allclose(day.resistance, 1 + COPPER * (day.winding - REFERENCE_K))


def test_the_highest_temperature_may_lie_within_a_mode():
    """A housing that friction has heated goes on warming the slower winding."""
    body = TwoBody(2.0, 5.0, 300.0, 600.0)
    seconds, other = (60.0, 1740.0), (200.0, 0.0)
    day = body.day(np.array(seconds), np.zeros(2), np.array(other))
    parts = integrated(body, seconds, (0.0, 0.0), other, REFERENCE_K, rounds=12)
    highest = max(y[0].max() for y in parts)
    assert highest > max(y[0][[0, -1]].max() for y in parts) + 5.0
    assert day.peak == pytest.approx(highest, abs=5e-3)
