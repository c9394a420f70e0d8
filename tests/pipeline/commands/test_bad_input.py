"""Unusable input: one line that names the place and the remedy, exit 2, nothing half-written.

A row for each kind of mistake; the rooms' own tests go through their rules one by one.
"""

import os
import re
from pathlib import Path

import pytest

from tests.command_line import DEMO, changed, own_robot

FOOT = r"neutral_foot = \[[^\]]*\]"
NECK = '<link name="head"/><joint name="neck" type="continuous"><parent link="base_link"/>'
WHOLE = r"\A.*\Z"
#: Pattern in a robot file, replacement, message; the file names a URDF of the user's own.
ROBOT_FILES = [
    (r"^\[robot\]", "[robot", r"malformed TOML: .*line \d"),
    (r"^\[robot\]", 'path = "x"\n[robot]', r"unknown key 'path': known: actuators, assumed"),
    (r"^base = ", "bass = ", r"unknown key 'bass': did you mean 'base'"),
    (r"value = 40$", "value = 1e300", r"total_mass.*is beyond any machine"),
    (r"value = 40$", "value = -40", r"total_mass = -40 kg lies outside"),
    (r"^neutral_foot = .*?$", "", r"missing: legs.\w\w.neutral_foot"),
    (FOOT, r"\g<0>" + "\nstart_posture = [0, 45, -90]", r"start_posture.2.* equal to 6.28"),
    (WHOLE, "", r"'robot': Field required; 'parameters'"),
    (WHOLE, 'extends = "own.toml"', r"extends itself"),
]
#: The same in the URDF.
URDFS = [
    (
        r'(<link name="base_link">.*?<mass value=)"[^"]*"',
        r'\1"5.6"',
        r"total mass fails \(links add up to 21\.\d+ kg, stated 40 kg",
    ),
    (r'mass value="(\d+)\.', r'mass value="\1,', r"is not a float; .*\[base_link\]"),
    (r"<robot", r'<!DOCTYPE r [<!ENTITY a "b">]>\g<0>', r"<!ENTITY is declared"),
    ("</robot>", NECK + '<child link="head"/></joint></robot>', r"in no leg: 'neck'"),
    (WHOLE, "", r"own.urdf: the file is empty"),
    (WHOLE, "\udc80\udc81", r"line 1: byte 0x80 is not UTF-8 .*own.toml names it"),
]
#: Values of --set, exit code, message.
CHANGES = [
    (["femur_mass"], 2, r"expected KEY=VALUE"),
    (["femur_mass=1 m"], 2, r"expected a mass such as .1 kg"),
    (["femur_mass=6"], 2, r"leave -[\d.]+ kg for the trunk"),
    (["harmonic_drive.load=-0.1"], 2, r"outside its bounds \[0, 0.5\]"),
    (["joint_1_range=5"], 2, r"'\w+_joint_1' would have to reach .* deg at t ="),
    (["tibia_length=100"], 2, r"mm beyond its reach; shorten the stroke"),
    (["standing.feet=lf,lx"], 2, r"no leg 'lx'.*LEG,LEG,LEG or all"),
    (["gait.speed=0.1 m/s", "gait.period=2 s", "foot_stroke=230"], 2, r"it changes nothing"),
    (["gait.slope_forward=25 deg"], 1, r"the robot tips at t = "),
    (["hip_spacing=200"], 1, r"leg 'lf' would have to pull with \d+\.\d N"),
]
WHERE = ("gap", "where", str(DEMO))
#: Whole commands, and the message.
COMMANDS = [
    ([], r"--help"),
    (["walk", "--samples", "0"], r"'samples': .* greater than or equal to 51, not 0"),
    (["walk", "--regeneration", "bsu"], r"expected none, bus or a fraction"),
    (["walk", "--out", ""], r"argument --out: expected a name, got an empty one"),
    (["walk", "--actuators", "/nowhere"], r"/nowhere/alternatives.toml: no such file"),
    (["walk", "--robot", "urdf/leg.toml"], r"a robot on a stand neither stands nor walks"),
    (["walk", "--robot", "{}/pipe.toml"], r"is no regular file"),
    (["walk", "--robot", "bolt"], r"a robot on a stand .* robot file .* as `init` writes"),
    (["init-actuator", "a/b", "--source", "x"], r"^'a/b': expected a name of letters a to z"),
    (["init-actuator", "own", "--source", "x"], r"^missing: --"),
    (["components", "maxon_14886"], r"did you mean 'maxon_148867'"),
    (["sweep", "--vary", "sped=0.1,0.2 m/s"], r"did you mean 'speed'"),
    (["sweep", "--vary", "speed=0.1:0.4 m/s"], r"expected NAME=FIRST:LAST:COUNT"),
    (["sweep", "--vary", "duty_factor=0.6,1.4"], r"must be above 0 to 1"),
    (["choose", "--pack", "catl_lfp"], r"'catl_lfp' states no voltage"),
    ([*WHERE, "--mapping", "none.toml"], r"none.toml"),
    ([*WHERE, "--effort", "heat"], r"heat"),
    ([*WHERE, "--alternative", "reversable"], r"reversible"),
    ([*WHERE, "--cutoff", "100000"], r"Hz"),
    ([*WHERE, "--holdout", "none.csv"], r"none.csv"),
    ([*WHERE, "--model", "none.toml"], r"none.toml"),
    ([*WHERE, "--robot", "urdf/hexapod.urdf"], r"alternative"),
]


@pytest.fixture
def own(root: Path, tmp_path: Path) -> Path:
    """A robot file with a URDF of its own beside it, own.urdf."""
    return own_robot(root, tmp_path, "</robot>", "</robot>")


@pytest.mark.parametrize(
    ("name", "pattern", "replacement", "message"),
    [*(("own.toml", *row) for row in ROBOT_FILES), *(("own.urdf", *row) for row in URDFS)],
)
def test_files(own, refused, name, pattern, replacement, message):
    path = own.with_name(name)
    text = changed(path.read_text("utf-8"), pattern, replacement)
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    line = refused(["walk", "--robot", own], own.with_name("out"))
    assert re.search(message, line), line


@pytest.mark.parametrize(("values", "code", "message"), CHANGES)
def test_changed_numbers(tmp_path, refused, values, code, message):
    verb = "stand" if values[0].startswith("standing") else "walk"
    words = [verb, *(word for value in values for word in ("--set", value))]
    line = refused(words, tmp_path / "out", code)
    assert re.search(message, line), line


@pytest.mark.parametrize(("words", "message"), COMMANDS)
def test_commands(root, tmp_path, monkeypatch, refused, words, message):
    monkeypatch.chdir(root)
    os.mkfifo(tmp_path / "pipe.toml")
    line = refused([word.replace("{}", str(tmp_path)) for word in words])
    assert re.search(message, line), line


def test_a_mass_that_the_urdf_does_not_take(own, refused):
    line = refused(["walk", "--robot", own, "--set", "total_mass=50"], own.with_name("out"))
    assert re.search(r"bodies .* are those of own.urdf.*gait.payload_mass", line), line
