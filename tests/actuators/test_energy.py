import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actuators.elements.motor import DCMotor
from actuators.energy.energy import (
    duration,
    integral,
    loss_energies,
    split_integral,
    stage_energies,
    stage_energy,
)
from actuators.energy.limits import limit_rows, rms_over_time, standing_rows, time_over
from actuators.energy.regeneration import supply
from actuators.errors import EnergyError
from actuators.loading.build import load_catalog
from tests.actuators.motions import ALTERNATIVES, CHAINS, harmonic, series, split


def sine(samples, offset=0.0):
    t = np.linspace(0.0, 2.0 * np.pi, samples)
    return t, (np.sin(t) + offset)[:, None]


def test_sine_in_closed_form():
    forward, reverse = split_integral(*sine(20001))
    assert forward[0] == pytest.approx(2.0, rel=1e-7)
    assert reverse[0] == pytest.approx(2.0, rel=1e-7)


def test_stage_energy_of_an_ideal_joint_in_closed_form():
    # q = -cos t, torque constant: power T sin t, E(+) = E(-) = 2 T
    t = np.linspace(0.0, 2.0 * np.pi, 4001)
    s = split(series(t, -np.cos(t), np.sin(t), np.cos(t), np.full_like(t, 5.0)))
    result = CHAINS["ideal"].inverse(s)
    for stage in ("out", "m"):
        energy = stage_energy(result, stage)
        assert energy.forward[0] == pytest.approx(10.0, rel=1e-6)
        assert energy.reverse[0] == pytest.approx(10.0, rel=1e-6)
        assert energy.net[0] == pytest.approx(0.0, abs=1e-9)
    electrical = stage_energy(result, "el").net[0]
    motor = CHAINS["ideal"].motor
    current = 5.0 / 400.0 / motor.torque_constant
    copper = motor.resistance * current**2 * 2.0 * np.pi
    assert electrical == pytest.approx(copper, rel=1e-9)


@given(st.lists(st.floats(-10, 10), min_size=2, max_size=30))
def test_piecewise_linear_power_is_integrated_exactly(values):
    t = np.arange(len(values), dtype=float)
    p = np.array(values)[:, None]
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
    assert forward[0] >= 0.0
    assert reverse[0] >= 0.0


def test_energy_is_never_negative_however_power_rounds():
    rng = np.random.default_rng(0)
    for small in (1e-17, 1e-12, 1e-3):
        power = rng.normal(size=(2, 2000)) * np.array([[1.0], [small]])
        for energy in split_integral(np.array([0.0, 1.0]), power):
            assert (energy >= 0.0).all()


def test_a_break_has_no_width():
    t = np.array([0.0, 1.0, 1.0, 2.0])
    forward, reverse = split_integral(t, np.array([1.0, 1.0, -3.0, -3.0])[:, None])
    assert (forward[0], reverse[0]) == (1.0, 3.0)


@pytest.mark.parametrize("alternative", ALTERNATIVES)
@pytest.mark.parametrize("seed", range(4))
def test_within_a_thousandth_of_twenty_times_finer_sampling(alternative, seed):
    chain = CHAINS[alternative]
    coarse, fine = (
        stage_energies(chain.inverse(split(harmonic(n, seed=seed)))) for n in (1501, 30001)
    )
    for a, b in zip(coarse, fine, strict=True):
        scale = b.forward + b.reverse
        assert (np.abs(a.forward - b.forward) <= 1e-3 * np.maximum(b.forward, 1e-3 * scale)).all()
        assert (np.abs(a.reverse - b.reverse) <= 1e-3 * np.maximum(b.reverse, 1e-3 * scale)).all()


