"""Blind trials end to end: sealing, asking, opening; killed and resumed; a seal of garbage."""

from __future__ import annotations

import csv
import hashlib
import json
import os
import signal
import time
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from pipeline.blind import answer
from pipeline.blind.answer import ask
from pipeline.blind.make import make, read_judgement
from pipeline.blind.twin.matrix import TrialSpec
from pipeline.cli import blind
from pipeline.cli.main import main
from tests.command_line import in_another_process

SPECS = (
    TrialSpec(0, 3, ("coulomb_friction",), "leg", "low"),
    TrialSpec(1, 102, (), "leg", "low"),
)


@pytest.fixture(scope="module")
def sealed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The two trials, made."""
    out = tmp_path_factory.mktemp("blind")
    for spec in SPECS:
        make(str(out), spec.number, spec.seed, list(spec.effects), spec.motion, spec.noise)
    return out


def test_the_folder_holds_log_robot_and_actuators_only(sealed: Path) -> None:
    folder = sealed / "trials" / "0000"
    assert sorted(p.name for p in folder.iterdir()) == ["actuators", "log.csv", "urdf"]
    everything = b"".join(p.read_bytes() for p in folder.rglob("*") if p.is_file())
    truth = json.loads((sealed / "sealed" / "0000.json").read_text(encoding="utf-8"))
    assert b"coulomb_friction" not in everything
    assert repr(truth["hidden"][0]["parameters"]["torque"]["value"]).encode() not in everything


def test_what_the_log_could_tell_is_fixed_with_the_seal(sealed: Path) -> None:
    (judged,) = read_judgement(sealed / "sealed" / "0000.identifiable.json")
    assert judged.visible
    assert {r.effect for r in judged.rivals} >= {"viscous_friction", "torque_constant_error"}
    assert read_judgement(sealed / "sealed" / "0001.identifiable.json") == []


def _write_answer(to: Path, effect: str) -> None:
    to.mkdir(parents=True, exist_ok=True)
    (to / "candidates.csv").write_text(
        "effect,joint,place,verdict\n"
        + (f"{effect},rm_joint_1,rm_joint_1,accepted\n" * bool(effect)),
        encoding="utf-8",
    )
    header = "order,effect,joint,parameter,value,ci_low,ci_high,gap_before,gap_after,noise_floor"
    line = f"1,{effect},rm_joint_1,torque,1.0,0.9,1.1,1.0,0.1,0.1,,true\n" * bool(effect)
    (to / "found.csv").write_text(f"{header},doubt,written\n{line}", encoding="utf-8")


def _sealed_at_once(out: str, number: int, *rest: Any) -> Any:
    """A trial with nothing in it, in place of one that is simulated."""
    seal = blind.seal_file(Path(out), number)
    seal.parent.mkdir(parents=True, exist_ok=True)
    seal.write_text('{"hidden": []}', encoding="utf-8")
    blind.judgement_file(Path(out), number).write_text("[]", encoding="utf-8")
    blind.trial_folder(Path(out), number).mkdir(parents=True)
    return {"sha256": hashlib.sha256(seal.read_bytes()).hexdigest(), "robot": "urdf/leg.toml"}


def test_a_stopped_run_goes_on_and_judges(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    made: list[int] = []
    asked: list[str] = []

    def fake_ask(folder: str, robot: str, out: str) -> dict[str, Any]:
        asked.append(Path(folder).name)
        if len(asked) == 2:
            while '"result"' not in (tmp_path / "blind" / "answers.jsonl").read_text("utf-8"):
                time.sleep(0.01)  # the first answer is written by the thread that waits
            raise KeyboardInterrupt
        _write_answer(Path(out), "")
        return {"code": 0, "seconds": 1.0, "message": ""}

    def fake_make(out: str, number: int, *rest: Any) -> Any:
        made.append(number)
        return _sealed_at_once(out, number)

    specs = [TrialSpec(k, k, (), "leg", "low") for k in range(3)]
    monkeypatch.setattr(blind, "trial_matrix", lambda seed: tuple(specs))
    monkeypatch.setattr(blind, "make", fake_make)
    monkeypatch.setattr(blind, "ask", fake_ask)
    monkeypatch.setattr(blind, "processes", blind.ThreadPoolExecutor)
    out = tmp_path / "blind"
    assert main(["blind", "--out", str(out), "--workers", "1"]) == 130
    assert not (out / "blind_trials.csv").exists()
    # A line cut short by the kill does not count.
    with (out / "answers.jsonl").open("a", encoding="utf-8") as file:
        file.write('{"task": "2", "resu')
    assert main(["blind", "--out", str(out), "--workers", "1", "--resume"]) == 0
    assert made == [0, 1, 2]
    assert asked.count("0000") == 1
    assert asked.count("0001") == 2
    with (out / "blind_trials.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["outcome"] for row in rows] == ["nothing"] * 3
    printed = capsys.readouterr().out
    assert printed.index("sha256") < printed.index("nothing hidden: nothing named): 3 of 3")
    assert (out / "blind_confusion.png").exists()
    before = (out / "blind_trials.csv").read_bytes()
    assert main(["blind", "--out", str(out), "--workers", "1", "--resume"]) == 0
    assert (out / "blind_trials.csv").read_bytes() == before

    blind.seal_file(out, 1).write_text('{"hidden": [1]}', encoding="utf-8")
    assert main(["blind", "--out", str(out), "--workers", "1", "--resume"]) == 2
    assert "not what was sealed" in capsys.readouterr().err


def _interrupted(whom: str, went_on: Path, out: str, number: int, *rest: Any) -> Any:
    """A second trial that interrupts the process of `blind`, or its group, after the first."""
    if whom and number == 1:
        kept = Path(out) / "sealed.jsonl"
        while len(kept.read_text(encoding="utf-8").splitlines()) < 2:
            time.sleep(0.01)
        (os.killpg if whom == "group" else os.kill)(os.getppid(), signal.SIGINT)
        time.sleep(60)
        went_on.touch()
    return _sealed_at_once(out, number)


@pytest.mark.parametrize("to", ["group", "one process"])
@pytest.mark.parametrize("at", ["making", "asking"])
def test_an_interrupt_ends_what_runs_and_keeps_what_is_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: str, to: str
) -> None:
    """The second trial sends the signal and would go on for a minute, then leave a file."""
    went_on, out, begun = tmp_path / "went on", tmp_path / "blind", tmp_path / "begun"

    program = tmp_path / "gap"
    # The first answer is given at once, as unusable input; PPID is the process of `blind`.
    program.write_text(
        f"#!/bin/sh\n[ -e '{begun}' ] || {{ touch '{begun}'; exit 2; }}\n"
        f"until [ $(wc -l < '{out}/answers.jsonl') -ge 2 ]; do sleep 0.01; done\n"
        f"kill -INT {'-' if to == 'group' else ''}$PPID\nsleep 60\ntouch '{went_on}'\n",
        encoding="utf-8",
    )
    program.chmod(0o700)
    specs = [TrialSpec(k, k, (), "leg", "low") for k in range(4)]
    monkeypatch.setattr(blind, "trial_matrix", lambda seed: tuple(specs))
    made = partial(_interrupted, to if at == "making" else "", went_on)
    monkeypatch.setattr(blind, "make", made)
    monkeypatch.setattr(answer.sys, "executable", str(program))
    arguments = ["blind", "--out", str(out), "--workers", "1"]
    ended = in_another_process(arguments, tmp_path, os.setsid)
    assert ended.returncode == 130
    assert ended.stderr == "interrupted; finished trials are kept, --resume goes on from them\n"
    assert not went_on.exists()
    kept = out / ("sealed.jsonl" if at == "making" else "answers.jsonl")
    assert len(kept.read_text(encoding="utf-8").splitlines()) == 2  # the head, one trial


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["blind", "--trials", "0"], "--trials 0"),
        (["blind", "--workers", "0"], "--workers 0"),
        (["twin", "--hide", "colomb_friction"], "coulomb_friction"),
        (["twin", "--motion", "fly"], "fly"),
        (["twin", "--seed", "-1"], "-1"),
    ],
)
def test_bad_options(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*arguments, "--out", str(tmp_path / "new")]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert not (tmp_path / "new").exists()


def test_twin_prints_the_hash_of_what_it_sealed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "trial"
    assert main(["twin", "--seed", "3", "--hide", "viscous_friction", "--out", str(out)]) == 0
    sealed = tmp_path / "trial.sealed.json"
    digest = hashlib.sha256(sealed.read_bytes()).hexdigest()
    assert digest in capsys.readouterr().out.splitlines()[0]


def _verdicts(folder: Path) -> dict[str, bytes]:
    return {name: (folder / name).read_bytes() for name in ("candidates.csv", "found.csv")}


def test_garbage_in_the_seal_changes_no_verdict(sealed: Path, tmp_path: Path) -> None:
    answers = []
    for k in range(2):
        out = tmp_path / f"answer_{k}"
        run = ask(str(sealed / "trials" / "0000"), "urdf/leg.toml", str(out))
        assert run["code"] in (0, 1), run["message"]
        answers.append(_verdicts(out))
        for path in (sealed / "sealed").iterdir():
            path.write_bytes(b"\x00garbage")
    assert answers[0] == answers[1]
    assert b"accepted" in answers[0]["candidates.csv"]
