"""Bags of ROS, read as the table that a CSV of the same numbers is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.logs.formats.convert import plain
from pipeline.logs.reading.expected import Expected
from pipeline.logs.reading.read import read_log
from tests.pipeline.logs.formats.bags import Sent, write_bag

Array = NDArray[np.float64]
START = 1_700_000_000 * 10**9


def sent(columns: dict[str, Array], rows: int = 400, topic: str = "/joint_states") -> list[Sent]:
    """Messages with the columns' numbers, recorded 0.3 ms after their stamps."""
    at = START + np.round(columns["time_s"][:rows] * 1e9).astype(int)
    keys = {"position": "position_rad", "velocity": "velocity_rad_s", "effort": "torque_Nm"}
    return [
        (
            topic,
            int(stamp),
            int(stamp) + 300_000,
            ("a", "b"),
            {q: [columns[f"{j}__{key}"][k] for j in "ab"] for q, key in keys.items()},
        )
        for k, stamp in enumerate(at)
    ]


@pytest.mark.parametrize(
    ("kind", "compressed"),
    [("mcap", ""), ("mcap", "storage"), ("db3", "message"), ("bag", "lz4"), ("bag", "")],
)
def test_every_kind_of_bag_gives_the_numbers_that_were_sent(
    kind: str, compressed: str, columns: dict[str, Array], two_joints: Expected, tmp_path: Path
) -> None:
    path = tmp_path / ("walk.bag" if kind == "bag" else "walk")
    write_bag(path, sent(columns), kind=kind, compressed=compressed)
    log = read_log(path, two_joints)
    assert np.allclose(log.time, columns["time_s"][:400], atol=1e-9)
    assert log.velocity is not None
    assert log.torque is not None
    for j, joint in enumerate("ab"):
        assert (log.position[:, j] == columns[f"{joint}__position_rad"][:400]).all()
        assert (log.velocity[:, j] == columns[f"{joint}__velocity_rad_s"][:400]).all()
        assert (log.torque[:, j] == columns[f"{joint}__torque_Nm"][:400]).all()
    assert plain(path) is plain(path)
    assert log.told == ()
