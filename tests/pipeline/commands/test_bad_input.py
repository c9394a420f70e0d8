"""Unusable input: one line that names the place and the remedy, exit 2, nothing half-written.

Every row is a trial that once ended in a traceback, in a number that was quietly wrong, or in a
message without a place.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import pytest

from tests.command_line import Refused
from tests.pipeline.commands.robots import changed, edited_robot, own_robot

#: what is wrong: pattern in the hexapod's robot file, replacement, message
ROBOT_FILES = {
    "malformed TOML": (r"^\[robot\]", "[robot", r"malformed TOML: .*line 5"),
    "unknown key": (r"^base = ", "bass = ", r"unknown key 'bass': did you mean 'base'"),
    "unknown station": (r'"middle"', '"midle"', r"did you mean 'middle'"),
    "beyond any robot": (r"value = 40$", "value = 1e300", r"total_mass.*is beyond any machine"),
    "missing number": (r"^\[parameters\.total_mass\].*?\n\n", "", r"missing parameter 'total_m"),
    "negative mass": (r"value = 40$", "value = -40", r"total_mass = -40 kg must be positive"),
    "lift in metres": (r"(foot_lift\]\nvalue = )75", r"\g<1>0.075", r"is 0.075 m meant\?"),
    "gravity in centimetres": (
        r"(gravity\]\nvalue = )[\d.]+(.*?interval = \[)[\d., ]+",
        r"\g<1>981\g<2>980, 982",
        r"gravity = 981 .* lies outside",
    ),
    "mass in grams": (r"value = 40$", "value = 40000", r"masses in g"),
    "limits in degrees": (
        r'(joint_2_upper\]\nvalue = )80\nunit = "deg"(.*?)interval = \[45, 100\]',
        r'\g<1>115\nunit = "rad"\2interval = [100, 120]',
        r"is 115 deg meant\?",
    ),
    "leg with a slash": (r"^\[legs\.lf\]", '[legs."a/b"]', r"'legs.a/b': a name holds '/'"),
    "leg without a name": (r"^\[legs\.lf\]", '[legs.""]', r"a name is empty"),
    "joint with a comma": (r'"lf_joint_2"', '"a,b"', r"'legs.lf.joints.2': a name holds ','"),
}
FOOT, POSTURE = r"neutral_foot = \[[^\]]*\]", r"\g<0>\nstart_posture = "
#: the same, where the robot file names a URDF of the user's own
OWN_FILES = {
    "two joints": (r', "rm_joint_3"', "", r"'rm_foot_link' is not carried by 'rm_joint_2'"),
    "no place for a foot": (r"^neutral_foot = .*?$", "", r"missing: legs.\w\w.neutral_foot"),
    "a leg left out": (r"^\[legs\.rm\].*?(?=^\[)", "", r"no leg 'rm'"),
    "feet in millimetres": (
        FOOT,
        "neutral_foot = [270, 260, -295]",
        r"270 at place 1.* are these milli",
    ),
    "feet of many digits": (
        FOOT,
        f"neutral_foot = [{10**400}, 0.26, -0.29]",
        r"'legs.lf.neutral_foot.1': Input should be a valid number",
    ),
    "posture in degrees": (
        FOOT,
        POSTURE + "[0, 45, -90]",
        r"has 45 at place 2.* are these degrees",
    ),
    "the knee the other way": (
        FOOT,
        POSTURE + "[0, -1.0, 3.0]",
        r"state another start_posture",
    ),
    "another base": (r'= "base_link"$', '= "trunk"', r"the root of own.urdf is 'base_link'"),
}
#: pattern in a URDF of the user's own, replacement, message
URDFS = {
    "another mass": (
        r'(<link name="base_link">.*?<mass value=)"[^"]*"',
        r'\1"5.6"',
        r"total mass fails \(links add up to 21\.\d+ kg, stated 40 kg",
    ),
    "a mimic": (
        r'(name="lf_joint_2"[^>]*>)',
        r'\1<mimic joint="lf_joint_1"/>',
        r"mimics 'lf_joint_1'",
    ),
    "link twice": (r'name="lf_femur_link">', 'name="lf_hip_link">', r"'lf_hip_link' is not unique"),
    "joint twice": (r'name="lf_joint_2"', 'name="lf_joint_1"', r"'lf_joint_1' is not unique"),
    "no parent": (r'<parent link="base_link" />', "", r"\[lf_joint_1\] is missing a parent"),
    "unknown child": (
        r'child link="lf_femur',
        'child link="lf_fmur',
        r"\[lf_fmur\w*\] of joint \[\w+\] not found",
    ),
    "a circle": (
        r'(parent link=)"base_link"',
        r'\1"lf_tibia_link"',
        r"lf_hip_link, .* hang on no root",
    ),
    "two roots": (r"</robot>", '<link name="lost"/></robot>', r"Two root links found: .*\[lost\]"),
    "unknown type": (
        r'type="revolute"',
        'type="revolut"',
        r"\[lf_joint_1\] has no known type \[revolut\]",
    ),
    "no axis": (
        r'<axis xyz="[^"]*"',
        '<axis xyz="0 0 0"',
        r"'lf_joint_1': axis '0 0 0' has no dir",
    ),
    "half an axis": (
        r'axis xyz="[^"]*"',
        'axis xyz="0 1"',
        r"axis .*\[lf_joint_1\]: .* 2 elements",
    ),
    "decimal comma": (
        r'mass value="(\d+)\.',
        r'mass value="\1,',
        r"\[base_link\].*write decimal dots",
    ),
    "underscores": (r'mass value="[^"]*"', 'mass value="2_4.0"', r"\[2_4.0\] is not a float"),
    "five moments": (r' iyz="0"', "", r"missing iyz attribute; .*\[base_link\]"),
    "a macro": (r"<link name", r'<xacro:leg name="x"/>\g<0>', r"macros; expand"),
    "an entity": (r"<robot", r'<!DOCTYPE r [<!ENTITY a "b">]>\g<0>', r"entity 'a' is declared"),
    "a mesh of no file": (r'<box size="[^"]*" />', "<mesh />", r"Mesh must contain a filename"),
    "a broken tag": (r"</inertial>", "</inertia>", r"malformed XML: .* line 9"),
    "another joint that moves": (
        r"</robot>",
        '<link name="head"/><joint name="neck" type="continuous"><parent link="base_link"/>'
        '<child link="head"/></joint></robot>',
        r"joints of the URDF in no leg: 'neck'",
    ),
    "negative mass": (r'(lf_femur_link">.*?<mass value=")', r"\1-", r"mass positive fails"),
    "negative moment": (r'ixx="[^"]*"', 'ixx="-0.1"', r"inertia possible fails .* may be negative"),
    "moment beyond the others": (r'ixx="[^"]*"', 'ixx="9"', r"fails .*may not exceed the sum"),
    "beyond any robot": (
        r'(<inertial>\s*<origin xyz=")0',
        r"\g<1>1e300",
        r"<origin xyz='1e300 .* is beyond any robot",
    ),
    "no limit": (r"<limit[^>]*/>", "", r"\[lf_joint_1\] .* does not specify limits"),
}
#: what the robot file holds, as a change of the hexapod's bytes, and the message
BYTES = {
    "nothing": (lambda t: b"", r"'robot': Field required; 'parameters'"),
    "Latin-1": (lambda t: t.replace("n", "\xe9").encode("latin-1"), r"byte 0xe9 is not UTF-8"),
    "a list of robots": (
        lambda t: t.replace("[robot]", "[[robot]]").encode(),
        r"'robot': Input should be a valid dictionary, not",
    ),
    "itself": (lambda t: b'extends = "robot.toml"', r"extends itself"),
    "a parent of no name": (lambda t: b'extends = ""', r"is a folder, a file is expected"),
    "a parent of no file": (lambda t: b'extends = "a\\u0000b"', r"embedded null byte"),
}
#: what the URDF file holds instead
URDF_BYTES = {
    "nothing": (b"", r"own.urdf: the file is empty"),
    "a mesh": (b"solid x\nfacet normal 0 0 1", r"own.urdf: malformed XML: .* line 1"),
    "SDF": (b"<sdf/>", r"the root element is <sdf> .*expected <robot>"),
    "no links": (b'<robot name="x"/>', r"own.urdf: No link elements"),
    "bytes": (bytes(range(128, 256)), r"line 1: byte 0x80 is not UTF-8 text; .*own.toml names it"),
}
#: what is wrong: value of --set, message
CHANGES = {
    "no value": ("femur_mass", r"expected KEY=VALUE"),
    "unknown key": ("femur_mas=1", r"did you mean 'femur_mass'"),
    "unlike any key": ("colour=1", r"no such number; parameters.csv of any run lists all names"),
    "unknown component key": ("harmonic_drive.lod=1", r"did you mean 'harmonic_drive.load'"),
    "number in another unit": ("femur_mass=1 m", r"expected a mass such as .1 kg"),
    "NaN": ("femur_mass=nan", r"femur_mass=nan: .nan. is no finite number"),
    "outside the link": ("tibia_com=1.2", r"tibia_com = 1.2 1 lies outside 0 to 1"),
    "no trunk left": ("femur_mass=6", r"leave -[\d.]+ kg for the trunk"),
    "negative friction": ("harmonic_drive.load=-0.1", r"outside its bounds \[0, 0.5\]"),
    "ratios apart": ("harmonic_drive.ratio=90", r"'requirement.ratio' asks for 400"),
    "radians for degrees": ("joint_1_axis_angle=1e5", r"= 100000 deg lies outside"),
    "beyond any machine": ("motor_re40_24v.supply_voltage=1e300", r"V is beyond any machine"),
    "beyond the joints": ("joint_1_range=5", r"'\w+_joint_1' would have to reach .* deg at t ="),
    "knee too short": ("tibia_length=100", r"mm beyond its reach; shorten the stroke"),
}
#: options, message
OPTIONS = {
    "zero samples": (["--samples", "0"], r"'samples': .* greater than or equal to 51, not 0"),
    "regeneration": (["--regeneration", "bsu"], r"expected none, bus or a fraction"),
    "negative regeneration": (["--regeneration=-0.1"], r"expected none, bus or a fraction"),
    "unknown option": (["--sampels", "9"], r"unrecognized arguments: --sampels"),
    "stroke out of reach": (
        ["--set", "foot_stroke=900", "--set", "gait_period=11.25", "--set", "hip_spacing=1000"],
        r"leg '\w\w' at t = .* mm beyond its reach",
    ),
    "no folder": (["--out", ""], r"argument --out: expected a name, got an empty one"),
    "a folder for a model": (["--model", "."], r"\.: is a folder, a file is expected"),
    "no actuators": (["--actuators", "/nowhere"], r"/nowhere/alternatives.toml: no such file"),
    "samples without end": (["--samples", "100000000"], r"less than or equal to 100000"),
    "metres": (["--set", "hip_spacing=0.28"], r"hip_spacing = 0.28 mm .* is 0.28 m meant\?"),
}
#: values of --set, exit code, message
GAITS = {
    "a dynamic gait": (["gait.name=Flying trot"], 2, r"no gait 'Flying trot': known: crawl"),
    "half a table": (["gait.phase={lf=0"], 2, r"gait.phase: malformed TOML"),
    "no table": (["gait.phase=3"], 2, r"gait.phase': Input should be a valid dictionary"),
    "no leg": (["standing.feet=lf,lx"], 2, r"no leg 'lx'.*standing.feet=lf,lm,lr"),
    "a stroke that follows from others": (
        ["gait.speed=0.1 m/s", "gait.period=2 s", "foot_stroke=230"],
        2,
        r"^foot_stroke: it changes nothing",
    ),
    "contradiction": (
        ["gait.speed=0.1 m/s", "gait.period=3 s", "gait.stroke=240 mm"],
        2,
        r"moves 0.15 m on the ground, but gait.stroke is 0.24 m",
    ),
    "no such margin": (
        ["gait.sway=least", "gait.stability_margin=90 mm"],
        2,
        r"no sway of the body keeps a margin of 90.0 mm",
    ),
    "tips on the slope": (["gait.slope_forward=25 deg"], 1, r"the robot tips at t = "),
    "stands on two feet": (["standing.feet=lf,rf"], 2, r"stands on 2 feet"),
    "stands in one line": (["standing.feet=lf,lm,lr"], 1, r"tips: .* the feet stand in one line"),
    "hips less than the stroke apart": (
        ["hip_spacing=200"],
        1,
        r"leg 'lf' would have to pull with \d+\.\d N",
    ),
}
#: what `--robot` names, message
ROBOTS = {
    "nowhere": ("nowhere.toml", r"nowhere.toml: no such file"),
    "a folder": (".", r"is a folder"),
    "on a stand": ("leg.toml", r"a robot on a stand neither stands nor walks"),
    "a pipe": ("pipe.toml", r"is no regular file"),
    "a loop of links": ("loop.toml", r"cannot be read \("),
}
#: whole commands, message
COMMANDS = {
    "no verb": ([], r"--help"),
    "a word too many": (["walk", "extra"], r"--help"),
    "a folder for a log": (["gap", "."], r"is a folder; name its CSV or Parquet files"),
    "a walk on two feet": (["walk", "--robot", "bolt"], r"a URDF says nothing of legs"),
    "init into no TOML": (["init", "solo12", "--out", "a.txt"], r"a.txt: a robot file's name ends"),
    "init's unknown foot": (["init", "a1", "--foot", "nose"], r"no link moves of name 'nose'"),
    "no such part": (["components", "maxon_14886"], r"did you mean 'maxon_148867'"),
    "no parts": (["components", "--parts", "nowhere"], r"nowhere: no such folder"),
    "choose: no such part": (
        ["choose", "--only", "maxon_63404X"],
        r"no part or kind 'maxon_63404X'",
    ),
    "choose: no such kind": (["choose", "--only", "strain_wav"], r"strain_wave"),
    "choose: no voltage": (["choose", "--pack", "catl_lfp"], r"'catl_lfp' states no voltage"),
    "choose: one draw": (["choose", "--draws", "1"], r"'draws': .* greater than or equal to 8"),
    "choose: no such policy": (["choose", "--regeneration", "buss"], r"expected none, bus or a fr"),
    "choose: a bus": (["choose", "--regeneration", "bus"], r"expected none or a fraction"),
    "choose: no such driver": (["choose", "--driver", "moteus_x2"], r"moteus_x1"),
    "choose: a driver for a pack": (["choose", "--pack", "moteus_x1"], r"no battery 'moteus_x1'"),
    "choose: volts for watts": (["choose", "--idle", "2 V"], r"idle"),
    "walk: no such rule": (["walk", "--forces", "least_tork"], r"choose from .*'least_torque'"),
    "walk: negative friction": (["walk", "--friction-coefficient", "-1"], r"greater than 0"),
    "walk: no motion": (["walk", "--motion", "nowhere.csv"], r"nowhere.csv: no such file"),
}
TABLES: dict[str, dict[str, Any]] = {
    "robot": ROBOT_FILES,
    "own": OWN_FILES,
    "urdf": URDFS,
    "bytes": BYTES,
    "urdf bytes": URDF_BYTES,
    "set": CHANGES,
    "option": OPTIONS,
    "gait": GAITS,
    "file": ROBOTS,
    "command": COMMANDS,
}


def prepared(root: Path, folder: Path, kind: str, given: list[Any]) -> list[str]:
    """The words of a command that a row makes, its files written into a folder."""
    sets = [
        word for change in (given[0] if kind == "gait" else given) for word in ("--set", change)
    ]
    own, hexapod = folder / "own.toml", root / "urdf" / "hexapod.toml"
    if kind in ("own", "urdf", "urdf bytes"):
        own_robot(root, folder, *(given if kind == "urdf" else ("</robot>", "</robot>")))
    match kind:
        case "robot":
            return ["walk", "--robot", str(edited_robot(root, folder, *given))]
        case "own":
            own.write_text(changed(own.read_text("utf-8"), *given), "utf-8")
        case "urdf bytes":
            (folder / "own.urdf").write_bytes(given[0])
        case "bytes":
            own = folder / "robot.toml"
            own.write_bytes(given[0](hexapod.read_text("utf-8")))
        case "set":
            return ["walk", *sets]
        case "gait":
            return ["stand" if given[0][0].startswith("standing") else "walk", *sets]
        case "option":
            return ["walk", *given[0]]
        case "command":
            return list(given[0])
        case "file":
            os.mkfifo(folder / "pipe.toml")
            (folder / "loop.toml").symlink_to(folder / "loop.toml")
            here = folder / given[0]
            own = here if given[0] in ("pipe.toml", "loop.toml") else root / "urdf" / given[0]
    return ["walk", "--robot", str(own)]


@pytest.mark.parametrize(
    ("kind", "what"), [(k, what) for k, rows in TABLES.items() for what in rows]
)
def test_bad_input(
    root: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    refused: Refused,
    kind: str,
    what: str,
) -> None:
    monkeypatch.chdir(root)
    *given, message = TABLES[kind][what]
    expected = given.pop() if kind == "gait" else 2
    words = prepared(root, tmp_path, kind, given)
    to = words and "--out" not in words and words[0] in ("walk", "stand", "gap", "choose")
    line = refused(words, tmp_path / "out" if to else None, expected)
    assert re.search(message, line), line


def test_a_mass_that_the_urdf_does_not_take(root: Path, tmp_path: Path, refused: Refused) -> None:
    robot = own_robot(root, tmp_path, "</robot>", "</robot>")
    line = refused(["walk", "--robot", robot, "--set", "total_mass=50"], tmp_path / "out")
    assert re.search(r"bodies .* are those of own.urdf.*gait.payload_mass", line), line


def test_missing_urdf(root: Path, tmp_path: Path, refused: Refused) -> None:
    robot = own_robot(root, tmp_path, "</robot>", "</robot>")
    (tmp_path / "own.urdf").unlink()
    line = refused(["walk", "--robot", robot], tmp_path / "out")
    assert re.search(r"own.urdf: no such file; .*own.toml names it", line), line
