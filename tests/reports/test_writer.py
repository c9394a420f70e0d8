"""What is written reads back to the same numbers, and is there whole or not at all."""

from __future__ import annotations

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

from actuators.errors import LegwattError
from pipeline.atomic import replacing, write_text
from pipeline.columns import FILE, column, declared, frame
from reports.folder import plain, read_record, staged
from reports.writer import LARGEST, SHARE, csv_bytes, without_roundoff, write_tables

ROUNDOFF = 2.2e-32


def table(values: Any) -> pd.DataFrame:
    return pd.DataFrame({"id": [str(i) for i in range(len(values))], "x": values})


def read(content: bytes, delimiter: str = ",") -> list[dict[str, str]]:
    text = content.decode("utf-8-sig")
    return list(csv.DictReader(io.StringIO(text, newline=""), delimiter=delimiter))


def test_every_column_is_declared_once_with_its_meaning() -> None:
    with FILE.open(encoding="utf-8", newline="") as file:
        rows = [*csv.reader(file)][1:]
    assert len({(name, header) for name, header, *_ in rows}) == len(rows)
    assert all(meaning for _, _, _, meaning, _ in rows)
    for name, header, unit, *_ in rows:
        other = unit.removeprefix("see ")
        assert other == unit or other in declared(name), (name, header)
    assert column("walking_joint_demand", "rm_joint_2__torque_Nm").unit == "N*m"
    assert column("rollout_walk", "a__after_voltage_V").unit == "V"
    for wrong in ("walking_enrgy", "standing"):
        with pytest.raises(LegwattError, match="did you mean 'walking_energy'|no column 'enrgy'"):
            column(wrong, "enrgy")


@settings(deadline=None)
@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=30))
def test_floats_round_trip_to_the_last_bit(values: list[float]) -> None:
    back = [float(row["x"]) for row in read(csv_bytes("t", table(np.array(values))))]
    assert np.array(back).tobytes() == np.array(values).tobytes()


@settings(deadline=None)
@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=30))
def test_decimal_commas_parse_back(values: list[float]) -> None:
    rows = read(csv_bytes("t", table(np.array(values)), decimal=","), ";")
    assert [float(row["x"].replace(",", ".")) for row in rows] == values
    assert not any("." in row["x"] for row in rows)


@settings(deadline=None)
@given(st.lists(st.text(st.characters(codec="utf-8", exclude_characters="\r\0")), min_size=1))
def test_texts_round_trip(texts: list[str]) -> None:
    made = pd.DataFrame({"s": texts, "n": [1] * len(texts)})
    assert [row["s"] for row in read(csv_bytes("t", made))] == texts


def test_nan_and_none_are_empty() -> None:
    content = csv_bytes("t", table(np.array([1.0, np.nan, -2.5])))
    assert content == b"id,x\n0,1\n1,\n2,-2.5\n"
    assert csv_bytes("t", table([None, 2.0])) == b"id,x\n0,\n1,2\n"
    assert csv_bytes("t", table([None, None])) == b"id,x\n0,\n1,\n"


def test_no_number_with_a_comma_keeps_a_dot_or_stands_in_quotes() -> None:
    """A number in a column of texts is one, too; a text that holds one is left alone."""
    texts = ["2.04", "-0.866", "1.5e-3", "almost 15", "1.2.3", "Table 3.", "0.21; 0.94", ""]
    made = pd.DataFrame({"s": texts, "x": np.arange(8) / 2})
    lines = csv_bytes("t", made, decimal=",").decode("utf-8-sig").splitlines()[1:]
    assert lines == [
        *("2,04;0", "-0,866;0,5", "1,5e-3;1", "almost 15;1,5", "1.2.3;2", "Table 3.;2,5"),
        *('"0.21; 0.94";3', ";3,5"),
    ]
    assert b"2.04,0\n" in csv_bytes("t", made)


def torques() -> pd.DataFrame:
    rows = [("x", "a", -30.0, ROUNDOFF, 1e-14), ("x", "b", ROUNDOFF, -3e-14, 2.0)]
    return frame("standing", [(*row, 1.0, 2.0, 0.0, 0.0) for row in rows])


