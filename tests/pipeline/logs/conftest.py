"""Limits of a machine of two joints, and a good log of it as columns."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.logs.log import Expected, Recording
from pipeline.logs.mapping import load_mapping
from pipeline.logs.read import read_log
from tests.pipeline.logs.made import motion

Array = NDArray[np.float64]


@pytest.fixture
def two_joints() -> Expected:
    """Joints `a` and `b` with limits of 2 rad, 20 rad/s and 50 N*m; ratio 100; one foot."""
    return Expected(
        robot="two",
        joints=("a", "b"),
        lower=np.array([-2.0, -2.0]),
        upper=np.array([2.0, 2.0]),
        effort_limit=np.array([50.0, 50.0]),
        feet=("lf",),
        foot_alias={"lf_foot_link": "lf"},
        ratio=np.array([100.0, -100.0]),
    )


@pytest.fixture
def columns() -> dict[str, Array]:
    """Columns of a good log in the log format."""
    t, q, v, a = motion()
    rng = np.random.default_rng(7)
    torque = 3.0 * a + 5.0 * np.sin(q) + rng.normal(0.0, 0.05, q.shape)
    out = {"time_s": t}
    for j, joint in enumerate("ab"):
        out[f"{joint}__position_rad"] = q[:, j] + rng.normal(0.0, 1e-5, t.size)
        out[f"{joint}__velocity_rad_s"] = v[:, j]
        out[f"{joint}__torque_Nm"] = torque[:, j]
    return out


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Write columns as CSV; cells as given where they are text."""

    def _write(columns: dict[str, Array], name: str = "log.csv") -> Path:
        path = tmp_path / name
        rows = zip(*columns.values(), strict=True)
        body = "\n".join(",".join(_cell(x) for x in row) for row in rows)
        path.write_text(",".join(columns) + "\n" + body + "\n", encoding="utf-8")
        return path

    return _write


@pytest.fixture
def read(
    two_joints: Expected, write: Callable[..., Path], tmp_path: Path
) -> Callable[..., Recording]:
    """Read columns as a CSV file, with the text of a mapping file."""

    def _read(
        columns: dict[str, Array], text: str = "", *, expected: Expected = two_joints
    ) -> Recording:
        (tmp_path / "mapping.toml").write_text(text, encoding="utf-8")
        return read_log(write(columns), expected, load_mapping(tmp_path / "mapping.toml"))

    return _read


def _cell(x: object) -> str:
    if isinstance(x, float | np.floating):
        return "" if np.isnan(x) else repr(float(x))
    return str(x)
