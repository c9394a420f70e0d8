"""The verbs `init` and `init-actuator`, from a name or a data sheet to a walk."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import pipeline as lw
from pipeline.commands.main import main
from tests.pipeline.robot.walkers import urdf_text
from tests.test_odd import PENDULUM


def test_init_writes_a_robot_file_and_a_picture_and_says_what_to_look_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "mine.toml"
    assert main(["init", "solo12", "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert f"{out}: 4 legs, 2.5 kg, base 'base_link'" in told
    assert "legs: FL to 'FL_FOOT', FR to" in told
    assert f"look at {tmp_path / 'mine.svg'}: left and right" in told
    assert "52 of 52 checks passed" in told
    assert sorted(p.name for p in tmp_path.iterdir()) == ["mine.svg", "mine.toml"]
    machine = lw.load(out)
    assert abs(lw.stand(machine, "ideal").contacts["force_z_N"].sum() / 9.81 - 2.5) < 1e-4
    before = out.read_bytes()
    assert main(["init", "solo12", "--out", str(out)]) == 2
    assert "there is such a file" in capsys.readouterr().err
    assert out.read_bytes() == before


def test_a_gait_that_cannot_be_walked_fails_the_check(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (root / "urdf" / "solo12.toml").read_text(encoding="utf-8")
    assert main(["check", str(root / "urdf" / "solo12.toml"), "-v"]) == 0
    assert "gait can be walked" in capsys.readouterr().out
    long = text.replace("[gait]", '[gait]\nstroke = "900 mm"')
    (tmp_path / "long.toml").write_text(long, encoding="utf-8")
    assert main(["check", str(tmp_path / "long.toml")]) == 1
    told = capsys.readouterr().out
    assert "FAIL solo12: gait can be walked:" in told
    assert told.count("FAIL") == 1


def test_legs_that_cannot_step_forward_are_a_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two axes along x: the feet move sideways and up only."""
    leg = (("revolute", "1 0 0"), ("revolute", "1 0 0"))
    (tmp_path / "crab.urdf").write_text(urdf_text((leg,) * 4, turned=False), encoding="utf-8")
    out = tmp_path / "crab.toml"
    assert main(["init", str(tmp_path / "crab.urdf"), "--out", str(out)]) == 1
    told = capsys.readouterr().out
    assert "gait can be walked: feet leave their paths by" in told
    assert "do not move them along x" in told


def test_a_single_joint_without_shapes_has_a_picture_in_a_folder_that_is_made(
    tmp_path: Path,
) -> None:
    (tmp_path / "one.urdf").write_text(PENDULUM, encoding="utf-8")
    out = tmp_path / "new" / "one.toml"
    assert main(["init", str(tmp_path / "one.urdf"), "--out", str(out)]) == 0
    assert out.with_suffix(".svg").exists()


def test_an_arm_gets_a_file_for_its_logs_and_motions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "arm.toml"
    assert main(["init", "ur5", "--out", str(out)]) == 0
    told = capsys.readouterr().out
    assert "0 legs, 20.99 kg, fixed base 'world'" in told
    assert "gait: none: feet found: tool0" in told
    time = np.linspace(0.0, 1.0, 101)
    moved = {
        f"{joint}__position_rad": 0.1 * np.sin(6 * time) for joint in lw.load(out).robot.joints
    }
    walk = lw.walk(lw.load(out), "ideal", motion=pd.DataFrame({"time_s": time, **moved}))
    assert (walk.energy["electrical_J"] > 0).any()
