"""Machines of the trials agree and balance; many trials give the same rows, real answers."""

from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest

from tests.blind import __main__ as command
from tests.blind import run
from tests.blind.judge import judged
from tests.blind.machines import forward, own, trial
from tests.blind.machines.machine import draw_chain, sines, true_bodies
from tests.blind.machines.plant import Plant, bristles
from tests.blind.machines.trial import KINDS, make
from tests.blind.run import ask, run_trials
from tests.blind.test_judge import answer


def machine(name: str):
    rng = np.random.default_rng(3)
    drawn = draw_chain(rng, name)
    return drawn, Plant.rigid(true_bodies(drawn, rng, 0.2), len(drawn.joints))


def followed(name: str, plant_of):
    """What MuJoCo did in a second, and the own inverse along it."""
    drawn, plant = machine(name)
    plant = plant_of(plant)
    course = sines(np.random.default_rng(1), len(drawn.joints), 1.0, forward.step_of(plant))
    happened = forward.run(drawn, plant, course)
    return happened, own.run(drawn, plant, happened)


@pytest.mark.parametrize("name", ["pendulum", "leg", "arm"])
def test_without_dry_friction_both_sources_give_the_same_torque(name):
    def smooth(plant: Plant) -> Plant:
        return replace(plant, inertia=0.05 + plant.inertia).at(0, viscous=0.3, quadratic=0.2)

    happened, inverse = followed(name, smooth)
    size = np.abs(happened.torque).max()
    np.testing.assert_allclose(happened.torque, inverse.torque, atol=1e-9 * size)


def test_a_gear_winds_up_alike_in_both_sources_and_a_play_is_as_wide_as_it_says():
    happened, inverse = followed("leg", lambda p: p.at(1, compliance=2e-3, inertia=0.05))
    one, two = (x.motor[:, 1] - x.q[:, 1] for x in (happened, inverse))
    # The engine's gear has a loss of its own, a twentieth of critical damping.
    assert np.std(one[2000:] - two[2000:]) < 0.05 * np.std(one[2000:])
    np.testing.assert_allclose(happened.motor[:, 0], happened.q[:, 0])
    happened, _ = followed("pendulum", lambda p: p.at(0, play=0.02, inertia=0.05, coulomb=0.3))
    assert 0.009 < np.abs(happened.motor - happened.q).max() < 0.0115


def test_dry_friction_of_the_engine_takes_the_work_it_should():
    """Energy: what the motors gave is in the bodies, or friction took it."""
    law = {"coulomb": 0.5, "driving": 0.1, "driven": 0.1}
    happened, _ = followed("pendulum", lambda plant: plant.at(0, **law))
    v, (drawn, plant) = happened.v[:, 0], machine("pendulum")
    link = own.link_torque(drawn, plant.model, happened)[0][:, 0]
    taken = float(np.sum((happened.torque[:, 0] - link) * v))
    assert taken == pytest.approx(np.sum((0.5 + 0.1 * np.abs(link)) * np.abs(v)), rel=0.02)


def test_bristles_slide_at_the_level_of_the_law():
    _, plant = machine("pendulum")
    law = plant.at(0, coulomb=1.0, excess=0.5, stribeck=0.2, asymmetry=0.2, driving=0.1)
    t = np.arange(2000) * 1e-3
    v = np.where(t < 1.0, 0.3, -0.3)[:, None]
    got = bristles(law, t, np.cumsum(v, axis=0) * 1e-3, v, np.full_like(v, 2.0))
    for row, way in ((900, 1.0), (1900, -1.0)):
        dry = 1.0 + 0.5 * np.exp(-((0.3 / 0.2) ** 2)) + 0.2 * way + (0.2 if way > 0 else 0.0)
        assert got[row, 0] == pytest.approx(way * dry, rel=1e-6)


