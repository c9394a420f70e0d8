"""`gap` on unusable input: one line, exit 2, nothing written."""

from __future__ import annotations

import csv
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pyarrow.parquet as pq
import pytest

from pipeline.identification.workflow.options import Options
from pipeline.identification.workflow.setup import load_logs, setup
from pipeline.machine.machine import machine_of_urdf
from tests.command_line import exit_code, rows_of, sidecar_of
from tests.demo import DEMO
from tests.leg_log import leg_logs

Columns = dict[str, np.ndarray]


def write_log(path: Path, columns: Columns) -> Path:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*(v.tolist() for v in columns.values()), strict=True))
    return path


def leg_columns(rows: int = 1500) -> Columns:
    t = np.arange(rows) / 250.0
    columns: Columns = {"time_s": t}
    rng = np.random.default_rng(1)
    for k in (1, 2, 3):
        columns[f"rm_joint_{k}__position_rad"] = 0.3 * np.sin(2 * np.pi * (0.3 + 0.11 * k) * t)
    for k in (1, 2, 3):
        columns[f"rm_joint_{k}__current_A"] = 0.1 * np.sin(t) + 0.01 * rng.standard_normal(rows)
    return columns


def _short(c: Columns) -> Columns:
    return {name: values[:10] for name, values in c.items()}


def _backwards(c: Columns) -> Columns:
    c["time_s"][7] = c["time_s"][3]
    return c


def _missing(c: Columns) -> Columns:
    del c["rm_joint_2__position_rad"]
    return c


def _degrees(c: Columns) -> Columns:
    for name in c:
        if name.endswith("position_rad"):
            c[name] = np.degrees(c[name])
    return c


def _empty(c: Columns) -> Columns:
    c["rm_joint_1__current_A"] = np.full_like(c["time_s"], np.nan)
    return c


def _rounded(c: Columns) -> Columns:
    for name in c:
        if name.endswith("position_rad"):
            c[name] = 0.2 * np.round(c[name] / 0.2)
    return c


def _other_robot(c: Columns) -> Columns:
    return {name.replace("rm_joint", "elbow"): values for name, values in c.items()}


