"""Where a series is split, energy and limits; drivers and batteries: closed forms and balances."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from actuators.energy import (
    Battery,
    Driver,
    battery_of,
    driver_of,
    integral,
    split_integral,
    stage_energies,
    supply,
)
from actuators.loading.parts import Part, load_parts
from tests.actuators.motions import CHAINS, series, split


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
    ("time", "v", "times", "directions"),
    [
        (STEPS, [2, 0, 1, 0, -1, -1], [0, 1, 2, 3, 3, 4, 5], [1, 1, 1, 1, -1, -1, -1]),
        (STEPS, [1, 0, 0, 0, 1, 1], [0, 1, 1, 2, 3, 3, 4, 5], [1, 1, 0, 0, 0, 1, 1, 1]),  # rest
        ([0, 1, 1, 2], [1, 1, -1, -1], [0, 1, 1, 2], [1, 1, -1, -1]),  # a jump across a break
        ([0, 1, 2], [1e-10, -1e-10, 0], [0, 1, 2], [0, 0, 0]),  # at rest
        ([0, 1, 1, 2], [1, 0, 0, 0], [0, 1, 1, 2], [1, 1, 0, 0]),  # rest after motion
    ],
)
def test_samples_at_rest_and_jumps(time, v, times, directions):
    s = split(series(time, v, v, 0 * np.array(v), v))
    assert (s.time.tolist(), s.direction[:, 0].tolist()) == (times, directions)


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


def test_stage_energy_of_an_ideal_joint_in_closed_form():
    # q = -cos t, torque constant: power T sin t, E(+) = E(-) = 2 T
    t = np.linspace(0.0, 2.0 * np.pi, 4001)
    s = split(series(t, -np.cos(t), np.sin(t), np.cos(t), np.full_like(t, 5.0)))
    out, m, el = stage_energies(CHAINS["ideal"].inverse(s)).values()
    for forward, reverse in (out, m):
        assert (forward[0], reverse[0]) == pytest.approx((10.0, 10.0), rel=1e-6)
    motor = CHAINS["ideal"].motor
    copper = motor.resistance * (5.0 / 400.0 / motor.torque_constant) ** 2 * 2.0 * np.pi
    assert el[0][0] - el[1][0] == pytest.approx(copper, rel=1e-9)


@settings(max_examples=30)
@given(st.lists(st.floats(-10, 10), min_size=2, max_size=30))
def test_piecewise_linear_power_is_integrated_exactly(values):
    t, p = np.arange(len(values), dtype=float), np.array(values)[:, None]
    forward, reverse = split_integral(t, p)
    # Each line by itself: a trapezoid above zero, or the triangle up to where it crosses.
    reference = 0.0
    for a, b in itertools.pairwise(values):
        if a * b >= 0.0:
            reference += 0.5 * (max(a, 0.0) + max(b, 0.0))
        else:
            reference += 0.5 * max(a, b) * (max(a, b) / abs(a - b))
    assert forward[0] == pytest.approx(reference, abs=1e-9)
    assert forward[0] - reverse[0] == pytest.approx(integral(t, p)[0], abs=1e-9)
    assert min(forward[0], reverse[0]) >= 0.0


def test_a_reversal_inside_an_interval_has_to_be_split():
    # Speed is a line through zero under constant load, so that friction power |v| has its kink
    # and R I^2 its jump inside an interval while everything else is linear there.
    def energy(samples, change):
        t = np.linspace(0.0, 3.0, samples)
        line = series(t, 0.5 * (t - 1.0) ** 2, t - 1.0, np.ones_like(t), np.full_like(t, 20.0))
        return stage_energies(CHAINS["reversible"].inverse(change(line)))["el"][0]

    fine, cut, raw = energy(30002, split), energy(12, split), energy(12, lambda s: s)
    assert np.abs(raw - fine) > 3 * np.abs(cut - fine)
    assert np.abs(cut / fine - 1.0) < 5e-3


def test_policies_share_one_electrical_energy():
    """Two joints with opposite power: what one returns the other needs."""
    t = np.linspace(0.0, 2.0 * np.pi, 2001)
    v = np.column_stack((np.sin(t), -np.sin(t)))
    result = CHAINS["ideal"].inverse(split(series(t, v, v, v, np.full_like(v, 20.0))))
    net = np.subtract(*stage_energies(result)["el"]).sum()
    for regeneration in ("none", 0.25, 1.0, "bus"):
        account = supply(result, regeneration)
        assert account.supplied_energy.sum() - account.dissipated_energy.sum() == pytest.approx(net)
        assert (account.dissipated_energy >= 0.0).all()
    none, bus = supply(result), supply(result, "bus")
    assert none.dissipated_energy.sum() > 1.0
    quarter = supply(result, 0.25).dissipated_energy
    assert quarter == pytest.approx(0.75 * none.dissipated_energy)
    assert bus.dissipated_energy.sum() == pytest.approx(0.0, abs=1e-9)
    assert bus.supplied_energy.sum() < none.supplied_energy.sum()


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


def test_a_driver_meets_its_efficiency_and_loses_the_same_whatever_the_motor_s_ampere():
    """The same copper loss c R I^2 is the same current; conduction goes with it."""
    driver, given = driver_of("escon", values(PARTS["maxon_escon_mod_50_5"], 0.0)), 0.98 * 50 * 5.0
    assert given / (given + driver.loss(np.array(5.0), 50.0)) == pytest.approx(0.98)
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
