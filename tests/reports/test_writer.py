"""What is written reads back to the same numbers, and is there whole or not at all."""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.atomic import write_text
from pipeline.errors import OutputError, TableError
from reports.table import Table
from reports.writer import csv_bytes, without_folders, write_table

META = {"seed": 1, "inputs": {"b.toml": "ff", "a.toml": "00"}, "warnings": []}


def table(values, name: str = "t", *, exact: bool = False) -> Table:
    return Table(
        name,
        {"id": [str(i) for i in range(len(values))], "x": values},
        {"id": ("row", ""), "x": ("length", "m")},
        "Lengths.",
        exact,
    )


def read(content: bytes, delimiter: str = ",") -> list[dict[str, str]]:
    text = content.decode("utf-8-sig")
    return list(csv.DictReader(io.StringIO(text, newline=""), delimiter=delimiter))


@settings(deadline=None)
@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=30))
def test_floats_round_trip_to_the_last_bit(values: list[float]) -> None:
    content = csv_bytes(table(np.array(values)))
    back = [float(row["x"]) for row in read(content)]
    assert np.array(back).tobytes() == np.array(values).tobytes()


@settings(deadline=None)
@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=30))
def test_comma_copy_parses_back(values: list[float]) -> None:
    rows = read(csv_bytes(table(np.array(values)), decimal=","), ";")
    assert [float(row["x"].replace(",", ".")) for row in rows] == values
    assert not any("." in row["x"] for row in rows)


@settings(deadline=None)
@given(st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\r\0")), min_size=1))
def test_texts_round_trip(texts: list[str]) -> None:
    made = Table("t", {"s": texts, "n": [1] * len(texts)}, {"s": ("s", ""), "n": ("n", "1")})
    assert [row["s"] for row in read(csv_bytes(made))] == texts


def test_nan_and_none_are_empty() -> None:
    content = csv_bytes(table(np.array([1.0, np.nan, -2.5])))
    assert content == b"id,x\n0,1\n1,\n2,-2.5\n"
    assert csv_bytes(table([None, 2.0])) == b"id,x\n0,\n1,2\n"
    assert csv_bytes(table([None, None])) == b"id,x\n0,\n1,\n"


def test_a_text_stands_in_quotes_where_it_needs_them_alone() -> None:
    assert b'"' not in csv_bytes(table([1.0]))
    quoted = Table("t", {"s": ["a,b", "c", 'd"e', "f;g"]}, {"s": ("s", "")})
    assert csv_bytes(quoted) == b's\n"a,b"\nc\n"d""e"\nf;g\n'
    assert csv_bytes(quoted, decimal=",") == b'\xef\xbb\xbfs\na,b\nc\n"d""e"\n"f;g"\n'


def test_no_number_of_a_comma_copy_keeps_a_dot_or_stands_in_quotes() -> None:
    """A number in a column of texts is one, too; a text that holds one is left alone."""
    texts = ["2.04", "-0.866", "1.5e-3", "almost 15", "1.2.3", "Table 3.", "0.21; 0.94", ""]
    made = Table("t", {"s": texts, "x": np.arange(8) / 2}, {"s": ("s", ""), "x": ("x", "1")})
    lines = csv_bytes(made, decimal=",").decode("utf-8-sig").splitlines()[1:]
    assert lines == [
        *("2,04;0", "-0,866;0,5", "1,5e-3;1", "almost 15;1,5", "1.2.3;2", "Table 3.;2,5"),
        *('"0.21; 0.94";3', ";3,5"),
    ]
    assert b"2.04,0\n" in csv_bytes(made)


def test_mixed_column_is_refused() -> None:
    with pytest.raises(TableError, match="'x' holds mixed values"):
        csv_bytes(table([1.0, "a"]))
    with pytest.raises(TableError, match="'x' holds"):
        csv_bytes(table([{"a": 1}]))


def test_same_input_same_bytes(tmp_path: Path) -> None:
    made = table(np.linspace(0, 1, 7))
    first = write_table(made, tmp_path / "a", meta=META, decimal=",")
    again = dict(reversed(META.items()))
    second = write_table(made, tmp_path / "b" / "c", meta=again, decimal=",")
    assert [p.name for p in first] == ["t.csv", "t.meta.json", "t.comma.csv"]
    for one, two in zip(first, second, strict=True):
        assert one.read_bytes() == two.read_bytes()


def test_sidecar_says_what_the_columns_are(tmp_path: Path) -> None:
    meta = {
        **META,
        "robot": Path("/home/someone/robot.toml"),
        "warnings": ["see /home/someone/x/robot.toml: odd", "3 rad/s is fine"],
        "scale": np.float64(2.0),
        "limit": float("inf"),
        "gap": float("nan"),
    }
    path = write_table(table([1.0]), tmp_path, meta=meta)[1]
    said = json.loads(path.read_text(encoding="utf-8"))
    assert said["columns"][0] == {"name": "id", "meaning": "row", "unit": ""}
    x = {"name": "x", "meaning": "length", "unit": "m", "zero_below": 1e-12}
    assert said["columns"][1] == x
    assert said["robot"] == "robot.toml"
    assert said["warnings"] == ["see robot.toml: odd", "3 rad/s is fine"]
    assert (said["scale"], said["limit"], said["gap"]) == (2.0, "inf", None)
    assert said["rows"] == 1
    assert list(said["inputs"]) == ["a.toml", "b.toml"]


def test_meta_that_json_cannot_hold_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TableError, match="meta holds a object"):
        write_table(table([1.0]), tmp_path, meta={"a": object()})
    with pytest.raises(TableError, match="reserved"):
        write_table(table([1.0]), tmp_path, meta={"columns": 1})
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("text", "short"),
    [
        ("/home/a/b.csv", "b.csv"),
        ("C:\\data\\b.csv", "b.csv"),
        ("'/a/b.csv': odd", "'b.csv': odd"),
        ("rad/s and 1/K and m/s/s", "rad/s and 1/K and m/s/s"),
        ("urdf/hexapod.toml", "urdf/hexapod.toml"),
        ("https://example.org/a/b", "https://example.org/a/b"),
    ],
)
def test_folders_of_absolute_paths_go(text: str, short: str) -> None:
    assert without_folders(text) == short


