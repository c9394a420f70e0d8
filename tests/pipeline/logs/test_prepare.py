"""Prepared logs: motion recovered, gaps and missing values masked, chunks equal to the whole."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from actuators.errors import LegwattError
from pipeline.identification.compare.loaded import prepare_logs
from pipeline.logs.log_format import Expected, expected_of_robot
from pipeline.logs.prepared.measurement import (
    TEST,
    TRAIN,
    VALIDATION,
    log_contact,
    lowest_feet,
    scheduled_contact,
)
from pipeline.logs.prepared.parts import cycle_noise, period, repeat_noise, split
from pipeline.logs.prepared.prepare import prepare
from pipeline.logs.reading.read import read_log
from pipeline.logs.signals.derivatives import LowPass, Settings, choose_settings
from pipeline.motion.motion import Motion
from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot, load_robot
from tests.pipeline.logs.made import made_log, motion, stream_prepared

Array = NDArray[np.float64]
RATE = 500.0


def noisy(n: int = 5000, seed: int = 0) -> tuple[Array, Array, Array, Array, Array]:
    t, q, v, a = motion(n, RATE)
    rng = np.random.default_rng(seed)
    effort = 0.1 * a + rng.normal(0, 0.5, q.shape)
    return t, q + rng.normal(0, 1e-4, q.shape), v, a, effort


def test_motion_is_recovered_from_noisy_positions() -> None:
    _, q, v, a, effort = noisy()
    ready = prepare(made_log(q, effort, RATE))
    middle = slice(300, -300)
    assert 5.0 < ready.cutoff < 60.0
    assert np.sqrt(np.mean((ready.v - v)[middle] ** 2)) < 0.01 * v.std()
    assert np.sqrt(np.mean((ready.a - a)[middle] ** 2)) < 0.05 * a.std()


def test_missing_effort_masks_only_its_surroundings() -> None:
    _, q, _, _, effort = noisy()
    effort[1000:1500, 0] = np.nan
    ready = prepare(made_log(q, effort, RATE), Settings(1 / RATE, 20.0, "test"))
    reach = ready.settings.lowpass.half
    assert not ready.mask[1000:1500, 0].any()
    assert ready.mask[100 : 1000 - reach, 0].all()
    assert ready.mask[1500 + reach : -100, 0].all()
    assert ready.mask[100:-100, 1].all()
    assert ready.motion_ok[100:-100].all()
    # Without the position of one joint nothing is known of any.
    q[2000:2200, 1] = np.nan
    assert not prepare(made_log(q, effort, RATE), ready.settings).mask[2000:2200].any()


@pytest.mark.parametrize("apart", [2e-4, 7e-4])
def test_efforts_with_stamps_of_their_own_are_brought_to_the_positions(apart: float) -> None:
    t, q, _, _, effort = noisy()
    time = np.stack([t, t + apart], axis=1).ravel()
    none = np.full_like(q, np.nan)
    rows = np.stack([q, none], axis=1).reshape(-1, 2), np.stack([none, effort], axis=1)
    log = made_log(rows[0], rows[1].reshape(-1, 2), time=time)
    ready = prepare(log, Settings(choose_settings([log]).dt, 20.0, "test"))
    assert ready.rate == pytest.approx(RATE)
    assert ready.mask[100:-100].all()
    late = np.interp(ready.time, t + apart, LowPass(RATE, 20.0).smooth(effort)[:, 0])
    assert np.abs(ready.effort[:, 0] - late)[300:-300].max() < 0.05


def test_gaps_split_the_log_and_nothing_runs_across() -> None:
    t, q, v, _, effort = noisy()
    keep = np.ones(t.size, dtype=np.bool_)
    keep[2000:2600] = False
    log = made_log(q[keep], effort[keep], time=t[keep])
    ready = prepare(log, Settings(1 / RATE, 20.0, "test"))
    assert [piece.stop - piece.start for piece in ready.pieces] == [2000, 2400]
    assert not ready.mask[1999].any()
    good = ready.mask.all(axis=1)
    assert np.abs(ready.v - v[keep])[good].max() < 0.1


def test_jittery_rows_are_resampled() -> None:
    t, q, v, _, effort = noisy()
    rng = np.random.default_rng(4)
    moved = np.sort(t + rng.uniform(-0.4, 0.4, t.size) / RATE)
    at = np.stack([np.interp(moved, t, q[:, j]) for j in range(2)], axis=1)
    log = made_log(at, effort, time=moved)
    ready = prepare(log, Settings(1 / RATE, 20.0, "test"))
    assert np.diff(ready.time) == pytest.approx(1 / RATE, abs=1e-9)
    truth = np.stack([np.interp(ready.time, t, v[:, j]) for j in range(2)], axis=1)
    assert np.abs(ready.v - truth)[300:-300].max() < 0.05


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_streamed_chunks_equal_the_whole(
    two_joints: Expected, tmp_path: Path, jitter: float
) -> None:
    t, q, _, _, effort = noisy(12_000)
    t = t + np.random.default_rng(5).uniform(0, jitter, t.size) / RATE
    names = ("a__position_rad", "b__position_rad", "a__torque_Nm", "b__torque_Nm")
    data = {"time_s": t} | dict(zip(names, np.hstack([q, effort]).T, strict=True))
    path = tmp_path / "long.parquet"
    pq.write_table(pa.table(data), path, row_group_size=1000)
    whole_log = read_log(path, two_joints)
    settings = Settings(float(np.median(np.diff(t))), 20.0, "test")
    whole = prepare(whole_log, settings, origin=float(t[0]))
    chunks = [p for _, p in stream_prepared(path, two_joints, settings=settings, rows=1500)]
    assert len(chunks) > 5
    time = np.concatenate([p.time[p.core] for p in chunks])
    assert np.diff(time) == pytest.approx(settings.dt, rel=0.5 if jitter else 1e-6)
    assert time.size == whole.time.size
    for name in ("q", "v", "a", "effort"):
        parts = np.concatenate([getattr(p, name)[p.core] for p in chunks])
        reference = getattr(whole, name)
        assert np.abs(parts - reference).max() < 1e-8 * np.abs(reference).max()
    mask = np.concatenate([p.mask[p.core] for p in chunks])
    assert np.array_equal(mask, whole.mask)


def test_a_long_rest_is_no_defect_of_a_stream(two_joints: Expected, tmp_path: Path) -> None:
    t, q, _, _, effort = noisy(60_000)
    q[:15_000] = q[15_000]
    effort[20_000:24_000, 1] = np.nan  # the drive is off for longer than a chunk
    names = ("a__position_rad", "b__position_rad", "a__torque_Nm", "b__torque_Nm")
    data = {"time_s": t} | dict(zip(names, np.hstack([q, effort]).T, strict=True))
    path = tmp_path / "long.parquet"
    pq.write_table(pa.table(data), path, row_group_size=1_000)
    chunks = [p for _, p in stream_prepared(path, two_joints, rows=2_000)]
    assert sum(p.core.stop - p.core.start for p in chunks) == t.size
    assert len({p.cutoff for p in chunks}) == 1
    assert 5.0 < chunks[0].cutoff < 60.0
    assert chunks[3].mask[chunks[3].core].all()  # a joint at rest can be compared
    expected = 0.5 * chunks[0].settings.lowpass.noise_gain
    assert chunks[-1].noise == pytest.approx([expected, expected], rel=0.15)


def test_a_joint_at_rest_does_not_choose_the_cutoff() -> None:
    _, q, _, _, effort = noisy()
    moving = choose_settings([made_log(q, effort, RATE)])
    q[:, 1] = 0.3 + np.random.default_rng(8).normal(0, 1e-4, len(q))
    one = choose_settings([made_log(q, effort, RATE)])
    assert np.isnan(one.per_joint[1])
    assert one.cutoff == pytest.approx(moving.per_joint[0])


def test_period_and_noise_between_cycles() -> None:
    t = np.arange(6000) / RATE
    rng = np.random.default_rng(6)
    w = 2 * np.pi / 1.37
    q = np.stack([np.sin(w * t), 0.4 * np.sin(2 * w * t + 0.3)], axis=1)
    effort = np.stack([3 * np.sign(np.cos(w * t)), np.cos(w * t)], axis=1)
    log = made_log(q, effort + rng.normal(0, 0.2, q.shape), RATE)
    ready = prepare(log, Settings(1 / RATE, 20.0, "test"))
    cycle = period(ready)
    assert cycle == pytest.approx(1.37, abs=1e-3)
    assert cycle is not None
    expected = 0.2 * ready.settings.lowpass.noise_gain
    assert cycle_noise(ready, cycle) == pytest.approx([expected, expected], rel=0.2)
    wide = np.full(2, np.inf)
    loaded = prepare_logs([log], Expected("made", ("a", "b"), -wide, wide, wide, wide), cutoff=20.0)
    assert loaded.prepared[0].noise_basis == "repeats"
    assert split(loaded.prepared).warning.startswith("the log repeats one motion every 1.37 s")
    chirp = np.stack([np.sin(2 * np.pi * (0.3 + 0.05 * t) * t)] * 2, axis=1)
    assert period(prepare(made_log(chirp, chirp, RATE), ready.settings)) is None


def test_noise_from_repeated_logs() -> None:
    settings = Settings(1 / RATE, 20.0, "test")
    first, second = (prepare(made_log(*noisy(seed=s)[1::3], RATE), settings) for s in (1, 2))
    expected = 0.5 * settings.lowpass.noise_gain
    assert repeat_noise(first, second) == pytest.approx([expected, expected], rel=0.2)
    other = prepare(made_log(first.q[::-1].copy(), first.effort, RATE), settings)
    assert repeat_noise(first, other) is None


def test_parts_are_further_apart_than_the_filter_sees() -> None:
    _, q, _, _, effort = noisy(10_000)
    ready = prepare(made_log(q, effort, RATE), Settings(1 / RATE, 10.0, "test"))
    parts = split([ready])
    kind = parts.part[0]
    for one, other in ((TRAIN, VALIDATION), (TRAIN, TEST), (VALIDATION, TEST)):
        a, b = np.flatnonzero(kind == one), np.flatnonzero(kind == other)
        nearest = np.abs(a - b[np.clip(np.searchsorted(b, a), 0, b.size - 1)]).min()
        before = np.abs(a - b[np.clip(np.searchsorted(b, a) - 1, 0, b.size - 1)]).min()
        assert min(nearest, before) / RATE > 2 * ready.memory
    shares = [(parts.part[0] == k).mean() for k in (TRAIN, VALIDATION, TEST)]
    assert shares[0] > 0.3
    assert min(shares) > 0.1
    assert np.unique(parts.block[0][parts.part[0] == TRAIN]).size >= 3
    # An input changed in one part leaves the filtered values of the others untouched.
    changed = effort.copy()
    changed[(parts.part[0] == TEST)] += 100.0
    again = prepare(made_log(q, changed, RATE), ready.settings)
    others = (parts.part[0] == TRAIN) | (parts.part[0] == VALIDATION)
    assert np.abs(again.effort - ready.effort)[others].max() < 1e-9


def test_the_last_share_proves() -> None:
    _, q, _, _, effort = noisy(10_000)
    ready = prepare(made_log(q, effort, RATE), Settings(1 / RATE, 20.0, "test"))
    parts = split([ready], prove_last=0.4)
    assert (parts.part[0] == TEST)[6000:].all()
    assert not (parts.part[0] == TEST)[:6000].any()
    assert (parts.part[0] == TRAIN).any()


def test_whole_logs_are_held_out_by_condition() -> None:
    settings = Settings(1 / RATE, 20.0, "test")
    logs = []
    for k, gain in enumerate((100, 100, 200, 200, 800, 800)):
        _, q, _, _, effort = noisy(seed=k)
        logs.append(prepare(made_log(q, effort, RATE, condition={"gain": gain}), settings))
    parts = split(logs)
    assert "gain = 200" in parts.rule
    proving = [bool((parts.part[k] == TEST).any()) for k in range(6)]
    assert proving == [False, False, True, True, False, False]
    assert all(not (parts.part[k] == TRAIN).any() for k in (2, 3))
    explicit = split(logs[:2], holdout=logs[2:3])
    assert (explicit.part[2] == TEST).all()


def test_what_cannot_be_prepared_is_refused(hexapod: Robot) -> None:
    _, q, _, _, effort = noisy()
    bare = replace(hexapod, spec=hexapod.spec.with_gait(sets=[]))
    short = prepare(made_log(q[:400], effort[:400], RATE), Settings(1 / RATE, 1.5, "test"))
    for refused, words in (
        (lambda: choose_settings([made_log(q[:100], effort[:100], RATE)]), "too short"),
        (lambda: choose_settings([made_log(q, effort, RATE)], cutoff=300.0), "cut-off 300 Hz"),
        (lambda: split([short]), "log longer"),
        (lambda: scheduled_contact(bare, np.zeros(1), start=0.0), "has no gait"),
    ):
        with pytest.raises(LegwattError, match=words):
            refused()


def test_contact_from_forces_columns_schedule_and_lowest_feet(hexapod: Robot, walk: Motion) -> None:
    segments = walk.segments
    q = np.concatenate([hexapod.leg_positions(s.configuration) for s in segments])
    flat = q.reshape(len(q), -1)
    time = np.arange(len(q)) * (walk.period or 3.0) / len(q)
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
    seen = lowest_feet(hexapod, flat, None, None)
    assert np.array_equal(seen.standing[inside], truth[inside])
    planned = scheduled_contact(hexapod, time, start=0.0)
    assert np.array_equal(planned.standing[inside], truth[inside])
    force = np.zeros((len(q), 6, 3))
    force[..., 2] = 60.0 * truth + np.random.default_rng(0).normal(0, 0.3, truth.shape)
    expected = expected_of_robot(hexapod)
    log = made_log(flat[:, :2], flat[:, :2], feet=expected.feet, foot_force=force)
    found = log_contact(log)
    assert found is not None
    assert found.source == "forces"
    assert np.array_equal(found.standing, truth)


@pytest.mark.parametrize("name", ["ripple", "tetrapod", "wave"])
def test_the_schedule_of_any_gait_tells_contact(hexapod: Robot, name: str) -> None:
    robot = load_robot(hexapod.spec.with_gait(name=name))
    motion = walking_motion(robot, samples=51)
    for segment in motion.segments:
        inside = segment.time[1:-1] + 7.0  # the log's clock began before the period
        planned = scheduled_contact(robot, inside, start=7.0 - 2 * 3.0)
        for foot, stands in zip(planned.feet, planned.standing.T, strict=True):
            assert np.all(stands == (foot in segment.stance))