@pytest.mark.parametrize(
    "spoil", [_short, _backwards, _missing, _degrees, _empty, _other_robot, _rounded]
)
def test_a_bad_log_is_refused_in_one_line(
    tmp_path: Path,
    root: Path,
    capsys: pytest.CaptureFixture[str],
    spoil: Callable[[Columns], Columns],
) -> None:
    log = write_log(tmp_path / "bad.csv", spoil(leg_columns()))
    out = tmp_path / "out"
    robot = root / "urdf" / "leg.toml"
    assert exit_code(["gap", str(log), "--robot", str(robot), "--out", str(out)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "bad" in err
    assert not out.exists()


@pytest.fixture(scope="module")
def simulated_leg() -> Columns:
    """A log that the model explains: only its model can tell that its units were changed."""
    return leg_logs(3, [])["log_1"]


def _scaled(factor: float, *names: str) -> Callable[[Columns], Columns]:
    def spoil(c: Columns) -> Columns:
        return {k: factor * v if k in names else v for k, v in c.items()}

    return spoil


def _milliamperes(c: Columns) -> Columns:
    # Drawn by a robot so light that its milliamperes are less than the drive's amperes.
    return _scaled(1e3, *(k for k in c if k.endswith("current_A")))(c)


def _exchanged(c: Columns) -> Columns:
    one, two = "rm_joint_1__current_A", "rm_joint_2__current_A"
    return c | {one: c[two], two: c[one]}


def _of_another_machine(c: Columns) -> Columns:
    other = leg_logs(4, [], 2)["log_2"]
    rows = min(other["time_s"].size, c["time_s"].size)
    return {k: (other if k.endswith("current_A") else c)[k][:rows] for k in c}


SPOILT = {
    "mA": (_milliamperes, "rm_joint_1__current_A", "mA"),
    "mA at one joint": (_scaled(1e3, "rm_joint_2__current_A"), "rm_joint_2__current_A", "mA"),
    "sign": (_scaled(-1.0, "rm_joint_2__current_A"), "rm_joint_2__current_A", "flip"),
    "degrees": (_degrees, "rm_joint_1__position_rad", "degrees"),
    "degrees at one joint": (
        _scaled(180.0 / np.pi, "rm_joint_1__position_rad"),
        "rm_joint_1__position_rad",
        "degrees",
    ),
    "exchanged joints": (_exchanged, "rm_joint_1__current_A", "rm_joint_2"),
    "another robot": (_of_another_machine, "spoilt", "another robot"),
}


@pytest.mark.parametrize("case", SPOILT)
def test_a_wrong_unit_that_the_model_betrays_is_refused_by_column(
    tmp_path: Path,
    root: Path,
    capsys: pytest.CaptureFixture[str],
    simulated_leg: Columns,
    case: str,
) -> None:
    spoil, column, word = SPOILT[case]
    log = write_log(tmp_path / "spoilt.csv", spoil(dict(simulated_leg)))
    out = tmp_path / "out"
    robot = root / "urdf" / "leg.toml"
    assert exit_code(["gap", "where", str(log), "--robot", str(robot), "--out", str(out)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert column in err
    assert word in err
    assert not out.exists()


def test_the_same_log_unspoilt_is_accepted(
    tmp_path: Path, root: Path, simulated_leg: Columns
) -> None:
    log = write_log(tmp_path / "good.csv", simulated_leg)
    robot = root / "urdf" / "leg.toml"
    arguments = ["gap", "where", str(log), "--robot", str(robot), "--out", str(tmp_path / "out")]
    assert exit_code(arguments) == 0
    quality = rows_of(tmp_path / "out" / "quality.csv")
    simulated = [r for r in quality if "simulated" in r["detail"]]
    assert len(simulated) == 3
    assert {r["verdict"] for r in simulated} == {"ok"}


@pytest.mark.parametrize(
    ("more", "word"),
    [
        (["--mapping", "none.toml"], "none.toml"),
        (["--effort", "heat"], "heat"),
        (["--base", "measured"], "leg.toml"),
        (["--alternative", "reversable"], "reversible"),
        (["--cutoff", "100000"], "Hz"),
        (["--gait-start", "0.5"], "fixed"),
        (["--gait-start", "nan"], "--gait-start"),
        (["--gait", "none.toml"], "none.toml"),
        (["--holdout", "none.csv"], "none.csv"),
        (["--model", "none.toml"], "none.toml"),
    ],
)
def test_bad_options_are_refused_in_one_line(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str], more: list[str], word: str
) -> None:
    log = write_log(tmp_path / "log.csv", leg_columns())
    robot = root / "urdf" / "leg.toml"
    arguments = ["gap", str(log), "--robot", str(robot), "--out", str(tmp_path / "out"), *more]
    assert exit_code(arguments) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert word in err
    assert not (tmp_path / "out").exists()


def test_a_mapping_that_is_no_mapping(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_log(tmp_path / "log.csv", leg_columns())
    mapping = tmp_path / "map.toml"
    mapping.write_text("[colums]\n", encoding="utf-8")
    robot = root / "urdf" / "leg.toml"
    arguments = ["gap", "read", str(log), "--robot", str(robot), "--out", str(tmp_path / "out")]
    assert exit_code([*arguments, "--mapping", str(mapping)]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "columns" in err


def test_a_urdf_with_currents_asks_for_the_actuator(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_log(tmp_path / "log.csv", leg_columns())
    robot = root / "urdf" / "leg.urdf"
    arguments = ["gap", "where", str(log), "--robot", str(robot), "--out", str(tmp_path / "out")]
    assert exit_code(arguments) == 2
    assert "--alternative" in capsys.readouterr().err


def _contact_source(tmp_path: Path, log: Path, more: list[str]) -> str:
    out = tmp_path / "out"
    assert exit_code(["gap", "read", str(log), "--out", str(out), *more]) == 0
    (row,) = [r for r in rows_of(out / "quality.csv") if r["check"] == "contact"]
    return row["detail"]


def test_a_start_of_the_gait_tells_contact_where_the_log_does_not(tmp_path: Path) -> None:
    whole = pq.read_table(DEMO)
    bare = tmp_path / "bare.parquet"
    pq.write_table(whole.drop([n for n in whole.column_names if "force" in n]), bare)
    start = ["--gait-start", "0.9"]
    assert "lowest feet" in _contact_source(tmp_path, bare, [])
    assert "schedule" in _contact_source(tmp_path, bare, start)
    assert "forces" in _contact_source(tmp_path, DEMO, start)


def test_a_gait_file_tells_the_schedule_that_the_log_was_walked_by(tmp_path: Path) -> None:
    whole = pq.read_table(DEMO)
    bare = tmp_path / "bare.parquet"
    pq.write_table(whole.drop([n for n in whole.column_names if "force" in n]), bare)
    gait = tmp_path / "wave.toml"
    gait.write_text('[gait]\nname = "wave"\n', encoding="utf-8")
    own = ["--gait-start", "0.9", "--gait", str(gait)]
    assert "schedule" in _contact_source(tmp_path, bare, own)
    assert "wave.toml" in sidecar_of(tmp_path / "out" / "quality.csv")["inputs_sha256"]
    feet: dict[Path | None, float] = {}
    for file in (None, gait):
        given = setup(Options((bare,), gait=file, gait_start=0.9))
        loaded, _, _ = load_logs(given, Options((bare,), step="read", gait_start=0.9))
        contact = loaded.prepared[0].contact
        assert contact is not None
        feet[file] = float(np.median(contact.standing.sum(axis=1)))
    assert feet == {None: 3, gait: 5}


def test_a_bare_urdf_has_no_gait(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = write_log(tmp_path / "log.csv", leg_columns())
    gait = tmp_path / "wave.toml"
    gait.write_text('[gait]\nname = "wave"\n', encoding="utf-8")
    robot = root / "urdf" / "leg.urdf"
    arguments = ["gap", "read", str(log), "--robot", str(robot), "--out", str(tmp_path / "out")]
    assert exit_code([*arguments, "--gait", str(gait)]) == 2
    assert "walks no gait" in capsys.readouterr().err


def test_vertical_foot_forces_alone_tell_contact_and_say_what_they_do_not(
    tmp_path: Path, short_demo: Path
) -> None:
    whole = pq.read_table(short_demo)
    lateral = [n for n in whole.column_names if "force_x" in n or "force_y" in n]
    vertical = tmp_path / "vertical.parquet"
    pq.write_table(whole.drop(lateral), vertical)
    out = tmp_path / "out"
    gaps = []
    for log in (short_demo, vertical):
        assert exit_code(["gap", "where", str(log), "--out", str(out)]) == 0
        rows = rows_of(out / "where.csv")
        assert rows[0]["joint"] == "rm_joint_1"
        gaps.append({r["joint"]: float(r["gap"]) for r in rows if r["by"] == "joint"})
    quality = {r["check"]: r for r in rows_of(out / "quality.csv")}
    assert quality["foot_forces"]["verdict"] == "warning"
    assert "least tangential" in quality["foot_forces"]["detail"]
    assert "forces" in quality["contact"]["detail"]
    # Computed lateral forces are further from the ground's than measured ones.
    assert sum(gaps[1].values()) > 1.2 * sum(gaps[0].values())


def test_a_step_without_a_log_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code(["gap", "read"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_run_killed_in_the_middle_leaves_nothing(tmp_path: Path, root: Path) -> None:
    out = tmp_path / "out"
    process = subprocess.Popen(
        [sys.executable, "-m", "pipeline", "gap", "where", str(DEMO), "--out", str(out)],
        cwd=root,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        process.wait(timeout=1.5)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    assert not out.exists() or not [p for p in out.iterdir() if p.name.startswith(".")]


def _gap(step: str, logs: list[Path], out: Path, *more: str, robot: Path) -> int:
    arguments = ["gap", step, *map(str, logs), "--robot", str(robot), "--out", str(out), *more]
    return exit_code(arguments)


def test_data_given_twice_is_refused_under_any_name(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str], simulated_leg: Columns
) -> None:
    robot, out = root / "urdf" / "leg.toml", tmp_path / "out"
    log = write_log(tmp_path / "one.csv", simulated_leg)
    copy = tmp_path / "two.csv"
    copy.write_bytes(log.read_bytes())
    later = {k: v + 100.0 if k == "time_s" else v for k, v in simulated_leg.items()}
    shifted = write_log(tmp_path / "later.csv", later)
    part = write_log(tmp_path / "part.csv", {k: v[1000:4000] for k, v in simulated_leg.items()})
    for logs, more in (
        ([log, log], []),
        ([log, copy], []),
        ([log], ["--holdout", str(log)]),
        ([log], ["--holdout", str(copy)]),
        ([log], ["--holdout", str(shifted)]),
        ([log], ["--holdout", str(part)]),
    ):
        assert _gap("where", logs, out, *more, robot=robot) == 2
        err = capsys.readouterr().err
        assert err.count("\n") == 1
        assert "the same" in err
        assert not out.exists()


def test_two_logs_of_one_machine_are_not_the_same(tmp_path: Path, root: Path) -> None:
    logs = leg_logs(3, [], 2)
    one, two = (write_log(tmp_path / f"{name}.csv", log) for name, log in logs.items())
    robot = root / "urdf" / "leg.toml"
    assert _gap("where", [one], tmp_path / "out", "--holdout", str(two), robot=robot) == 0


def test_one_sample_of_500_rad_is_said_and_left_out(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str], simulated_leg: Columns
) -> None:
    robot = root / "urdf" / "leg.toml"
    column = "rm_joint_2__position_rad"
    spoilt = simulated_leg | {column: simulated_leg[column].copy()}
    spoilt[column][1234] = 500.0
    gaps = []
    for name, columns in (("good", simulated_leg), ("spoilt", spoilt)):
        log, out = write_log(tmp_path / f"{name}.csv", columns), tmp_path / f"{name}.out"
        assert _gap("where", [log], out, robot=robot) == 0
        rows = rows_of(out / "where.csv")
        gaps.append({r["joint"]: float(r["gap"]) for r in rows if r["by"] == "joint"})
    (row,) = [r for r in rows_of(out / "quality.csv") if r["check"] == "glitches"]
    assert (row["column"], row["verdict"]) == (column, "warning")
    assert "500 rad" in capsys.readouterr().out
    assert gaps[1] == pytest.approx(gaps[0], rel=0.05)


@pytest.mark.parametrize(
    ("old", "new"),
    [("current_A", "curent_A"), ("current_A", "current_a"), ("voltage_V", "votlage_V")],
)
def test_a_slip_of_the_pen_in_a_header_is_no_other_log(
    tmp_path: Path,
    root: Path,
    capsys: pytest.CaptureFixture[str],
    simulated_leg: Columns,
    old: str,
    new: str,
) -> None:
    slipped = {k.replace(old, new): v for k, v in simulated_leg.items()}
    log = write_log(tmp_path / "log.csv", slipped)
    assert _gap("read", [log], tmp_path / "out", robot=root / "urdf" / "leg.toml") == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert f"did you mean 'rm_joint_1__{old}'" in err


def test_a_column_of_another_name_is_kept_and_ignored(
    tmp_path: Path, root: Path, simulated_leg: Columns
) -> None:
    reference = {"rm_joint_1__current_reference_A": simulated_leg["rm_joint_1__current_A"]}
    log, out = write_log(tmp_path / "log.csv", simulated_leg | reference), tmp_path / "out"
    assert _gap("read", [log], out, robot=root / "urdf" / "leg.toml") == 0
    assert {r["verdict"] for r in rows_of(out / "quality.csv")} <= {"ok", "masked"}


def _with_torque(root: Path, friction: float) -> Columns:
    """A leg's motion with the torque its motors supply, brought to the joints."""
    from tests.pipeline.identification import bench_leg as leg

    m = leg.leg_motion(duration=12.0)
    rigid = machine_of_urdf(root / "urdf" / "leg.urdf").rigid
    torque = np.array(
        [pin.rnea(rigid, rigid.createData(), *x) for x in zip(m.q, m.v, m.a, strict=True)]
    )
    torque[:, 1] += friction * np.sign(m.v[:, 1])
    torque += 0.02 * np.random.default_rng(3).standard_normal(torque.shape)
    columns: Columns = {"time_s": m.time}
    for j, joint in enumerate(m.joints):
        columns[f"{joint}__position_rad"] = m.q[:, j]
        columns[f"{joint}__torque_Nm"] = torque[:, j]
    return columns


def test_torque_means_the_same_with_a_robot_file_and_with_its_urdf(
    tmp_path: Path, root: Path
) -> None:
    log = write_log(tmp_path / "log.csv", _with_torque(root, 1.5))
    found = []
    for name in ("leg.toml", "leg.urdf"):
        out = tmp_path / name
        assert _gap("name", [log], out, robot=root / "urdf" / name) == 0
        found.append(rows_of(out / "found.csv"))
    for (row,) in found:
        assert (row["effect"], row["joint"]) == ("coulomb_friction", "rm_joint_2")
        assert float(row["value"]) == pytest.approx(1.5, rel=0.05)
    assert float(found[0][0]["value"]) == pytest.approx(float(found[1][0]["value"]), rel=0.01)


def test_weak_correlation_is_said_and_no_reason_to_stop(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = _with_torque(root, 0.0)
    for j in (1, 2, 3):
        v = np.gradient(columns[f"rm_joint_{j}__position_rad"])
        # Geared wrists: friction is many times what their bodies ask.
        columns[f"rm_joint_{j}__torque_Nm"] = columns[f"rm_joint_{j}__torque_Nm"] + 40 * np.sign(v)
    log, out = write_log(tmp_path / "log.csv", columns), tmp_path / "out"
    assert _gap("where", [log], out, robot=root / "urdf" / "leg.urdf") == 0
    (row,) = [r for r in rows_of(out / "quality.csv") if r["check"] == "correlation"]
    assert row["verdict"] == "warning"
    assert "little in common" in capsys.readouterr().out


def test_a_scaled_log_is_never_called_explained_without_a_name(
    tmp_path: Path, root: Path, capsys: pytest.CaptureFixture[str], simulated_leg: Columns
) -> None:
    currents = {k: 5.0 * v for k, v in simulated_leg.items() if k.endswith("current_A")}
    bare = {k: v for k, v in simulated_leg.items() if not k.endswith("voltage_V")}
    log, out = write_log(tmp_path / "log.csv", bare | currents), tmp_path / "out"
    _gap("name", [log], out, robot=root / "urdf" / "leg.toml")
    row = rows_of(out / "found.csv")[0]
    assert (row["effect"], row["written"]) == ("effort_gain", "true")
    assert float(row["value"]) == pytest.approx(5.0, rel=0.05)
    said = capsys.readouterr().out
    hint = re.search(r'\[columns\."\*__current_A"\] scale = ([0-9.]+)', said)
    assert hint
    assert float(hint[1]) == pytest.approx(0.2, rel=0.05)
    factors = [r for r in rows_of(out / "quality.csv") if r["check"] == "factor"]
    assert {r["verdict"] for r in factors} == {"warning"}
