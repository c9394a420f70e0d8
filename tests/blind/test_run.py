"""Many trials: the same rows whatever the number of workers and after a resume; real answers."""

from functools import partial
from pathlib import Path

import pandas as pd
import pytest

from tests.blind import __main__ as command
from tests.blind import run
from tests.blind.judge import judged
from tests.blind.machines import trial
from tests.blind.run import ask, run_trials
from tests.blind.test_judge import answer


def test_rows_are_the_same_whatever_the_workers_and_after_a_resume(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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


def test_the_command_writes_its_tables_and_prints_the_rates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "run_trials", partial(run_trials, ask=answer))
    arguments = ["--trials", "2", "--workers", "1", "--seed", "3", "--out", str(tmp_path)]
    assert command.main(arguments) == 1
    assert len(pd.read_csv(tmp_path / "trials.csv")) == 2
    assert set(pd.read_csv(tmp_path / "names.csv")["effect"]) == {"coulomb_friction"}
    assert "of    2  100.0% (34.2% to 100.0%)  answered" in capsys.readouterr().out


def test_gap_answers_a_short_trial_and_names_what_is_hidden(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trial, "SECONDS", (8.0, 4.0))
    truth = trial.make("own", 3, 0, tmp_path, machine="leg", effects=("viscous_friction",))
    row, names = judged(truth, ask(tmp_path, truth["options"]))
    assert row["answered"], row["message"]
    assert row["all_found"]
    assert not row["wrong"], names


@pytest.mark.parametrize("options", [["--supply"], ["--machine", "pendulum", "--hide", "backlash"]])
def test_a_log_is_written_into_a_new_folder_only(
    tmp_path: Path, options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
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
def test_what_cannot_be_done_is_one_line_and_writes_nothing(
    tmp_path: Path, options: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main([*options.split(), str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())
