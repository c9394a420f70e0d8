"""The judgement on a log: each defect is put in and must be found, and only it."""

import re
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from actuators.errors import LegwattError
from pipeline.logs.checks import glitches, judge, quantum, refuse_repeats
from pipeline.logs.log import Expected, Finding, Recording, refuse
from tests.pipeline.logs.made import made_log, motion

Array = NDArray[np.float64]


def good(n: int = 4000, seed: int = 3) -> tuple[Array, Array, Array]:
    """Position, velocity and torque with a little noise."""
    _, q, v, a = motion(n)
    rng = np.random.default_rng(seed)
    return (
        q + rng.normal(0, 1e-5, q.shape),
        v + rng.normal(0, 1e-3, q.shape),
        0.1 * a + 5 * np.sin(q) + rng.normal(0, 0.05, q.shape),
    )


def checks(quality: tuple[list[Finding], Recording], verdict: str) -> set[tuple[str, str]]:
    return {(f.column, f.check) for f in quality[0] if f.verdict == verdict}


def test_a_good_log_has_nothing_against_it(two_joints):
    q, v, e = good()
    quality = judge(made_log(q, e, velocity=v), two_joints)
    refuse(quality[0])
    assert {f.verdict for f in quality[0]} == {"ok"}
    assert np.isfinite(quality[1].position).all()
    assert np.isfinite(quality[1].efforts).all()


def only(q: Array, joint: int, factor: float) -> Array:
    return np.where(np.arange(2) == joint, factor, 1.0) * q


DEG = 180 / np.pi
ODD: dict[str, tuple[Callable[[Array, Array], Recording], str, str]] = {
    "ten rows": (lambda q, e: made_log(q[:10], e[:10]), "refused", "10 rows"),
    "no position": (lambda q, e: made_log(q * np.nan, e), "refused", "a__position_rad.*no number"),
    "no effort": (lambda q, e: made_log(q, 0 * e + 1.5), "refused", "that moves has a live torque"),
    "nothing moves": (lambda q, e: made_log(0 * q, 0 * e), "refused", "no joint moves"),
    "degrees": (lambda q, e: made_log(only(q, 0, DEG), e), "suspected", "a__position.*degrees"),
    "and of b": (lambda q, e: made_log(only(q, 1, DEG), e), "suspected", "b__position.*degrees"),
    "mN*m": (lambda q, e: made_log(q, 1e3 * e), "suspected", "a__torque_Nm.*another unit"),
    "another robot": (lambda q, e: made_log(q + 300.0, e), "suspected", "another robot"),
}


@pytest.mark.parametrize("name", ODD)
def test_what_cannot_be_used_is_refused_and_a_wrong_unit_is_suspected(two_joints, name):
    make, verdict, says = ODD[name]
    q, _, e = good()
    found, _ = judge(make(q, e), two_joints)
    said = [f"{f.column}: {f.detail}" for f in found if f.verdict == verdict]
    assert re.search(says, "; ".join(said))
    if verdict == "refused":
        with pytest.raises(LegwattError, match=re.escape(found[-1].log)) as error:
            refuse(found)
        assert "\n" not in str(error.value)
    else:
        refuse(found)


def uneven(q: Array, e: Array, share: float) -> Recording:
    steps = (1.0 + share * (-1.0) ** np.arange(len(q))) / 500.0
    return made_log(q, e, time=np.cumsum(steps))


def stepped(q: Array, e: Array, values: float) -> Recording:
    e[:, 0] = np.arange(len(q)) % int(values)
    return made_log(q, e)


def outside(q: Array, e: Array, end: float) -> Recording:
    """Joint a's positions up to an end."""
    q[:, 0] += end - q[:, 0].max()
    return made_log(q, e)


#: Two numbers on either side of a threshold, and what is said of joint a or of the log.
EDGES: dict[str, tuple[Callable[[Array, Array, float], Recording], list[tuple[float, str]]]] = {
    "rows": (lambda q, e, n: made_log(q[: int(n)], e[: int(n)]), [(99, "refused"), (100, "ok")]),
    "rate": (lambda q, e, x: made_log(q, e, rate=x), [(4.9, "refused"), (5.1, "ok")]),
    "jitter": (uneven, [(0.047, ""), (0.053, "warning")]),
    "constant": (stepped, [(3, "warning"), (4, "")]),
    "magnitude": (
        lambda q, e, x: made_log(q, e * (x / np.quantile(np.abs(e[:, 0]), 0.99))),
        [(249.0, ""), (251.0, "suspected")],
    ),
    # A twentieth of the range of 4 rad beyond it; most rows four turns away from it.
    "share_outside_limits": (
        outside,
        [(2.19, ""), (2.21, "warning"), (-27.0, "warning"), (-27.2, "suspected")],
    ),
}


@pytest.mark.parametrize("check", EDGES)
def test_each_threshold_has_two_sides(two_joints, check):
    make, sides = EDGES[check]
    for number, verdict in sides:
        q, _, e = good()
        found, _ = judge(make(q, e, number), two_joints)
        said = {f.verdict for f in found if f.check == check and not f.column.startswith("b__")}
        assert said == ({verdict} if verdict else set()), number


@pytest.mark.parametrize(("shared", "same"), [(60, False), (100, True)])
def test_logs_that_share_a_fiftieth_are_the_same(shared, same):
    logs = []
    for seed in (1, 2):
        q, _, e = good(4000, seed)
        q[-400:], e[-400:] = 0.1, 0.2  # both end at rest
        q[:shared], e[:shared] = (x[:shared] for x in good(4000, 3)[::2])
        logs.append(made_log(q, e))
    with pytest.raises(LegwattError, match="the same measurements") if same else nullcontext():
        refuse_repeats(logs)


