"""A mission with a defect is one clear line."""

from __future__ import annotations

from pathlib import Path

import pytest

import pipeline as lw
from pipeline.choice.answer.tables import tables_of
from pipeline.choice.choose import choose
from pipeline.choice.errors import ChoiceError, MissionError
from pipeline.choice.loads import loads_of
from pipeline.choice.missions.mission import read_mission
from pipeline.choice.wanted import Wanted
from pipeline.errors import StanceError

WRONG = {
    "mode,share\nwalk,0.5\n": "sum to 0.5",
    "mode,share,gate\nwalk,1,\n": "gait",
    "mode\nwalk\n": "one of share and hours",
    "mode,hours\nwalk,25\n": "25 h",
    "mode,share\nwalk,half\n": "no number above 0",
    "mode,share,hold\nwalk,1,brake\n": "hold is of standing",
    "mode,share,drivers\nwalk,1,off\n": "needs its drivers",
    "mode,share,gait,hold\nstand,1,stand,brakes\n": "brake",
    "mode,share\nwalk,0.5\nwalk,0.5\n": "stands twice",
    "mode,share,gait,speed\nstand,1,stand,1 m/s\n": "no speed",
    "mode,share\n": "no modes",
}
CANNOT = {
    "mode,share,gait\nwalk,1,trot\n": "mode 'walk'.*dynamic gait",
    "mode,share,speed\nwalk,1,fast\n": "mode 'walk'.*speed",
    "mode,share,motion\nmove,1,none.csv\n": "mode 'move'.*none.csv",
}


def written(folder: Path, text: str) -> Path:
    path = folder / "day.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize("text", WRONG)
def test_defect_is_named(tmp_path: Path, text: str) -> None:
    with pytest.raises(MissionError, match=WRONG[text]) as caught:
        read_mission(written(tmp_path, text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", CANNOT)
def test_mode_that_cannot_be_done_is_named(tmp_path: Path, text: str) -> None:
    with pytest.raises(MissionError, match=CANNOT[text]):
        loads_of(lw.load("urdf/hexapod.toml"), read_mission(written(tmp_path, text)))


def test_mode_in_which_the_robot_tips_is_named(tmp_path: Path) -> None:
    path = written(tmp_path, "mode,share,slope\nclimb,1,20 deg\n")
    with pytest.raises(StanceError, match="mode 'climb'.*tips"):
        loads_of(lw.load("urdf/hexapod.toml"), read_mission(path))


def test_no_design_within_limits_says_which_limit(tmp_path: Path) -> None:
    modes = read_mission(written(tmp_path, "mode,share\nwalk,1\n"))
    wanted = Wanted(only=("maxon_267121",), brakes=False)
    with pytest.raises(ChoiceError, match=r"none of \d+ designs.*continuous current \d+"):
        choose(lw.load("urdf/hexapod.toml"), modes, wanted)


def test_answer_of_few_parts_is_within_limits_in_full(tmp_path: Path) -> None:
    modes = read_mission(written(tmp_path, "mode,share,gait\nwalk,0.5,\nstand,0.5,stand\n"))
    only = ("maxon_634043", "maxon_496661", "hd_csg_17", "maxon_gp_32_c", "maxon_gp_62_a")
    machine = lw.load("urdf/hexapod.toml")
    chosen = choose(machine, modes, Wanted(only=only, brakes=False, draws=16))
    power, mass, _ = chosen.robots()
    assert (power[1:] >= power[:-1]).all()
    assert (mass[1:] < mass[:-1]).all()
    for group, doubt in chosen.doubts.items():
        assert doubt.chance.sum() == pytest.approx(1.0)
        assert doubt.regret >= 0.0
        assert (doubt.worth() <= doubt.regret + 1e-9).all()
        assert chosen.answer[group][0].startswith(only)
    tables = {table.name: table.frame() for table in tables_of(chosen)}
    day, robot = tables["day"], tables["answer"].iloc[-1]
    parts = day[day.group != "robot"]
    assert parts.energy_Wh.sum() == pytest.approx(robot.energy_Wh_per_day)
    kinds = ["mechanical_W", "winding_W", "friction_W", "brakes_W", "idle_W", "returned_W"]
    kinds += ["driver_W"]
    # Over a cycle no kinetic energy is left.
    assert day[kinds].sum(axis=1).tolist() == pytest.approx(day.power_W.tolist(), rel=0.01)
