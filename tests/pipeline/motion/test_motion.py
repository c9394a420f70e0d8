"""A motion refuses what no later stage could compute with."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.errors import InvalidMotionError
from pipeline.motion.motion import Motion, Segment

N = 4


def segment(**changes: object) -> Segment:
    good: dict[str, object] = {
        "name": "s",
        "time": np.arange(float(N)),
        "configuration": np.zeros((N, 7)),
        "velocity": np.zeros((N, 6)),
        "acceleration": np.zeros((N, 6)),
        "stance": (),
    }
    return Segment(**(good | changes))  # type: ignore[arg-type]


def with_nan(row: int, column: int) -> np.ndarray:
    values = np.zeros((N, 6))
    values[row, column] = np.nan
    return values


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time": np.zeros(0)}, "'s' has no samples; at least 1"),
        ({"time": np.array([0.0, 1.0, 1.0, 2.0])}, "sample 2: time does not increase"),
        ({"time": np.array([0.0, 1.0, 2.0, np.inf])}, "sample 3: time is not finite"),
        ({"velocity": np.zeros((3, 6))}, "velocity has 3 samples, time has 4"),
        ({"velocity": with_nan(2, 5)}, "sample 2: velocity is not finite"),
    ],
)
def test_unusable_segment(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidMotionError, match=message):
        segment(**changes)


def test_one_sample_is_a_segment_and_samples_are_counted() -> None:
    one = {
        name: np.zeros((1, n))
        for name, n in (("configuration", 7), ("velocity", 6), ("acceleration", 6))
    }
    assert Motion((segment(), segment(time=np.zeros(1), **one))).samples == N + 1
    with pytest.raises(InvalidMotionError, match="no segments; at least 1"):
        Motion(())
