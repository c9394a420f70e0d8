"""What `gap` says is left: noise only where no joint leaves more."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from pipeline.identification.results import Residual
from reports.page import plain
from reports.pages.gap_answer import answer


def said(left: Residual) -> str:
    """The answer of a machine of two joints of which nothing was found."""
    whole = {"by": "joint", "joint": "a", "gap": 2.0, "unit": "N*m", "share_of_total": 0.9}
    effect = ["effect", "place", "joint"]
    outcome: Any = SimpleNamespace(
        gaps=(2.0, 0.3),
        noise=0.25,
        suspected=(),
        energy=None,
        unit="N*m",
        held=SimpleNamespace(left=(left,)),
        given=SimpleNamespace(alternative="", model=SimpleNamespace(joints=("a", "b"))),
        compared=SimpleNamespace(logs=(SimpleNamespace(channels=("torque",), recording=None),)),
    )
    tables = {
        "found": pd.DataFrame(columns=[*effect, "parameter", "value", "level", "written"]),
        "candidates": pd.DataFrame(columns=["effect", "place", "verdict"], dtype=str),
        "where": pd.DataFrame([whole]),
    }
    lines = [plain(line) for line in answer(outcome, tables)]
    assert len(lines) <= 10
    return " ".join(lines)


@pytest.mark.parametrize("significant", [True, False])
def test_noise_is_said_only_where_no_joint_leaves_more(significant: bool) -> None:
    told = said(Residual("a", "torque", 0.9, 0.3, "N*m", significant, "falls in time"))
    assert ("is noise: at most 3 times its floor, at a" in told) != significant
    assert ("a 0.9 N·m, 3 times its floor, falls in time" in told) == significant
