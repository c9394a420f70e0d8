"""From a foreign log to an answer in two commands: `gap mapping`, then `gap`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from pipeline.commands.main import main
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file

Columns = dict[str, np.ndarray]
LEG = "urdf/leg.toml"
JOINTS = [f"rm_joint_{k}" for k in (1, 2, 3)]


def hanging() -> Columns:
    """A leg that swings, with currents that say no more than that somebody measured them."""
    t = np.arange(1500) / 250.0
    columns = {"time_s": t}
    for k, joint in enumerate(JOINTS, start=1):
        columns[f"{joint}__position_rad"] = 0.3 * np.sin(2 * np.pi * (0.3 + 0.11 * k) * t)
        columns[f"{joint}__current_A"] = 0.4 * np.cos(2 * np.pi * (0.3 + 0.11 * k) * t + k)
    return columns


def block(columns: Columns, end: str) -> np.ndarray:
    return np.stack([columns[f"{joint}__{end}"] for joint in JOINTS], axis=1)


def as_csv(columns: Columns, folder: Path) -> Path:
    q, i = np.degrees(block(columns, "position_rad")), 1e3 * block(columns, "current_A")
    frame = pd.DataFrame({"zeit_ms": 1e3 * columns["time_s"]})
    for k in range(3):
        frame[f"Winkel {k + 1} angle"] = q[:, k]
        frame[f"Motor {k + 1} current"] = i[:, k]
    frame.to_csv(folder / "log.csv", sep=";", decimal=",", index=False)
    return folder / "log.csv"


def second_command(log: Path, mapping: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """What `gap mapping` says to run next."""
    assert main(["gap", "mapping", str(log), "--robot", LEG, "--out", str(mapping)]) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert said.startswith("next: python -m pipeline gap ")
    return said.removeprefix("next: python -m pipeline ").split()


def test_two_commands_judge_a_foreign_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mapping = tmp_path / "mapping.toml"
    gap, *second = second_command(as_csv(hanging(), tmp_path), mapping, capsys)
    assert main([gap, "read", *second, "--out", str(tmp_path / "out")]) == 0
    assert "checks passed" in capsys.readouterr().out
    assert main(["gap", "mapping", second[0], "--robot", LEG, "--out", str(mapping)]) == 2
    assert "is there already" in capsys.readouterr().err


@pytest.mark.slow
def test_two_commands_name_what_a_model_lacks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = load_robot(load_robot_file(Path(LEG))).model
    data, t = model.createData(), np.arange(6000) / 250.0
    w, phase = np.array([1.9, 2.7, 3.6]), np.array([0.1, 1.2, 2.5])
    mid = 0.5 * (model.lowerPositionLimit + model.upperPositionLimit)
    q = mid + 0.3 * np.sin(np.outer(t, w) + phase) + 0.1 * np.sin(np.outer(t, 2.3 * w))
    v, a = (np.gradient(x, t, axis=0) for x in (q, np.gradient(q, t, axis=0)))
    tau = np.array([pin.rnea(model, data, *row) for row in zip(q, v, a, strict=True)]) + 0.5 * v
    rng = np.random.default_rng(4)
    tau += rng.normal(0.0, 0.05, tau.shape)
    q = q + rng.normal(0.0, 1e-5, q.shape)
    np.savez(tmp_path / "log.npz", t=t, q=q, tau=tau)
    second = second_command(tmp_path / "log.npz", tmp_path / "mapping.toml", capsys)
    assert main([*second, "--out", str(tmp_path / "out")]) in (0, 1)
    assert "viscous" in (tmp_path / "out" / "found.csv").read_text(encoding="utf-8")
