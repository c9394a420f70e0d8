"""A whole run of `gap` on the shipped demonstration, and what its files promise."""

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from pipeline.effects.model_file import read_model_file
from tests.command_line import DEMO, HIDDEN, exit_code, record_of, rows_of


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
