"""The map of two candidates passes through the paper's break-even."""

from __future__ import annotations

import pytest

import pipeline as lw
from actuators.errors import CatalogError
from pipeline.choice.answer.break_even import rows
from pipeline.choice.errors import ChoiceError
from pipeline.paper.omissions.omissions import idle_break_even
from pipeline.paper.published import PAIR


def test_map_passes_through_the_papers_94_percent() -> None:
    """Both middle legs, one of them loaded; idle power by the closed form of the omissions."""
    machine = lw.load("urdf/hexapod.toml")
    map_ = list(rows(machine, PAIR, idle=0.672, joints="?m_joint_*", samples=751))
    speed = max(row.speed_m_s for row in map_)
    even = {row.idle_W: row.break_even for row in map_ if row.speed_m_s == speed}
    standing = {row.idle_W: row.first_W for row in map_ if row.standing_share == 1.0}
    assert even[0.0] == pytest.approx(0.94, abs=0.002)
    for idle, printed in ((0.672, 0.735), (2.0, 0.513)):
        assert even[idle] == pytest.approx(printed, abs=0.002)
        closed = idle_break_even(even[0.0], standing[0.0], 6 * idle)
        assert even[idle] == pytest.approx(closed, rel=1e-9)
    for row in map_:
        if row.break_even and abs(row.standing_share - row.break_even) > 1e-9:
            assert row.better == PAIR[row.standing_share > row.break_even]


def test_unknown_candidate_or_joint_is_one_line() -> None:
    machine = lw.load("urdf/hexapod.toml")
    with pytest.raises(CatalogError, match="reversible"):
        list(rows(machine, ("reversibel", "ideal"), idle=0.0, samples=51))
    with pytest.raises(ChoiceError, match="no such joint"):
        list(rows(machine, PAIR, idle=0.0, joints="knee", samples=51))
