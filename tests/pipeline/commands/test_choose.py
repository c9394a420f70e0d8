"""The verb `choose` on few parts: the hexapod, a motion of one's own, and what cannot be used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.commands.main import main
from pipeline.commands.robots import load
from tests.reports.read_page import checked

FEW = ["--only", "maxon_634043", "--only", "maxon_496661", "--only", "maxon_gp_62_a"]
QUICK = ["--no-brakes", "--draws", "16", "--unlisted", "--margin-torque", "1"]
QUICK += ["--margin-speed", "1"]


def written(folder: Path, text: str) -> str:
    path = folder / "day.csv"
    path.write_text(text)
    return str(path)


def test_answer_of_few_parts_balances_and_names_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    day = written(tmp_path, "mode,share,gait\nwalk,0.4,\nstand,0.6,stand\n")
    out = tmp_path / "out"
    assert main(["choose", "--mission", day, "--out", str(out), *FEW, *QUICK]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("hexapod: ")
    answer = pd.read_csv(out / "answer.csv").set_index("group")
    groups = answer.drop("robot")
    assert groups.power_W.sum() == pytest.approx(answer.power_W["robot"])
    assert groups.motor.isin(["maxon_634043", "maxon_496661"]).all()
    assert (groups.power_low_W < groups.power_W).all()
    assert (groups.power_W < groups.power_high_W).all()
    modes = pd.read_csv(out / "day.csv")
    own = modes[modes.group != "robot"]
    assert (own.winding_degC >= 25.0).all()
    assert (own.winding_degC <= own.winding_peak_degC + 1e-9).all()
    assert (own.winding_peak_degC <= own.winding_limit_degC).all()
    assert (own.warming_W <= 0.5 * own.winding_W).all()
    assert {"front_map.svg", "day_energy.svg"} <= {*checked(out).targets}


def test_what_locks_is_held_against_what_does_not_on_a_shared_bus(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    day = written(tmp_path, "mode,share,gait,drivers\nwalk,0.1,,\nwait,0.9,stand,off\n")
    out = tmp_path / "out"
    options = ["--only", "hpc_m1", "--regeneration", "bus", "--idle", "4 W", "--voltage", "24 V"]
    assert main(["choose", "--mission", day, "--out", str(out), *FEW, *QUICK, *options]) == 0
    both = pd.read_csv(out / "reversible_or_not.csv").set_index("candidate")
    even = both.break_even["reversible"]
    power = (1.0 - even) * both.moving_W + even * both.standing_W
    assert power["reversible"] == pytest.approx(power["irreversible"])
    assert both.standing_W["irreversible"] < both.standing_W["reversible"]
    assert f"the one that locks takes less above {100 * even:.3g} %" in capsys.readouterr().out
    modes = pd.read_csv(out / "day.csv").set_index(["mode", "group"])
    walk = modes.loc["walk"]
    own = walk.drop("robot").power_W.sum()  # as if the bus used all that each group returns
    assert walk.power_W["robot"] == pytest.approx(own + walk.returned_W["robot"])


def test_own_motion_is_a_mode(tmp_path: Path) -> None:
    """A leg on a stand that swings; its power is the sum of its groups."""
    robot = load("urdf/leg.toml").robot.spec
    time = np.linspace(0.0, 4.0, 201)
    swing = 0.1 * (1.0 - np.cos(0.5 * np.pi * time))
    columns = {f"{joint}__position_rad": swing for joint in robot.joints}
    pd.DataFrame({"time_s": time} | columns).to_csv(tmp_path / "move.csv", index=False)
    day = written(tmp_path, "mode,share,motion\nmove,1,move.csv\n")
    out = tmp_path / "out"
    given = ["--robot", "urdf/leg.toml", "--mission", day, "--out", str(out)]
    assert main(["choose", *given, *FEW, *QUICK]) == 0
    modes = pd.read_csv(out / "day.csv").set_index("group")
    assert (modes.power_W > 0.0).all()
    assert modes.drop("robot").power_W.sum() == pytest.approx(modes.power_W["robot"])
    assert modes.hours.eq(24.0).all()