def test_a_reversal_inside_an_interval_has_to_be_split():
    # Speed is a line through zero under constant load, so that friction power |v| has its kink
    # and R I^2 its jump inside an interval while everything else is linear there.
    def line(samples):
        t = np.linspace(0.0, 3.0, samples)
        return series(t, 0.5 * (t - 1.0) ** 2, t - 1.0, np.ones_like(t), np.full_like(t, 20.0))

    catalog = load_catalog()
    for name, value in (("coulomb", 3.3), ("load", 0.134), ("viscous", 1.05)):
        catalog = catalog.replaced(f"harmonic_drive.{name}", value)
    for name, value in (("coulomb", 0.026), ("load", 0.03), ("viscous", 1e-5)):
        catalog = catalog.replaced(f"timing_belt.{name}", value)
    chain = catalog.chain("reversible")
    fine = stage_energy(chain.inverse(split(line(30002))), "el").forward
    raw = stage_energy(chain.inverse(line(12)), "el").forward
    cut = stage_energy(chain.inverse(split(line(12))), "el").forward
    assert np.abs(cut / fine - 1.0) < 5e-3
    assert np.abs(raw / fine - 1.0) > 5 * np.abs(cut / fine - 1.0)


@pytest.mark.parametrize("alternative", ALTERNATIVES)
def test_losses_account_for_the_electrical_energy_of_a_cycle(alternative):
    s = split(harmonic(3001, seed=5))
    result = CHAINS[alternative].inverse(s)
    lost = sum(loss_energies(result).values())
    joint = stage_energy(result, "out").net
    np.testing.assert_allclose(stage_energy(result, "el").net, joint + lost, rtol=1e-4, atol=1e-5)


def test_no_time_is_an_error():
    with pytest.raises(EnergyError, match="spans no time"):
        duration(np.array([1.0, 1.0]))


# --- regeneration ---------------------------------------------------------------------------------
def opposed():
    """Two joints with opposite power: what one returns the other needs."""
    t = np.linspace(0.0, 2.0 * np.pi, 2001)
    v = np.column_stack((np.sin(t), -np.sin(t)))
    s = split(series(t, v, v, v, np.full_like(v, 20.0)))
    return CHAINS["ideal"].inverse(s)


def test_policies_share_one_electrical_energy():
    result = opposed()
    net = stage_energy(result, "el").net.sum()
    for policy, fraction in (("none", 0.0), ("fraction", 0.5), ("fraction", 1.0), ("bus", 0.0)):
        account = supply(result, policy, fraction)
        assert account.supplied_energy.sum() - account.dumped_energy.sum() == pytest.approx(net)
        np.testing.assert_allclose(
            account.supplied - account.dumped, account.electrical, atol=1e-12
        )
        assert (account.dumped >= 0.0).all()
    none, bus = supply(result), supply(result, "bus")
    assert none.dumped_energy.sum() > 1.0
    assert bus.dumped_energy.sum() == pytest.approx(0.0, abs=1e-9)
    assert bus.supplied_energy.sum() < none.supplied_energy.sum()
    assert bus.accounts == ("bus",)
    assert supply(result, "fraction", 0.0).supplied_energy == pytest.approx(none.supplied_energy)


@pytest.mark.parametrize(
    ("policy", "fraction", "message"),
    [
        ("buss", 0.0, "did you mean 'bus'"),
        ("fraction", 1.5, "between 0 and 1"),
        ("fraction", float("nan"), "between 0 and 1"),
        ("none", 0.5, "takes no fraction"),
    ],
)
def test_bad_policies(policy, fraction, message):
    with pytest.raises(EnergyError, match=message):
        supply(opposed(), policy, fraction)


