"""Torque from targets and gains: by the law, marked, and refused where it cannot be."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.logs.log_format import Expected
from pipeline.logs.quality.quality import judge
from pipeline.logs.reading.log import Log
from tests.pipeline.logs.test_read import one_line

Array = NDArray[np.float64]
Columns = dict[str, Array]
Read = Callable[..., Log]
#: Stiffness [N*m/rad] and damping [N*m*s/rad] of a and b.
KP, KD = np.array([40.0, 60.0]), np.array([0.5, 0.8])
GAINS = "[pd_gains]\nkp = {a = 40.0, b = 60.0}\nkd = {a = 0.5, b = 0.8}\n"


@pytest.fixture
def targets(columns: Columns) -> Columns:
    """The log without its torque, with targets that ask for just this torque."""
    out = {k: v for k, v in columns.items() if "torque" not in k}
    for j, joint in enumerate("ab"):
        q, v = columns[f"{joint}__position_rad"], columns[f"{joint}__velocity_rad_s"]
        out[f"{joint}__goal_position_rad"] = (
            q + (columns[f"{joint}__torque_Nm"] + KD[j] * v) / KP[j]
        )
    return out


def test_the_law_gives_back_the_torque_that_was_asked_for(
    targets: Columns, columns: Columns, read: Read, two_joints: Expected
) -> None:
    log = read(targets, GAINS)
    assert log.torque is not None
    for j, joint in enumerate("ab"):
        assert np.allclose(log.torque[:, j], columns[f"{joint}__torque_Nm"], atol=1e-9)
    assert log.derived == {"torque": "kp (goal - position) + kd (0 - velocity)"}
    found = [f for f in judge(log, two_joints).findings if f.verdict == "warning"]
    assert any("not measured" in f.detail for f in found)


def test_feed_forward_goal_velocity_and_limit(targets: Columns, read: Read) -> None:
    plain = read(targets, GAINS).torque
    more: dict[str, Any] = dict(targets)
    for joint in "ab":
        more[f"{joint}__goal_velocity_rad_s"] = np.full(2000, 2.0)
        more[f"{joint}__goal_torque_Nm"] = np.full(2000, 3.0)
    told = read(more, GAINS + "limit = 50.0\n")
    assert plain is not None
    assert told.torque is not None
    assert np.allclose(told.torque, np.clip(plain + 2.0 * KD + 3.0, -50.0, 50.0))
    assert "clipped" in told.derived["torque"]


def test_without_a_measured_velocity_the_position_tells_it(targets: Columns, read: Read) -> None:
    measured = read(targets, GAINS).torque
    own = read({k: v for k, v in targets.items() if "velocity" not in k}, GAINS)
    assert own.torque is not None
    assert measured is not None
    # Encoder noise of 1e-5 rad at 500 Hz, through kd.
    assert np.std(own.torque - measured) < 3.0 * KD.max() * 1e-5 * 500.0
    assert "derivative of position" in own.derived["torque"]


def test_a_measured_effort_outranks_the_law(columns: Columns, targets: Columns, read: Read) -> None:
    both = targets | {f"{j}__current_A": columns[f"{j}__torque_Nm"] / 10.0 for j in "ab"}
    assert read(both, GAINS).effort.channel == "current"
    assert read(both, 'effort = "torque"\n' + GAINS).effort.channel == "torque"
    assert read(targets | columns, GAINS).derived == {}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "[pd_gains]"),
        ("[pd_gains]\nkp = {a = 1.0}", "'b'"),
        ("[pd_gains]\nkp = {a = 1.0, b = 1.0, c = 1.0}", "'c'"),
        ("[pd_gains]\nkp = -1.0", "pd_gains.kp"),
        ("[pd_gains]\nkp = {a = nan, b = 1.0}", "finite"),
        ("[pd_gains]\nkd = 1.0", "pd_gains"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    text: str, words: str, targets: Columns, read: Read
) -> None:
    one_line(lambda: read(targets, text), (words,))
