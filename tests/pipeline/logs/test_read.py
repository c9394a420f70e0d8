"""Reading logs as tools write them: what comes out of a good file, one line for a bad one."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from actuators.errors import LegwattError
from pipeline.logs import formats
from pipeline.logs import load as load_module
from pipeline.logs.load import Asked
from pipeline.logs.log import TEST, TRAIN, VALIDATION, Recording
from pipeline.logs.mapping import parse_mapping
from pipeline.logs.read import read_log
from tests.pipeline.logs.made import motion

Array = NDArray[np.float64]
Columns = dict[str, Array]
Read = Callable[..., Recording]


def one_line(action: Callable[[], object], words: tuple[str, ...]) -> str:
    """An error's message: one line that says these words."""
    with pytest.raises(LegwattError) as error:
        action()
    message = str(error.value)
    assert "\n" not in message
    assert len(message) < 500
    for word in words:
        assert word in message, message
    return message


def test_a_good_log_round_trips_in_the_robots_order(columns, read):
    log = read({"time_s": columns["time_s"]} | dict(reversed(list(columns.items()))))
    assert log.joints == ("a", "b")
    assert np.array_equal(log.time, columns["time_s"])
    assert np.array_equal(log.position[:, 1], columns["b__position_rad"])
    assert log.effort == "torque"
    assert not log.at_motor
    assert len(log.sha256) == 64


def renamed(old: str, new: str) -> Callable[[Columns], Columns]:
    return lambda c: {k.replace(old, new): v for k, v in c.items()}


def with_value(column: str, rows: object, value: object) -> Callable[[Columns], Columns]:
    def spoil(c: Columns) -> Columns:
        c[column][rows] = value  # type: ignore[index]
        return c

    return spoil


BAD_COLUMNS = [
    (with_value("time_s", [50, 51], [0.102, 0.1]), ("row 53", "sort")),
    (renamed("time_s", "clock"), ("time_s",)),
    (renamed("b__", "c__"), ("b__position_rad", "c__position_rad")),
    (renamed("b__position_rad", "b__postion_rad"), ("did you mean 'b__position_rad'",)),
    (renamed("__", "_wheel__"), ("another robot", "a_wheel")),
    (renamed("a__position_rad", "a__position_deg"), ("a__position_deg", "mapping")),
    (lambda c: {k: v for k, v in c.items() if "torque" not in k}, ("no effort", "a__torque_Nm")),
    (with_value("time_s", -1, np.inf), ("row 2001", "time")),
]


@pytest.mark.parametrize(("spoil", "words"), BAD_COLUMNS)
def test_bad_columns_give_one_clear_line(spoil, words, columns, read):
    assert one_line(lambda: read(spoil(columns)), words).startswith("log.csv")


def test_a_joint_the_log_does_not_know_stands_still_and_is_left_out(columns, read):
    known = {k: v for k, v in columns.items() if not k.startswith("b__")}
    log = read(known | {"a__vibration_m_s": known["time_s"]})  # whose name is no slip
    assert np.all(log.position[:, 1] == 0.0)
    assert "taken as still at 0 rad" in log.left_out["b"]
    empty = columns | {k: np.full(2000, np.nan) for k in columns if k.startswith("b__")}
    assert read(empty).left_out == log.left_out
    stated = read(known, '[constants.b__position_rad]\nvalue = 0.4\nunit = "rad"')
    assert np.all(stated.position[:, 1] == 0.4)
    assert "not compared" in stated.left_out["b"]


