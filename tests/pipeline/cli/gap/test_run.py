"""A whole run of `gap` on the shipped demonstration, and what its files promise."""

from __future__ import annotations

import csv
import shutil
import tomllib
from pathlib import Path

import pytest

from pipeline.effects.model_file import apply_edits, read_model_file
from pipeline.simulation.files import base_model
from tests.command_line import exit_code, rows_of, sidecar_of
from tests.demo import DEMO, HIDDEN
from tests.reports.browser import layout, needs_chromium

COLUMNS = {
    "quality": "log column check value unit verdict detail",
    "candidates": "effect joint place validation_before validation_after unit identifiable verdict "
    "reason",
    "found": "order effect law amounts_to joint place parameter value ci_low ci_high unit "
    "gap_before gap_after gap_unit noise_floor level reason written",
}
FIGURES = ("where_map", "waterfall", "in_time", "effect_1_coulomb_friction")


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
@pytest.mark.parametrize("name", COLUMNS)
def test_tables_have_the_promised_columns(run: tuple[int, Path], name: str) -> None:
    _, out = run
    with (out / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        assert next(csv.reader(file)) == COLUMNS[name].split()
    meta = sidecar_of(out / f"{name}.csv")
    assert "walk.parquet" in meta["inputs_sha256"]
    assert str(out) not in (out / f"{name}.meta.json").read_text(encoding="utf-8")


@pytest.mark.slow
def test_pictures_and_page_are_there(run: tuple[int, Path]) -> None:
    _, out = run
    for name in FIGURES:
        assert (out / f"{name}.svg").stat().st_size > 5000
    report = (out / "report.md").read_text(encoding="utf-8")
    first = report.split("##")[0]
    for word in ("rm_joint_1", "coulomb_friction", "N·m", "95 %", "J", "noise"):
        assert word in first
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert "data:image/svg+xml" in page


@needs_chromium
@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 400])
def test_the_answer_is_seen_at_first_sight(
    run: tuple[int, Path], tmp_path: Path, width: int
) -> None:
    seen = layout(run[1] / "index.html", width, tmp_path)
    assert seen.at_first_sight()
    assert seen.letters >= 9
    assert seen.beyond == []
    first = (run[1] / "report.md").read_text(encoding="utf-8").split("##")[0]
    for said in (
        "**Fitted:**",
        "**Predicted:**",
        "**Whose motors:** as stated for this robot",
        "8.64 kg",
    ):
        assert said in first


@pytest.mark.slow
def test_the_model_file_goes_round(run: tuple[int, Path], tmp_path: Path, root: Path) -> None:
    _, out = run
    file = read_model_file(out / "model.toml")
    (edit,) = file.edits
    assert edit.effect == HIDDEN.effect
    assert edit.basis == "identified"
    assert not file.changed
    found = {r["parameter"]: float(r["value"]) for r in rows_of(out / "found.csv")}
    assert edit.values == pytest.approx(found, rel=1e-12)
    machine = apply_edits(base_model(file), file.edits)
    assert machine.actuator("rm_joint_1").elements[0].name == HIDDEN.effect
    text = tomllib.loads((out / "model.toml").read_text(encoding="utf-8"))
    assert not Path(text["robot"]["file"]).is_absolute()
    model = ["--model", str(out / "model.toml")]
    for verb in ("walk", "stand"):
        assert exit_code([verb, *model, "--out", str(tmp_path / verb)]) == 0
    losses = rows_of(tmp_path / "walk" / "walking_losses.csv")
    added = [r for r in losses if r["element"] == HIDDEN.effect and float(r["loss_J"]) > 0]
    # Other actuators have gears with losses of their own, to which it cannot be added.
    assert {(r["alternative"], r["joint"]) for r in added} == {("rotor", "rm_joint_1")}
    sidecar = sidecar_of(tmp_path / "walk" / "walking_losses.csv")
    (warning,) = sidecar["warnings"]
    assert "found against 'rotor'" in warning
    assert "model.toml" in sidecar["inputs_sha256"]


@pytest.mark.slow
def test_a_stored_model_is_checked_against_a_log(
    run: tuple[int, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, out = run
    arguments = ["gap", "shrink", str(DEMO), "--model", str(out / "model.toml")]
    assert exit_code([*arguments, "--out", str(tmp_path)]) == 0
    (row,) = rows_of(tmp_path / "found.csv")
    assert float(row["gap_after"]) < 0.1 * float(row["gap_before"])
    assert not (tmp_path / "model.toml").exists()
    assert "falls from" in capsys.readouterr().out


@pytest.mark.slow
def test_a_model_that_a_step_reads_from_its_own_folder_stays(
    run: tuple[int, Path], tmp_path: Path
) -> None:
    """The report of `gap shrink` replaces that of the run that found the model, not the model."""
    out = tmp_path  # as deep as the run's, for the model file names its robot from where it lies
    shutil.copytree(run[1], out, dirs_exist_ok=True)
    model = (out / "model.toml").read_bytes()
    assert (
        exit_code(
            ["gap", "shrink", str(DEMO), "--model", str(out / "model.toml")] + ["--out", str(out)]
        )
        == 0
    )
    assert (out / "model.toml").read_bytes() == model
    assert (out / "waterfall.svg").exists()
    assert exit_code(["gap", "read", str(DEMO), "--out", str(out)]) == 0
    assert {p.name for p in out.iterdir() if not p.name.startswith(".")} == {
        *("quality.csv", "quality.meta.json")
    }


def test_where_gives_the_same_bytes_twice(tmp_path: Path, short_demo: Path) -> None:
    for name in ("one", "two"):
        assert exit_code(["gap", "where", str(short_demo), "--out", str(tmp_path / name)]) == 0
    files = sorted(p.name for p in (tmp_path / "one").iterdir())
    assert files == sorted(p.name for p in (tmp_path / "two").iterdir())
    for name in files:
        one, two = ((tmp_path / folder / name).read_bytes() for folder in ("one", "two"))
        assert one == two, name
    rows = rows_of(tmp_path / "one" / "where.csv")
    assert rows[0]["joint"] == HIDDEN.place[0]
    shares = [float(r["share_of_total"]) for r in rows if r["by"] == "joint"]
    assert sum(shares) == pytest.approx(1.0)
