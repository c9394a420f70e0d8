"""Speeds fused by noise, stamps, spacing, reversals, ripple and two positions, on made signals."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.logs.prepared.prepare import prepare
from pipeline.logs.prepared.read_off import (
    read_off,
    ripples,
    signal_findings,
    two_sides,
)
from pipeline.logs.signals.derivatives import LowPass, Settings
from pipeline.logs.signals.grid import interpolated, stamp_error
from tests.pipeline.logs.made import made_log, motion

Array = NDArray[np.float64]
RATE = 500.0
SETTINGS = Settings(1 / RATE, 20.0, "test")


def error_of(column: Array | None, q: Array, v: Array) -> tuple[float, float]:
    """RMS errors of speed with a velocity column, and as the log states its noise."""
    log = made_log(q, 0 * q + np.sin(q), velocity=column)
    one = prepare(log, SETTINGS)
    inside = slice(200, -200)
    return float(np.std((one.v - v)[inside, 0])), float(one.fusion.noise[0, 0])


@pytest.mark.parametrize(("fine", "share"), [(1e-3, 0.9), (1.0, 0.1)])
def test_speed_comes_from_the_quieter_of_position_and_velocity(fine: float, share: float) -> None:
    rng = np.random.default_rng(1)
    _, q, v, _ = motion(4000)
    noisy = q + rng.normal(0, 3e-4, q.shape)
    column = v + rng.normal(0, fine, v.shape)
    one = prepare(made_log(noisy, np.sin(q), velocity=column), SETTINGS)
    weight = one.fusion.weight[0, 0]
    assert weight > share if fine < 0.1 else weight < share


def test_two_readings_are_better_than_either_and_the_stated_noise_is_the_errors() -> None:
    rng = np.random.default_rng(2)
    _, q, v, _ = motion(6000)
    gain = float(np.sqrt((LowPass(RATE, 20.0).kernels[1] ** 2).sum()))
    passed = LowPass(RATE, 20.0).noise_gain
    noisy = q + rng.normal(0, 3e-4, q.shape)
    equal = 3e-4 * gain / passed  # a velocity as noisy in the bandwidth as the position's rate
    alone, _ = error_of(None, noisy, v)
    both, stated = error_of(v + rng.normal(0, equal, v.shape), noisy, v)
    assert both == pytest.approx(alone / np.sqrt(2), rel=0.15)
    assert stated == pytest.approx(both, rel=0.2)


def test_a_late_scaled_and_offset_velocity_is_brought_to_the_position() -> None:
    rng = np.random.default_rng(3)
    t, q, v, _ = motion(6000)
    late = np.stack([np.interp(t - 0.01, t, c) for c in v.T], axis=1)
    column = 1.1 * late + 0.2 + rng.normal(0, 1e-3, v.shape)
    one = prepare(made_log(q + rng.normal(0, 3e-4, q.shape), np.sin(q), velocity=column), SETTINGS)
    assert one.fusion.lag[0] == pytest.approx(0.01, abs=1e-3)
    assert one.fusion.weight[0, 0] > 0.5
    assert np.abs((one.v - v)[200:-200, 0]).max() < 0.02


def test_a_velocity_of_something_else_has_no_say() -> None:
    _, q, v, _ = motion(4000)
    one = prepare(made_log(q, np.sin(q), velocity=np.roll(v, 700, axis=0)), SETTINGS)
    assert not one.fusion.weight.any()


@pytest.mark.parametrize("error", [0.0, 2e-4, 5e-4])
def test_errors_of_stamps_are_told_by_the_positions(error: float) -> None:
    rng = np.random.default_rng(4)
    t = np.arange(20_000) / RATE
    stamped = np.sort(t + rng.normal(0, error, t.size)) if error else t
    q = np.sin(2 * np.pi * 0.7 * t)[:, None] + rng.normal(0, 1e-5, (t.size, 1))
    found, uncertainty = stamp_error(stamped, q, 2.5 / RATE)
    assert found == pytest.approx(error, rel=0.15, abs=4 * uncertainty)
    # Rows that were really uneven have none.
    uneven = np.sin(2 * np.pi * 0.7 * stamped)[:, None] + rng.normal(0, 1e-5, (t.size, 1))
    found, uncertainty = stamp_error(stamped, uneven, 2.5 / RATE)
    assert found < 4 * uncertainty or found < 1e-5


def test_interpolated_rows_are_told_from_sampled_and_from_rounded_ones() -> None:
    t, q, _, _ = motion(5000)
    coarse = np.interp(t, t[::10], q[::10, 0])
    assert interpolated(t, coarse).mean() == pytest.approx(0.9, abs=0.03)
    assert not interpolated(t, q[:, 0] + np.random.default_rng(1).normal(0, 1e-6, t.size)).any()
    step = 2 * np.pi / 4096
    assert not interpolated(t, np.round(q[:, 0] / step) * step).any()


def test_a_sparse_channel_sets_the_bandwidth_and_no_row_is_lost() -> None:
    t, q, _, a = motion(8000)
    rng = np.random.default_rng(6)
    effort = 0.1 * a + 5 * np.sin(q) + rng.normal(0, 0.05, q.shape)
    effort[np.arange(t.size) % 10 != 0] = np.nan
    one = prepare(made_log(q + rng.normal(0, 1e-6, q.shape), effort))
    assert one.cutoff == pytest.approx(RATE / 80, rel=0.01)
    assert "one sample in 20 ms" in one.settings.reason
    assert one.mask.mean() > 0.95


def test_dropped_rows_are_bridged() -> None:
    t, q, _, a = motion(8000)
    keep = np.random.default_rng(7).random(t.size) > 0.1
    effort = 0.1 * a + 5 * np.sin(q)
    log = made_log(q, effort).rows(keep)
    one = prepare(log)
    assert one.mask.mean() > 0.95
    assert len(one.pieces) < 10


def ripple_log(size: float, order: float) -> tuple[Array, Array]:
    rng = np.random.default_rng(8)
    _, q, _, a = motion(20_000)
    effort = 0.1 * a + 5 * np.sin(q) + rng.normal(0, 0.05, q.shape)
    effort[:, 0] += size * np.sin(order * q[:, 0] + 0.6)
    return q, effort


def test_a_ripple_above_the_cutoff_is_seen_over_the_angle() -> None:
    q, effort = ripple_log(0.05, 200.0)
    found = ripples(prepare(made_log(q, effort), SETTINGS))
    assert list(found) == ["a"]
    assert found["a"].order == pytest.approx(200.0, abs=1.5)
    assert found["a"].amplitude == pytest.approx(0.05, rel=0.3)
    # Noise and friction are none.
    q, effort = ripple_log(0.0, 200.0)
    assert not ripples(prepare(made_log(q, effort), SETTINGS))
    _, _, v, _ = motion(20_000)
    rubbing = effort + np.sign(v)
    assert not ripples(prepare(made_log(q, rubbing), SETTINGS))


def twisted(
    compliance: float, width: float, loop: float = 0.0, noise: float = 1e-5
) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(9)
    _, q, v, _ = motion(6000)
    torque = 20 * np.sin(q[:, 0]) + 6 * np.cos(3 * q[:, 1])
    ahead = (
        0.4 + compliance * torque + 0.5 * width * np.sign(torque) + 0.5 * loop * np.sign(v[:, 0])
    )
    return ahead + rng.normal(0, noise, ahead.size), torque, v[:, 0]


@pytest.mark.parametrize(
    ("compliance", "width"), [(2e-4, 0.0), (1e-5, 5e-3), (2e-4, 5e-3), (0.0, 0.0)]
)
def test_a_line_is_a_spring_and_a_step_is_play(compliance: float, width: float) -> None:
    ahead, torque, v = twisted(compliance, width)
    ok = np.ones(v.size, dtype=np.bool_)
    seen = read_off(ahead, torque, v, ok, noise=0.05, rest=0.05)
    assert seen is not None
    assert seen.compliance[0] == pytest.approx(compliance, abs=4 * seen.compliance[1] + 1e-8)
    assert seen.width[0] == pytest.approx(width, abs=4 * seen.width[1] + 1e-6)
    assert seen.plays == (width > 0)
    assert seen.elastic == (compliance > 0)


def test_neither_a_loop_of_friction_nor_a_torque_of_one_sign_is_play() -> None:
    ahead, torque, v = twisted(2e-4, 0.0, loop=1e-3)
    ok = np.ones(v.size, dtype=np.bool_)
    seen = read_off(ahead, torque, v, ok, noise=0.05, rest=0.05)
    assert seen is not None
    assert seen.loop[0] == pytest.approx(1e-3, rel=0.05)
    assert not seen.plays
    heavy = torque + 100.0
    seen = read_off(2e-4 * heavy, heavy, v, ok, noise=0.05, rest=0.05)
    assert seen is not None
    assert np.isnan(seen.width[0])
    assert not seen.plays


def test_a_log_with_both_positions_says_what_its_gears_do() -> None:
    rng = np.random.default_rng(10)
    _, q, _, a = motion(6000)
    effort = 0.1 * a + 20 * np.sin(q) + rng.normal(0, 0.02, q.shape)
    motor = q + rng.normal(0, 1e-6, q.shape)
    motor[:, 0] += 3e-4 * (0.1 * a + 20 * np.sin(q))[:, 0]
    log = made_log(q + rng.normal(0, 1e-6, q.shape), effort, motor_position=motor)
    one = prepare(log, SETTINGS)
    seen = two_sides(one)
    assert seen["a"].stiffness[0] == pytest.approx(1 / 3e-4, rel=0.03)
    assert not seen["b"].elastic
    checks = {(f.column, f.check) for f in signal_findings(one)}
    assert ("a__motor_position_rad", "elasticity") in checks
    assert ("b__motor_position_rad", "rigid") in checks
