"""What is written reads back to the same numbers, and is there whole or not at all."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuators.errors import LegwattError
from pipeline.atomic import replacing, write_text
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
def test_decimal_commas_parse_back(values: list[float]) -> None:
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


def test_no_number_with_a_comma_keeps_a_dot_or_stands_in_quotes() -> None:
    """A number in a column of texts is one, too; a text that holds one is left alone."""
    texts = ["2.04", "-0.866", "1.5e-3", "almost 15", "1.2.3", "Table 3.", "0.21; 0.94", ""]
    made = Table("t", {"s": texts, "x": np.arange(8) / 2}, {"s": ("s", ""), "x": ("x", "1")})
    lines = csv_bytes(made, decimal=",").decode("utf-8-sig").splitlines()[1:]
    assert lines == [
        *("2,04;0", "-0,866;0,5", "1,5e-3;1", "almost 15;1,5", "1.2.3;2", "Table 3.;2,5"),
        *('"0.21; 0.94";3', ";3,5"),
    ]
    assert b"2.04,0\n" in csv_bytes(made)


def test_same_input_same_bytes(tmp_path: Path) -> None:
    made = table(np.linspace(0, 1, 7))
    first = write_table(made, tmp_path / "a", meta=META, decimal=",")
    again = dict(reversed(META.items()))
    second = write_table(made, tmp_path / "b" / "c", meta=again, decimal=",")
    assert [p.name for p in first] == ["t.csv", "t.meta.json"]
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
    path = write_table(table([1.0]), tmp_path, meta=meta, decimal=",")[1]
    said = json.loads(path.read_text(encoding="utf-8"))
    assert said["columns"][0] == {"name": "id", "meaning": "row", "unit": ""}
    x = {"name": "x", "meaning": "length", "unit": "m", "zero_below": 1e-12}
    assert said["columns"][1] == x
    assert said["robot"] == "robot.toml"
    assert said["warnings"] == ["see robot.toml: odd", "3 rad/s is fine"]
    assert (said["scale"], said["limit"], said["gap"]) == (2.0, "inf", None)
    assert said["rows"] == 1
    assert said["dialect"] == {"delimiter": ";", "decimalChar": ","}
    assert list(said["inputs"]) == ["a.toml", "b.toml"]


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
def test_a_stop_in_the_middle_of_a_file_leaves_the_old_one(tmp_path: Path, stop) -> None:
    write_text(tmp_path / "a.md", "old")

    def stopped() -> None:
        with replacing(tmp_path / "a.md") as temporary:
            temporary.write_text("half")
            raise stop

    with pytest.raises(LegwattError if isinstance(stop, OSError) else stop):
        stopped()
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]


@pytest.mark.parametrize(
    ("values", "folder", "more", "says"),
    [
        ([1.0, "a"], "out", {}, "'x' holds mixed values"),
        ([{"a": 1}], "out", {}, "'x' holds"),
        ([1.0], "out", {"meta": {"a": object()}}, "meta holds a object"),
        ([1.0], "out", {"meta": {"columns": 1}}, "reserved"),
        ([1.0], "out", {"decimal": ";"}, "decimal"),
        ([1.0], "file", {}, "not a folder"),
        ([1.0], "file/deeper", {}, "not a folder"),
        ([1.0], "taken", {}, "Is a directory"),
    ],
)
def test_what_cannot_be_written_is_one_clear_line(
    tmp_path: Path, values: list, folder: str, more: dict, says: str
) -> None:
    (tmp_path / "file").write_text("x")
    (tmp_path / "taken" / "t.csv").mkdir(parents=True)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(LegwattError, match=says) as caught:
        write_table(table(values), tmp_path / folder, **{"meta": META} | more)
    assert "\n" not in str(caught.value)
    assert sorted(tmp_path.rglob("*")) == before


def test_unwritable_folder(tmp_path: Path, monkeypatch) -> None:
    def denied(self: Path, data: bytes) -> int:
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "write_bytes", denied)
    with pytest.raises(LegwattError, match=r"t\.csv: cannot be written \(Permission denied\)"):
        write_table(table([1.0]), tmp_path, meta=META)
