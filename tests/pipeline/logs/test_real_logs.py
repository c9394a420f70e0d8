"""The measured logs of real machines, read and judged with mapping files only."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.identification.compare.loaded import LoadedLogs, prepare_logs
from pipeline.logs.log_format import Expected, expected_of_model
from pipeline.logs.prepared.measurement import TEST
from pipeline.logs.prepared.parts import split
from pipeline.logs.reading.mapping import Mapping, load_mapping
from pipeline.logs.reading.read import read_log
from pipeline.robot.robot import parse_urdf

FILES = Path(__file__).parents[1] / "data_files"


def expected(urdf: Path) -> Expected:
    return expected_of_model(
        parse_urdf(urdf.read_text(encoding="utf-8"), urdf.name, floating=False), urdf.stem
    )


def load_logs(
    paths: list[Path],
    robot: Expected,
    mapping: Mapping | None = None,
    cutoff: float | None = None,
) -> LoadedLogs:
    return prepare_logs([read_log(p, robot, mapping) for p in paths], robot, cutoff=cutoff)


def test_tx40_is_accepted_as_it_is(shared_data: Path) -> None:
    folder = shared_data / "tx40"
    loaded = load_logs([folder / "tx40_log.csv"], expected(folder / "tx40.urdf"), cutoff=100.0)
    (ready,) = loaded.prepared
    assert ready.channel == "torque"
    assert ready.rate == pytest.approx(2500.0)
    assert {f.verdict for f in loaded.findings} == {"ok"}
    still = [f.value for f in loaded.findings if f.check == "standstill_share"]
    assert np.all(np.array(still) > 0.2)  # at rest at both ends
    parts = split(loaded.prepared, prove_last=0.4)
    assert np.flatnonzero(parts.part[0] == TEST)[[0, -1]].tolist() == [13_500, 22_499]
    # The motion stays within the velocities the maker states.
    limit = expected(folder / "tx40.urdf").velocity_limit
    assert (np.abs(ready.v).max(axis=0) <= 1.03 * limit).all()


def test_xl330_with_its_mapping(shared_data: Path) -> None:
    logs = sorted((shared_data / "xl330").glob("*.csv"))
    mapping = load_mapping(FILES / "xl330.toml")
    loaded = load_logs(logs, expected(FILES / "xl330.urdf"), mapping)
    assert {p.channel for p in loaded.prepared} == {"voltage"}
    assert {p.log.condition["gain"] for p in loaded.prepared} == {100.0, 200.0, 800.0}
    for ready in loaded.prepared:
        log = ready.log
        # The stated gain is that of the voltage column.
        assert log.gain is not None
        assert log.supply is not None
        assert log.goal_position is not None
        assert log.voltage is not None
        duty = np.clip(log.gain * (log.goal_position - log.position), -1.0, 1.0)
        assert np.nanmax(np.abs(log.supply[:, None] * duty - log.voltage)) < 2e-3
        if "lift_and_drop" in log.name:
            assert log.torque_off is not None
            assert log.torque_off_bridge == "open"
            assert np.array_equal(np.isnan(log.voltage), log.torque_off)
            assert not ready.mask[log.torque_off].any()
            assert ready.motion_ok[60:-60].all()
    assert "gain = 200" in split(loaded.prepared).rule


def test_xl330_velocity_is_found_late_and_position_quantised(shared_data: Path) -> None:
    logs = [shared_data / "xl330" / "xl330_kp200_sin_sin.csv"]
    mapping = load_mapping(FILES / "xl330.toml")
    loaded = load_logs(logs, expected(FILES / "xl330.urdf"), mapping)
    found = {(f.column, f.check): f.value for f in loaded.findings}
    assert found["pendulum_joint__velocity_rad_s", "skew"] == pytest.approx(0.020, abs=0.002)
    quantum = found["pendulum_joint__position_rad", "quantum"]
    assert quantum == pytest.approx(2 * np.pi / 4096, rel=0.01)