def test_a_trial_hangs_on_source_seed_and_number_alone(tmp_path):
    one, two = (make("own", 2, 6, tmp_path / name) for name in ("one", "two"))
    assert one == two
    for name in ("log.csv", "machine.urdf", "mapping.toml", "test.csv"):
        first, second = (tmp_path / n / "given" / name for n in ("one", "two"))
        assert first.read_bytes() == second.read_bytes()
    assert make("own", 2, 7, tmp_path / "three") != one


def test_a_log_shows_what_is_hidden_and_which_names_look_like_it(tmp_path):
    assert KINDS.count("outside") == KINDS.count("empty") == len(KINDS) / 5
    effects = ("coulomb_friction", "joint_elasticity", "parallel_spring")
    truth = make("own", 4, 1, tmp_path / "t", machine="leg", effects=effects)
    assert [h["effect"] for h in truth["hidden"]] == list(effects)
    assert all(h["visible"] and not h["alike"] for h in truth["hidden"])
    truth = make("own", 4, 4, tmp_path / "t", machine="pendulum", effects=("effort_gain",))
    assert {"rigid_body_parameters", "link_mass"} <= set(truth["hidden"][0]["alike"])


def test_rows_are_the_same_whatever_the_workers_and_after_a_resume(tmp_path, monkeypatch):
    one = run_trials(["own"], 3, 3, tmp_path / "one", ask=answer)
    assert one == run_trials(["own"], 3, 3, tmp_path / "two", workers=2, ask=answer)
    # Killed in the second trial: half a line is left of it.
    kept = tmp_path / "one" / "answers.jsonl"
    lines = kept.read_text(encoding="utf-8").splitlines(keepends=True)
    kept.write_text("".join(lines[:2]) + lines[2][:40], encoding="utf-8")
    made, make = [], trial.make
    monkeypatch.setattr(run, "make", lambda *block: made.append(block[2]) or make(*block))
    assert one == run_trials(["own"], 3, 3, tmp_path / "one", ask=answer)
    assert made == [1, 2]


def test_the_command_writes_its_tables_and_prints_the_rates(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(command, "run_trials", partial(run_trials, ask=answer))
    arguments = ["--trials", "2", "--workers", "1", "--seed", "3", "--out", str(tmp_path)]
    assert command.main(arguments) == 1
    assert len(pd.read_csv(tmp_path / "trials.csv")) == 2
    assert set(pd.read_csv(tmp_path / "names.csv")["effect"]) == {"coulomb_friction"}
    assert "of    2  100.0% (34.2% to 100.0%)  answered" in capsys.readouterr().out


def test_gap_answers_a_short_trial_and_names_what_is_hidden(tmp_path, monkeypatch):
    monkeypatch.setattr(trial, "SECONDS", (8.0, 4.0))
    truth = trial.make("own", 3, 0, tmp_path, machine="leg", effects=("viscous_friction",))
    row, names = judged(truth, ask(tmp_path, truth["options"]))
    assert row["answered"], row["message"]
    assert row["all_found"]
    assert not row["wrong"], names


@pytest.mark.parametrize("options", [["--supply"], ["--machine", "pendulum", "--hide", "backlash"]])
def test_a_log_is_written_into_a_new_folder_only(tmp_path, options, capsys):
    folder = tmp_path / "my trial"
    assert command.main(["--write", str(folder), *options]) == 0
    assert {path.name for path in folder.iterdir()} == {"given", "truth.json"}
    assert f"cd '{folder}/given' && python -m pipeline gap" in capsys.readouterr().out
    assert command.main(["--write", str(folder), *options]) == 2
    assert "not empty" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--supply --hide rust --write", "'rust' is nothing of a supply"),
        ("--machine walk --hide backlash --write", "cannot be hidden in a walk"),
        ("--source mujoco --machine walk --write", "has no machine 'walk'"),
        ("--trials 0 --out", "--trials and --workers start at 1"),
    ],
)
def test_what_cannot_be_done_is_one_line_and_writes_nothing(tmp_path, options, words, capsys):
    assert command.main([*options.split(), str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())
