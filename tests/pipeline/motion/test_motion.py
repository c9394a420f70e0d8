"""A motion refuses what no later stage could compute with."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.errors import LegwattError
from pipeline.motion.motion import Motion, Segment


def segment(time: np.ndarray, velocity: np.ndarray | None = None) -> Segment:
    still = np.zeros((time.size, 6))
    configuration = np.zeros((time.size, 7))
    return Segment("s", time, configuration, still if velocity is None else velocity, still, ())


NAN = np.zeros((4, 6))
NAN[2, 5] = np.nan


@pytest.mark.parametrize(
    ("time", "velocity", "message"),
    [
        ([], None, "'s' has no samples; at least 1"),
        ([0.0, 1.0, 1.0, 2.0], None, "sample 2: time does not increase"),
        ([0.0, 1.0, 2.0, np.inf], None, "sample 3: time is not finite"),
        ([0.0, 1.0, 2.0, 3.0], np.zeros((3, 6)), "velocity has 3 samples, time has 4"),
        ([0.0, 1.0, 2.0, 3.0], NAN, "sample 2: velocity is not finite"),
    ],
)
def test_unusable_segment(time: list[float], velocity: np.ndarray | None, message: str) -> None:
    with pytest.raises(LegwattError, match=message):
        segment(np.array(time), velocity)


def test_one_sample_is_a_segment_and_none_is_no_motion() -> None:
    assert Motion((segment(np.arange(4.0)), segment(np.zeros(1)))).samples == 5
    with pytest.raises(LegwattError, match="no segments; at least 1"):
        Motion(())
