"""Whole runs of `gap`: the demonstration, and logs and options that cannot be what they say."""

from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pyarrow.parquet as pq
import pytest

from pipeline.effects.model_file import read_model_file
from pipeline.simulation.machine import read_machine
from tests.command_line import DEMO, HIDDEN, exit_code, record_of, rows_of
from tests.pipeline.identification import bench_leg as leg


@pytest.mark.slow
def test_the_demonstration_names_what_was_hidden_and_its_model_file_goes_round(command, tmp_path):
    out = tmp_path / "gap"
    assert command("gap", out, str(DEMO)) == 0
    rows = rows_of(out / "found.csv")
    assert {(r["effect"], r["joint"]) for r in rows} == {(HIDDEN.effect, HIDDEN.place[0])}
    for row in rows:
        truth = HIDDEN.parameters[row["parameter"]]
        assert float(row["ci_low"]) <= truth <= float(row["ci_high"])
        assert float(row["gap_after"]) < 1.6 * float(row["noise_floor"])
    file = read_model_file(model := out / "model.toml")
    (edit,) = file.edits
    assert (edit.effect, edit.basis, file.changed) == (HIDDEN.effect, "identified", ())
    found = {r["parameter"]: float(r["value"]) for r in rows}
    assert edit.values == pytest.approx(found, rel=1e-12)
    assert exit_code(["walk", "--model", str(model), "--out", str(tmp_path / "walk")]) == 0
    losses = rows_of(tmp_path / "walk" / "walking_losses.csv")
    added = [r for r in losses if r["element"] == HIDDEN.effect and float(r["loss_J"]) > 0]
    # Other actuators have gears with losses of their own, to which it cannot be added.
    assert {(r["alternative"], r["joint"]) for r in added} == {("rotor", "rm_joint_1")}
    record = record_of(tmp_path / "walk" / "walking_losses.csv")
    assert "found against 'rotor'" in " ".join(record["warnings"])
    assert "model.toml" in record["inputs_sha256"]


@pytest.mark.usefixtures("sketched")
@pytest.mark.parametrize(("without", "both"), [("motion", False), ("effort", True), ("", True)])
def test_a_joint_that_stands_still_or_has_no_effort_is_left_out(tmp_path, without, both):
    """In one of two logs, or in both; or its columns are not there at all."""
    whole, joint, logs = pq.read_table(DEMO).to_pandas(), "lr_joint_2", []
    efforts = [f"{joint}__current_A", f"{joint}__voltage_V"]
    for k in range(2):
        table = whole[2000 * k : 2000 * (k + 1)].copy()
        if both or k == 1:
            if without == "motion":
                table[f"{joint}__position_rad"] = table[f"{joint}__position_rad"].iloc[0]
            elif without == "effort":
                table[efforts] = np.nan
            else:
                table = table.drop(columns=efforts)
        logs.append(str(tmp_path / f"log_{k + 1}.parquet"))
        table.to_parquet(logs[-1])
    out = tmp_path / "out"
    assert exit_code(["gap", "where", *logs, "--out", str(out)]) == 0
    rows = [r for r in rows_of(out / "where.csv") if r["by"] == "joint"]
    assert rows[0]["joint"] == HIDDEN.place[0]
    assert (joint in {r["joint"] for r in rows}) != both
    assert sum(float(r["share_of_total"]) for r in rows) == pytest.approx(1.0)


Columns = dict[str, np.ndarray]
URDF = leg.ROOT / "urdf"


def written(path: Path, columns: Columns) -> Path:
    pd.DataFrame(columns).to_csv(path, index=False)
    return path


def where(log: Path, robot: Path, out: Path) -> list[dict[str, str]]:
    """Rows of what was compared; the log must be accepted."""
    assert exit_code(["gap", "where", str(log), "--robot", str(robot), "--out", str(out)]) == 0
    return rows_of(out / "where.csv")


@pytest.fixture(scope="module")
def simulated_leg() -> Columns:
    """A log that the model explains: only its model can tell that its units were changed."""
    return leg.leg_log(3)


def test_data_given_twice_is_refused_under_any_name(tmp_path, refused, simulated_leg):
    log = written(tmp_path / "one.csv", simulated_leg)
    later = {k: v + 100.0 if k == "time_s" else v for k, v in simulated_leg.items()}
    shifted = written(tmp_path / "later.csv", later)
    part = written(tmp_path / "part.csv", {k: v[1000:4000] for k, v in simulated_leg.items()})
    for more in ([log], ["--holdout", shifted], ["--holdout", part]):
        arguments = ["gap", "where", log, *more, "--robot", URDF / "leg.toml"]
        assert "the same" in refused([*map(str, arguments)], tmp_path / "out")


def test_torque_means_the_same_with_a_robot_file_and_with_its_urdf(tmp_path):
    """A leg's motion with the torque its motors supply, brought to the joints; friction at one."""
    m = leg.leg_motion(duration=12.0)
    rigid = read_machine(URDF / "leg.urdf").model.rigid
    data = rigid.createData()
    torque = np.array([pin.rnea(rigid, data, *x) for x in zip(m.q, m.v, m.a, strict=True)])
    torque[:, 1] += 1.5 * np.sign(m.v[:, 1])
    torque += 0.02 * np.random.default_rng(3).standard_normal(torque.shape)
    columns: Columns = {"time_s": m.time}
    for j, joint in enumerate(m.joints):
        columns[f"{joint}__position_rad"] = m.q[:, j]
        columns[f"{joint}__torque_Nm"] = torque[:, j]
    log = written(tmp_path / "log.csv", columns)
    gaps = []
    for name in ("leg.toml", "leg.urdf"):
        rows = where(log, URDF / name, tmp_path / name)
        gaps.append({r["joint"]: float(r["gap"]) for r in rows if r["by"] == "joint"})
    assert gaps[0]["rm_joint_2"] == pytest.approx(1.5, rel=0.05)
    assert gaps[0] == pytest.approx(gaps[1], rel=0.01)


def test_two_commands_judge_a_foreign_log(tmp_path, capsys):
    """`gap mapping` tells degrees, milliseconds and milliamperes, and what to run next."""
    t = np.arange(1500) / 250.0
    columns = {"zeit_ms": 1e3 * t}
    for k in (1, 2, 3):
        w = 2.0 * np.pi * (0.3 + 0.11 * k)
        columns[f"Winkel {k} angle"] = np.degrees(0.3 * np.sin(w * t))
        columns[f"Motor {k} current"] = 400.0 * np.cos(w * t + k)
    log, mapping = tmp_path / "log.csv", tmp_path / "mapping.toml"
    pd.DataFrame(columns).to_csv(log, sep=";", decimal=",", index=False)
    first = ["gap", "mapping", str(log), "--robot", str(URDF / "leg.toml"), "--out", str(mapping)]
    assert exit_code(first) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert said.startswith("next: python -m pipeline gap ")
    second = said.removeprefix("next: python -m pipeline gap ").split()
    assert exit_code(["gap", "read", *second, "--out", str(tmp_path / "out")]) == 0
    assert "checks passed" in capsys.readouterr().out
    assert exit_code(first) == 2
    assert "is there already" in capsys.readouterr().err
