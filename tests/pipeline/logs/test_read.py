"""Reading logs: what comes out of a good file, and the one line a bad one gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from pipeline.logs.errors import GapError
from pipeline.logs.quality.quality import judge
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.mapping import parse_mapping
from pipeline.logs.reading.read import read_log, stream_log
from pipeline.logs.reading.table_file import open_table, row_count

Array = NDArray[np.float64]
Columns = dict[str, Array]
Write = Callable[..., Path]


def test_a_good_log_round_trips(two_joints: Expected, columns: Columns, write: Write) -> None:
    log = read_log(write(columns), two_joints)
    assert log.joints == ("a", "b")
    assert np.array_equal(log.time, columns["time_s"])
    assert np.array_equal(log.position[:, 1], columns["b__position_rad"])
    assert log.effort.channel == "torque"
    assert log.effort.unit == "N*m"
    assert log.position_source == "joint"
    assert log.valid.all()
    assert len(log.sha256) == 64


def test_parquet_and_csv_agree(
    two_joints: Expected, columns: Columns, write: Write, tmp_path: Path
) -> None:
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(columns), path, row_group_size=300)
    a, b = read_log(write(columns), two_joints), read_log(path, two_joints)
    assert np.array_equal(a.torque, b.torque)
    assert row_count(open_table(path)) == len(b)
    pieces = list(stream_log(path, two_joints, rows=700))
    assert np.array_equal(np.concatenate([p.position for p in pieces]), b.position)


def test_columns_come_in_the_robots_order(
    two_joints: Expected, columns: Columns, write: Write
) -> None:
    turned = {"time_s": columns["time_s"]} | dict(reversed(list(columns.items())))
    assert np.array_equal(
        read_log(write(turned), two_joints).position[:, 0], columns["a__position_rad"]
    )


def test_motor_side_positions_are_divided_by_the_signed_ratio(
    two_joints: Expected, columns: Columns, write: Write
) -> None:
    for joint, ratio in (("a", 100.0), ("b", -100.0)):
        columns[f"{joint}__motor_position_rad"] = ratio * columns.pop(f"{joint}__position_rad")
    log = read_log(write(columns), two_joints)
    assert log.position_source == "motor"
    assert np.ptp(log.position, axis=0) == pytest.approx([2.4, 2.0], abs=0.3)


def test_feet_go_by_leg_or_frame(two_joints: Expected, columns: Columns, write: Write) -> None:
    n = columns["time_s"].size
    for k, axis in enumerate("xyz"):
        columns[f"lf_foot_link__force_{axis}_N"] = np.full(n, float(k))
    columns["lf__contact"] = np.array([True] * n)
    log = read_log(write(columns), two_joints)
    assert log.feet == ("lf",)
    assert log.foot_force is not None
    assert np.array_equal(log.foot_force[0, 0], [0.0, 1.0, 2.0])
    assert log.contact is not None
    assert log.contact.all()


@pytest.mark.parametrize(
    ("given", "kept", "verdict"), [("xyz", "xyz", "ok"), ("z", "z", "warning"), ("xy", "", "")]
)
def test_forces_of_feet_are_kept_as_measured(
    two_joints: Expected, columns: Columns, write: Write, given: str, kept: str, verdict: str
) -> None:
    n = columns["time_s"].size
    for axis in given:
        columns[f"lf__force_{axis}_N"] = np.full(n, float("xyz".index(axis)))
    log = read_log(write(columns), two_joints)
    found = [f for f in judge(log, two_joints).findings if f.check == "foot_forces"]
    if not kept:
        assert log.foot_force is None
        assert set(log.ignored) == {f"lf__force_{axis}_N" for axis in given}
        assert not found
        return
    assert log.foot_force is not None
    for k, axis in enumerate("xyz"):
        expected = float(k) if axis in kept else np.nan
        assert np.array_equal(log.foot_force[:, 0, k], np.full(n, expected), equal_nan=True)
    assert [f.verdict for f in found] == [verdict]


def test_forces_of_some_feet_alone_are_not_used(
    two_joints: Expected, columns: Columns, write: Write
) -> None:
    six = replace(two_joints, feet=("lf", "rf"))
    for axis in "xyz":
        columns[f"lf__force_{axis}_N"] = np.ones(columns["time_s"].size)
    columns["lf__contact"] = np.ones(columns["time_s"].size)
    log = read_log(write(columns), six)
    assert log.foot_force is None
    assert log.contact is None
    assert len(log.ignored) == 4


def test_empty_effort_cells_are_masked_not_invented(
    two_joints: Expected, columns: Columns, write: Write
) -> None:
    columns["b__torque_Nm"][100:200] = np.nan
    log = read_log(write(columns), two_joints)
    assert not log.valid[100:200, 1].any()
    assert log.valid[:, 0].all()


def unsorted(c: Columns) -> Columns:
    c["time_s"][[50, 51]] = c["time_s"][[51, 50]]
    return c


def stopped(c: Columns) -> Columns:
    c["time_s"][:] = 1.0
    return c


def no_time(c: Columns) -> Columns:
    return {k: v for k, v in c.items() if k != "time_s"}


def renamed_joint(c: Columns) -> Columns:
    return {k.replace("b__", "c__"): v for k, v in c.items()}


def misspelt_joint(c: Columns) -> Columns:
    return {k.replace("b__position_rad", "b__postion_rad"): v for k, v in c.items()}


def another_robot(c: Columns) -> Columns:
    return {k.replace("a__", "wheel_1__").replace("b__", "wheel_2__"): v for k, v in c.items()}


def other_unit(c: Columns) -> Columns:
    return {k.replace("a__position_rad", "a__position_deg"): v for k, v in c.items()}


def no_effort(c: Columns) -> Columns:
    return {k: v for k, v in c.items() if "torque" not in k}


def renamed_effort(c: Columns) -> Columns:
    return {k.replace("b__torque", "c__torque"): v for k, v in c.items()}


def huge(c: Columns) -> Columns:
    c["a__torque_Nm"][3] = 1e300
    return c


def infinite_time(c: Columns) -> Columns:
    c["time_s"][-1] = np.inf
    return c


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (unsorted, ("row 53", "sort")),
        (no_time, ("time_s",)),
        (stopped, ("time never changes",)),
        (renamed_joint, ("'b'", "b__position_rad", "c__position_rad")),
        (misspelt_joint, ("b__postion_rad", "did you mean 'b__position_rad'")),
        (another_robot, ("another robot", "wheel_1")),
        (other_unit, ("a__position_deg", "a__position_rad", "mapping")),
        (no_effort, ("no effort", "a__torque_Nm")),
        (renamed_effort, ("'b'", "torque")),
        (huge, ("row 5", "a__torque_Nm", "1e+300")),
        (infinite_time, ("row 2001", "time")),
    ],
)
def test_bad_columns_give_one_clear_line(
    spoil: Callable[[Columns], Columns],
    words: tuple[str, ...],
    two_joints: Expected,
    columns: Columns,
    write: Write,
) -> None:
    with pytest.raises(GapError) as error:
        read_log(write(spoil(columns)), two_joints)
    message = str(error.value)
    assert "\n" not in message
    assert len(message) < 500
    assert message.startswith("log.csv")
    for word in words:
        assert word in message, message


def test_rows_that_repeat_a_time_are_dropped_and_counted(
    two_joints: Expected, columns: Columns, write: Write
) -> None:
    whole = read_log(write(columns), two_joints)
    columns["time_s"][51] = columns["time_s"][50]
    log = read_log(write(columns), two_joints)
    assert log.repeated_times == 1
    assert np.array_equal(log.position, np.delete(whole.position, 51, axis=0))


def test_a_joint_the_log_does_not_know_stands_still_and_is_left_out(
    two_joints: Expected, columns: Columns, write: Write
) -> None:
    known = {k: v for k, v in columns.items() if not k.startswith("b__")}
    log = read_log(write(known), two_joints)
    assert np.all(log.position[:, 1] == 0.0)
    assert "taken as still at 0 rad" in log.left_out["b"]
    empty = columns | {k: np.full(2000, np.nan) for k in columns if k.startswith("b__")}
    assert read_log(write(empty), two_joints).left_out == log.left_out
    stated = parse_mapping(
        {"constants": {"b__position_rad": {"value": 0.4, "unit": "rad"}}}, "mapping"
    )
    log = read_log(write(known), two_joints, stated)
    assert np.all(log.position[:, 1] == 0.4)
    assert "not compared" in log.left_out["b"]


def test_a_joint_without_an_effort_keeps_its_motion(
    two_joints: Expected, columns: Columns, write: Write
) -> None:
    del columns["b__torque_Nm"]
    log = read_log(write(columns), two_joints)
    assert np.array_equal(log.position[:, 1], columns["b__position_rad"])
    assert not log.valid[:, 1].any()
    assert "not compared" in log.left_out["b"]


def test_columns_a_star_catches_beside_the_robots_joints_are_ignored(
    two_joints: Expected, columns: Columns, write: Write
) -> None:
    foreign = {k.replace("__position_rad", " q"): v for k, v in columns.items()}
    foreign |= {"gripper q": foreign["a q"]}
    mapping = parse_mapping({"columns": {"* q": {"as": "*__position_rad"}}}, "mapping")
    assert "gripper q" in read_log(write(foreign), two_joints, mapping).ignored


HEAD = b"time_s,a__position_rad,b__position_rad,a__torque_Nm,b__torque_Nm\n"


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", ("empty",)),
        (b"\n\n", ("empty",)),
        (HEAD, ("no rows",)),
        (HEAD + b"0,1,2,3,4\n1,2,3\n", ("row 3", "has 3 cells", "header 5")),
        (HEAD + b"0,1,2,3,4,5\n", ("row 2", "has 6 cells")),
        (HEAD + b"0,0,1,0,2,0,3,0,4,0\n", ("decimal commas",)),
        (HEAD + b'0,"1,5",2,3,4\n', ("a__position_rad", "decimal comma")),
        (HEAD.replace(b",", b";") + b"0;1,5;2;3;4\n", ("separated by ';'", "[csv]")),
        (HEAD + b"0,x1,2,3,4\n", ("row 2", "a__position_rad", "'x1'", "number")),
        (HEAD + b"0,\xff\xfe,2,3,4\n", ("a__position_rad",)),
        (HEAD.decode().encode("utf-16"), ("UTF-8",)),
        (b"0,1,2,3,4\n0,1,2,3,4\n", ("header",)),
        (HEAD[:-1] + b",time_s\n0,1,2,3,4,5\n", ("'time_s' occurs twice",)),
        (HEAD[:-1] + b",\n0,1,2,3,4,5\n", ("column 6 has no name",)),
        (b"PAR1" + bytes(100), ("Parquet",)),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), ("UTF-8",)),
    ],
)
def test_bad_bytes_give_one_clear_line(
    data: bytes, words: tuple[str, ...], two_joints: Expected, tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(data)
    with pytest.raises(GapError) as error:
        read_log(path, two_joints)
    message = str(error.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message


def test_a_missing_file_is_named(two_joints: Expected, tmp_path: Path) -> None:
    with pytest.raises(GapError, match="nothing_here"):
        read_log(tmp_path / "nothing_here.csv", two_joints)


def test_streamed_time_is_checked_across_pieces(
    two_joints: Expected, columns: Columns, tmp_path: Path
) -> None:
    columns["time_s"][700:] -= columns["time_s"][700] - columns["time_s"][600]
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(columns), path)
    with pytest.raises(GapError, match="row 702"):
        list(stream_log(path, two_joints, rows=700))
