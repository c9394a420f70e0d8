"""What is said of a log before naming: rows that are missing."""

from __future__ import annotations

import numpy as np

from pipeline.identification.model_check import rows_left
from pipeline.logs.log import Log
from pipeline.logs.reduce import DRIVE_OFF, INSTEAD, NO_EFFORT


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
