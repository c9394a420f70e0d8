"""`gap` on unusable input: one line, exit 2, nothing written."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from pipeline.logs.checks import refuse_repeats
from pipeline.logs.log_format import expected_of_robot
from pipeline.logs.read import read_log
from pipeline.machine.machine import machine_of_urdf
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from tests.command_line import Refused, exit_code, rows_of
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


@pytest.fixture(scope="module")
def simulated_leg() -> Columns:
    """A log that the model explains: only its model can tell that its units were changed."""
    return leg_logs(3, [])["log_1"]


def _exchanged(c: Columns) -> Columns:
    one, two = "rm_joint_1__current_A", "rm_joint_2__current_A"
    return c | {one: c[two], two: c[one]}


def _of_another_machine(c: Columns) -> Columns:
    other = leg_logs(4, [], 2)["log_2"]
    rows = min(other["time_s"].size, c["time_s"].size)
    return {k: (other if k.endswith("current_A") else c)[k][:rows] for k in c}


SPOILT = {
    # Drawn by a robot so light that its milliamperes are less than the drive's amperes.
    "mA": (
        lambda c: {k: v * (1e3 if "_A" in k else 1) for k, v in c.items()},
        ("1__cur", "is in mA"),
    ),
    "exchanged joints": (_exchanged, ("rm_joint_1__current_A", "rm_joint_2")),
    "another robot": (_of_another_machine, ("spoilt", "another robot")),
}


@pytest.mark.parametrize("case", SPOILT)
def test_a_wrong_unit_that_the_model_betrays_is_suspected_by_column(
    tmp_path: Path, root: Path, simulated_leg: Columns, case: str
) -> None:
    spoil, words = SPOILT[case]
    log = write_log(tmp_path / "spoilt.csv", spoil(dict(simulated_leg)))
    robot = root / "urdf" / "leg.toml"
    arguments = ["gap", "where", str(log), "--robot", str(robot), "--out", str(tmp_path / "out")]
    assert exit_code(arguments) == 0
    quality = rows_of(tmp_path / "out" / "quality.csv")
    said = " ".join(str(row) for row in quality if row["verdict"] == "suspected")
    assert all(word in said for word in words)


def test_the_same_log_unspoilt_is_accepted(
    tmp_path: Path, root: Path, simulated_leg: Columns
) -> None:
    log = write_log(tmp_path / "good.csv", simulated_leg)
    robot = root / "urdf" / "leg.toml"
    arguments = ["gap", "where", str(log), "--robot", str(robot), "--out", str(tmp_path / "out")]
    assert exit_code(arguments) == 0
    quality = rows_of(tmp_path / "out" / "quality.csv")
    assert not {r["check"] for r in quality} & {"correlation", "another_motion"}
    assert "suspected" not in {r["verdict"] for r in quality}


@pytest.mark.parametrize(
    ("robot", "more", "word"),
    [
        ("leg.toml", ["--mapping", "none.toml"], "none.toml"),
        ("leg.toml", ["--mapping", "wrong.toml"], "columns"),
        ("leg.toml", ["--effort", "heat"], "heat"),
        ("leg.toml", ["--base", "measured"], "leg.toml"),
        ("leg.toml", ["--alternative", "reversable"], "reversible"),
        ("leg.toml", ["--cutoff", "100000"], "Hz"),
        ("leg.toml", ["--gait", "none.toml"], "none.toml"),
        ("leg.toml", ["--holdout", "none.csv"], "none.csv"),
        ("leg.toml", ["--model", "none.toml"], "none.toml"),
        ("leg.urdf", ["--gait", "wave.toml"], "walks no gait"),
        ("leg.urdf", [], "alternative"),
    ],
)
def test_bad_options_are_refused_in_one_line(
    tmp_path: Path,
    root: Path,
    refused: Refused,
    robot: str,
    more: list[str],
    word: str,
) -> None:
    log = write_log(tmp_path / "log.csv", leg_columns())
    (tmp_path / "wrong.toml").write_text("[colums]\n", encoding="utf-8")
    (tmp_path / "wave.toml").write_text('[gait]\nname = "wave"\n', encoding="utf-8")
    more = [str(tmp_path / x) if (tmp_path / x).exists() else x for x in more]
    arguments = ["gap", "where", str(log), "--robot", str(root / "urdf" / robot), *more]
    assert word in refused(arguments, tmp_path / "out")


def _gap(step: str, logs: list[Path], out: Path, *more: str, robot: Path) -> int:
    arguments = ["gap", step, *map(str, logs), "--robot", str(robot), "--out", str(out), *more]
    return exit_code(arguments)


def test_data_given_twice_is_refused_under_any_name(
    tmp_path: Path, root: Path, refused: Refused, simulated_leg: Columns
) -> None:
    robot = root / "urdf" / "leg.toml"
    log = write_log(tmp_path / "one.csv", simulated_leg)
    copy = tmp_path / "two.csv"
    copy.write_bytes(log.read_bytes())
    later = {k: v + 100.0 if k == "time_s" else v for k, v in simulated_leg.items()}
    shifted = write_log(tmp_path / "later.csv", later)
    part = write_log(tmp_path / "part.csv", {k: v[1000:4000] for k, v in simulated_leg.items()})
    for more in ([log], ["--holdout", copy], ["--holdout", shifted], ["--holdout", part]):
        arguments = ["gap", "where", log, *more, "--robot", robot]
        assert "the same" in refused([*map(str, arguments)], tmp_path / "out")
    expected = expected_of_robot(load_robot(load_robot_file(robot)))
    logs = leg_logs(3, [], 2)
    refuse_repeats(
        [read_log(write_log(tmp_path / f"{k}.csv", v), expected) for k, v in logs.items()]
    )


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
    gaps = []
    for name in ("leg.toml", "leg.urdf"):
        out = tmp_path / name
        assert _gap("where", [log], out, robot=root / "urdf" / name) == 0
        rows = rows_of(out / "where.csv")
        gaps.append({r["joint"]: float(r["gap"]) for r in rows if r["by"] == "joint"})
    assert gaps[0]["rm_joint_2"] == pytest.approx(1.5, rel=0.05)  # its friction
    assert gaps[0] == pytest.approx(gaps[1], rel=0.01)


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
