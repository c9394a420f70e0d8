"""Options of the ground's forces, from the command line and from Python."""

from __future__ import annotations

from pathlib import Path

import pytest

import pipeline as lw
from pipeline.errors import GaitError, SlidingError
from tests.command_line import Command, Refused, rows_of, sidecar_of

RULES = ["least_tangential", "least_torque", "least_power"]


def test_a_table_says_what_each_rule_costs_with_each_actuator(
    tmp_path: Path, command: Command
) -> None:
    assert command("walk", tmp_path, "--samples", "51", "--compare-forces") == 0
    rows = rows_of(tmp_path / "walking_force_rules.csv")
    alternatives = ["ideal", "rotor", "reversible", "irreversible"]
    assert [(r["rule"], r["alternative"]) for r in rows] == [
        (rule, name) for rule in RULES for name in alternatives
    ]
    energy = {(row["rule"], row["alternative"]): float(row["electrical_J"]) for row in rows}
    supplied = {
        row["alternative"]: float(row["electrical_J"])
        for row in rows_of(tmp_path / "walking_energy.csv")
        if row["leg"] == "robot"
    }
    for row in rows:
        paper = energy["least_tangential", row["alternative"]]
        assert paper == pytest.approx(supplied[row["alternative"]], rel=1e-9)
        change = float(row["electrical_J"]) / paper - 1
        assert float(row["relative_difference"]) == pytest.approx(change, abs=1e-12)
        if row["rule"] == "least_power":
            assert change < 0
    assert "no limit" in sidecar_of(tmp_path / "walking_force_rules.csv")["description"]


def test_the_table_is_not_made_unasked(out: Path) -> None:
    assert not (out / "walking_force_rules.csv").exists()


@pytest.mark.parametrize("rule", [["least_torque"], ["least_power", "--power-of", "rotor"]])
def test_a_rule_is_in_the_tables_and_in_their_sidecars(
    rule: list[str], tmp_path: Path, command: Command, out: Path
) -> None:
    options = ["--forces", *rule, "--friction-coefficient", "0.4", "--samples", "51"]
    assert command("walk", tmp_path, *options) == 0
    rows = rows_of(tmp_path / "walking_stability.csv")
    assert 0.3 < max(float(row["greatest_friction_needed"]) for row in rows) <= 0.4 + 1e-9
    told = sidecar_of(tmp_path / "walking_contact_forces.csv")
    assert told["options"]["forces"] == rule[0]
    assert told["options"]["friction_coefficient"] == 0.4
    assert "Least tangential" not in told["description"]
    assert "forces" not in sidecar_of(out / "walking_contact_forces.csv")["options"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--forces", "least_tork"], "did you mean 'least_torque'?"),
        (["--forces", "least_power"], "needs an actuator: --power-of with one of ideal, rotor"),
        (["--forces", "least_power", "--power-of", "roter"], "did you mean 'rotor'?"),
        (["--power-of", "rotor"], "takes no --power-of rotor"),
        (["--friction-coefficient", "-1"], "friction coefficient -1: expected a finite number"),
        (["--friction-coefficient", "much"], "invalid float value: 'much'"),
    ],
)
def test_what_cannot_be_chosen_is_told_in_one_line(
    options: list[str], said: str, tmp_path: Path, refused: Refused
) -> None:
    assert said in refused(["walk", *options], tmp_path / "new")


def test_ground_that_is_too_smooth_is_a_finding(tmp_path: Path, refused: Refused) -> None:
    options = ["--friction-coefficient", "0.0001", "--samples", "51"]
    error = refused(["walk", *options], tmp_path / "new", 1)
    assert "the robot slides at t = " in error
    assert "0.0001 is given" in error


def test_python_takes_the_same(root: Path) -> None:
    machine = lw.load(root / "urdf" / "hexapod.toml")
    own = lw.walk(machine, "reversible", samples=51, forces="least_power", compare_forces=True)
    costs = own.table("walking_force_rules").frame().set_index(["rule", "alternative"])
    robot = own.energy.frame().set_index(["alternative", "leg"]).electrical_J
    assert robot["reversible", "robot"] == pytest.approx(
        costs.electrical_J["least_power", "reversible"], rel=1e-9
    )
    held = lw.stand(machine, "reversible", forces="least_power")
    paper = lw.stand(machine, "reversible")
    name = "reversible"
    assert held.result.holding[name].power.sum() < paper.result.holding[name].power.sum()
    with pytest.raises(GaitError, match="needs an actuator"):
        lw.walk(machine, samples=51, forces="least_power")
    with pytest.raises(SlidingError, match="slides"):
        lw.walk(machine, samples=51, friction_coefficient=0.0001)


def test_friction_of_the_ground_may_stand_with_the_gait_and_an_option_outdoes_it(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    slippery = ["--samples", "51", "--set", "gait.friction_coefficient=0.003"]
    assert command("walk", tmp_path, *slippery) == 1
    assert "slides" in capsys.readouterr().err
    assert command("walk", tmp_path, *slippery, "--friction-coefficient", "0.4") == 0
    told = sidecar_of(tmp_path / "walking_contact_forces.csv")
    assert told["options"]["friction_coefficient"] == 0.4
    assert command("walk", tmp_path, "--samples", "51", "--set", "gait.friction_coefficient=0") == 2
    assert "gait.friction_coefficient = 0" in capsys.readouterr().err
