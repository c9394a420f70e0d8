"""Robot files guessed from URDFs: what is found, why, what is asked for, and what `init` says."""

from pathlib import Path

import numpy as np
import pytest

import pipeline as lw
from actuators.errors import LegwattError
from pipeline.commands.main import main
from pipeline.dynamics.joint_demand import check_gait, segment_demand
from pipeline.motion.gait import gait_of
from pipeline.motion.walking import standing_posture
from pipeline.robot.check import check_robot
from pipeline.robot.guess import Guess, guesses, robot_text
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.pipeline.robot.walkers import MIXED, urdf_text

#: Published robots that walk on four legs: joints of each leg, joints that are held, SRDF pose.
WALKERS = {
    "b1_z1": (3, 7, "standing_with_arm_home"),
    "centauro": (5, 19, "homing_balanced"),
    "laikago": (3, 0, ""),
    "solo8": (2, 0, "standing"),
}


def guessed(given: str, folder: Path, **options: object) -> tuple[Guess, Robot]:
    guess = next(guesses(given, **options))
    path = folder / "robot.toml"
    path.write_text(robot_text(guess, path), encoding="utf-8")
    return guess, load_robot(load_robot_file(path))


@pytest.mark.parametrize("name", WALKERS)
def test_published_quadrupeds_are_found_and_stand(name, tmp_path):
    joints, held, pose = WALKERS[name]
    guess, robot = guessed(name, tmp_path)
    assert [len(leg.joints) for leg in guess.legs] == [joints] * 4
    assert len(guess.held) == held
    assert guess.stance.reason.startswith(f"pose '{pose}'" if pose else "level feet under")
    assert [f.detail for f in check_robot(robot) if not f.passed] == []
    segment = standing_posture(robot)  # within reach and limits
    np.testing.assert_allclose(
        robot.leg_positions(segment.configuration)[0], guess.stance.posture, atol=2e-3
    )
    _, contacts = segment_demand(robot, segment)
    assert contacts.force_world[0, :, 2].sum() == pytest.approx(9.81 * guess.mass, rel=1e-9)
    assert (contacts.force_world[0, :, 2] > 0).all()


def test_the_hexapods_own_legs_are_found_again(root, hexapod, tmp_path):
    """Without an SRDF: a search finds about the stance that the paper chose, femurs level."""
    guess, robot = guessed(str(root / "urdf" / "hexapod.urdf"), tmp_path)
    assert [(leg.name, leg.joints, leg.foot, leg.side) for leg in robot.spec.legs] == [
        (leg.name, leg.joints, leg.foot, leg.side) for leg in hexapod.spec.legs
    ]
    stances = [gait_of(each.spec).footfall.stances() for each in (robot, hexapod)]
    assert stances[0] == stances[1]
    feet = guess.stance.feet
    np.testing.assert_allclose(feet[:3], feet[3:] * [1, -1, 1], atol=1e-9)  # mirrored
    papers = np.array([leg.neutral_foot for leg in hexapod.spec.legs])
    off = np.linalg.norm(feet - papers, axis=1)
    assert (off < 0.25 * np.abs(papers[:, 2])).all()


def test_three_leaves_are_feet_where_nothing_is_called_one_and_an_arm_is_held(tmp_path):
    def unnamed(legs: int) -> Guess:
        text = urdf_text((MIXED[0],) * legs, arm=True).replace("_foot", "_x").replace("_tip", "_y")
        (tmp_path / "walker.urdf").write_text(text, encoding="utf-8")
        return guessed(str(tmp_path / "walker.urdf"), tmp_path)[0]

    assert not unnamed(2).legs
    guess = unnamed(5)
    assert [leg.foot for leg in guess.legs] == [f"leg{i}_x" for i in range(5)]
    assert [leg.name for leg in guess.legs] == [f"leg{i}" for i in range(5)]
    assert [(joint, at) for joint, at, _ in guess.held] == [("arm", 0.0)]


#: Robots that do not walk on three feet: feet that are found, what is held, in a mimic's pair too.
OTHERS = {
    "bolt": (["FL_FOOT", "FR_FOOT"], 0),
    "panda": ([], 9),  # a gripper of two fingers, one of which mimics the other
    "alex_sake_hands": ([], 23),  # four finger tips
}


@pytest.mark.parametrize("name", OTHERS)
def test_arms_wheels_and_two_legs_get_a_robot_file_without_a_gait(name, tmp_path):
    feet, held = OTHERS[name]
    guess, robot = guessed(name, tmp_path)
    assert [leg.foot for leg in guess.legs] == feet
    assert (len(guess.held), robot.floating) == (held, bool(feet))
    assert [f.detail for f in check_robot(robot) if not f.passed] == []
    assert check_gait(robot) == []
    with pytest.raises(LegwattError, match=f"{len(feet)} legs have no statically stable gait"):
        gait_of(robot.spec)


@pytest.mark.parametrize(
    ("given", "options", "message"),
    [
        ("cassie", {}, r"cassie: .* has no URDF of it"),
        ("solo21", {}, r"no robot of example-robot-data, is 'solo21': did you mean 'solo"),
        ("nowhere/x.urdf", {}, r"nowhere/x.urdf: no such file"),
        ("{}/slash.urdf", {}, r"leg 'left_1': 'joints.2': a name holds '/'"),
        ("a1", {"feet": ["FL_fot"]}, r"feet: no link moves of name 'FL_fot': .*'FL_foot'"),
        ("a1", {"feet": ["FL_foot", "FL_calf", "FR_foot"]}, r"'FL_foot' and 'FL_calf' both hang"),
    ],
)
def test_what_cannot_be_found_is_asked_for(tmp_path, given, options, message):
    (tmp_path / "slash.urdf").write_text(urdf_text(MIXED).replace("leg0_1", "leg0/1"), "utf-8")
    with pytest.raises(LegwattError, match=message) as caught:
        guessed(given.format(tmp_path), tmp_path, **options)
    assert "\n" not in str(caught.value)


def test_init_writes_a_robot_file_and_a_picture_and_says_what_to_look_at(tmp_path, capsys):
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


def test_a_gait_that_cannot_be_walked_fails_the_check(root, tmp_path, capsys):
    text = (root / "urdf" / "solo12.toml").read_text(encoding="utf-8")
    assert main(["check", str(root / "urdf" / "solo12.toml"), "-v"]) == 0
    assert "gait can be walked" in capsys.readouterr().out
    long = text.replace("[gait]", '[gait]\nstroke = "900 mm"')
    (tmp_path / "long.toml").write_text(long, encoding="utf-8")
    assert main(["check", str(tmp_path / "long.toml")]) == 1
    told = capsys.readouterr().out
    assert "FAIL solo12: gait can be walked:" in told
    assert told.count("FAIL") == 1


def test_legs_that_cannot_step_forward_are_a_finding(tmp_path, capsys):
    """Two axes along x: the feet move sideways and up only."""
    leg = (("revolute", "1 0 0"), ("revolute", "1 0 0"))
    (tmp_path / "crab.urdf").write_text(urdf_text((leg,) * 4, turned=False), encoding="utf-8")
    out = tmp_path / "crab.toml"
    assert main(["init", str(tmp_path / "crab.urdf"), "--out", str(out)]) == 1
    told = capsys.readouterr().out
    assert "gait can be walked: feet leave their paths by" in told
    assert "do not move them along x" in told
