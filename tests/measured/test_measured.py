"""Measured robots: the range is that of all choices, and the committed table is of these facts."""

import itertools
import tomllib

import pandas as pd
import pytest

import pipeline as lw
from pipeline.choice.result import trust
from tests.measured.__main__ import ROOT, TABLE, fingerprint, main, of_robot, predicted, read_facts

#: Solo12 standing and three unknowns: 2 ways by 2 numbers.
SMALL = """
title = "Solo12"
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
measured = 0.1
"""


def test_the_range_holds_what_the_plain_calls_give_at_every_choice(tmp_path):
    (tmp_path / "small.toml").write_text(SMALL, encoding="utf-8")
    small = tomllib.loads(SMALL)
    machine = lw.load(ROOT / "urdf" / "solo12.toml")
    by_hand = {}
    for pose, (a, ohm), (b, load) in itertools.product(
        (0, 1), enumerate((0.348825, 0.23255, 0.4651)), enumerate((0.02, 0.0, 0.041))
    ):
        values: dict[str, object] = {"motor.resistance": ohm, "belts.load": load}
        if pose:
            values["gait.body_height"] = "180 mm"
        held = lw.stand(machine.with_values(values), "solo12").result.holding["solo12"]
        by_hand[pose, a, b] = float(held.power.sum())
    for choice, watts in predicted(small, small["quantity"][0]).items():
        assert watts == pytest.approx(by_hand[choice], rel=1e-9)
    power, moon = of_robot("small", small, tmp_path).to_dict("records")
    assert power["least"] == pytest.approx(10 / max(by_hand.values()))
    assert power["likeliest"] == pytest.approx(15 / by_hand[0, 0, 0])
    assert power["greatest"] == pytest.approx(20 / min(by_hand.values()))
    # Both powers of a quotient are predicted with the same unknowns, so that most of them cancel.
    spread = 0.5 * power["greatest"] / power["least"]  # of the predictions
    assert moon["greatest"] / moon["least"] < 0.5 * spread


def test_the_committed_table_is_of_these_facts():
    table, every = pd.read_csv(TABLE), read_facts()
    known = {facts["title"]: fingerprint(name) for name, facts in every.items()}
    assert dict(zip(table["robot"], table["facts"], strict=True)) == known, (
        "python -m tests.measured"
    )
    assert trust(table)[0] == "0.25 to 1.1 times"  # of watts: ANYmal C took more, all others less


@pytest.mark.slow
def test_the_committed_table_is_what_the_model_predicts_today(tmp_path):
    main(tmp_path / "now.csv")
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "now.csv"), pd.read_csv(TABLE), rtol=1e-3)
