"""Energies, returned energy and limits against closed forms and finer sampling."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuators.energy.energy import (
    integral,
    limit_rows,
    rms_over_time,
    split_integral,
    stage_energies,
    supply,
)
from tests.actuators.motions import CHAINS, series, split


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


def test_limits_of_a_fast_and_a_slow_joint():
    t = np.linspace(0.0, 1.0, 101)
    ramp = np.column_stack((4.0 * t, 0.1 * t))  # motor: 0 to 1600 rad/s, limit 858.7
    zero, chain = np.zeros_like(ramp), CHAINS["ideal"]
    s = split(series(t, zero, ramp, zero, zero, joints=("fast", "slow")))
    rows = {(r.joint, r.quantity): r for r in limit_rows(chain.inverse(s))}
    speed = rows["fast", "speed"]
    assert speed.breach
    assert speed.peak == pytest.approx(1600.0)
    assert rows["fast", "voltage"].breach
    assert not any(r.breach for (joint, _), r in rows.items() if joint == "slow")


def test_root_mean_square_is_exact_for_lines():
    for a, b, rms in ((0, 3, 3**0.5), (1, 4, 7**0.5), (-1, 2, 1.0)):
        assert rms_over_time(np.array([0.0, 3.0]), np.array([[a], [b]]))[0] == pytest.approx(rms)
