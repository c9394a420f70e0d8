"""Logs at one bandwidth: motion, gaps, parts, contacts, what a motor is ahead of its joint."""

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.identification.two_positions import read_off, two_sides
from pipeline.logs.filters import LowPass, choose_cutoff, smoother_noise
from pipeline.logs.load import shortened, split
from pipeline.logs.log import TEST, TRAIN, VALIDATION, Log, expected_of_robot
from pipeline.logs.reduce import find_contact
from tests.pipeline.logs.made import made_log, motion, reduced_log, settings_of

RATE = 500.0
REACH = LowPass(RATE, 20.0).half
GAIN = float(LowPass(RATE, 20.0).gains[0])


def noisy(n: int = 5000, seed: int = 0) -> tuple[Array, Array, Array, Array, Array]:
    t, q, v, a = motion(n, RATE)
    rng = np.random.default_rng(seed)
    effort = 0.1 * a + rng.normal(0, 0.5, q.shape)
    return t, q + rng.normal(0, 1e-4, q.shape), v, a, effort


def known(log: Log) -> NDArray[np.bool_]:
    assert log.known is not None
    return log.known


def test_motion_is_recovered_from_noisy_positions():
    _, q, v, a, effort = noisy()
    ready = reduced_log(made_log(q, effort, RATE), None)
    middle = slice(300, -300)
    assert 5.0 < ready.bandwidth < 60.0
    assert np.sqrt(np.mean((ready.v - v)[middle] ** 2)) < 0.01 * v.std()
    assert np.sqrt(np.mean((ready.a - a)[middle] ** 2)) < 0.05 * a.std()
    few = reduced_log(made_log(q, effort, RATE), 10.0, thinned=True)
    assert few.rate == pytest.approx(100.0)
    assert few.q[5] == pytest.approx(reduced_log(made_log(q, effort, RATE), 10.0).q[25])


@pytest.mark.parametrize("what", ["white", "rounded", "jitter", "velocity"])
def test_another_draw_of_the_noise_tells_by_how_much_a_coefficient_shrinks(what):
    rng, t, shrinks, draws = np.random.default_rng(1), np.arange(10_000) / RATE, [], []
    for _ in range(4):
        at = t + 4e-4 * rng.standard_normal(t.size) * (what == "jitter")
        w, phase = 2 * np.pi * np.array([0.2, 0.5, 0.9]), rng.uniform(0, 6, 3)
        x = np.stack(
            [0.5 * w**k * np.sin(np.outer(at, w) + phase + k * np.pi / 2) for k in range(3)]
        )
        q, v, a = x.sum(axis=2)[..., None]
        q = q + 3e-4 * rng.standard_normal(q.shape) * (what in ("white", "velocity"))
        q = np.round(q / 1.5e-3) * 1.5e-3 if what == "rounded" else q
        own = {"velocity": v + 0.02 * rng.standard_normal(v.shape)} if what == "velocity" else {}
        m = reduced_log(made_log(q, a, RATE, **own), 40.0, thinned=True)
        noisy, rows = m.a[m.mask], m.effort[m.mask][:, 0]
        shrinks.append(1.0 - noisy @ rows / (noisy @ noisy))
        draws.append(np.sum(m.a_noise[m.mask] ** 2) / (noisy @ noisy))
    assert np.mean(shrinks) > 0.005
    assert np.mean(draws) == pytest.approx(np.mean(shrinks), rel=0.2)


@pytest.mark.parametrize("apart", [2e-4, 7e-4])
def test_efforts_with_stamps_of_their_own_are_brought_to_the_positions(apart):
    t, q, _, _, effort = noisy()
    time = np.stack([t, t + apart], axis=1).ravel()
    none = np.full_like(q, np.nan)
    rows = np.stack([q, none], axis=1).reshape(-1, 2), np.stack([none, effort], axis=1)
    ready = reduced_log(made_log(rows[0], rows[1].reshape(-1, 2), time=time))
    assert ready.rate == pytest.approx(RATE)
    assert known(ready)[100:-100].all()
    late = np.interp(ready.time, t + apart, LowPass(RATE, 20.0).smooth(effort)[:, 0])
    assert np.abs(ready.effort[:, 0, 0] - late)[300:-300].max() < 0.05


