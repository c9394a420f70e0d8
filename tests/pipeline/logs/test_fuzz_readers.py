"""Whatever the bytes: a clear line or a usable log, never a traceback."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from actuators.errors import LegwattError
from pipeline.logs.load import Asked, load
from pipeline.logs.log_format import Expected
from pipeline.logs.mapping import load_mapping

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
torque_off_bridge = "open"
[constants]
load = {value = 3, unit = "kg"}
supply__voltage_V = {value = 24, unit = "V"}
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
    if rng.integers(20) == 0:
        return rng.bytes(int(rng.integers(0, 2000)))
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(0, len(out) + 1))
        end = min(len(out), at + int(rng.integers(1, 40)))
        token = tokens[int(rng.integers(len(tokens)))]
        new = (b"", token, out[at:end] * 2, rng.bytes(1))[int(rng.integers(4))]
        out[at : end if rng.integers(2) else at] = new
        if rng.integers(50) == 0:
            del out[at:]
    return bytes(out)


def check(path: Path, expected: Expected, mapping: Path | None) -> bool:
    """Read, judge and prepare. Returns whether the input was accepted."""
    try:
        rules = load_mapping(mapping) if mapping is not None else None
        loaded = load([path], 1, Asked(expected, rules))
    except LegwattError as error:
        message = str(error)
        assert message
        assert "\n" not in message
        assert len(message) < 700, message
        return False
    (ready,) = loaded.logs
    assert np.isfinite(ready.q).all()
    assert np.isfinite(ready.a).all()
    assert np.isfinite(ready.effort[ready.mask]).all()
    assert (np.diff(ready.time) > 0).all()
    return True


@pytest.mark.parametrize("kind", ["csv", "parquet", "toml"])
def test_changed_inputs(two_joints: Expected, tmp_path: Path, kind: str) -> None:
    """Of so many changed inputs of one kind some are refused, and none ends in anything else."""
    rng, count = np.random.default_rng(1), 40
    good, bad = tmp_path / "good.csv", tmp_path / f"bad.{kind}"
    good.write_bytes(valid_csv())
    pq.write_table(pa.table(valid_columns()), tmp_path / "good.parquet")
    source = MAPPING if kind == "toml" else (tmp_path / f"good.{kind}").read_bytes()
    tokens, accepted = TOML_TOKENS if kind == "toml" else TOKENS, 0
    for k in range(count + 1):
        bad.write_bytes(mutated(source, rng, tokens) if k else source)
        usable = check(good, two_joints, bad) if kind == "toml" else check(bad, two_joints, None)
        assert usable or k
        accepted += usable
    assert accepted < 0.85 * count  # most mutations must matter, else nothing was tested
