"""Whole runs of `gap`: the demonstration, and logs and options that cannot be what they say."""

from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pyarrow.parquet as pq
import pytest

from pipeline.effects.model_file import read_model_file
from pipeline.simulation.machine import read_machine
from tests.command_line import DEMO, HIDDEN, Refused, exit_code, record_of, rows_of
from tests.leg_log import leg_logs
from tests.pipeline.identification import bench_leg as leg


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, root: Path) -> tuple[int, Path]:
    out = tmp_path_factory.mktemp("gap")
    robot = root / "urdf" / "hexapod.toml"
    return exit_code(["gap", str(DEMO), "--robot", str(robot), "--out", str(out)]), out


@pytest.mark.slow
def test_the_demonstration_names_what_was_hidden(run: tuple[int, Path]) -> None:
    code, out = run
    assert code == 0
    rows = rows_of(out / "found.csv")
    assert {(r["effect"], r["joint"]) for r in rows} == {(HIDDEN.effect, HIDDEN.place[0])}
    for row in rows:
        truth = HIDDEN.parameters[row["parameter"]]
        assert float(row["ci_low"]) <= truth <= float(row["ci_high"])
        assert float(row["gap_after"]) < 1.6 * float(row["noise_floor"])


@pytest.mark.slow
def test_the_model_file_goes_round(run: tuple[int, Path], tmp_path: Path) -> None:
    model = run[1] / "model.toml"
    file = read_model_file(model)
    (edit,) = file.edits
    assert (edit.effect, edit.basis, file.changed) == (HIDDEN.effect, "identified", ())
    found = {r["parameter"]: float(r["value"]) for r in rows_of(run[1] / "found.csv")}
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
def test_where_gives_the_same_bytes_twice(tmp_path: Path, short_demo: Path) -> None:
    for name in ("one", "two"):
        assert exit_code(["gap", "where", str(short_demo), "--out", str(tmp_path / name)]) == 0
    one, two = (
        {p.name: p.read_bytes() for p in (tmp_path / folder).iterdir()} for folder in ("one", "two")
    )
    assert one == two
    rows = rows_of(tmp_path / "one" / "where.csv")
    assert rows[0]["joint"] == HIDDEN.place[0]
    shares = [float(r["share_of_total"]) for r in rows if r["by"] == "joint"]
    assert sum(shares) == pytest.approx(1.0)


@pytest.mark.usefixtures("sketched")
@pytest.mark.parametrize(("without", "both"), [("motion", False), ("effort", True), ("", True)])
def test_a_joint_that_stands_still_or_has_no_effort_is_left_out(
    tmp_path: Path, without: str, both: bool
) -> None:
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
    return leg_logs(3, [])["log_1"]


def _exchanged(c: Columns) -> Columns:
    one, two = "rm_joint_1__current_A", "rm_joint_2__current_A"
    return c | {one: c[two], two: c[one]}


def _of_another_machine(c: Columns) -> Columns:
    other = leg_logs(4, [], 2)["log_2"]
    rows = min(other["time_s"].size, c["time_s"].size)
    return {k: (other if k.endswith("current_A") else c)[k][:rows] for k in c}


SPOILT = {
    "nothing": (lambda c: c, ()),
    # Drawn by a robot so light that its milliamperes are less than the drive's amperes.
    "mA": (lambda c: {k: v * (1e3 if "_A" in k else 1) for k, v in c.items()}, ("1__cur", "mA")),
    "exchanged joints": (_exchanged, ("rm_joint_1__current_A", "rm_joint_2")),
    "another robot": (_of_another_machine, ("spoilt", "another robot")),
}


@pytest.mark.parametrize("case", SPOILT)
def test_what_the_model_betrays_is_suspected_by_column(
    tmp_path: Path, simulated_leg: Columns, case: str
) -> None:
    spoil, words = SPOILT[case]
    log = written(tmp_path / "spoilt.csv", spoil(dict(simulated_leg)))
    where(log, URDF / "leg.toml", tmp_path / "out")
    quality = rows_of(tmp_path / "out" / "quality.csv")
    said = " ".join(str(row) for row in quality if row["verdict"] == "suspected")
    assert bool(said) == bool(words)
    assert all(word in said for word in words)


def test_data_given_twice_is_refused_under_any_name(
    tmp_path: Path, refused: Refused, simulated_leg: Columns
) -> None:
    log = written(tmp_path / "one.csv", simulated_leg)
    later = {k: v + 100.0 if k == "time_s" else v for k, v in simulated_leg.items()}
    shifted = written(tmp_path / "later.csv", later)
    part = written(tmp_path / "part.csv", {k: v[1000:4000] for k, v in simulated_leg.items()})
    for more in ([log], ["--holdout", shifted], ["--holdout", part]):
        arguments = ["gap", "where", log, *more, "--robot", URDF / "leg.toml"]
        assert "the same" in refused([*map(str, arguments)], tmp_path / "out")


def test_torque_means_the_same_with_a_robot_file_and_with_its_urdf(tmp_path: Path) -> None:
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


def test_two_commands_judge_a_foreign_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
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