@pytest.mark.parametrize("stop", [KeyboardInterrupt, RuntimeError, OSError(28, "No space left")])
def test_a_stop_in_the_middle_leaves_the_old_files(tmp_path: Path, monkeypatch, stop) -> None:
    old = write_table(table([1.0, 2.0]), tmp_path, meta=META)
    before = [p.read_bytes() for p in old]
    real = Path.write_bytes

    def failing(self: Path, data: bytes) -> int:
        if ".meta.json" in self.name:
            real(self, data[: len(data) // 2])
            raise stop
        return real(self, data)

    monkeypatch.setattr(Path, "write_bytes", failing)
    expected = OutputError if isinstance(stop, OSError) else stop
    with pytest.raises(expected):
        write_table(table([3.0]), tmp_path, meta=META)
    assert [p.read_bytes() for p in old] == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t.csv", "t.meta.json"]


def test_folder_that_is_a_file_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("x")
    for folder in (tmp_path / "out", tmp_path / "out" / "deeper"):
        with pytest.raises(OutputError, match="not a folder") as caught:
            write_table(table([1.0]), folder, meta=META)
        assert "\n" not in str(caught.value)
    assert (tmp_path / "out").read_text() == "x"


def test_target_that_is_a_folder(tmp_path: Path) -> None:
    (tmp_path / "t.csv").mkdir()
    with pytest.raises(OutputError, match="is a folder"):
        write_table(table([1.0]), tmp_path, meta=META)


def test_what_a_killed_process_left_goes_and_a_living_ones_stays(tmp_path: Path) -> None:
    dead = subprocess.Popen(["true"])
    dead.wait()
    for name in (f".a.md.{dead.pid}.tmp", f".a.md.{os.getppid()}.tmp", ".a.md.notes.tmp"):
        (tmp_path / name).write_text("half")
    write_text(tmp_path / "a.md", "whole")
    left = {f".a.md.{os.getppid()}.tmp", ".a.md.notes.tmp", "a.md"}
    assert {path.name for path in tmp_path.iterdir()} == left
