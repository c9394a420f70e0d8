"""The verb `init`, from a name to a robot that stands."""

from __future__ import annotations

from pathlib import Path

import pytest

import pipeline as lw
from pipeline.cli.main import main
from pipeline.errors import RobotFileError
from tests.pipeline.robot.walkers import urdf_text


def test_init_writes_a_robot_file_and_a_picture_and_says_what_to_look_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "mine.toml"
    assert main(["init", "solo12", "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert f"{out}: 4 legs, 2.5 kg, base 'base_link'" in told
    assert "FL: left, FL_HAA - FL_HFE - FL_KFE, foot 'FL_FOOT' at (" in told
    assert f"look at {tmp_path / 'mine.png'}: left and right" in told
    assert "check: 96 of 96 passed" in told
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


def test_check_knows_published_robots_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "solo8"]) == 0
    assert "solo8: 62 of 62 checks passed" in capsys.readouterr().out
    assert main(["walk", "--robot", "solo8"]) == 2
    assert "`python -m pipeline init solo8` writes one" in capsys.readouterr().err


def test_a_robots_name_is_no_robot_file_but_init_makes_one() -> None:
    with pytest.raises(RobotFileError, match="`python -m pipeline init solo12` writes one"):
        lw.load("solo12")


def test_legs_that_cannot_step_forward_are_a_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two axes along x: the feet move sideways and up only."""
    leg = (("revolute", "1 0 0"), ("revolute", "1 0 0"))
    (tmp_path / "crab.urdf").write_text(urdf_text((leg,) * 4, turned=False), encoding="utf-8")
    out = tmp_path / "crab.toml"
    assert main(["init", str(tmp_path / "crab.urdf"), "--out", str(out)]) == 1
    assert "no stroke along x, which is forward" in capsys.readouterr().out
    assert "no stroke was found" in out.read_text(encoding="utf-8")


NECK = (
    '<link name="head"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>'
    '<inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    '<joint name="neck" type="revolute"><parent link="base_link"/><child link="head"/>'
    '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>'
)


def test_a_head_is_held_and_counts(root: Path, tmp_path: Path) -> None:
    """Its torque is that of its weight, its energy the difference of the robot's and the legs'."""
    text = (root / "urdf" / "hexapod.urdf").read_text(encoding="utf-8")
    (tmp_path / "own.urdf").write_text(text.replace("</robot>", NECK), encoding="utf-8")
    made = lw.init(tmp_path / "own.urdf", tmp_path / "own.toml")
    assert [(joint, at) for joint, at, _ in made.guess.held] == [("neck", 0.0)]
    walk = lw.walk(lw.load(made.path), "ideal", samples=51)
    torque = walk.demand.frame()["neck__torque_Nm"]
    assert torque.to_numpy() == pytest.approx(-0.5 * 9.81 * 0.1, rel=1e-9)
    energy = walk.energy.frame().set_index("leg")["electrical_J"]
    assert energy["held joints"] > 0
    assert energy.drop("robot").sum() == pytest.approx(energy["robot"], rel=1e-12)
    tracking = walk.table("foot_tracking").frame()
    assert (tracking["directions"] == 3).all()
    assert tracking["deviation_time_s"].isna().all()