def test_gaps_split_the_log_and_nothing_runs_across():
    t, q, v, _, effort = noisy()
    keep = np.ones(t.size, dtype=np.bool_)
    keep[2000:2600] = False
    ready = reduced_log(made_log(q[keep], effort[keep], time=t[keep]))
    assert [piece.stop - piece.start for piece in ready.pieces] == [2000, 2400]
    assert not known(ready)[1999].any()
    assert np.abs(ready.v - v[keep])[known(ready).all(axis=1)].max() < 0.1


def test_parts_are_as_far_apart_as_noise_remembers():
    _, q, _, _, effort = noisy(10_000)
    (log,), guard = split([reduced_log(made_log(q, effort, RATE))])
    for one, other in ((TRAIN, VALIDATION), (TRAIN, TEST), (VALIDATION, TEST)):
        a, b = np.flatnonzero(log.part == one), np.flatnonzero(log.part == other)
        nearest = np.abs(a - b[np.clip(np.searchsorted(b, a), 0, b.size - 1)]).min()
        before = np.abs(a - b[np.clip(np.searchsorted(b, a) - 1, 0, b.size - 1)]).min()
        assert min(nearest, before) / RATE >= guard > 0.0
    shares = [(log.part == k).mean() for k in (TRAIN, VALIDATION, TEST)]
    assert shares[0] > 0.3
    assert min(shares) > 0.1
    noise = LowPass(RATE, 20.0).smooth(np.random.default_rng(1).standard_normal(10**6))
    lag = round(guard * RATE)
    assert abs(np.corrcoef(noise[lag:], noise[:-lag])[0, 1]) < 0.06


def test_of_a_long_log_the_stretches_that_tell_most_are_kept():
    t, q, _, _, effort = noisy(60_000)
    q[:, 1] = 0.3
    q[37_000:38_000, 1] += 0.2 * np.sin(3 * t[37_000:38_000])
    few = shortened(made_log(q, effort, RATE), 6, 1000)
    assert len(few) == 6000
    assert len(shortened(few, 1, 1000)) == 1000
    assert ((few.time > 74.2) & (few.time < 75.8)).any()
    assert np.unique((10 * few.time / t[-1]).astype(int)).size >= 4
    (log,), _ = split([reduced_log(few)])
    assert {TRAIN, VALIDATION, TEST} <= set(log.part.tolist())


def test_what_cannot_be_prepared_is_refused():
    _, q, _, _, effort = noisy()
    log = made_log(q, effort, RATE)
    for refused, words in (
        (lambda: settings_of(made_log(q[:100], effort[:100], RATE)), "log longer or faster"),
        (lambda: settings_of(log, 300.0), "to 125 Hz"),
        (lambda: settings_of(made_log(0 * q, effort, RATE)), "no joint moves"),
        (lambda: split([reduced_log(made_log(q[:60], effort[:60], 20.0), 2.0)]), "log longer"),
    ):
        with pytest.raises(LegwattError, match=words):
            refused()


def test_contact_from_forces_and_lowest_feet(hexapod, walk):
    segments = walk.segments
    q = np.concatenate([hexapod.leg_positions(s.configuration) for s in segments])
    flat = q.reshape(len(q), -1)
    time = np.arange(len(q)) * walk.segments[-1].time[-1] / len(q)
    truth = np.concatenate(
        [
            np.tile([leg in s.stance for leg in hexapod.leg_names], (len(s.configuration), 1))
            for s in segments
        ]
    )
    inside = np.ones(len(q), dtype=np.bool_)
    for edge in np.flatnonzero((truth[1:] != truth[:-1]).any(axis=1)) + 1:
        inside[max(0, edge - 90) : edge + 90] = False
    inside[:90] = inside[-90:] = False
    log = made_log(flat, flat, time=time)
    seen = find_contact(log, hexapod)
    assert seen[1] == "lowest feet"
    assert np.array_equal(seen[0][inside], truth[inside])
    force = np.zeros((len(q), 6, 3))
    force[..., 2] = 60.0 * truth + np.random.default_rng(0).normal(0, 0.3, truth.shape)
    feet = expected_of_robot(hexapod).feet
    found = find_contact(made_log(flat[:, :2], flat[:, :2], feet=feet, force=force))
    assert found[1] == "forces"
    assert np.array_equal(found[0], truth)


