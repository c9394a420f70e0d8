"""The zero-phase filter against closed forms, finite differences and its own memory."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.logs.filters import LowPass, choose_cutoff, smoother_noise

RATE = 1000.0
MIDDLE = slice(300, -300)


@pytest.fixture
def lowpass() -> LowPass:
    return LowPass(RATE, 20.0)


def test_constants_ramps_and_parabolas_are_exact(lowpass: LowPass) -> None:
    t = np.arange(2000) / RATE
    x = np.stack([np.full(t.size, 3.0), 2 * t, t**2], axis=1)
    q, v, a = lowpass.derivatives(x)
    assert v[MIDDLE] == pytest.approx(np.stack([0 * t, 0 * t + 2, 2 * t], 1)[MIDDLE], abs=1e-9)
    assert a[MIDDLE] == pytest.approx(np.stack([0 * t, 0 * t, 0 * t + 2], 1)[MIDDLE], abs=1e-7)
    assert q[MIDDLE, :2] == pytest.approx(x[MIDDLE, :2], abs=1e-12)


@pytest.mark.parametrize(("frequency", "low", "high"), [(4, 0.998, 1.002), (20, 0.49, 0.51)])
def test_amplitude_is_kept_below_and_halved_at_the_cutoff(
    lowpass: LowPass, frequency: float, low: float, high: float
) -> None:
    t = np.arange(4000) / RATE
    w = 2 * np.pi * frequency
    x = np.sin(w * t)
    q, v, a = lowpass.derivatives(x)
    gain = np.abs(q[MIDDLE]).max()
    assert low < gain < high
    # Zero phase: value and acceleration stay in step with the sine, velocity with the cosine.
    assert q[MIDDLE] == pytest.approx(gain * x[MIDDLE], abs=1e-3)
    assert v[MIDDLE] / w == pytest.approx(gain * np.cos(w * t)[MIDDLE], abs=2e-3)
    assert -a[MIDDLE] / w**2 == pytest.approx(gain * x[MIDDLE], abs=2e-3)


def test_the_chosen_cutoff_follows_the_noise() -> None:
    t = np.arange(20_000) / RATE
    rng = np.random.default_rng(2)
    # A spectrum that falls smoothly: noise through a one-pole filter.
    drive = rng.normal(size=t.size)
    x = np.zeros(t.size)
    for k in range(1, t.size):
        x[k] = 0.98 * x[k - 1] + 0.02 * drive[k]
    x = np.convolve(x, np.ones(20) / 20, mode="same")
    noise = rng.normal(size=t.size)
    chosen = [float(choose_cutoff([(x + s * noise)[:, None]], RATE)[0]) for s in (1e-4, 1e-3, 1e-2)]
    assert chosen[0] > chosen[1] > chosen[2] > 0.5
    assert np.isnan(choose_cutoff([np.ones((1000, 1))], RATE)[0])


def test_white_noise_is_told_by_what_lies_above_the_band(lowpass: LowPass) -> None:
    t = np.arange(20_000)[:, None] / RATE
    x = np.sin(3.0 * t) + 0.3 * np.random.default_rng(1).standard_normal(t.shape)
    ok, whole = np.ones(x.shape, dtype=np.bool_), (slice(None),)
    assert smoother_noise(x, ok, whole, lowpass)[0] == pytest.approx(0.3, rel=0.1)
