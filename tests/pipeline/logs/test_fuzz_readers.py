"""Whatever the bytes: a clear line or a usable log, never a traceback."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from actuators.errors import ActuatorError
from pipeline.identification.compare.loaded import prepare_logs
from pipeline.logs.errors import GapError
from pipeline.logs.log_format import Expected
from pipeline.logs.reading.mapping import load_mapping
from pipeline.logs.reading.read import read_log
from tests.pipeline.logs.made import stream_prepared

Array = NDArray[np.float64]
ROWS = 400
TOKENS = (
    *(b",", b";", b"\n", b"\r\n", b'"', b"nan", b"inf", b"-inf", b"1e308", b"-1e-320", b"\x00"),
    *(b"\xff\xfe", b"\xef\xbb\xbf", b"true", b"abc", b"0,5", b"-", b"1e999", b"=1+1", b"#", b"''"),
    *(b"time_s", b"a__position_rad", b"__", b"a__position_deg", b"9" * 400, b"\t", b" ", b"\xc3"),
)
TOML_TOKENS = (
    *(b"[", b"]", b"[[", b"]]", b"{", b"}", b"=", b'"', b"'", b"\n", b"*", b"nan", b"inf", b"-1"),
    *(b"1e400", b"0x10", b"true", b"[columns]", b"[logs]", b"unit", b'"deg"', b'"xyz"', b"1e20"),
    *(b"2020-01-01", b"[[logs]]", b"\x00", b"\xff", b"as", b".", b"99999999999999999999", b"[]"),
)
MAPPING = b"""effort = "torque"
locked = []
[time]
column = "time_s"
unit = "s"
[columns."a__*_Nm"]
as = "a__*_Nm"
unit = "mN*m"
scale = 1000.0
flip = true
zero = 0.5
[joints]
a = "a"
[controller]
gain_per_rad = 2.0
law = "duty"
torque_off_bridge = "open"
[supply]
voltage = {value = 24, unit = "V"}
[constants]
load = {value = 3, unit = "kg"}
[keep]
columns = ["a__torque_Nm"]
[[logs]]
match = "*"
gain_per_rad = 3
condition = {gain = 3}
"""


def valid_columns() -> dict[str, Array]:
    t = np.arange(ROWS) / 100.0
    rng = np.random.default_rng(0)
    out = {"time_s": t}
    for k, joint in enumerate("ab"):
        out[f"{joint}__position_rad"] = np.round(np.sin((3 + k) * t), 5)
        out[f"{joint}__torque_Nm"] = np.round(np.cos((3 + k) * t) + rng.normal(0, 0.1, ROWS), 4)
    return out


def valid_csv() -> bytes:
    columns = valid_columns()
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(f"{x:.6g}" for x in row) for row in rows)]
    return ("\n".join(lines) + "\n").encode()


def mutated(data: bytes, rng: np.random.Generator, tokens: tuple[bytes, ...]) -> bytes:
    """A few cuts, insertions, doublings and flipped bytes; rarely nothing but noise."""
    kind = rng.integers(20)
    if kind == 0:
        return rng.bytes(int(rng.integers(0, 2000)))
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(0, len(out) + 1))
        end = min(len(out), at + int(rng.integers(1, 40)))
        action = int(rng.integers(6))
        if action == 0:
            del out[at:end]
        elif action == 1:
            out[at:at] = tokens[int(rng.integers(len(tokens)))]
        elif action == 2:
            out[at:end] = tokens[int(rng.integers(len(tokens)))]
        elif action == 3:
            out[at:at] = out[at:end]
        elif action == 4 and at < len(out):
            out[at] = int(rng.integers(256))
        elif action == 5 and rng.integers(8) == 0:
            del out[at:]
    return bytes(out)


CELLS = ("", "nan", "inf", "1e300", "-1e8", "0", "1", "0,5", "x", "1e-310", "true", "57.3", "-3")
HEADERS = (
    *("time_s", "a__position_rad", "b__motor_position_rad", "a__velocity_rad_s", "a__voltage_V"),
    *("lf__force_z_N", "lf__contact", "base__roll_rad", "a__position_deg", "", "x", "a__"),
)


def respelt(columns: dict[str, Array], rng: np.random.Generator) -> dict[str, list[str]]:
    """Defects that a real logger makes: cells, columns, rows and headers, well-formed as CSV."""
    table = {name: [f"{x:.6g}" for x in values] for name, values in columns.items()}
    for _ in range(int(rng.integers(1, 4))):
        name = str(rng.choice(list(table)))
        cells, header = table[name], str(rng.choice(HEADERS))
        rows = len(cells)
        first = int(rng.integers(0, rows))
        part = slice(first, first + int(rng.integers(1, rows)))
        action = int(rng.integers(8))
        if action == 0:
            cells[part if rng.integers(2) else slice(first, first + 1)] = [str(rng.choice(CELLS))]
            cells += ["0"] * (rows - len(cells))
        elif action == 1:
            factor = float(rng.choice([57.3, 1e3, -1.0, 0.0, 1e-3, 1e7]))
            table[name] = [f"{factor * _number(cell):.9g}" for cell in cells]
        elif action == 2 and part.stop - part.start < rows - 2:
            for each in table.values():
                del each[part]
        elif action == 3:
            table = {header if k == name else k: v for k, v in table.items()}
        elif action == 4:
            order = rng.permutation(rows) if rng.integers(2) else np.arange(rows)[::-1]
            table[name] = [cells[i] for i in order]
        elif action == 5:
            table[name] = [cells[i // 7 * 7] for i in range(rows)]
        elif action == 6 and len(table) > 1:
            del table[name]
        elif action == 7:
            table.setdefault(header, [str(i % 2) for i in range(rows)])
    return table


def as_csv(table: dict[str, list[str]]) -> bytes:
    rows = zip(*table.values(), strict=True)
    lines = [",".join(table), *(",".join(f'"{c}"' if "," in c else c for c in r) for r in rows)]
    return ("\n".join(lines) + "\n").encode()


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")


def check(path: Path, expected: Expected, mapping: Path | None) -> bool:
    """Read, judge and prepare. Returns whether the input was accepted."""
    try:
        rules = load_mapping(mapping) if mapping is not None else None
        loaded = prepare_logs([read_log(path, expected, rules)], expected)
        if path.suffix == ".parquet":
            for _, chunk in stream_prepared(path, expected, rules, rows=150):
                assert np.isfinite(chunk.a).all()
    except (GapError, ActuatorError) as error:
        message = str(error)
        assert message
        assert "\n" not in message
        assert len(message) < 700, message
        return False
    (ready,) = loaded.prepared
    assert np.isfinite(ready.q).all()
    assert np.isfinite(ready.a).all()
    assert np.isfinite(ready.effort[ready.mask]).all()
    assert (np.diff(ready.time) > 0).all()
    return True


def fuzz(expected: Expected, folder: Path, count: int, seed: int, kind: str) -> int:
    """How many of so many changed inputs of one kind are accepted."""
    rng = np.random.default_rng(seed)
    good, whole = folder / "good.csv", folder / "good.parquet"
    good.write_bytes(valid_csv())
    pq.write_table(pa.table(valid_columns()), whole)
    bad, accepted = folder / f"bad.{kind}", 0
    for _ in range(count):
        if kind == "toml":
            bad.write_bytes(mutated(MAPPING, rng, TOML_TOKENS))
            accepted += check(good, expected, bad)
            continue
        table = respelt(valid_columns(), rng)
        if rng.integers(3) == 0:
            bad.write_bytes(mutated((good if kind == "csv" else whole).read_bytes(), rng, TOKENS))
        elif kind == "csv":
            bad.write_bytes(as_csv(table))
        else:
            pq.write_table(pa.table({k: [*map(_number, v)] for k, v in table.items()}), bad)
        accepted += check(bad, expected, None)
    return accepted


def test_the_unmutated_inputs_are_accepted(two_joints: Expected, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_bytes(valid_csv())
    (tmp_path / "m.toml").write_bytes(MAPPING)
    assert check(tmp_path / "log.csv", two_joints, None)
    assert check(tmp_path / "log.csv", two_joints, tmp_path / "m.toml")


@pytest.mark.parametrize(
    "count", [40, pytest.param(10_000, marks=pytest.mark.slow)], ids=["few", "many"]
)
@pytest.mark.parametrize("kind", ["csv", "parquet", "toml"])
def test_changed_inputs(two_joints: Expected, tmp_path: Path, kind: str, count: int) -> None:
    accepted = fuzz(two_joints, tmp_path, count, 1, kind)
    assert accepted < 0.85 * count  # most mutations must matter, else nothing was tested