def test_roundoff_is_zero_beside_what_has_the_same_unit() -> None:
    """A column of round-off alone, too; numbers that were given are left alone."""
    clean, zero_below = without_roundoff("standing", torques())
    assert clean["joint_torque_Nm"].tolist() == [-30.0, 0.0]
    assert clean["motor_torque_Nm"].tolist() == [0.0, 0.0]
    assert clean["current_A"].tolist() == [0.0, 2.0]
    assert zero_below["motor_torque_Nm"] == 30.0 * SHARE
    exact = frame("parameters", [("a", "b", ROUNDOFF, "N*m", "assumed", "", None, None, "")])
    assert without_roundoff("parameters", exact)[0] is exact


def test_rows_with_units_of_their_own() -> None:
    rows = [("x", "a", "q", u, 0.0, p, 0.0, 0.0, False) for p, u in
            ((700.0, "rad/s"), (ROUNDOFF, "rad/s"), (5e-11, "A"), (0.2, "A"))]  # fmt: skip
    clean, zero_below = without_roundoff("motor_limits", frame("motor_limits", rows))
    assert clean["peak"].tolist() == [700.0, 0.0, 5e-11, 0.2]
    assert zero_below["peak"] == pytest.approx({"rad/s": 700 * SHARE, "A": 0.2 * SHARE})


def postures(values: list[float]) -> pd.DataFrame:
    return frame("standing_posture", [(str(k), x) for k, x in enumerate(values)])


def test_one_number_gone_astray_wipes_out_nothing() -> None:
    """The end of an interval that nothing bounds is no measure of rounding."""
    clean, zero_below = without_roundoff("standing_posture", postures([1e30, 0.5, 1e-6, -1e-10]))
    assert clean["position_rad"].tolist() == [1e30, 0.5, 1e-6, 0.0]
    assert zero_below["position_rad"] == LARGEST


@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=20))
def test_twice_is_once_and_every_change_is_below_what_is_stated(values: list[float]) -> None:
    once, zero_below = without_roundoff("standing_posture", postures(values))
    bound = zero_below.get("position_rad", 0.0)
    for old, new in zip(values, once["position_rad"], strict=True):
        assert new == (0.0 if abs(old) <= bound else old)
        assert math.copysign(1.0, new) == 1.0 or new < 0
    assert without_roundoff("standing_posture", once)[0].equals(once)


def test_the_record_says_what_the_columns_are(tmp_path: Path) -> None:
    """Meanings, units, dialect, hash, and the run's options; the same bytes for the same run."""
    said = {"seed": 1, "robot": tmp_path / "robot.toml", "gap": math.nan}
    for folder in ("a", "b"):
        about: dict[str, Any] = {}
        with staged(tmp_path / folder, "stand", decimal=",", said=said, about=about) as out:
            about |= write_tables({"standing": torques()}, out, decimal=",")
    one, two = ((tmp_path / folder / "datapackage.json").read_bytes() for folder in "ab")
    assert one == two
    record = json.loads(one)
    assert (record["seed"], record["robot"], record["gap"]) == (1, "robot.toml", None)
    (resource,) = record["resources"]
    assert (resource["path"], resource["rows"]) == ("standing.csv", 2)
    assert resource["dialect"] == {"delimiter": ";", "decimalChar": ","}
    torque = resource["schema"]["fields"][2]
    assert (torque["name"], torque["type"], torque["unit"]) == ("joint_torque_Nm", "number", "N*m")
    assert torque["description"]
    assert read_record(tmp_path / "a")[0] == "stand"


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
    assert plain(text) == short


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
        ([1.0, "a"], "out", {}, "'position_rad' holds mixed values"),
        ([{"a": 1}], "out", {}, "'position_rad' holds"),
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
    (tmp_path / "taken" / "standing_posture.csv").mkdir(parents=True)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(LegwattError, match=says) as caught:
        write_tables({"standing_posture": postures(values)}, tmp_path / folder, **more)
    assert "\n" not in str(caught.value)
    assert sorted(tmp_path.rglob("*")) == before
