"""What an outcome says of held-out rows."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from pipeline.identification.workflow.outcome import Outcome
from pipeline.logs.prepared.measurement import TEST, TRAIN


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
    compared = SimpleNamespace(measurements=(log,))
    return SimpleNamespace(compared=compared, validated=SimpleNamespace(joints=(0, 0)))


def test_a_joint_that_turns_one_way_where_it_is_held_out_is_named_once() -> None:
    one_way = Outcome.one_way.fget  # type: ignore[attr-defined]
    assert one_way(outcome([1.0, -1.0, -1.0, -1.0, 1.0, 1.0])) == [("knee", "positive")]
    assert one_way(outcome([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])) == [("knee", "negative")]
    assert one_way(outcome([1.0, 1.0, 1.0, 1.0, -1.0, 1.0])) == []
