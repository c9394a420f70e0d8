"""What is said of a log before naming: rows that are missing, friction that drifts."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipeline.identification.model_check import drifts, rows_left
from pipeline.logs.log import Log
from pipeline.logs.reduce import DRIVE_OFF, INSTEAD, NO_EFFORT


@pytest.mark.parametrize(("end", "told"), [(1.0, ""), (0.95, ""), (0.6, "falls"), (1.5, "rises")])
def test_friction_that_drifts_is_told(end: float, told: str) -> None:
    """A tenth of the level is a drift; beside wrong inertia, gravity and an offset."""
    t, rng = np.arange(0.0, 120.0, 0.02), np.random.default_rng(2)
    q = 0.8 * np.sin(2.1 * t) + 0.3 * np.sin(0.7 * t)
    v, a = np.gradient(q, t), np.gradient(np.gradient(q, t), t)
    level = 1.0 + (end - 1.0) * t / t[-1]
    simulated = 2.0 * np.sin(q)
    y = 1.1 * simulated + 0.2 * a + 0.3 + level * np.sign(v) + 0.1 * rng.standard_normal(t.size)
    log: Any = SimpleNamespace(
        name="log", time=t, joints=("knee",), channels=("torque",), q=q[:, None], v=v[:, None],
        a=a[:, None], effort=y[:, None, None], mask=np.ones((t.size, 1), dtype=bool),
        lowpass=lambda x: x,
    )  # fmt: skip
    prediction: Any = SimpleNamespace(effort=simulated[:, None, None], rest=None)
    found = drifts([log], [prediction])
    assert [f.detail.split()[1] for f in found] == [told] * bool(told)
    if told:
        assert found[0].value == pytest.approx(end - 1.0, abs=0.1)


def measured(mask: np.ndarray) -> Log:
    n, joints = mask.shape
    zero, one = np.zeros((n, joints)), np.ones(joints)
    return Log(
        "made", np.arange(n) / 100, tuple("ab"[:joints]), zero, zero, zero, ("torque",),
        zero[..., None], one[:, None], mask, np.zeros(n, np.int8), np.zeros(n, np.intp),
        (slice(0, n),), removed=((DRIVE_OFF, 0.7 * one), (NO_EFFORT, 0.3 * one)),
    )  # fmt: skip


def test_a_joint_without_rows_is_left_out_and_a_log_without_is_refused() -> None:
    mask = np.zeros((400, 2), dtype=np.bool_)
    mask[:100, 0] = True
    whole, joint = rows_left(measured(mask))
    assert (whole.verdict, joint.column, joint.verdict) == ("ok", "b__torque_Nm", "warning")
    assert "70 % the drive is off" in whole.detail
    (seen,) = rows_left(measured(np.zeros((400, 2), dtype=np.bool_)))
    assert seen.verdict == "refused"
    assert seen.detail == f"near zero rows left (0 of 800); 70 % {DRIVE_OFF}: {INSTEAD[DRIVE_OFF]}"