# --- limits ---------------------------------------------------------------------------------------
def test_limits_of_a_fast_and_a_slow_joint():
    t = np.linspace(0.0, 1.0, 101)
    ramp = np.column_stack((4.0 * t, 0.1 * t))  # motor: 0 to 1600 rad/s, limit 858.7
    zero = np.zeros_like(ramp)
    s = split(series(t, zero, ramp, zero, zero, joints=("fast", "slow")))
    chain = CHAINS["ideal"]
    rows = {(r.joint, r.quantity): r for r in limit_rows(chain.inverse(s))}
    assert len(rows) == 8
    speed = rows["fast", "speed"]
    assert speed.breach
    assert speed.peak == pytest.approx(1600.0)
    assert speed.peak_time == 1.0
    assert speed.share_over == pytest.approx(1.0 - chain.motor.max_speed / 1600.0)
    assert rows["fast", "voltage"].breach
    assert not any(r.breach for (joint, _), r in rows.items() if joint == "slow")
    assert rows["slow", "rms_current"].limit == 5.77


def test_limits_at_standstill_in_closed_form():
    """I = T / k and U = R I; the continuous current binds, since standing has no end."""
    chain = CHAINS["ideal"]
    k, ratio = chain.motor.torque_constant, chain.ratio
    motor = replace(chain.motor, resistance=170.0)
    holding = replace(chain, motor=motor).holding(np.array([30.71, -0.01]))
    rows = {(r.joint, r.quantity): r for r in standing_rows(holding, ("a", "b"), (motor, motor))}
    assert len(rows) == 6
    assert rows["a", "voltage"].peak == pytest.approx(170.0 * 30.71 / ratio / k)
    assert (rows["a", "voltage"].limit, rows["a", "voltage"].breach) == (24.0, True)
    assert rows["a", "rms_current"].peak == pytest.approx(30.71 / ratio / k)
    assert [key for key, row in rows.items() if row.breach] == [("a", "voltage")]


def test_a_peak_at_its_limit_is_no_breach():
    """The data sheet permits the limit itself, at every instant and root mean square."""
    chain = CHAINS["ideal"]
    motor = DCMotor(
        "m", 0.03, 0.3, max_speed=800.0, peak_current=2.5 / 0.03, continuous_current=2.5 / 0.03
    )
    two = np.ones((2, 1))
    s = series([0.0, 4.0], 0 * two, 2.0 * two, 0 * two, 1000.0 * two)  # 800 rad/s, 2.5 N*m
    result = replace(chain, motor=motor).inverse(s)
    rows = {r.quantity: r for r in limit_rows(result)}
    assert rows["speed"].peak == rows["speed"].limit == 800.0
    assert rows["current"].peak == rows["current"].limit
    for quantity in ("speed", "current"):
        assert not rows[quantity].breach
        assert rows[quantity].share_over == 0.0
    assert not rows["voltage"].breach  # no limit
    exact = replace(motor, continuous_current=rows["rms_current"].peak)
    assert not {r.quantity: r for r in limit_rows(replace(result, motors=(exact,)))}[
        "rms_current"
    ].breach
    lower = replace(motor, continuous_current=0.99 * rows["rms_current"].peak)
    over = {r.quantity: r for r in limit_rows(replace(result, motors=(lower,)))}["rms_current"]
    assert (over.breach, over.share_over, over.peak_time) == (True, 1.0, 0.0)


@pytest.mark.parametrize(("a", "b", "rms"), [(0, 3, 3**0.5), (1, 4, 7**0.5), (-1, 2, 1.0)])
def test_root_mean_square_of_a_line_is_exact(a, b, rms):
    assert rms_over_time(np.array([0.0, 3.0]), np.array([[a], [b]]))[0] == pytest.approx(rms)


@pytest.mark.parametrize(("limit", "over"), [(5.0, 4.0), (8.0, 0.0), (0.0, 6.0), (np.inf, 0.0)])
def test_time_over_a_limit_counts_the_part_of_each_line_above_it(limit, over):
    t, m = np.array([0.0, 1.0, 3.0, 4.0, 6.0]), np.array([0.0, 4.0, 8.0, 8.0, 4.0])
    assert time_over(t, m, limit) == pytest.approx(over)
    assert time_over(t, np.full(5, 4.0), 4.0) == 0.0
