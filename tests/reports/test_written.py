"""What is written reads back to the same numbers; a run's files replace those of the run before."""

import csv
import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuators.checked import write_text
from actuators.errors import LegwattError
from pipeline.columns import frame
from reports.folder import RECORD, ROUND_OFF, plain, staged, without_roundoff, write_tables, written

OLD = {"a.csv": "old", "b.csv": "old", "sub/c.txt": "old"}
NEW = {"b.csv": "new", "deep/er/d.txt": "new"}


def run(out: Path, files: dict[str, str], verb: str = "walk", **more: Any) -> None:
    with staged(out, verb, **more) as folder:
        for name, text in files.items():
            write_text(folder / name, text)


def files(folder: Path) -> dict[str, str]:
    found = (p for p in folder.rglob("*") if p.is_file() and p.name != RECORD)
    return {p.relative_to(folder).as_posix(): p.read_text("utf-8") for p in found}


def test_a_run_replaces_what_the_last_run_left_and_nothing_else(tmp_path):
    run(tmp_path, OLD, "reports")
    write_text(tmp_path / "notes.txt", "mine")
    run(tmp_path, NEW)
    assert files(tmp_path) == NEW | {"notes.txt": "mine"}
    assert not (tmp_path / "sub").exists()
    package = json.loads((tmp_path / RECORD).read_text("utf-8"))
    assert (package["name"], package["verb"]) == ("legwatt-walk", "walk")
    assert written(tmp_path) == [*NEW]


def test_an_error_leaves_everything_as_it_was(tmp_path):
    run(tmp_path / "out", OLD)
    before = (tmp_path / "out" / RECORD).read_bytes()

    def stopped(out: Path) -> None:
        with staged(out, "walk") as folder:
            write_text(folder / "b.csv", "new")
            raise KeyboardInterrupt

    for place in ("out", "new/deeper"):
        with pytest.raises(KeyboardInterrupt):
            stopped(tmp_path / place)
    assert files(tmp_path / "out") == OLD
    assert (tmp_path / "out" / RECORD).read_bytes() == before
    assert not (tmp_path / "new").exists()


def test_a_file_that_the_run_reads_stays(tmp_path):
    run(tmp_path, {"model.toml": "found", "found.csv": "1"}, "gap")
    run(tmp_path, {"in_time.svg": "*"}, "gap shrink", inputs=[tmp_path / "model.toml"])
    assert files(tmp_path) == {"model.toml": "found", "in_time.svg": "*"}


@pytest.mark.parametrize(
    ("place", "text", "says"),
    [
        ("out/b.csv", "mine", "b.csv: no run wrote it"),
        (f"out/{RECORD}", '{"resources": 1}', "damaged"),
        ("out", "a file", "not a folder"),
    ],
)
def test_what_is_in_the_way_is_named(tmp_path, place, text, says):
    write_text(tmp_path / place, text)
    with pytest.raises(LegwattError, match=says) as caught:
        run(tmp_path / "out", NEW)
    assert "\n" not in str(caught.value)
    assert (tmp_path / place).read_text("utf-8") == text


def postures(names: list[str], values: Any) -> pd.DataFrame:
    return frame("standing_posture", zip(names, values, strict=True))


@settings(max_examples=40)
@given(
    values=st.lists(st.floats(allow_nan=False), min_size=1, max_size=9),
    text=st.text(st.characters(codec="utf-8", exclude_characters="\r\0"), min_size=1),
)
def test_numbers_read_back_to_the_last_bit(tmp_path_factory, values, text):
    out = tmp_path_factory.mktemp("t")
    table = postures([f"{text}x"] * len(values), values)
    write_tables({"standing_posture": table}, out)
    content = (out / "standing_posture.csv").read_text("utf-8")
    rows = csv.reader(io.StringIO(content, newline=""))
    names, back = zip(*[*rows][1:], strict=True)
    shown = [0.0 if abs(value) < ROUND_OFF else value for value in values]
    assert [*map(float, back)] == shown
    assert set(names) == {f"{text}x"}


def test_cells(tmp_path):
    """Nothing for no number; round-off is zero."""
    table = postures(["a", "b", "c", "0.21, 0.94", ""], [1.5, np.nan, None, 2.2e-32, -3e-14])
    write_tables({"standing_posture": table}, tmp_path)
    lines = (tmp_path / "standing_posture.csv").read_text("utf-8").splitlines()[1:]
    assert lines == ["a,1.5", "b,", "c,", '"0.21, 0.94",0.0', ",0.0"]
    given = frame("parameters", [("a", "b", 2.2e-32, "N*m", "assumed", "", None, None, "")])
    assert without_roundoff("parameters", given)["value"].tolist() == [2.2e-32]


def test_folders_of_absolute_paths_go():
    said = {"robot": Path("/a/robot.toml"), "gap": math.nan, "why": "'/a/b.csv': odd, C:\\d\\c.csv"}
    assert plain(said) == {"robot": "robot.toml", "gap": None, "why": "'b.csv': odd, c.csv"}
    for text in ("rad/s and 1/K, urdf/hexapod.toml", "https://example.org/a/b"):
        assert plain(text) == text
