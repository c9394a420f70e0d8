"""The motor's conversion and its warming, against closed forms and a general integrator."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuators.elements.heating import ZERO_CELSIUS, Heating, Warming, warmed
from actuators.errors import LegwattError
from actuators.shaft import DCMotor


@pytest.mark.parametrize(
    "build",
    [
        lambda: DCMotor("m", 0.0, 0.3),
        lambda: DCMotor("m", np.array([0.03, 0.0]), 0.3),
        lambda: DCMotor("m", 0.03, -0.3),
        lambda: DCMotor("m", 0.03, 0.3, max_speed=0.0),
        lambda: DCMotor("m", 0.03, 0.3, continuous_current=2.0, peak_current=1.0),
        lambda: Heating(time_constant=0.0),
        lambda: Heating(thermal_resistance=-1.0),
    ],
)
def test_unphysical_motors_are_refused(build):
    with pytest.raises(LegwattError):
        build()


def test_heating_solves_its_equation_for_a_current_that_changes():
    """Against a general integrator, the current held over each interval."""
    rng = np.random.default_rng(6)
    time = np.cumsum(rng.uniform(0.05, 1.5, 30))
    loss = rng.uniform(0.0, 40.0, 30)
    node = Heating(thermal_resistance=3.0, time_constant=7.0, rise=5.0, initial=12.0)
    level, expected = 12.0, [12.0]
    for k in range(29):
        pull = lambda t, x, p=loss[k]: (5.0 + 3.0 * p * (1.0 + 0.00393 * x) - x) / 7.0  # noqa: E731
        solved = solve_ivp(pull, time[k : k + 2], [level], rtol=1e-10, atol=1e-10)
        level = float(solved.y[0, -1])
        expected.append(level)
    np.testing.assert_allclose(node.temperature_rise(time, loss), expected, rtol=1e-7)


def test_copper_magnets_and_sensor_follow_their_coefficients():
    warm = np.array([0.0, 100.0])
    motor = warmed(DCMotor("m", torque_constant=0.03, resistance=0.5), warm)
    np.testing.assert_allclose(motor.resistance, [0.5, 0.5 * 1.393])
    np.testing.assert_allclose(motor.torque_constant, [0.03, 0.03 * 0.89])
    sensed = Heating(sensor_gain=4.0).sensed(np.array([25.0, 30.0, 20.0]))
    np.testing.assert_allclose(sensed, [0.0, 20.0, -20.0])


def test_warming_is_the_first_order_of_an_exponential_law():
    """Friction (c s + d v) exp(-b (T - T_ref)) to first order in b (T - T_ref)."""
    b, c, d, reference = 1e-4, 2.0, 0.5, 300.0
    kelvin = np.linspace(290.0, 310.0, 21)
    v = np.linspace(-2.0, 2.0, 21)
    sense = np.sign(v)
    friction = c * sense + d * v
    exact = friction * np.exp(-b * (kelvin - reference)) - friction
    told = Warming(b * c, b * d, reference).torque(kelvin - ZERO_CELSIUS, sense, v)
    assert told == pytest.approx(exact, abs=1e-3 * np.abs(exact).max())