SILENT = [
    (lambda q, e: e[:, :1].fill(1.5), "a__torque_Nm", "constant", 0.0),
    (lambda q, e: e[:, :1].fill(np.nan), "a__torque_Nm", "constant", 0.0),
    (lambda q, e: np.rint(np.tanh(e[:, 0]), out=e[:, 0]), "a__torque_Nm", "constant", 0.0),
    (lambda q, e: e[500:900, :1].fill(1.5), "a__torque_Nm", "frozen", 0.9),
    (lambda q, e: q[:, :1].fill(0.3), "a__position_rad", "still", 1.0),
]


@pytest.mark.parametrize(("spoil", "column", "check", "left"), SILENT)
def test_a_silent_joint_is_left_out_with_one_sentence_and_the_others_stay(
    two_joints, spoil, column, check, left
):
    q, _, e = good()
    spoil(q, e)
    quality = judge(made_log(q, e), two_joints)
    refuse(quality[0])
    assert checks(quality, "warning") == {(column, check)}
    assert np.isfinite(quality[1].efforts[:, 0]).mean() == pytest.approx(left, abs=0.02)
    assert np.isfinite(quality[1].efforts[:, 1]).all()


@pytest.mark.parametrize("factor", [2, 5])
def test_sample_and_hold_is_found_and_bridged(two_joints, factor):
    q, _, e = good()
    index = np.arange(len(q)) // factor * factor
    quality = judge(made_log(q[index], e), two_joints)
    assert ("a__position_rad", "held") in checks(quality, "masked")
    share = next(f.value for f in quality[0] if f.check == "held")
    assert share == pytest.approx(1 - 1 / factor, rel=0.2)  # at turning points none is seen
    assert np.isnan(quality[1].position).any()
    assert ("a__torque_Nm", "held") not in checks(quality, "masked")


def test_saturation_is_masked(two_joints):
    q, _, e = good()
    clipped = np.clip(e, -4.0, 4.0)
    quality = judge(made_log(q, clipped), two_joints)
    assert ("a__torque_Nm", "saturated") in checks(quality, "masked")
    assert np.isnan(quality[1].efforts[np.abs(clipped) == 4.0]).all()
    assert np.isfinite(quality[1].efforts[np.abs(clipped) < 4.0]).all()


@pytest.mark.parametrize(("at", "length"), [(0, 1), (1, 1), (3999, 1), (700, 1), (700, 4)])
def test_samples_that_jump_away_and_back_are_left_out(two_joints, at, length):
    q, _, e = good()
    rows = slice(at, at + length)
    q[rows, 0] = 500.0
    quality = judge(made_log(q, e), two_joints)
    assert checks(quality, "warning") == {("a__position_rad", "glitches")}
    bad = np.zeros(len(q), dtype=np.bool_)
    bad[rows] = True
    assert np.array_equal(np.isnan(quality[1].position[:, 0]), bad)
    assert np.isfinite(quality[1].position[:, 1]).all()


def test_a_jump_at_rest_is_judged_by_the_pace_about_it():
    x = np.append(np.arange(400.0), np.full(400, 400.0))
    x[480] += 8.0  # within twelve times the pace of the fast part
    assert np.flatnonzero(glitches(x, np.ones(800, np.bool_), 0.0)).tolist() == [480]


def test_an_interpolated_channel_rests_on_the_values_of_its_sensor():
    """As many of its rows as lie between two equal samples."""
    rng, step, t = np.random.default_rng(1), 1e-3, np.arange(2000) / 100
    sensor = np.rint(0.2 * np.sin(0.5 * t) / step) * step
    later = np.interp(np.sort(rng.uniform(0.0, t[-1], 4000)), t, sensor)
    assert np.unique(later).size > 2000
    assert quantum(later) == pytest.approx(step)


WEIGHT = 400.0


def found(log: Recording, expected: Expected, check: str) -> list[Finding]:
    return [f for f in judge(log, expected)[0] if f.check == check]


def standing(scale: Array) -> Recording:
    rng = np.random.default_rng(1)
    _, q, _, a = motion(3000)
    force = np.zeros((q.shape[0], 2, 3))
    share = 0.5 + 0.4 * np.sin(np.arange(q.shape[0]) / 300)
    force[:, 0, 2], force[:, 1, 2] = WEIGHT * share, WEIGHT * (1 - share)
    force = force * scale[None, :, None] + rng.normal(0, 1.0, force.shape)
    effort = 0.1 * a + 5 * np.sin(q) + rng.normal(0, 0.05, q.shape)
    return made_log(q, effort, feet=("lf", "rf"), force=force)


@pytest.mark.parametrize(
    ("scale", "verdict", "words"),
    [
        ((1.0, 1.0), "ok", "carry"),
        ((1.09, 1.09), "ok", "carry"),
        ((1.11, 1.11), "warning", "a load that the model lacks"),
        ((0.102, 0.102), "warning", "are no newtons"),
        ((1.0, 60.0), "warning", "are no newtons"),
        ((-1.0, -1.0), "warning", "sign is turned"),
        ((1.0, 0.0), "warning", "a foot that tells nothing"),
        ((1.3, 1.3), "warning", "a load that the model lacks"),
    ],
)
def test_feet_have_to_carry_the_weight(two_joints, scale, verdict, words):
    robot = replace(two_joints, weight=WEIGHT, feet=("lf", "rf"))
    (seen,) = found(standing(np.array(scale)), robot, "feet_carry")
    assert seen.verdict == verdict
    assert words in seen.detail
