"""Winding and housing against closed forms, the single node and a general integrator."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuators.elements.heating import COPPER, Heating
from actuators.elements.two_body import REFERENCE_K, TwoBody
from actuators.errors import UnphysicalElementError

RE40 = TwoBody(1.93, 4.65, 42.8, 809.0)


def test_in_balance_the_warm_winding_s_own_loss_leaves_through_both_resistances():
    """Fixed point of R(T), by iteration."""
    copper, other, ambient = 7.0, 2.0, 310.0
    rise = 0.0
    for _ in range(200):
        warm = copper * (1 + COPPER * (ambient + rise - REFERENCE_K))
        rise = warm * (1.93 + 4.65) + other * 4.65
    winding, housing = RE40.balance(np.array(copper), other, ambient=ambient)
    assert winding - ambient == pytest.approx(rise, rel=1e-9)
    assert housing - ambient == pytest.approx(4.65 * (warm + other), rel=1e-9)


def test_it_runs_away_from_the_loss_on_that_the_balance_names():
    most = 1 / (COPPER * (1.93 + 4.65))
    losses = np.array([0.999, 1.001]) * most
    assert np.isinf(RE40.balance(losses)[0]).tolist() == [False, True]
    day = RE40.day(np.array([100.0, 20.0]), np.stack([losses, losses], axis=1))
    assert day.runs_away.tolist() == [False, True]
    assert np.isinf(day.resistance[1]).all()


def test_a_day_of_one_mode_is_its_balance():
    for copper in (0.0, 5.0, 20.0):
        day = RE40.day(np.array([3600.0]), np.array([copper]), 1.0)
        winding, housing = RE40.balance(np.array(copper), 1.0)
        assert day.peak == pytest.approx(winding)
        assert day.winding[0] == pytest.approx(winding)
        assert day.housing[0] == pytest.approx(housing)


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
            solved = solve_ivp(
                slope,
                (0, d),
                state,
                args=(p, h),
                rtol=1e-9,
                atol=1e-9,
                t_eval=np.linspace(0, d, 1001),
                method="LSODA",
            )
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


def test_what_the_losses_give_leaves_to_the_surroundings():
    """Energy over a round: copper at its warm resistance and the rest pass the housing's wall."""
    seconds, copper, other = np.array([7.0, 300.0]), np.array([40.0, 0.5]), np.array([1.0, 0.0])
    day = RE40.day(seconds, copper, other, ambient=295.0)
    given = (seconds * (copper * day.resistance + other)).sum()
    left = (seconds * (day.housing - 295.0)).sum() / RE40.housing_to_ambient
    assert given == pytest.approx(left, rel=1e-9)


def test_the_highest_temperature_may_lie_within_a_mode():
    """A housing that friction has heated goes on warming the slower winding."""
    body = TwoBody(2.0, 5.0, 300.0, 600.0)
    seconds, other = (60.0, 1740.0), (200.0, 0.0)
    day = body.day(np.array(seconds), np.zeros(2), np.array(other))
    parts = integrated(body, seconds, (0.0, 0.0), other, REFERENCE_K, rounds=12)
    highest = max(y[0].max() for y in parts)
    assert highest > max(y[0][[0, -1]].max() for y in parts) + 5.0
    assert day.peak == pytest.approx(highest, abs=5e-3)


def test_with_no_resistance_to_the_air_it_is_the_single_node():
    node = Heating(thermal_resistance=2.0, time_constant=40.0)
    body = TwoBody(2.0, 1e-9, 40.0, 1e-3)
    time = np.tile([50.0, 30.0], 40).cumsum()
    rises = node.temperature_rise(np.concatenate([[0.0], time]), np.tile([30.0, 0.0], 41)[:81])
    day = body.day(np.array([50.0, 30.0]), np.array([30.0, 0.0]))
    assert day.peak - REFERENCE_K == pytest.approx(rises[-2], rel=1e-6)


def test_many_motors_at_once_are_each_by_itself():
    rng = np.random.default_rng(2)
    numbers = rng.uniform(1.0, 5.0, (2, 6)), rng.uniform(20.0, 900.0, (2, 6))
    many = TwoBody(numbers[0][0], numbers[0][1], numbers[1][0], numbers[1][1])
    copper, seconds = rng.uniform(0.0, 15.0, (6, 3)), np.array([10.0, 200.0, 3000.0])
    day = many.day(seconds, copper)
    for k in range(6):
        one = TwoBody(*(float(n[j][k]) for n in numbers for j in (0, 1)))
        alone = one.day(seconds, copper[k])
        assert day.peak[k] == pytest.approx(alone.peak)
        assert day.winding[k] == pytest.approx(alone.winding)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_impossible_thermal_numbers_are_refused(value):
    with pytest.raises(UnphysicalElementError):
        TwoBody(value, 1.0, 1.0, 1.0)
