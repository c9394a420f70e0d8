"""The verb `init`, from a name to a robot that stands."""

from __future__ import annotations

from pathlib import Path

import pytest

import pipeline as lw
from pipeline.cli.main import main
from pipeline.errors import RobotFileError


def test_init_writes_a_robot_file_and_a_picture_and_says_what_to_look_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "mine.toml"
    assert main(["init", "solo12", "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert f"{out}: 4 legs, 2.5 kg, base 'base_link'" in told
    assert "FL: left, FL_HAA - FL_HFE - FL_KFE, foot 'FL_FOOT' at (" in told
    assert f"look at {tmp_path / 'mine.png'}: left and right" in told
    assert "check: 95 of 95 passed" in told
    assert sorted(p.name for p in tmp_path.iterdir()) == ["mine.png", "mine.svg", "mine.toml"]
    machine = lw.load(out)
    assert abs(lw.stand(machine, "ideal").contacts.frame()["force_z_N"].sum() / 9.81 - 2.5) < 1e-4
    before = out.read_bytes()
    assert main(["init", "solo12", "--out", str(out)]) == 2
    assert "there is such a file; give another name with --out" in capsys.readouterr().err
    assert out.read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["bolt"], "two feet found"),
        (["solo12", "--out", "robot.txt"], "--out robot.txt: a robot file's name ends in .toml"),
        (["a1", "--foot", "nose"], "--foot nose: no link of that name moves"),
    ],
)
def test_what_init_cannot_do_leaves_nothing(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", *arguments]) == 2
    captured = capsys.readouterr()
    assert message in captured.err
    assert captured.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_robots_name_is_no_robot_file_but_init_makes_one() -> None:
    with pytest.raises(RobotFileError, match="`python -m pipeline init solo12` writes one"):
        lw.load("solo12")
