"""The verb `choose` on few parts: the hexapod, a motion of one's own, and what cannot be used."""

from pathlib import Path

import pandas as pd
import pytest

from pipeline.commands.main import main
from tests.reports.read_page import checked

FEW = ["--only", "maxon_634043", "--only", "maxon_496661", "--only", "hd_csg_20"]
QUICK = ["--draws", "16", "--unlisted", "--margin-torque", "1", "--margin-speed", "1"]


def chosen(folder: Path, day: str, *options: str) -> Path:
    """Runs the verb on a day's table; the folder of its answer."""
    (folder / "day.csv").write_text(day)
    words = ["--mission", str(folder / "day.csv"), "--out", str(folder / "out")]
    assert main(["choose", *words, *FEW, *QUICK, *options]) == 0
    return folder / "out"


def test_answer_of_few_parts_balances_and_names_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    day = "mode,share,gait\nwalk,0.4,\nstand,0.6,stand\n"
    out = chosen(tmp_path, day, "--without", "brake")
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("hexapod, knee: ")
    answer = pd.read_csv(out / "answer.csv").set_index("group")
    groups = answer.drop("robot")
    assert groups.power_W.sum() == pytest.approx(answer.power_W["robot"])
    answers = pd.read_csv(out / "answers.csv").set_index("answer")
    assert answers.recommended["knee"]
    assert answers.power_W["least power"] <= answers.power_W["knee"] <= answers.power_W["lightest"]
    assert answers.power_W["knee"] == pytest.approx(answer.power_W["robot"])
    assert answers.index[-1].startswith("today: ")
    assert (pd.read_csv(out / "limits.csv").use <= 1.0).all()
    assert groups.motor.isin(["maxon_634043", "maxon_496661"]).all()
    low, high = answer.loc["robot", ["power_low_W", "power_high_W"]]
    assert low < answer.power_W["robot"] < high
    drawn = {"front.svg", "motor_planes.svg", "limits_use.svg", "day_energy.svg"}
    assert drawn <= {*checked(out).targets}


def test_the_share_of_standing_from_which_on_locking_pays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "mode,share,gait,hold,drivers\nwalk,0.1,,,\nwait,0.9,stand,brake,off\n"
    out = chosen(tmp_path, text, "--regeneration", "0.5", "--idle", "4 W")
    share = pd.read_csv(out / "standing_share.csv").set_index(["family", "share"]).power_W
    assert share["none locks", 0.0] < share["all lock", 0.0]
    assert share["none locks", 1.0] > share["all lock", 1.0]
    assert "joints that lock take less from" in capsys.readouterr().out
    modes = pd.read_csv(out / "day.csv").set_index(["mode", "group"])
    walk = modes.loc["walk"]
    assert walk.power_W["robot"] == pytest.approx(walk.drop("robot").power_W.sum())
