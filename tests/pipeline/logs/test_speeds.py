"""The expected sign of friction against the sign and a smooth step, on data with known truth."""

from typing import NamedTuple

import numpy as np
import pytest

from actuators.arrays import Array
from pipeline.logs.filters import LowPass
from pipeline.logs.load import with_rest
from pipeline.logs.speeds import STANDING, friction_sign, within
from tests.pipeline.logs.made import made_log, reduced_log

#: Gravity's moment [N*m], inertia [kg*m^2], viscous [N*m*s/rad], Coulomb [N*m], load friction [1].
TRUTH = np.array([8.0, 0.4, 1.5, 2.0, 0.08])
TORQUE_NOISE = 0.05  # [N*m]


class Moved(NamedTuple):
    """A log of one joint."""

    rate: float
    cutoff: float
    q: Array
    torque: Array


#: Rate [Hz], cut-off [Hz], length [s], noise of the encoder [rad].
MOTIONS = {
    "slow": (200.0, 2.0, 40.0, 3e-4),
    "fast": (500.0, 15.0, 20.0, 3e-5),
    "stairs": (250.0, 30.0, 40.0, 3e-5),
    "pace": (500.0, 18.0, 30.0, 3e-5),
    "pace at 50 Hz": (50.0, 12.5, 60.0, 3e-5),
    "stops": (250.0, 16.0, 40.0, 3e-5),
}


def course(kind: str, t: Array, rng: np.random.Generator) -> Array:
    """Position, velocity and acceleration, shape (3, N)."""
    if kind in ("stairs", "stops"):
        short = kind == "stairs"
        out, at, now = np.zeros((3, t.size)), 0.0, 0.0
        while at < t[-1]:
            lasts = rng.uniform(0.1, 0.25) if short else rng.uniform(0.8, 2.0)
            step = rng.choice([-1, 1]) * rng.uniform(0.1, 0.25) * (1 if short else 4)
            step = -step if abs(now + step) > 1.2 else step
            s = np.clip((t - at) / lasts, 0, 1)
            out[0] += step * (10 * s**3 - 15 * s**4 + 6 * s**5)
            out[1] += step * 30 * (s**2 - 2 * s**3 + s**4) / lasts
            out[2] += step * 60 * (s - 3 * s**2 + 2 * s**3) / lasts**2
            now += step
            at += lasts + (rng.uniform(0.1, 0.4) if short else rng.uniform(1.5, 4.0))
        return out
    f, size = {
        "slow": (rng.uniform(0.03, 0.06, 3), np.array([0.02, 0.01, 0.006])),
        "fast": (rng.uniform(0.3, 1.2, 3), np.array([0.6, 0.3, 0.15])),
    }.get(kind, (2.1 * np.arange(1, 4) * rng.uniform(0.95, 1.05), np.array([0.4, 0.1, 0.03])))
    w, angle = 2 * np.pi * f, 2 * np.pi * np.outer(t, f) + rng.uniform(0, 6.28, 3)
    sin, cos = size * np.sin(angle), size * np.cos(angle)
    return np.stack([sin.sum(1), (w * cos).sum(1), -(w**2 * sin).sum(1)])


def columns(q: Array, v: Array, a: Array, sign: Array) -> Array:
    """Per unit of TRUTH, shape (N, 5)."""
    load = TRUTH[0] * np.sin(q + 0.5) + TRUTH[1] * a
    return np.stack([np.sin(q + 0.5), a, v, sign, np.abs(load) * sign], axis=1)


def moved(kind: str, rng: np.random.Generator) -> Moved:
    """At rest friction is whatever it stopped with."""
    rate, cutoff, lasts, noise = MOTIONS[kind]
    t = np.arange(0, lasts, 1 / rate)
    q, v, a = course(kind, t, rng)
    rest = np.abs(v) < 1e-6
    number = np.cumsum(np.diff(np.concatenate([[0], rest.astype(int)])) == 1)
    sign = np.where(rest, rng.uniform(-1, 1, number.max() + 1)[number], np.sign(v))
    torque = columns(q, v, a, sign) @ TRUTH + TORQUE_NOISE * rng.standard_normal(t.size)
    step = 2 * np.pi / 2**16
    return Moved(
        rate, cutoff, step * np.round((q + noise * rng.standard_normal(t.size)) / step), torque
    )


