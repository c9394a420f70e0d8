"""Drivers and batteries against closed forms, energy balances, and the parts that are shipped."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from actuators.loading.parts import Part, load_parts
from actuators.supply import Battery, Driver, battery_of, driver_of

PACK = Battery("pack", energy=650 * 3600.0, full=54.0, empty=42.0, resistance=0.08)
PARTS = load_parts()


def values(part: Part, share: float = 0.5) -> dict[str, float]:
    """One value for each entry: the low end of its range at 0, the high end at 1."""
    return {n: x.low + share * (x.high - x.low) for n, x in part.printed.items()}


@given(st.floats(-50, 50))
def test_the_driver_s_loss_is_what_three_phases_conduct_and_what_switching_costs(current):
    """3 I_rms^2 R_on by phase is 2 c R_on I^2 in the root mean square's ampere, c = 1.5."""
    on, rms = 2.5e-3, current
    driver = Driver("d", resistance=2 * 1.5 * on, idle=0.7, switching=0.01, voltage_share=0.9)
    by_phase = sum(on * (math.sqrt(2) * rms * math.sin(a)) ** 2 for a in np.arange(3) * 2.0944)
    loss = driver.loss(np.array(current), 48.0)
    assert loss == pytest.approx(0.7 + by_phase + 0.01 * 48 * abs(current), rel=1e-4)


def closed_form(b: Battery, power: float, last: float) -> float:
    """Hours at constant power: the integral of 1/I = (E + sqrt(E^2 - 4RP)) / 2P over E."""
    a = 4 * b.resistance * power

    def f(e: float) -> float:
        root = math.sqrt(e * e - a)
        return 0.5 * e * e + 0.5 * (e * root - a * math.log(e + root))

    e = b.empty + (b.full - b.empty) * last
    return b.charge * (f(b.full) - f(e)) / (b.full - b.empty) / (2 * power) / 3600


@pytest.mark.parametrize("power", [1.0, 200.0, 4000.0, 7000.0])
@pytest.mark.parametrize("cut_off", [0.0, 44.0])
def test_life_at_constant_power_is_the_closed_form(power, cut_off):
    last = PACK.charge_at_end(power, cut_off)
    found = PACK.hours(np.array([power]), np.array([1.0]), cut_off=cut_off)
    assert found == pytest.approx(closed_form(PACK, power, last) if last < 1 else 0.0, rel=1e-5)
    if 0 < last < 1 and cut_off:
        drop = PACK.resistance * PACK.current(np.array(power), np.array(last))
        assert 42.0 + 12.0 * last - drop == pytest.approx(cut_off)


def test_life_in_modes_with_return_is_that_of_a_general_integrator():
    b = Battery("b", 9e5, full=29.0, empty=20.0, resistance=0.1, returned=0.8)
    power, shares = np.array([900.0, 30.0, -150.0]), np.array([0.2, 0.5, 0.3])
    last = b.charge_at_end(900.0, 15.0)

    def rate(_, s):
        current = b.current(power, np.full(3, s[0]))
        return [-(np.where(current < 0, 0.8 * current, current) @ shares) / b.charge]

    ends = lambda _, s: s[0] - last  # noqa: E731
    ends.terminal = True
    solved = solve_ivp(rate, (0, 1e6), [1.0], events=ends, rtol=1e-10, atol=1e-12)
    assert b.hours(power, shares, cut_off=15.0) == pytest.approx(solved.t[-1] / 3600, rel=1e-6)
    assert b.hours(np.array([900.0, -9e3]), np.array([0.5, 0.5])) == math.inf


def test_a_driver_s_efficiency_is_met_at_full_voltage_and_current():
    driver = driver_of("escon", values(PARTS["maxon_escon_mod_50_5"], 0.0))
    given = 0.98 * 50 * 5.0
    loss = driver.loss(np.array(5.0), 50.0)
    assert given / (given + loss) == pytest.approx(0.98)


def test_one_driver_loses_the_same_whatever_the_motor_s_ampere():
    """The same copper loss c R I^2 is the same current; conduction goes with it."""
    x = values(PARTS["moteus_n1"])
    own, other = (driver_of("n1", x, current_of=c) for c in (1.0, 1.5))
    current = np.array(8.0 / math.sqrt(1.5))
    assert other.loss(current, 40.0) == pytest.approx(own.loss(np.array(8.0), 40.0))
    assert other.voltage_share == pytest.approx(math.sqrt(1.5) * x["voltage_share"])


def test_a_battery_of_any_energy_has_its_part_s_density_swing_and_sag():
    part = PARTS["aspilsan_13s4p"]
    b = battery_of(part.name, values(part), energy=650 * 3600.0, voltage=48.0)
    assert b.mass == pytest.approx(650 * 3600.0 / part.printed["specific_energy"].value)
    assert b.energy == pytest.approx(650 * 3600.0 * 0.9)
    assert 0.5 * (b.full + b.empty) == pytest.approx(48.0)
    assert b.resistance * (650.0 / 48.0) / 48.0 == pytest.approx(0.04)
