"""Unusable input: one line that names the place and the remedy, exit 2, nothing half-written."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.command_line import Command, exit_code, rows_of
from tests.pipeline.cli.robots import changed, edited_robot, own_robot

#: what is wrong: pattern in the hexapod's robot file, replacement, message
ROBOT_FILES = {
    "malformed TOML": (r"^\[robot\]", "[robot", r"malformed TOML: .*line 5"),
    "unknown key": (
        r"^base = ",
        "bass = ",
        r"'robot': unknown key 'bass': did you mean 'base'",
    ),
    "unknown unit": (r'unit = "kg"', 'unit = "kgg"', r"'total_mass'.*'kgg'.*did you mean 'kg'"),
    "wrong dimension": (r'unit = "kg"', 'unit = "mm"', r"'mm' is a unit of length, expected mass"),
    "two joints": (r', "rm_joint_3"', "", r"'legs.rm': names 2 joints; a built leg has 3"),
    "unknown station": (
        r'"middle"',
        '"midle"',
        r"'legs.lm.station' = 'midle': did you mean 'middle'",
    ),
    "sets of no legs": (r"^tripods = .*?$", "tripods = 2", r"gait.tripods: must be two lists"),
    "beyond any robot": (r"value = 40$", "value = 1e300", r"total_mass.*is beyond any machine"),
    "unknown leg": (r'feet = \["lf"', 'feet = ["fl"', r"standing.feet: leg 'fl' is not known"),
    "unknown path": (
        r'path = "\w+"',
        'path = "cubical"',
        r"'cubical' is not known; did you mean 'cubic'",
    ),
    "missing number": (
        r"^\[parameters\.total_mass\].*?\n\n",
        "",
        r"missing: parameters.total_mass \[kg\]; see urdf/hexapod.toml",
    ),
    "no source": (r'source = "Table I"', 'source = ""', r"'body_length': no source"),
    "unknown basis": (r'"published"', '"publishd"', r"unknown basis.*did you mean 'published'"),
    "NaN": (r"value = 40$", "value = nan", r"'total_mass.value' must be a finite number"),
    "text for a number": (r"value = 40$", 'value = "40"', r"'total_mass.value' must be a number"),
    "negative mass": (r"value = 40$", "value = -40", r"total_mass = -40 kg must be positive"),
    "negative link mass": (
        r"(\[parameters\.tibia_mass\]\nvalue = )[\d.]+(.*?interval = \[)[\d.]+",
        r"\g<1>-0.5\g<2>-1",
        r"tibia_mass = -0.5 kg must be positive",
    ),
    "negative period": (r"value = 3$", "value = -3", r"gait_period = -3 s must be positive"),
    "zero period": (r"value = 3$", "value = 0", r"gait_period = 0 s must be positive"),
    "contradicting gait": (r"value = 3$", "value = 4", r"foot_stroke is 0.24 m; change one"),
    "one set of legs": (r', \["rf", "rr", "lm"\]', "", r"must part the legs .* in two sets"),
}
#: the same, where the robot file names a URDF of the user's own
OWN_FILES = {
    "unknown joint": (
        r'"rm_joint_1"',
        '"rm_joint_l"',
        r"'rm_joint_l' is not in the URDF; did you mean 'rm_joint_",
    ),
    "joints out of order": (
        r'"rm_joint_1", "rm_joint_2"',
        '"rm_joint_2", "rm_joint_1"',
        r"'rm_joint_2' hangs on 'rm_joint_1'.*base outward",
    ),
    "two joints": (
        r', "rm_joint_3"',
        "",
        r"foot 'rm_foot_link' is not carried by 'rm_joint_2'.* list",
    ),
    "unknown foot": (r'"rm_foot_link"', '"rm_fot_link"', r"did you mean 'rm_foot_link'"),
    "no place for a foot": (r"^neutral_foot = .*?$", "", r"missing: legs.\w\w.neutral_foot; see"),
    "a leg left out": (r"^\[legs\.rm\].*?(?=^\[)", "", r"leg 'rm' is not known"),
}
#: what is wrong: value of --set, message
CHANGES = {
    "no value": ("femur_mass", r"expected KEY=VALUE"),
    "empty key": ("=1", r"expected KEY=VALUE"),
    "unknown key": ("femur_mas=1", r"no such number; did you mean 'femur_mass'"),
    "unlike any key": ("colour=1", r"no such number; parameters.csv of any run lists all names"),
    "unknown component key": (
        "harmonic_drive.lod=0.1",
        r"no such number; did you mean 'harmonic_drive.load'",
    ),
    "not a number": ("femur_mass=heavy", r"femur_mass=heavy: expected a number"),
    "number with unit": ("femur_mass=1 kg", r"expected a number in kg, without the unit"),
    "NaN": ("femur_mass=nan", r"femur_mass=nan: expected a finite number"),
    "infinite": ("gait_period=1e999", r"expected a finite number"),
    "negative mass": ("femur_mass=-1", r"femur_mass = -1 kg must be positive"),
    "negative period": ("gait_period=-3", r"gait_period = -3 s must be positive"),
    "outside the link": ("tibia_com=1.2", r"tibia_com = 1.2 lies outside the link"),
    "no trunk left": ("femur_mass=6", r"leave -[\d.]+ kg for the trunk; lower the link masses"),
    "unknown path": ("gait.transfer_path=cubik", r"did you mean 'cubic'"),
    "negative friction": ("harmonic_drive.load=-0.1", r"outside its bounds \[0, 0.5\]"),
    "ratios apart": ("harmonic_drive.ratio=90", r"'requirement.ratio' asks for 400"),
    "radians for degrees": ("joint_1_axis_angle=1e5", r"= 100000 deg is more than a turn; check"),
    "beyond any machine": (
        "motor_re40_24v.supply_voltage=1e300",
        r"1e\+300 V is beyond any machine",
    ),
    "beyond the joints": ("joint_1_range=5", r"'\w+_joint_1' would have to reach .* deg at t ="),
    "knee too short": ("tibia_length=100", r"mm beyond its reach; shorten the stroke"),
}
OPTIONS = {
    "zero samples": (["--samples", "0"], r"--samples 0: at least 51"),
    "negative samples": (["--samples", "-5"], r"--samples -5: at least 51"),
    "NaN samples": (["--samples", "nan"], r"argument --samples: invalid int value: 'nan'"),
    "too few samples": (["--samples", "20"], r"--samples 20: at least 51"),
    "regeneration": (["--regeneration", "bsu"], r"expected none, bus or a fraction"),
    "negative regeneration": (["--regeneration=-0.1"], r"expected none, bus or a fraction"),
    "NaN regeneration": (["--regeneration", "nan"], r"expected none, bus or a fraction"),
    "decimal": (["--decimal", "point"], r"argument --decimal: invalid choice: 'point'"),
    "unknown option": (["--sampels", "9"], r"unrecognized arguments: --sampels"),
    "stroke out of reach": (
        ["--set", "foot_stroke=900", "--set", "gait_period=11.25", "--set", "hip_spacing=1000"],
        r"leg '\w\w' at t = .* mm beyond its reach; shorten the stroke",
    ),
}


def refused(
    capsys: pytest.CaptureFixture[str], out: Path, code: int, message: str, expected: int = 2
) -> None:
    printed = capsys.readouterr()
    assert code == expected, printed.err
    assert printed.out == ""
    assert printed.err.endswith("\n")
    assert printed.err.count("\n") == 1, printed.err
    assert "Traceback" not in printed.err
    assert re.search(message, printed.err), printed.err
    assert not out.exists()


GAITS = {
    "too few feet": (["gait.duty_factor=0.4"], 2, r"only 0 feet stand .*raise gait.duty_factor"),
    "always in the air": (["gait.duty_factor=0"], 2, r"--set gait.duty_factor=0: .* 0 it never"),
    "never in the air": (["gait.duty_factor=1"], 2, r"at 1 it never steps"),
    "gait of other legs": (["gait.name=crawl"], 2, r"for 4 legs, the robot has 6; for these: trip"),
    "no such gait": (["gait.name=riple"], 2, r"--set gait.name=riple: .*did you mean 'ripple'"),
    "a dynamic gait": (["gait.name=Flying trot"], 2, r"dynamic gait: .* fewer than 3 .*: crawl"),
    "a list for a name": (['gait.name=["trot"]'], 2, r"expected the name of a gait: crawl"),
    "no sets": (["gait.sets=[]"], 2, r"gait.sets must part the legs"),
    "text for lists": (
        ["gait.sets=lf,rm"],
        2,
        r'must be lists of leg names such as \[\["lf", "lr"',
    ),
    "half a table": (["gait.phase={lf=0"], 2, r"gait.phase: malformed TOML"),
    "no table": (["gait.phase=3"], 2, r"number for each leg such as \{lf = 0, lm = 0.167"),
    "no leg": (["standing.feet=lf,lx"], 2, r"'lx' is not known; .*standing.feet=lf,lm,lr"),
    "a stroke that follows from others": (
        ["gait.speed=0.1 m/s", "gait.period=2 s", "foot_stroke=230"],
        2,
        r"--set foot_stroke: it changes nothing",
    ),
    "no such key": (["gait.speeed=1 m/s"], 2, r"unknown key of \[gait\] 'speeed'; did you mean"),
    "no unit": (["gait.speed=1"], 2, r"gait.speed = 1.0 has no unit; expected text such as"),
    "contradiction": (
        ["gait.speed=0.1 m/s", "gait.period=3 s", "gait.stroke=240 mm"],
        2,
        r"moves 0.15 m on the ground, but gait.stroke is 0.24 m; change one or leave one out",
    ),
    "no such margin": (
        ["gait.sway=least", "gait.stability_margin=90 mm"],
        2,
        r"no sway of the body keeps a margin of 90.0 mm; .* is attainable: lower",
    ),
    "tips on the slope": (["gait.slope_forward=25 deg"], 1, r"the robot tips at t = "),
    "tips under the load": (
        ["gait.payload_mass=80 kg", "gait.payload_y=300 mm"],
        1,
        r"the robot tips at t = ",
    ),
    "stands on two feet": (["standing.feet=lf,rf"], 2, r"stands on 2 feet"),
    "stands on no such foot": (["standing.feet=lf,rf,xx"], 2, r"leg 'xx' is not known"),
}


@pytest.mark.parametrize("what", GAITS)
def test_gait(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    changes, expected, message = GAITS[what]
    options = [word for change in changes for word in ("--set", change)]
    verb = "stand" if changes[0].startswith("standing") else "walk"
    code = command(verb, tmp_path / "out", "--samples", "51", *options)
    refused(capsys, tmp_path / "out", code, message, expected)


@pytest.mark.parametrize("what", ROBOT_FILES)
def test_robot_file(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    pattern, replacement, message = ROBOT_FILES[what]
    robot = edited_robot(root, tmp_path, pattern, replacement)
    code = command("walk", tmp_path / "out", robot=robot)
    refused(capsys, tmp_path / "out", code, message)


@pytest.mark.parametrize("what", OWN_FILES)
def test_robot_file_with_an_own_urdf(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    pattern, replacement, message = OWN_FILES[what]
    robot = own_robot(root, tmp_path, "</robot>", "</robot>")
    robot.write_text(changed(robot.read_text(encoding="utf-8"), pattern, replacement), "utf-8")
    code = command("walk", tmp_path / "out", robot=robot)
    refused(capsys, tmp_path / "out", code, message)


@pytest.mark.parametrize("what", CHANGES)
def test_change(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    change, message = CHANGES[what]
    code = command("walk", tmp_path / "out", "--set", change)
    refused(capsys, tmp_path / "out", code, message)


@pytest.mark.parametrize("what", OPTIONS)
def test_option(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], what: str
) -> None:
    more, message = OPTIONS[what]
    code = command("walk", tmp_path / "out", *more)
    refused(capsys, tmp_path / "out", code, message)


@pytest.mark.parametrize(
    ("pattern", "replacement", "message"),
    [
        (
            r'(<link name="lf_femur_link">.*?<mass value=")',
            r"\1-",
            r"lf_femur_link: mass positive fails",
        ),
        (r'ixx="[^"]*"', 'ixx="-0.1"', r"inertia possible fails \(moments .*none may be negative"),
        (r'ixx="[^"]*"', 'ixx="9"', r"inertia possible fails \(moments .*may not exceed the sum"),
        (
            r'ixx="[^"]*"',
            'ixx="nan"',
            r"line \d+: <inertia>: ixx = 'nan', expected a finite number",
        ),
        (r"<limit[^>]*/>", "", r"own.urdf: line \d+: <joint name='\w+'>: .* needs <limit>"),
        (r"</robot>", "", r"own.urdf: line \d+: malformed XML"),
        (r'<joint name="rm_joint_2"', '<joint name="rm_knee"', r"'rm_joint_2' is not in the URDF"),
    ],
)
def test_urdf_of_ones_own(
    root: Path,
    tmp_path: Path,
    command: Command,
    capsys: pytest.CaptureFixture[str],
    pattern: str,
    replacement: str,
    message: str,
) -> None:
    robot = own_robot(root, tmp_path, pattern, replacement)
    code = command("walk", tmp_path / "out", robot=robot)
    refused(capsys, tmp_path / "out", code, message)


def test_a_mass_that_the_urdf_does_not_take(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = own_robot(root, tmp_path, "</robot>", "</robot>")
    code = command("walk", tmp_path / "out", "--set", "total_mass=50", robot=robot)
    refused(capsys, tmp_path / "out", code, r"bodies .* are those of own.urdf.*gait.payload_mass")


@pytest.mark.parametrize(
    ("robot", "message"),
    [
        ("nowhere.toml", r"nowhere.toml: no such file; name a robot file \(TOML\)"),
        (".", r"is a folder"),
        ("hexapod.urdf", r"a URDF says nothing of legs and gait; give a robot file"),
        ("leg.toml", r"a robot on a stand neither stands nor walks; give one with a floating base"),
    ],
)
def test_robot_that_is_none(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], robot: str, message: str
) -> None:
    code = command("walk", tmp_path / "out", robot=robot)
    refused(capsys, tmp_path / "out", code, message)


def test_missing_urdf(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = own_robot(root, tmp_path, "</robot>", "</robot>")
    (tmp_path / "own.urdf").unlink()
    code = command("walk", tmp_path / "out", robot=robot)
    refused(capsys, tmp_path / "out", code, r"own.urdf: no such file; .*own.toml names it")


def test_a_robot_that_tips_is_a_finding(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    """Hips less than the stroke apart: exit 1, with instant, foot, force and margin."""
    code = command("walk", tmp_path / "out", "--set", "hip_spacing=200")
    message = (
        r"tips at t = 0 s .* leg 'lf' would have to pull with \d+\.\d N, static margin -17\.\d mm"
    )
    refused(capsys, tmp_path / "out", code, message, expected=1)


def test_feet_in_one_line_are_a_finding(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = edited_robot(
        root, tmp_path, r'feet = \["lf", "lr", "rm"\]', 'feet = ["lf", "lm", "lr"]'
    )
    code = command("stand", tmp_path / "out", robot=robot)
    refused(capsys, tmp_path / "out", code, r"tips: .* the feet stand in one line", expected=1)


def test_two_feet_are_refused(
    root: Path, tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = edited_robot(root, tmp_path, r'feet = \["lf", "lr", "rm"\]', 'feet = ["lf", "rm"]')
    code = command("stand", tmp_path / "out", robot=robot)
    refused(capsys, tmp_path / "out", code, r"stands on 2 feet; .* at least 3")


@pytest.mark.parametrize("place", ["a file", "below a file", "no folder", "no file"])
def test_output_that_cannot_be_written(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str], place: str
) -> None:
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    out = {
        "a file": tmp_path / "file",
        "below a file": tmp_path / "file" / "out",
        "no folder": Path("/proc/legwatt-out"),
        "no file": Path("/proc"),
    }[place]
    code = command("stand", out)
    error = capsys.readouterr().err
    assert code == 2
    assert error.count("\n") == 1
    assert "choose another folder" in error
    assert error.startswith(f"{out}: ")  # no name of our own
    assert (tmp_path / "file").read_text(encoding="utf-8") == "mine"
    assert {p.name for p in tmp_path.iterdir()} == {"file"}


def test_a_folder_in_the_way_of_a_table(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "standing.csv").mkdir()
    assert command("stand", tmp_path) == 2
    assert "standing.csv: is a folder, a file was to be written" in capsys.readouterr().err
    assert {p.name for p in tmp_path.iterdir()} == {"standing.csv"}


def test_own_urdf_walks_like_the_built_one(
    root: Path, tmp_path: Path, command: Command, out: Path
) -> None:
    """The robot of the refusals above is sound before it is spoilt, and gives the same numbers."""
    assert command("stand", tmp_path, robot=own_robot(root, tmp_path, "</robot>", "</robot>")) == 0
    for own, built in zip(
        rows_of(tmp_path / "standing.csv"), rows_of(out / "standing.csv"), strict=True
    ):
        for column, value in built.items():
            if column in ("alternative", "joint"):
                assert own[column] == value
            else:
                assert float(own[column]) == pytest.approx(float(value), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("arguments", [[], ["wlak"], ["walk", "extra"], ["check"]])
def test_grammar(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code(arguments) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "--help" in error
