"""Files as other tools write them: arrays, compressed text, dates, rows of units."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from actuators.errors import LegwattError
from pipeline.logs.log_format import Expected
from pipeline.logs.mapping import parse_mapping
from pipeline.logs.read import read_log
from pipeline.logs.recording import Recording

Array = NDArray[np.float64]
Columns = dict[str, Array]
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


def save_npz(path: Path, arrays: dict[str, Array]) -> None:
    np.savez(path, **{f"robot/{k}": v for k, v in arrays.items()})


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
    [("log.npz", save_npz), ("log.mat", save_mat), ("log.h5", save_h5), ("log73.mat", save_mat73)],
)
def test_arrays_are_columns(
    name: str,
    save: Callable[[Path, dict[str, Array]], None],
    columns: Columns,
    two_joints: Expected,
    tmp_path: Path,
) -> None:
    save(tmp_path / name, blocks(columns))
    agrees(read_log(tmp_path / name, two_joints, parse_mapping(NAMED, "mapping")), columns)


def text_of(columns: Columns, header: str, *above: str, below: str = "") -> str:
    rows = (",".join(repr(float(x)) for x in row) for row in zip(*columns.values(), strict=True))
    return "\n".join([*above, header, *([below] if below else []), *rows]) + "\n"


def test_a_row_of_units_counts(columns: Columns, two_joints: Expected, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    other = {"t": 1e3 * columns["time_s"]}
    for j in "ab":
        other[f"q_{j}"] = np.degrees(columns[f"{j}__position_rad"])
        other[f"tau_{j}"] = 1e3 * columns[f"{j}__torque_Nm"]
    path.write_text(text_of(other, ",".join(other), below="ms,[deg],mNm,°,mN*m"), encoding="utf-8")
    mapping = {
        "time": {"column": "t", "unit": "ms"},
        "columns": {"q_*": {"as": "*__position_rad"}, "tau_*": {"as": "*__torque_Nm"}},
    }
    agrees(read_log(path, two_joints, parse_mapping(mapping, "mapping")), columns)
    wrong = ",".join(["s", "deg", "rad/s", "Nm", "rad", "rad/s", "Nm"])
    path.write_text(text_of(columns, ",".join(columns), below=wrong))
    with pytest.raises(LegwattError, match="'deg' by the row of units"):
        read_log(path, two_joints)


def _rows(text: str, change: Callable[[str], str]) -> str:
    return "\n".join(change(line) for line in text.splitlines()) + "\n"


TOOLS: dict[str, Callable[[str], str]] = {
    "lines above the header": lambda text: "Recorder 2.1\nDate: today\n\n" + text,
    "Excel's separator": lambda text: "sep=;\n" + text.replace(",", ";"),
    "a comma at every end": lambda text: text.replace("\n", ",\n"),
    "a column without a name": lambda text: _rows(text, lambda line: f",{line}"),
    "columns of spaces": lambda text: _rows(text, lambda line: "  " + line.replace(",", "   ")),
    "Windows": lambda text: "\ufeff" + text.replace("\n", "\r\n"),
    "quotes": lambda text: text.replace("time_s", '"time_s"'),
    "Latin-1": lambda text: _rows(text, lambda line: line + (",\u00b0" if "t" in line else ",1")),
}


@pytest.mark.parametrize("tool", TOOLS)
def test_text_as_other_tools_write_it(
    tool: str, columns: Columns, two_joints: Expected, tmp_path: Path
) -> None:
    text = TOOLS[tool](text_of(columns, ",".join(columns)))
    (tmp_path / "log.csv").write_bytes(text.encode("latin-1" if tool == "Latin-1" else "utf-8"))
    agrees(read_log(tmp_path / "log.csv", two_joints), columns)


@pytest.mark.parametrize("zone", ["", "+02:00"])
def test_dates_and_times(zone: str, columns: Columns, two_joints: Expected, tmp_path: Path) -> None:
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
