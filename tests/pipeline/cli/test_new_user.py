"""What a new user gets wrong: encodings, units, names, places; one line each, exit 2, no file.

Every row is a trial that once ended in a traceback, in a number that was quietly wrong, or in a
message without a place.
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import pytest

from pipeline.cli.main import parser
from pipeline.cli.options import settings_of
from pipeline.paper.judgement.basis import Basis, basis
from tests.command_line import Command, exit_code, rows_of
from tests.pipeline.cli.robots import changed, edited_robot, own_robot
from tests.pipeline.cli.test_bad_input import refused

#: what the robot file holds, as a change of the hexapod's bytes, and the message
BYTES = {
    "nothing": (lambda t: b"", r"missing: robot.name, robot.urdf, .*parameters.gravity \[m/s\^2\]"),
    "UTF-16": (lambda t: t.encode("utf-16"), r"is UTF-16 text; save it as UTF-8"),
    "Latin-1": (
        lambda t: t.replace("[robot]", "# caf\xe9\n[robot]").encode("latin-1"),
        r"line 5: byte 0xe9 is not UTF-8",
    ),
    "a picture": (lambda t: b"\x89PNG\r\n\x1a\n" + bytes(range(256)), r"line 1: byte 0x89 is not"),
    "zeros": (lambda t: b"\0" * 100, r"malformed TOML"),
    "brackets": (lambda t: b"a=" + b"[" * 100_000, r"malformed TOML: tables are nested too deeply"),
    "digits": (lambda t: b"a=" + b"9" * 10_000, r"malformed TOML: a number has thousands of dig"),
    "42 MB": (lambda t: b"#" * 42_000_000, r"has 42 MB, expected at most"),
    "a list of robots": (
        lambda t: t.replace("[robot]", "[[robot]]").encode(),
        r"'robot' must be a table",
    ),
    "itself": (lambda t: b'extends = "robot.toml"', r"extends itself"),
    "a parent of no name": (lambda t: b'extends = ""', r"is a folder, a file is expected"),
    "a parent of no file": (lambda t: b'extends = "a\\u0000b"', r"no file can have this name"),
    "a parent that is none": (lambda t: b'extends = "none.toml"', r"none.toml: no such file"),
}
#: pattern in the hexapod's robot file, replacement, message
NUMBERS = {
    "stroke in metres": (
        r"(foot_stroke\]\nvalue = )240",
        r"\g<1>0.24",
        r"foot_stroke = 0.24 mm is shorter than in any walking robot; is 0.24 m meant\?",
    ),
    "stroke of 240 m": (
        r'(foot_stroke\]\nvalue = 240\nunit = )"mm"',
        r'\1"m"',
        r"foot_stroke = 240 m is longer than in any walking robot; is 240 mm meant\?",
    ),
    "lift in metres": (r"(foot_lift\]\nvalue = )75", r"\g<1>0.075", r"is 0.075 m meant\?"),
    "gravity in cm/s^2": (
        r"(gravity\]\nvalue = )[\d.]+(.*?interval = \[)[\d., ]+",
        r"\g<1>981\g<2>980, 982",
        r"gravity is beyond any planet; check its unit",
    ),
    "mass in grams": (r"value = 40$", "value = 40000", r"in 15.\d litres, denser than any metal"),
    "limits in degrees": (
        r'(joint_2_upper\]\nvalue = )80\nunit = "deg"(.*?)interval = \[45, 100\]',
        r'\g<1>115\nunit = "rad"\2interval = [100, 120]',
        r"robot.toml: parameters.joint_2_upper = 115 rad is more than a turn; is 115 deg meant\?",
    ),
    "half an interval": (r"interval = \[80, 200\]", "interval = [80]", r"must be \[low, high\]"),
    "interval of NaN": (r"interval = \[80, 200\]", "interval = [nan, 1]", r"must be a finite num"),
    "leg with a slash": (r"^\[legs\.lf\]", '[legs."a/b"]', r"'legs.a/b': a name holds '/'"),
    "leg without a name": (r"^\[legs\.lf\]", '[legs.""]', r"a name is empty"),
    "joint with a path": (r'"lf_joint_2"', '"../x"', r"'legs.lf.joints 2': a name holds '/'"),
    "joint with a comma": (r'"lf_joint_2"', '"a,b"', r"'legs.lf.joints 2': a name holds ','"),
    "joint of two legs": (r'"lf_joint_2"', '"lm_joint_2"', r"'lm_joint_2' belongs to two legs"),
    "several missing": (
        r'^urdf = .*?^base_link = [^\n]*$|^transfer_path = "\w+"$',
        "",
        r"missing: robot.urdf, robot.base_link; see urdf/hexapod.toml",
    ),
    "half a number": (
        r'(total_mass\]\nvalue = 40\n)unit = "kg"\nbasis = "published"\n',
        r"\1",
        r"parameters: 'total_mass': missing keys 'unit', 'basis'",
    ),
    "feet that nobody stands on": (r'feet = \["lf", "lr", "rm"\]', "feet = []", r"on 0 feet; .*3"),
}
#: pattern in a URDF of the user's own, replacement, message
URDFS = {
    "another mass": (
        r'(<link name="base_link">.*?<mass value=)"[^"]*"',
        r'\1"5.6"',
        r"total mass fails \(links add up to 21\.\d+ kg, stated 40 kg, 46 % apart",
    ),
    "degrees": (
        r'(<joint name="lf_joint_2".*?lower=")[^"]*(" upper=")[^"]*',
        r"\1-115\g<2>115",
        r"own.urdf: lf_joint_2: limits in radians fails \(-115 rad are 18.3 turns; degrees\?",
    ),
    "a mimic": (
        r'(<joint name="lf_joint_2"[^>]*>)',
        r'\1<mimic joint="lf_joint_1"/>',
        r"lf_joint_2\b.* mimics 'lf_joint_1'",
    ),
    "millimetres": (
        r'(<joint name="lf_joint_2".*?<origin xyz=)"[^"]*"',
        r'\1"0 180 0"',
        r"lf_joint_2: lengths in metres fails \(origin 0 180 0: 180 m from its parent; millimetres",
    ),
    "inertia in kg*mm^2": (
        r'(<link name="lf_tibia_link">.*?ixx=)"[^"]*"(.*?iyy=)"[^"]*"',
        r'\1"3000"\2"3000"',
        r"lf_tibia_link: inertia fits the size fails \(radius of gyration [\d.]+ m, the longest",
    ),
    "thigh without inertia": (
        r'(<link name="lf_femur_link">\s*)<inertial>.*?</inertial>',
        r"\1",
        r"lf_femur_link: mass positive fails \(0 kg: 'lf_joint_2' moves it; give it an <inertial>",
    ),
    "link twice": (
        r'<link name="lf_femur_link">',
        '<link name="lf_hip_link">',
        r"own.urdf: line 50: <link name='lf_hip_link'>: the name is taken by line 27; rename one",
    ),
    "joint twice": (
        r'<joint name="lf_joint_2"',
        '<joint name="lf_joint_1"',
        r"line 43: <joint name='lf_joint_1'>: the name is taken by line 20",
    ),
    "no parent": (
        r'<parent link="base_link" />',
        "",
        r"line 20: <joint name='lf_joint_1'>: has no <parent link=...>",
    ),
    "unknown child": (
        r'<child link="lf_femur_link" />',
        '<child link="lf_fmur_link" />',
        r"line 43: <joint name='lf_joint_2'>: child 'lf_fmur_link' is no link; did you mean 'lf_",
    ),
    "a circle": (
        r'<parent link="base_link" />',
        '<parent link="lf_tibia_link" />',
        r"line 27: <link name='lf_hip_link'>: the joints above it run in a circle",
    ),
    "two roots": (
        r"</robot>",
        '<link name="lost"/></robot>',
        r"<link name='lost'>: hangs on no joint, and neither does 'base_link'",
    ),
    "unknown type": (r'type="revolute"', 'type="revolut"', r"'revolut'; did you mean 'revolute'"),
    "no axis": (r'<axis xyz="[^"]*"', '<axis xyz="0 0 0"', r"line 20: .*'0 0 0' has no direction"),
    "half an axis": (
        r'<axis xyz="[^"]*"',
        '<axis xyz="0 1"',
        r"line 24: <axis>: xyz = '0 1', expected 3 finite numbers",
    ),
    "decimal comma": (
        r'mass value="(\d+)\.(\d+)"',
        r'mass value="\1,\2"',
        r"line 7: <mass>: value = '[\d,]+', expected a finite number; write decimal dots \(link 'b",
    ),
    "infinite mass": (r'mass value="[^"]*"', 'mass value="inf"', r"line 7: <mass>: value = 'inf'"),
    "underscores": (r'mass value="[^"]*"', 'mass value="2_4.0"', r"value = '2_4.0', expected a fi"),
    "no mass": (
        r'<mass value="[^"]*" />',
        "",
        r"line 4: <link name='base_link'>: .* without <mass",
    ),
    "five moments": (r' iyz="0"', "", r"line 4: .*<inertia> without iyz \[kg\*m\^2\]"),
    "a macro": (
        r'<link name="lf_femur_link">',
        '<xacro:leg name="x"/><link name="lf_femur_link">',
        r"line 50: <xacro:leg name='x'>: a macro; expand the file first",
    ),
    "an entity": (
        r"<robot",
        '<!DOCTYPE r [<!ENTITY a "b">]><robot',
        r"entity 'a' is declared; write the text itself",
    ),
    "a mesh of no file": (r'<box size="[^"]*" />', "<mesh />", r"line 13: <mesh> without filename"),
    "a flat box": (r'<box size="[^"]*"', '<box size="1 2"', r"size = '1 2', expected 3 finite num"),
    "a broken tag": (r"</inertial>", "</inertia>", r"line 9: malformed XML: mismatched tag at col"),
    "another joint that moves": (
        r"</robot>",
        '<link name="head"/><joint name="neck" type="continuous"><parent link="base_link"/>'
        '<child link="head"/></joint></robot>',
        r"joint 'neck' of the URDF belongs to no leg",
    ),
}
#: what the URDF file holds instead
URDF_BYTES = {
    "nothing": (b"", r"own.urdf: the file is empty"),
    "a mesh": (b"solid x\nfacet normal 0 0 1", r"line 1: not XML; a URDF is expected"),
    "SDF": (b"<sdf/>", r"the root element is <sdf>, expected <robot> \(SDF\); convert it"),
    "no links": (b'<robot name="x"/>', r"no <link>"),
    "bytes": (bytes(range(128, 256)), r"line 1: byte 0x80 is not UTF-8 text; .*own.toml names it"),
}
#: pattern in the robot file of a URDF of one's own, replacement, message
PLACES = {
    "feet in millimetres": (
        r"neutral_foot = \[[^\]]*\]",
        "neutral_foot = [270, 260, -295]",
        r"'legs.lf.neutral_foot': has 270 at place 1; it is written in metres, are these milli",
    ),
    "feet of NaN": (
        r"neutral_foot = \[[^\]]*\]",
        "neutral_foot = [nan, 0.26, -0.29]",
        r"'legs.lf.neutral_foot' must be a finite number",
    ),
    "feet of many digits": (
        r"neutral_foot = \[[^\]]*\]",
        f"neutral_foot = [{10**400}, 0.26, -0.29]",
        r"'legs.lf.neutral_foot' must be a finite number",
    ),
    "posture in degrees": (
        r"(neutral_foot = \[[^\]]*\])",
        r"\1\nstart_posture = [0, 45, -90]",
        r"start_posture': has 45 at place 2; it is written in radians, are these degrees \(0.7854",
    ),
    "the knee the other way": (
        r"(neutral_foot = \[[^\]]*\])",
        r"\1\nstart_posture = [0, -1.0, 3.0]",
        r"start_posture lies on another branch: .*choose the knee's branch: legs.lf: \[0.00, 0.25",
    ),
    "another base": (
        r'base_link = "base_link"',
        'base_link = "trunk"',
        r"base_link = 'trunk', the root of own.urdf is 'base_link'",
    ),
}
OPTIONS = {
    "no folder": (["--out", ""], r"argument --out: expected a name, got an empty one"),
    "a blank folder": (["--out", " "], r"argument --out: expected a name, got an empty one"),
    "no model": (["--model", ""], r"argument --model: expected a name, got an empty one"),
    "a folder for a model": (["--model", "."], r"\.: is a folder, a file is expected"),
    "no actuators": (["--actuators", "/nowhere"], r"/nowhere/alternatives.toml: no such file"),
    "samples without end": (
        ["--samples", "100000000"],
        r"18 joints and 4 actuators need about 6480 GB of memory \(64.8 kB per sample\), .* GB are "
        r"free; at most \d+ samples fit",
    ),
    "metres": (["--set", "hip_spacing=0.28"], r"hip_spacing = 0.28 mm .* is 0.28 m meant\?"),
}


@pytest.mark.parametrize("what", BYTES)
def test_bytes_of_a_robot_file(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    make, message = BYTES[what]
    robot = tmp_path / "robot.toml"
    robot.write_bytes(make((root / "urdf" / "hexapod.toml").read_text(encoding="utf-8")))
    refused(capsys, tmp_path / "out", command("walk", tmp_path / "out", robot=robot), message)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda t: b"\xef\xbb\xbf" + t.encode(),
        lambda t: t.replace("\n", "\r\n").encode(),
    ],
    ids=["byte-order mark", "CRLF"],
)
def test_files_of_other_editors_are_read(
    root: Path, tmp_path: Path, command: Command, out: Path, spoil: object
) -> None:
    robot = tmp_path / "robot.toml"
    assert callable(spoil)
    robot.write_bytes(spoil((root / "urdf" / "hexapod.toml").read_text(encoding="utf-8")))
    assert command("stand", tmp_path, robot=robot) == 0
    assert (tmp_path / "standing.csv").read_bytes() == (out / "standing.csv").read_bytes()


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1", "utf-8-sig"])
def test_a_urdf_is_read_in_the_encoding_it_declares(
    root: Path, tmp_path: Path, command: Command, out: Path, encoding: str
) -> None:
    robot = own_robot(root, tmp_path, "</robot>", "<!-- caf\xe9 --></robot>")
    urdf = tmp_path / "own.urdf"
    text = urdf.read_text(encoding="utf-8")
    if encoding == "latin-1":
        text = text.replace('version="1.0"?', 'version="1.0" encoding="iso-8859-1"?')
    urdf.write_bytes(text.encode(encoding))
    assert command("stand", tmp_path, robot=robot) == 0
    assert len(rows_of(tmp_path / "standing.csv")) == len(rows_of(out / "standing.csv"))


@pytest.mark.parametrize("what", NUMBERS)
def test_numbers_and_names(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    pattern, replacement, message = NUMBERS[what]
    robot = edited_robot(root, tmp_path, pattern, replacement)
    verb = "stand" if "feet" in what else "walk"
    refused(capsys, tmp_path / "out", command(verb, tmp_path / "out", robot=robot), message)


@pytest.mark.parametrize("what", URDFS)
@pytest.mark.parametrize("verb", ["walk", "gap"])
def test_urdf_of_ones_own(
    root: Path,
    tmp_path: Path,
    command: Command,
    capsys: pytest.CaptureFixture[str],
    what: str,
    verb: str,
) -> None:
    """Every verb that computes refuses it, with line and element where there is one."""
    pattern, replacement, message = URDFS[what]
    robot = own_robot(root, tmp_path, pattern, replacement)
    more = (
        [] if verb == "walk" else ["read", str(root / "pipeline/identification/demo/walk.parquet")]
    )
    code = exit_code([verb, *more, "--robot", str(robot), "--out", str(tmp_path / "out")])
    refused(capsys, tmp_path / "out", code, message)


@pytest.mark.parametrize("what", URDF_BYTES)
def test_bytes_of_a_urdf(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    content, message = URDF_BYTES[what]
    robot = own_robot(root, tmp_path, "</robot>", "</robot>")
    (tmp_path / "own.urdf").write_bytes(content)
    refused(capsys, tmp_path / "out", command("walk", tmp_path / "out", robot=robot), message)


@pytest.mark.parametrize("what", PLACES)
def test_feet_and_postures(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    pattern, replacement, message = PLACES[what]
    robot = own_robot(root, tmp_path, "</robot>", "</robot>")
    robot.write_text(changed(robot.read_text(encoding="utf-8"), pattern, replacement), "utf-8")
    refused(capsys, tmp_path / "out", command("stand", tmp_path / "out", robot=robot), message)


@pytest.mark.parametrize("what", OPTIONS)
@pytest.mark.parametrize("verb", ["walk", "reports"])
def test_options(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str, verb: str
) -> None:
    more, message = OPTIONS[what]
    refused(capsys, tmp_path / "out", command(verb, tmp_path / "out", *more), message)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--robot", "urdf/leg.toml"], r"leg.toml: its base is fixed, so it does not walk; .*give"),
        (
            ["--robot", "urdf/hexapod_axis90.toml"],
            r"the result is written into this file, which do",
        ),
        (["--robot", "urdf/leg.urdf"], r"a URDF says nothing of legs"),
        (["--workers", "0"], r"--workers 0: at least one process"),
        (["--seed", "-1"], r"--seed -1: expected zero or a positive number"),
    ],
)
def test_calibrate_refuses_before_it_starts(
    root: Path,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(root)
    refused(capsys, tmp_path / "out", exit_code(["calibrate", *arguments]), message)


@pytest.mark.parametrize("what", ["a device", "a loop of links", "a pipe", "a folder"])
def test_what_is_no_file(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    robot = tmp_path / "a.toml"
    if what == "a device":
        robot = Path("/dev/zero")
    elif what == "a loop of links":
        robot.symlink_to(tmp_path / "b.toml")
        (tmp_path / "b.toml").symlink_to(robot)
    elif what == "a pipe":
        os.mkfifo(robot)
    else:
        robot.mkdir()
    message = {"a loop of links": r"cannot be read \(", "a folder": "is a folder"}.get(
        what, "is no regular file"
    )
    refused(capsys, tmp_path / "out", command("walk", tmp_path / "out", robot=robot), message)


def test_a_folder_is_no_log(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    code = exit_code(["gap", str(tmp_path), "--out", str(tmp_path / "out")])
    refused(capsys, tmp_path / "out", code, r"is a folder; name its CSV or Parquet files")


def test_a_thousandfold_change_is_said(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("stand", tmp_path, "--set", "trunk_com_left=0.0068") == 0
    assert re.search(
        r"trunk_com_left = 0.0068 mm is about a thousand times less than the file's 6.8\d*; --set",
        capsys.readouterr().out,
    )


def test_cost_of_transport_has_the_mass_of_the_forces(
    root: Path, tmp_path: Path, command: Command
) -> None:
    """Stated masses are rounded: within half a percent the URDF's own counts, everywhere."""
    pattern = r'(<link name="base_link">.*?<mass value=)"([\d.]+)"'
    robot = own_robot(root, tmp_path, pattern, r'\1"24.15"')
    # Without the links' inertia the feet carry the weight alone.
    assert command("walk", tmp_path, "--quasi-static", robot=robot) == 0
    forces = rows_of(tmp_path / "walking_contact_forces.csv")
    weight = sum(float(forces[0][k] or 0) for k in forces[0] if k.endswith("__force_z_N"))
    assert weight != pytest.approx(40 * 9.81, rel=1e-3)
    for row in rows_of(tmp_path / "robot_energy.csv"):
        transport = float(row["average_power_W"]) / (weight * 0.16)
        assert float(row["cost_of_transport"]) == pytest.approx(transport, rel=1e-6)


