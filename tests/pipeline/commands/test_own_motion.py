"""A motion of the user's own through the API and the command line, as the gait goes."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from pipeline.motion.walking import walking_motion
from pipeline.robot.robot import Robot
from tests.command_line import Command
from tests.pipeline.simulation.test_own_motion import written


@pytest.fixture(scope="module")
def path(hexapod: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = Path(tmp_path_factory.mktemp("motion")) / "walk.csv"
    written(hexapod, walking_motion(hexapod, samples=201)).to_csv(path, index=False)
    return path


def test_walk_with_a_motion_writes_the_tables_that_make_sense(
    command: Command, tmp_path: Path, path: Path
) -> None:
    gait, own = tmp_path / "gait", tmp_path / "own"
    assert command("walk", gait, "--samples", "201") == 0
    assert command("walk", own, "--motion", str(path)) == 0
    names = [{file.name for file in folder.glob("*.csv")} for folder in (gait, own)]
    assert names[1] == names[0]
    for name in ("robot_energy", "walking_stage_energy", "walking_losses", "walking_base"):
        one, other = (pd.read_csv(folder / f"{name}.csv") for folder in (gait, own))
        numbers = one.select_dtypes("number")
        scale = numbers.abs().max().to_numpy() + 1e-3
        difference = (other[numbers.columns] - numbers).abs().max().to_numpy()
        assert (difference < 1e-4 * scale).all(), name
    assert '"motion": ' in (own / "datapackage.json").read_text(encoding="utf-8")
