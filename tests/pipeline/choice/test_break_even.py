"""The map of two candidates passes through the paper's break-even."""

from __future__ import annotations

import pytest

import pipeline as lw
from actuators.errors import CatalogError
from pipeline.choice.answer.break_even import cost, rows
from pipeline.choice.errors import ChoiceError
from pipeline.choice.loads import loads_of
from pipeline.choice.missions.mission import Mode
from pipeline.paper.omissions import idle_break_even
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


def test_the_papers_alternatives_have_its_numbers() -> None:
    """Leg rm in 3 s of standing, section IV.B; walking over the ideal actuator's, section V."""
    machine = lw.load("urdf/hexapod.toml")
    stand = Mode("stand", 1.0, True, None, {}, "motor", True, "standing")
    walk = Mode("walk", 1.0, False, None, {}, "motor", True, "walking")
    still, walked = loads_of(machine, [stand, walk], samples=751)
    leg = [k for k, joint in enumerate(still.series.joints) if joint.startswith("rm_")]
    ideal = cost(machine, "ideal", walked, leg, None).power
    printed = {
        "ideal": (6.14, 1.0, 1e-9),
        "rotor": (5.565, 4.0, 0.5),
        "reversible": (2.60, 10.5, 0.5),
        "irreversible": (0.0, 14.75, 0.25),
    }
    for name, (energy, ratio, half) in printed.items():
        assert 3.0 * cost(machine, name, still, leg, None).power == pytest.approx(energy, abs=0.005)
        assert cost(machine, name, walked, leg, None).power / ideal == pytest.approx(
            ratio, abs=half
        )


def test_unknown_candidate_or_joint_is_one_line() -> None:
    machine = lw.load("urdf/hexapod.toml")
    with pytest.raises(CatalogError, match="reversible"):
        list(rows(machine, ("reversibel", "ideal"), idle=0.0, samples=51))
    with pytest.raises(ChoiceError, match="no such joint"):
        list(rows(machine, PAIR, idle=0.0, joints="knee", samples=51))