def speed_error(column: Array | None, q: Array, v: Array) -> tuple[float, float]:
    """RMS error of the first joint's speed with a velocity column, and as the log states it."""
    more = {} if column is None else {"velocity": column}
    one = reduced_log(made_log(q, 0 * q + np.sin(q), **more))
    assert one.rate_noise is not None
    return float(np.std((one.v - v)[200:-200, 0])), float(one.rate_noise[0, 0])


def test_position_and_velocity_are_weighed_by_their_noise():
    rng = np.random.default_rng(2)
    _, q, v, _ = motion(6000)
    noisy_q = q + rng.normal(0, 3e-4, q.shape)
    gains = LowPass(RATE, 20.0).gains
    equal = 3e-4 * gains[1] / gains[0]  # as noisy in the bandwidth as the position's rate
    alone, _ = speed_error(None, noisy_q, v)
    both, stated = speed_error(v + rng.normal(0, equal, v.shape), noisy_q, v)
    fine, _ = speed_error(v + rng.normal(0, 1e-3, v.shape), noisy_q, v)
    assert both == pytest.approx(alone / np.sqrt(2), rel=0.15)
    assert stated == pytest.approx(both, rel=0.2)
    assert fine < 0.2 * alone
    # Another thing's velocity has no say.
    assert speed_error(np.roll(v, 700, axis=0), noisy_q, v)[0] == pytest.approx(alone)
    # Late, in another zero and at another gain it has the same say.
    late = np.stack([np.interp(np.arange(6000), np.arange(6000) + 5, c) for c in v.T], axis=1)
    other = 1.1 * late + 0.2 + rng.normal(0, 1e-3, v.shape)
    assert speed_error(other, noisy_q, v)[0] < 0.2 * alone


def times(sizes: Sequence[float]) -> Array:
    """Times of rows with gaps of these lengths [s] after every hundred."""
    step = np.full(100 * len(sizes) + 100, 1 / RATE)
    step[100::100] += sizes
    return np.cumsum(step)


def test_pieces_too_short_for_guards_are_dealt_out_whole():
    time = times([1.0] * 15)
    q = np.sin(2.0 * time)[:, None] + 1e-4 * np.random.default_rng(1).standard_normal((1600, 1))
    (log,), _ = split([reduced_log(made_log(q, q, time=time))])
    assert [np.unique(log.part[piece]).size for piece in log.pieces] == [1] * 16
    assert [log.part[p.start] for p in log.pieces[:4]] == [TRAIN, VALIDATION, TRAIN, TEST]


ROWS_HZ = 1000.0
MIDDLE = slice(300, -300)


@pytest.fixture
def lowpass() -> LowPass:
    return LowPass(ROWS_HZ, 20.0)


def test_constants_ramps_and_parabolas_are_exact(lowpass):
    t = np.arange(2000) / ROWS_HZ
    x = np.stack([np.full(t.size, 3.0), 2 * t, t**2], axis=1)
    q, v, a = lowpass.derivatives(x)
    assert v[MIDDLE] == pytest.approx(np.stack([0 * t, 0 * t + 2, 2 * t], 1)[MIDDLE], abs=1e-9)
    assert a[MIDDLE] == pytest.approx(np.stack([0 * t, 0 * t, 0 * t + 2], 1)[MIDDLE], abs=1e-7)
    assert q[MIDDLE, :2] == pytest.approx(x[MIDDLE, :2], abs=1e-12)


