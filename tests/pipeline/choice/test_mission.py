"""A mission with a defect is one clear line."""

import pytest

import pipeline as lw
from actuators.errors import LegwattError
from pipeline.choice.loads import loads_of
from pipeline.choice.mission import read_mission

WRONG = {
    "mode,share\nwalk,0.5\n": "sum to 0.5",
    "mode\nwalk\n": "one of share and hours",
    "mode,hours\nwalk,25\n": "25 h",
    "mode,share\nwalk,half\n": "share.*half",
    "mode,share,hold\nwalk,1,brake\n": "hold is of standing",
    "mode,share,drivers\nwalk,1,off\n": "needs its drivers",
    "mode,share\nwalk,0.5\nwalk,0.5\n": "stands twice",
    "mode,share,gait,speed\nstand,1,stand,1 m/s\n": "no speed",
    "mode,share,gait\nwalk,1,trot\n": "mode 'walk'.*trot",
    "mode,share,motion\nmove,1,none.csv\n": "mode 'move'.*none.csv",
}


@pytest.mark.parametrize("text", WRONG)
def test_defect_is_named(tmp_path, text):
    path = tmp_path / "day.csv"
    path.write_text(text)
    machine = lw.load("urdf/hexapod.toml")
    with pytest.raises(LegwattError, match=WRONG[text]) as caught:
        loads_of(machine, read_mission(path))
    assert "\n" not in str(caught.value)


def test_semicolons_separate_as_commas_do(tmp_path):
    path, text = tmp_path / "day.csv", "# a, b; c\nmode,share,gait\nwalk,0.1,\nstand,0.9,stand\n"
    one, two = (path.write_text(text.replace(",", by)) and read_mission(path) for by in ",;")
    assert one == two