def without_ideal(root: Path, folder: Path) -> Path:
    """The project's actuators without the ideal one, as a catalogue of one's own."""
    shutil.copytree(root / "actuators" / "catalog", folder)
    file = folder / "alternatives.toml"
    text = changed(file.read_text(encoding="utf-8"), r"^\[ideal\].*?(?=^\[rotor\])", "")
    file.write_text(text, encoding="utf-8")
    return folder


@pytest.mark.parametrize("verb", ["stand", "walk"])
def test_actuators_of_ones_own(root: Path, tmp_path: Path, command: Command, verb: str) -> None:
    """`--actuators` as for `gap`: another folder, here without the ideal actuator."""
    folder = without_ideal(root, tmp_path / "actuators")
    assert command(verb, tmp_path / "out", "--actuators", str(folder)) == 0
    name = "walking_energy.csv" if verb == "walk" else "standing_energy.csv"
    rows = rows_of(tmp_path / "out" / name)
    assert {row["alternative"] for row in rows} == {"rotor", "reversible", "irreversible"}


def test_a_robot_and_actuators_of_ones_own_are_reported(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    """Meshes that are nowhere are skipped, legs are sticks; nothing is held against a paper."""
    robot = own_robot(root, tmp_path, "</robot>", "</robot>")
    urdf = tmp_path / "own.urdf"
    mesh = '<mesh filename="package://nowhere/link.stl"/>'
    text = re.sub(r"<(box|sphere) [^>]*/>", mesh, urdf.read_text(encoding="utf-8"))
    urdf.write_text(text, encoding="utf-8")
    folder = without_ideal(root, tmp_path / "actuators")
    assert command("reports", tmp_path / "out", "--actuators", str(folder), robot=robot) == 0
    assert capsys.readouterr().err == ""
    for figure in ("robot", "zero_pose", "gait"):
        assert (tmp_path / "out" / f"{figure}.png").stat().st_size > 10_000
    assert not (tmp_path / "out" / "reproduction.csv").exists()


def test_the_projects_robot_is_held_against_the_paper_as_far_as_its_actuators_are_the_papers(
    root: Path, tmp_path: Path
) -> None:
    options = parser().parse_args(
        ["reports", "--actuators", str(without_ideal(root, tmp_path / "actuators"))]
    )
    options.robot = root / "urdf" / "hexapod.toml"
    by = basis(settings_of(options))
    assert isinstance(by, Basis)
    assert by.missing == ("ideal",)
    assert by.results is None
    options.actuators = None
    by = basis(settings_of(options))
    assert isinstance(by, Basis)
    assert by.missing == ()
    assert by.results is not None