@pytest.mark.parametrize(("frequency", "low", "high"), [(4, 0.998, 1.002), (20, 0.49, 0.51)])
def test_amplitude_is_kept_below_and_halved_at_the_cutoff(lowpass, frequency, low, high):
    t = np.arange(4000) / ROWS_HZ
    w = 2 * np.pi * frequency
    x = np.sin(w * t)
    q, v, a = lowpass.derivatives(x)
    gain = np.abs(q[MIDDLE]).max()
    assert low < gain < high
    # Zero phase: value and acceleration stay in step with the sine, velocity with the cosine.
    assert q[MIDDLE] == pytest.approx(gain * x[MIDDLE], abs=1e-3)
    assert v[MIDDLE] / w == pytest.approx(gain * np.cos(w * t)[MIDDLE], abs=2e-3)
    assert -a[MIDDLE] / w**2 == pytest.approx(gain * x[MIDDLE], abs=2e-3)


def test_the_chosen_cutoff_follows_the_noise():
    t = np.arange(20_000) / ROWS_HZ
    rng = np.random.default_rng(2)
    # A spectrum that falls smoothly: noise through a one-pole filter.
    drive = rng.normal(size=t.size)
    x = np.zeros(t.size)
    for k in range(1, t.size):
        x[k] = 0.98 * x[k - 1] + 0.02 * drive[k]
    x = np.convolve(x, np.ones(20) / 20, mode="same")
    noise = rng.normal(size=t.size)
    chosen = [
        float(choose_cutoff([(x + s * noise)[:, None]], ROWS_HZ)[0][0]) for s in (1e-4, 1e-3, 1e-2)
    ]
    assert chosen[0] > chosen[1] > chosen[2] > 0.5
    assert np.isnan(choose_cutoff([np.ones((1000, 1))], ROWS_HZ)[0][0])


def test_white_noise_is_told_by_what_lies_above_the_band(lowpass):
    t = np.arange(20_000)[:, None] / ROWS_HZ
    x = np.sin(3.0 * t) + 0.3 * np.random.default_rng(1).standard_normal(t.shape)
    ok, whole = np.ones(x.shape, dtype=np.bool_), (slice(None),)
    assert smoother_noise(x, ok, whole, lowpass)[0] == pytest.approx(0.3, rel=0.1)


def test_noise_is_told_above_the_motion_and_not_just_above_the_band():
    t, q, _, _, effort = noisy()
    fast = 0.05 * np.sin(2 * np.pi * 14.0 * t)[:, None]
    log = made_log(q + fast, effort - 0.1 * (2 * np.pi * 14.0) ** 2 * fast, RATE)
    floor = 0.5 * LowPass(RATE, 8.0).gains[0]
    assert reduced_log(log, 8.0).noise[:, 0] == pytest.approx([floor, floor], rel=0.2)


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
def test_a_line_is_a_spring_and_a_step_is_play(compliance, width):
    ahead, torque, v = twisted(compliance, width)
    ok = np.ones(v.size, dtype=np.bool_)
    seen = read_off(ahead, torque, v, ok, noise=0.05, rest=0.05)
    assert seen.compliance[0] == pytest.approx(compliance, abs=4 * seen.compliance[1] + 1e-8)
    assert seen.width[0] == pytest.approx(width, abs=4 * seen.width[1] + 1e-6)
    assert seen.plays == (width > 0)
    assert seen.elastic == (compliance > 0)


def test_a_log_with_both_positions_says_what_its_gears_do():
    rng = np.random.default_rng(10)
    _, q, _, a = motion(6000)
    effort = 0.1 * a + 20 * np.sin(q) + rng.normal(0, 0.02, q.shape)
    motor = q + rng.normal(0, 1e-6, q.shape)
    motor[:, 0] += 3e-4 * (0.1 * a + 20 * np.sin(q))[:, 0]
    log = made_log(q + rng.normal(0, 1e-6, q.shape), effort, motor_position=motor)
    seen = two_sides(reduced_log(log))
    assert seen["a"].stiffness[0] == pytest.approx(1 / 3e-4, rel=0.03)
    assert not seen["b"].elastic