def estimate(log: Moved, how: str) -> Array:
    """Least squares with weights, TRUTH's shape; NaN where masks leave no row.

    ``"masks"``: rows in the filter's reach of standstill or reversal do not count.
    """
    rate, n = log.rate, log.q.size
    narrow = LowPass(rate, log.cutoff)
    wide = LowPass(rate, min(4 * log.cutoff, 0.25 * rate))
    # Ringing from both ends is no part of this.
    inside = np.zeros(n, dtype=np.bool_)
    inside[narrow.half : -narrow.half] = True
    q, v, a = narrow.derivatives(log.q)
    y, fast = narrow.smooth(log.torque), wide.derivatives(log.q)[1]
    white = np.std(np.diff(log.q, 4)[np.abs(np.diff(log.q, 4)) > 0]) / np.sqrt(70.0)
    noise, wider = (float(white * band.gains[1]) for band in (narrow, wide))
    unsure = np.zeros(n)
    if how == "expected":
        sign, unsure = friction_sign(v, noise, fast, wider, (slice(0, n),), narrow)
    else:
        rest = max(0.003 * float(np.quantile(np.abs(v), 0.95)), 3 * noise)
        sign = np.sign(v) if how == "sign" else np.tanh(v / rest)
        if how == "masks":
            still = np.abs(v) < STANDING * rest
            still[1:] |= np.signbit(v[1:]) != np.signbit(v[:-1])
            reach = int(np.ceil(rate / log.cutoff))
            inside &= ~within(still[:, None], (slice(0, n),), reach)[:, 0]
            if inside.sum() < 50:
                return np.full(5, np.nan)
    X = columns(q, v, a, sign)
    X[:, 3:] = narrow.smooth(X[:, 3:])
    weight, x = np.ones(n), np.zeros(5)
    for _ in range(4):
        w = np.sqrt(weight)[inside]
        x = np.linalg.lstsq(X[inside] * w[:, None], y[inside] * w, rcond=None)[0]
        left, sure = y - X @ x, inside & (unsure < 0.1)
        scatter = float(np.std(left[sure] if sure.sum() > 50 else left[inside]))
        level = np.abs(x[3]) + np.abs(x[4] * X[:, 0] * TRUTH[0])
        weight = 1 / (1 + (level * unsure / max(scatter, 1e-3)) ** 2)
    return x


def errors(kind: str, how: str, draws: int) -> Array:
    """Estimates less truth, shape (draws, 5)."""
    logs = (moved(kind, np.random.default_rng([7, k])) for k in range(draws))
    return np.array([estimate(log, how) for log in logs]) - TRUTH


@pytest.mark.slow
@pytest.mark.parametrize("kind", MOTIONS)
def test_weighing_rows_is_as_good_as_leaving_them_out(kind):
    """Masses, viscous, Coulomb and load friction, or within 1 %; masks may leave no row."""
    expected, masks = (rms(errors(kind, how, 30)) for how in ("expected", "masks"))
    assert np.isfinite(expected).all()
    assert ((expected <= np.maximum(1.1 * masks, 0.01 * TRUTH)) | np.isnan(masks)).all()


def rms(x: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(x**2, axis=0)))


@pytest.mark.parametrize("kind", [kind for kind in MOTIONS if kind != "pace at 50 Hz"])
def test_an_answer_everywhere(kind):
    """Dry friction within 6 %, however the joint moves."""
    assert rms(errors(kind, "expected", 4))[3] < 0.06 * TRUTH[3]


@pytest.mark.parametrize("kind", ["stairs", "stops"])
def test_rest_is_no_slow_motion(kind):
    """Where a joint rests, the sign of its noise shrinks Coulomb friction; its expectation not."""
    expected, smooth = (rms(errors(kind, how, 3))[3] for how in ("expected", "tanh"))
    assert expected < 0.02 * TRUTH[3] < 0.2 * smooth


def test_rows_that_do_not_tell_the_sense_of_friction_are_left_out_where_enough_stay():
    log = moved("stairs", np.random.default_rng(1))
    made = made_log(log.q[:, None], log.torque[:, None], log.rate)
    m = with_rest([reduced_log(made, 16.0)])[0]
    q, v, a = m.q[:, 0], m.v[:, 0], m.a[:, 0]
    left = m.effort[:, 0, 0] - m.smooth(columns(q, v, a, m.sign[:, 0]) @ TRUTH)
    kept = m.mask[:, 0]
    assert kept.mean() > 0.2
    assert rms(left[kept]) < 8.5 * m.noise[0, 0]
