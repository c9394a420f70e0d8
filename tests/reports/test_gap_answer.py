"""What `gap` says of its tables: common laws first, classes, what has no name, ten sentences."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from pipeline.identification.results import Residual
from reports.page import plain
from reports.pages.gap_answer import answer, changed
from reports.pages.gap_page import law_table

JOINTS = ("a", "b")


def row(effect: str, place: str, parameter: str, value: float, **more: Any) -> dict[str, Any]:
    known = {"effect": effect, "place": place, "joint": place if place in JOINTS else ""}
    size = {"parameter": parameter, "value": value, "ci_low": 0.9 * value, "ci_high": 1.1 * value}
    usual = {"unit": "N*m", "level": "confirmed", "written": True, "reason": ""}
    return known | size | usual | more


FRICTION = [
    row("coulomb_friction", "a", "torque", 0.2),
    row("coulomb_friction", "b", "torque", 0.4),
    row("viscous_friction", "a", "coefficient", 1.0, unit="N*m*s/rad"),
    row("viscous_friction", "b", "coefficient", 3.0, unit="N*m*s/rad"),
]
COLUMNS = [*row("", "", "", 0.0)]


def said(
    *found: dict[str, Any],
    rest: list[tuple[str, str, float]] | None = None,
    left: tuple[Residual, ...] = (Residual("a", "torque", 0.3, 0.25, "N*m", False, ""),),
) -> list[str]:
    """The answer to made tables of a machine of two joints."""
    whole = {"by": "joint", "joint": "a", "gap": 2.0, "unit": "N*m", "share_of_total": 0.9}
    tables = {
        "found": pd.DataFrame(found, columns=COLUMNS),
        "candidates": pd.DataFrame(columns=["effect", "place", "verdict"], dtype=str),
        "where": pd.DataFrame([whole]),
    }
    if rest:
        tables["rest"] = pd.DataFrame(rest, columns=["joint", "kind", "share"])
    outcome: Any = SimpleNamespace(
        gaps=(2.0, 0.3),
        noise=0.25,
        suspected=(),
        energy=None,
        unit="N*m",
        held=SimpleNamespace(left=left),
        given=SimpleNamespace(alternative="", model=SimpleNamespace(joints=JOINTS)),
        compared=SimpleNamespace(
            logs=(SimpleNamespace(channels=("torque",), recording=None),),
        ),
    )
    lines = [plain(line) for line in answer(outcome, tables)]
    assert len(lines) <= 10
    return lines


def test_a_law_is_one_line_and_one_column_of_the_table() -> None:
    first, second, third, *_ = said(
        row("position_offset", "a", "angle", 0.1, unit="rad", written=False), *FRICTION
    )
    assert first == "Missing, confirmed: Coulomb friction at a and b: torque 0.2 to 0.4 N·m."
    assert "viscous friction at a and b" in second
    ends = "angle 0.1 rad, 95 % 0.0900 to 0.110."
    assert third == f"Missing, confirmed, not written: position offset at a: {ends}"
    (gain, *_) = said(row("effort_gain", "*__torque_Nm", "gain", 1.1, unit="1"))
    assert gain.startswith("Missing, confirmed: effort gain at all joints: gain 1.1,")
    table = law_table(pd.DataFrame(FRICTION), JOINTS)
    assert table["joint"].tolist() == ["a", "b"]
    assert table["Coulomb friction, torque [N·m]"].tolist()[1] == "0.4 (0.360 to 0.440)"


def test_numbers_that_were_not_estimated_are_not_told() -> None:
    fixed = row("backlash", "a", "stiffness", 1e12, ci_low=1e12, ci_high=1e12)
    (line, *_) = said(row("backlash", "a", "width", 0.02, unit="rad"), fixed)
    assert line == "Missing, confirmed: backlash at a: width 0.02 rad, 95 % 0.0180 to 0.0220."


def test_what_has_no_name_is_told_by_its_kind() -> None:
    (line,) = (x for x in said(rest=[("b", "memory", 0.12)]) if x.startswith("What has no name"))
    assert line.endswith("at b, 12 % of the gap depends on the way it came, as hysteresis does.")


@pytest.mark.parametrize("significant", [True, False])
def test_noise_is_said_only_where_no_joint_leaves_more(significant: bool) -> None:
    left = Residual("a", "torque", 0.9, 0.3, "N*m", significant, "what is left in a falls in time")
    told = " ".join(said(left=(left,)))
    noise = "is noise: at most 3 times its floor, at a, of which no variable of the motion tells"
    assert (noise in told) != significant
    assert "is noise: at most 1.2 times its floor, at a." in " ".join(said())
    assert ("a 0.9 N·m, 3 times its floor, falls in time" in told) == significant


def test_what_was_mounted_is_told_as_one_thing_and_friction_in_percent() -> None:
    rows = [("body", "fore", "mass", 0.9, 0.8, 1.0)]
    rows += [
        ("body", "fore", f"centre {a}", x, x - 0.01, x + 0.01)
        for a, x in zip("xyz", (0.12, 0.0, 0.03), strict=True)
    ]
    rows += [("friction_factor", "all joints", "factor", 1.08, 1.05, 1.11)]
    table = pd.DataFrame(rows, columns=["what", "place", "quantity", "value", "ci_low", "ci_high"])
    mounted, friction = changed({"changed": table})
    assert mounted.startswith("0.9 kg more on fore (95 % 0.8 to 1), at x 0.12 ± 0.01, y 0 ±")
    assert friction == "friction at all joints 8 % higher (95 % 5 to 11 %)"
