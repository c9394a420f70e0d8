"""Rows that are compared, what removed the others, and a log that keeps near zero of them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from pipeline.identification.compare.model_check import rows_left
from pipeline.identification.workflow.outcome import Outcome
from pipeline.logs.log import TEST, TRAIN, Log
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


def outcome(speed: list[float]) -> Any:
    """One joint over six samples, of which the first and the last two are held out."""
    part = np.array([TEST, TRAIN, TRAIN, TRAIN, TEST, TEST])
    log = SimpleNamespace(
        name="log",
        joints=("knee",),
        time=0.5 * np.arange(6),
        part=part,
        v=np.array(speed)[:, None],
        mask=np.ones((6, 1), dtype=bool),
    )
    compared = SimpleNamespace(logs=(log,))
    return SimpleNamespace(compared=compared, validated=SimpleNamespace(joints=(0, 0)))


def test_a_joint_that_turns_one_way_where_it_is_held_out_is_named_once() -> None:
    one_way = Outcome.one_way.fget  # type: ignore[attr-defined]
    assert one_way(outcome([1.0, -1.0, -1.0, -1.0, 1.0, 1.0])) == [("knee", "positive")]
    assert one_way(outcome([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])) == [("knee", "negative")]
    assert one_way(outcome([1.0, 1.0, 1.0, 1.0, -1.0, 1.0])) == []