HEAD = b"time_s,a__position_rad,b__position_rad,a__torque_Nm,b__torque_Nm\n"


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", ("empty", "no header")),
        (HEAD, ("no header", "rows")),
        (HEAD + b"0,1,2,3,4\n1,2,3,4,5,6\n2,3,4,5,6\n", ("line 3, saw 6",)),
        (HEAD + b'0,"1,5",2,3,4\n', ("row 2", "a__position_rad", "'1,5'", "as 1.5")),
        (HEAD + b"0,x1,2,3,4\n", ("row 2", "a__position_rad", "'x1'", "number")),
        (HEAD + b"0,\xff\xfe,2,3,4\n", ("a__position_rad",)),
        (HEAD.decode().encode("utf-16"), ("UTF-8",)),
        (b"0,1,2,3,4\n0,1,2,3,4\n", ("header",)),
        (HEAD[:-1] + b",time_s\n0,1,2,3,4,5\n", ("'time_s' occurs twice",)),
        (b"PAR1" + bytes(100), ("Parquet",)),
    ],
)
def test_bad_bytes_give_one_clear_line(data, words, two_joints, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(data)
    one_line(lambda: read_log(path, two_joints), words)


def test_a_row_cut_off_at_the_end_is_left_out(columns, write, two_joints):
    path = write(columns)
    path.write_bytes(path.read_bytes()[:-40])
    log = read_log(path, two_joints)
    assert np.array_equal(log.time, columns["time_s"][:-1])


def both_sides(
    columns: Columns, ratio: float = 1.0, *, own: str = "ab", motor: str = "ab"
) -> Columns:
    """Positions at the joint and at the motor of some of the joints."""
    out = dict(columns)
    for joint, n in (("a", 100.0 * ratio), ("b", -100.0 * ratio)):
        q = out.pop(f"{joint}__position_rad")
        out |= {f"{joint}__position_rad": q} if joint in own else {}
        out |= {f"{joint}__motor_position_rad": n * q} if joint in motor else {}
    return out


SIDES = [
    (both_sides, True, "", ""),
    (both_sides, False, "", "gear ratio -100 by the two positions"),
    (lambda c: both_sides(c, 0.8), True, "", "80 by the two positions, 100 by the files"),
    (lambda c: both_sides(c, own=""), False, "[gear_ratio]\na = 100\nb = -100\n", ""),
    (lambda c: both_sides(c, own="a", motor="b"), True, "", ""),
]


@pytest.mark.parametrize(("make", "stated", "text", "says"), SIDES)
def test_positions_of_both_sides_of_a_gear_are_the_joints(
    two_joints, columns, read, make, stated, text, says
):
    expected = two_joints if stated else replace(two_joints, ratio=None)
    log = read(make(columns), text, expected=expected)
    assert np.allclose(np.abs(log.position[:, 1]), np.abs(columns["b__position_rad"]))
    said = " ".join(f.detail for f in log.findings)
    assert (says in said) if says else not said


def test_a_file_beyond_memory_is_read_in_spread_stretches_and_a_long_log_by_what_tells_most(
    two_joints, tmp_path, monkeypatch
):
    t, q, _, _ = motion(40_000)
    columns = {"time_s": t}
    for j, joint in enumerate("ab"):
        columns[f"{joint}__position_rad"] = q[:, j]
        columns[f"{joint}__torque_Nm"] = np.sin(q[:, j]) + 0.05 * np.cos(7.0 * t)
    pq.write_table(pa.table(columns), path := tmp_path / "long.parquet")
    monkeypatch.setattr(formats, "_STRETCH", 2_000)
    monkeypatch.setattr(formats, "MOST_BYTES", 8 * 5 * 20_000)
    log = read_log(path, two_joints)
    assert len(log) == 20_000
    assert log.time[-1] > 70.0
    assert (np.diff(log.time) > 1.0).sum() == 9
    monkeypatch.setattr(load_module, "MOST_ROWS", 1_000)
    (few,) = load_module.load([path], 1, Asked(two_joints, cutoff=10.0)).logs
    assert len(few) <= 1_000
    assert {TRAIN, VALIDATION, TEST} <= set(few.part.tolist())


NAMED = {
    "time": {"column": "robot/t"},
    "columns": {"robot/q[*]": {"as": "*__position_rad"}, "robot/tau[*]": {"as": "*__torque_Nm"}},
    "joints": {"0": "a", "1": "b"},
}


def blocks(columns: Columns) -> dict[str, Array]:
    """The columns as a time vector and matrices of both joints."""
    q, tau = (
        np.stack([columns[f"{j}__{end}"] for j in "ab"], axis=1)
        for end in ("position_rad", "torque_Nm")
    )
    return {"t": columns["time_s"], "q": q, "tau": tau}


def agrees(log: Recording, columns: Columns) -> None:
    assert np.allclose(log.time - log.time[0], columns["time_s"], atol=1e-6)
    torque = log.of("torque")
    assert torque is not None
    for j, joint in enumerate("ab"):
        assert np.allclose(log.position[:, j], columns[f"{joint}__position_rad"], atol=1e-12)
        assert np.allclose(torque[:, j], columns[f"{joint}__torque_Nm"], atol=1e-12)


def save_mat(path: Path, arrays: dict[str, Array]) -> None:
    from scipy.io import savemat

    savemat(path, {"robot": arrays, "gain": 3.0})


def save_h5(path: Path, arrays: dict[str, Array]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, array in arrays.items():
            file[f"robot/{name}"] = array


def save_mat73(path: Path, arrays: dict[str, Array]) -> None:
    """As MATLAB does: HDF5 behind 512 bytes of its own, matrices transposed."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("robot")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, array in arrays.items():
            data = group.create_dataset(name, data=np.atleast_2d(array.T))
            data.attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124))
        file.write(b"\x00\x02IM")


@pytest.mark.parametrize(
    ("name", "save"),
    [("log.mat", save_mat), ("log.h5", save_h5), ("log73.mat", save_mat73)],
)
def test_arrays_are_columns(name, save, columns, two_joints, tmp_path):
    save(tmp_path / name, blocks(columns))
    agrees(read_log(tmp_path / name, two_joints, parse_mapping(NAMED, "mapping")), columns)


def text_of(columns: Columns) -> str:
    rows = (",".join(repr(float(x)) for x in row) for row in zip(*columns.values(), strict=True))
    return "\n".join([",".join(columns), *rows]) + "\n"


def _rows(text: str, change: Callable[[str], str]) -> str:
    return "\n".join(change(line) for line in text.splitlines()) + "\n"


TOOLS: dict[str, Callable[[str], str]] = {
    "lines above the header": lambda text: "Recorder 2.1\nDate: today\n\n" + text,
    "Excel's separator": lambda text: "sep=;\n" + text.replace(",", ";"),
    "a comma at every end": lambda text: text.replace("\n", ",\n"),
    "a column without a name": lambda text: _rows(text, lambda line: f",{line}"),
    "columns of spaces": lambda text: _rows(text, lambda line: "  " + line.replace(",", "   ")),
    "Windows": lambda text: "\ufeff" + text.replace("\n", "\r\n"),
    "a remark": lambda text: "# of a robot\n# " + text + "# end\n",
    "cells in line": lambda text: text.replace(",", "  ,  "),
    "quotes": lambda text: text.replace("time_s", '"time_s"'),
    "Latin-1": lambda text: _rows(text, lambda line: line + (",\u00b0" if "t" in line else ",1")),
}


@pytest.mark.parametrize("tool", TOOLS)
def test_text_as_other_tools_write_it(tool, columns, two_joints, tmp_path):
    text = TOOLS[tool](text_of(columns))
    (tmp_path / "log.csv").write_bytes(text.encode("latin-1" if tool == "Latin-1" else "utf-8"))
    agrees(read_log(tmp_path / "log.csv", two_joints), columns)


@pytest.mark.parametrize("zone", ["", "+02:00"])
def test_dates_and_times(zone, columns, two_joints, tmp_path):
    start = np.datetime64("2026-03-01T23:59:58.5", "ns")
    stamps = start + np.round(columns["time_s"] * 1e9).astype("timedelta64[ns]")
    rows = zip(*[v for k, v in columns.items() if k != "time_s"], strict=True)
    lines = [
        ",".join([f"{t}{zone}", *(repr(float(x)) for x in row)])
        for t, row in zip(stamps, rows, strict=True)
    ]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join(columns), *lines]) + "\n")
    agrees(read_log(path, two_joints), columns)
