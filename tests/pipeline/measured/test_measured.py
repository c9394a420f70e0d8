"""Measured robots: the range is that of all choices, ratios pair equal ones."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

import pipeline as lw
from pipeline.errors import RobotFileError
from pipeline.measured.evaluate import ROBOTS, Prediction, predicted
from pipeline.measured.facts import read_facts
from pipeline.measured.page import write_measured
from pipeline.measured.tables import ratio_rows

#: Solo12 standing and two unknowns: 2 ways by 2 numbers.
SMALL = """
title = "Solo12"
order = 1
robot = "solo12.toml"
actuator = "solo12"
source = "nobody"

[[unknown]]
name = "height"
way = [{name = "as it is"}, {name = "lower", set = {"gait.body_height" = "180 mm"}}]

[[unknown]]
name = "ampere"
numbers = ["motor.resistance"]

[[unknown]]
name = "belts"
numbers = ["belts.load"]

[[quantity]]
name = "standing"
watts = [10, 20]
does = "stand"

[[quantity]]
name = "standing on the Moon"
does = "stand"
set = {gravity = 1.62}

[[ratio]]
name = "Moon over Earth"
over = "standing on the Moon"
under = "standing"
"""


@pytest.fixture
def facts(tmp_path: Path) -> Path:
    (tmp_path / "small.toml").write_text(SMALL, encoding="utf-8")
    return tmp_path


def test_the_range_holds_what_the_plain_calls_give_at_every_choice(facts: Path) -> None:
    small = read_facts(facts)["small"]
    found = predicted(small, small.quantity[0])
    machine = lw.load(ROBOTS / "solo12.toml")
    by_hand = {}
    for pose, (a, ohm), (b, load) in itertools.product(
        (0, 1), enumerate((0.348825, 0.23255, 0.4651)), enumerate((0.02, 0.0, 0.041))
    ):
        values: dict[str, object] = {"motor.resistance": ohm, "belts.load": load}
        if pose:
            values["gait.body_height"] = "180 mm"
        held = lw.stand(machine.with_values(values), "solo12").result.holding["solo12"]
        by_hand[pose, a, b] = float(held.power.sum())
    assert set(found.power) <= set(by_hand)
    for choice, watts in found.power.items():
        assert watts == pytest.approx(by_hand[choice], rel=1e-9)  # type: ignore[index]
    assert found.range[0] == pytest.approx(min(by_hand.values()))
    assert found.range[1] == pytest.approx(by_hand[0, 0, 0])
    assert found.range[2] == pytest.approx(max(by_hand.values()))
    assert [end for end, _ in found.ends(1)] == [1, 0, 2]  # watts with ohms


def test_tables_figure_and_page_are_written(facts: Path, tmp_path: Path, sketched: None) -> None:
    lines = write_measured(tmp_path / "out", folder=facts)
    assert lines[0].startswith("Solo12, standing: predicted ")
    assert lines[0].endswith("measured 10 to 20 W.")
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"measured.csv", "unknowns.csv", "measured_ratios.csv", "index.html"} <= files
    moves = (tmp_path / "out" / "unknowns.csv").read_text("utf-8").splitlines()
    first, second = (float(line.split(",")[-1]) for line in moves[1:3])
    assert first > second > 0


def test_the_shipped_facts_name_what_their_robots_have() -> None:
    """The likeliest of every quantity can be computed; nothing is read but files."""
    every = read_facts()
    assert [f.title for f in every.values()] == ["Magnecko v2", "Tytan", "ANYmal D", "Solo12"]
    for facts in every.values():
        machine = lw.load(ROBOTS / facts.robot, changes=facts.set)
        assert facts.actuator in machine.ready.catalog.alternatives
        for unknown in facts.unknown:
            for number in unknown.numbers:
                assert machine.ready.catalog.parameter(number).interval
            for way in unknown.way:
                machine.with_values(way.set)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "ampere"', 'nam = "ampere"', r"small.toml: .*unknown key 'nam'"),
        ('over = "standing on the Moon"', 'over = "dancing"', "is of no quantity here"),
        ('numbers = ["belts.load"]', "", "expected two ways or more, or numbers"),
        ("watts = [10, 20]", "watts = [10, 15, 20]", r"small.toml: .*watts"),
    ],
)
def test_facts_that_cannot_be_are_one_line(facts: Path, old: str, new: str, words: str) -> None:
    (facts / "small.toml").write_text(SMALL.replace(old, new), encoding="utf-8")
    with pytest.raises(RobotFileError, match=words):
        read_facts(facts)


def test_a_ratio_pairs_equal_choices() -> None:
    facts = read_facts()["magnecko"]
    over = Prediction({(0,): 2.0, (1,): 8.0, (3,): 1.0}, (0,))
    under = Prediction({(0,): 1.0, (1,): 4.0, (2,): 100.0}, (0,))
    (row,) = ratio_rows(facts, {facts.ratio[0].over: over, facts.ratio[0].under: under})
    assert (row.low, row.nominal, row.high) == (2.0, 2.0, 2.0)
