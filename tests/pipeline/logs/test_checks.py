"""Checks of one channel against another: each a log with exactly that fault, and a clean one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.identification.compare.model_check import Course, friction_drift
from pipeline.logs.errors import Finding
from pipeline.logs.log_format import Expected
from pipeline.logs.quality.checks import cannot_tell
from pipeline.logs.quality.quality import judge
from pipeline.logs.reading.log import Log
from tests.pipeline.logs.made import made_log, motion

Array = NDArray[np.float64]
WEIGHT = 400.0


def found(log: Log, expected: Expected, check: str) -> list[Finding]:
    return [f for f in judge(log, expected).findings if f.check == check]


def standing(scale: Array) -> Log:
    rng = np.random.default_rng(1)
    _, q, _, a = motion(3000)
    force = np.zeros((q.shape[0], 2, 3))
    share = 0.5 + 0.4 * np.sin(np.arange(q.shape[0]) / 300)
    force[:, 0, 2], force[:, 1, 2] = WEIGHT * share, WEIGHT * (1 - share)
    force = force * scale[None, :, None] + rng.normal(0, 1.0, force.shape)
    effort = 0.1 * a + 5 * np.sin(q) + rng.normal(0, 0.05, q.shape)
    return made_log(q, effort, feet=("lf", "rf"), foot_force=force)


@pytest.mark.parametrize(
    ("scale", "verdict", "words"),
    [
        ((1.0, 1.0), "ok", "carry"),
        ((1e-3, 1e-3), "warning", "wrong unit|never carry"),
        ((-1.0, -1.0), "warning", "sign is turned"),
        ((1.0, 0.0), "warning", "rf never carries"),
        ((1.3, 1.3), "warning", "a load that the model lacks"),
    ],
)
def test_feet_have_to_carry_the_weight(
    two_joints: Expected, scale: tuple[float, float], verdict: str, words: str
) -> None:
    robot = replace(two_joints, weight=WEIGHT, feet=("lf", "rf"))
    (seen,) = found(standing(np.array(scale)), robot, "feet_carry")
    assert seen.verdict == verdict
    assert any(word in seen.detail for word in words.split("|"))


@pytest.mark.parametrize("late", [0, 8])
def test_a_torque_that_is_late_on_its_current_is_told(two_joints: Expected, late: int) -> None:
    rng = np.random.default_rng(2)
    _, q, _, a = motion(4000)
    current = 0.1 * a + 5 * np.sin(q)
    torque = 2.0 * np.roll(current, late, axis=0)
    log = made_log(
        q,
        torque + rng.normal(0, 0.02, q.shape),
        current=current + rng.normal(0, 0.02, q.shape),
    )
    seen = found(log, two_joints, "late")
    assert len(seen) == 2
    assert {f.verdict for f in seen} == ({"warning"} if late else {"ok"})
    if late:
        assert seen[0].value == pytest.approx(late / 500, rel=0.05)
        assert "16 ms behind the current of the same motor" in seen[0].detail


def course(level: Array, n: int, seed: int, wrong: float = 0.0) -> Course:
    """A joint whose friction has a level (N,), and whose body is wrong by a share."""
    rng = np.random.default_rng(seed)
    t, q, v, a = (x[:, 0] if x.ndim > 1 else x for x in motion(n))
    simulated = 0.3 * a + 5 * np.sin(q)
    rest = level * np.sign(v) + wrong * simulated + rng.normal(0, 0.1, n)
    return Course(t, rest, simulated, q, v, a)


def test_friction_that_falls_from_run_to_run_is_told_with_its_change() -> None:
    runs = [course(np.full(4000, 2.0 - 0.3 * k), 4000, k, wrong=0.2) for k in range(4)]
    drift = friction_drift(runs)
    assert drift is not None
    assert drift.seen
    assert drift.last - drift.first == pytest.approx(-1.2, rel=0.15)
    stays = friction_drift([course(np.full(4000, 2.0), 4000, k, wrong=0.3) for k in range(4)])
    assert stays is not None
    assert not stays.seen


def test_friction_that_falls_within_one_long_log_is_told_and_a_short_log_is_silent() -> None:
    long = course(np.linspace(2.0, 1.2, 40_000), 40_000, 1)
    drift = friction_drift([long])
    assert drift is not None
    assert drift.seen
    assert friction_drift([course(np.linspace(2.0, 1.2, 4000), 4000, 1)]) is None


def test_what_a_log_cannot_tell_names_what_is_needed() -> None:
    _, q, v, a = motion(4000)
    effort = 0.1 * a + 5 * np.sin(q)
    ok = np.ones(q.shape, dtype=np.bool_)

    def told(v: Array) -> str:
        return " ".join(f.detail for f in cannot_tell(made_log(q, effort), v, effort, ok))

    for words in ("motors' positions", "both torque and current", "without a temperature"):
        assert words in told(v)
    assert "both ways" not in told(v)
    assert "both ways" in told(np.abs(v) + 0.3)
