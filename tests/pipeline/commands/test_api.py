"""The Python API says what the command line writes; sweeps lose and repeat nothing."""

import doctest
import os
import signal
from pathlib import Path
from threading import Timer
from typing import Any

import numpy as np
import pandas as pd
import pytest
from distributed import Client, LocalCluster

import pipeline as lw
from actuators.errors import LegwattError
from pipeline import sweeps
from pipeline.commands.main import main
from tests.command_line import DEMO, exit_code
from tests.reports.test_page import checked

ROOT = Path(__file__).parents[3]
KEY = "harmonic_drive.viscous"


@pytest.fixture(scope="module")
def machine() -> lw.Machine:
    return lw.load(ROOT / "urdf" / "hexapod.toml")


@pytest.fixture(scope="module")
def demand(machine: lw.Machine) -> lw.Demand:
    return lw.demand(machine, samples=51)


def total(machine: lw.Machine, demand: lw.Demand) -> float:
    return float(lw.energy(machine, demand, "reversible")["reversible"].sum())


def test_saved_files_are_those_of_the_command_line(machine, tmp_path):
    """With a robot file that walks another's gait otherwise, and a changed number of the gait."""
    file, base = tmp_path / "wave.toml", Path("urdf/hexapod.toml").resolve()
    text = f'extends = "{base}"\n[gait]\nname = "wave"\npayload_mass = "2 kg"\n'
    file.write_text(text, encoding="utf-8")
    changed = lw.load(file, changes={"gait.slope_forward": "4 deg"})
    walk = lw.walk(changed, samples=51)
    assert walk.table("walking_base")["base__z_m"].is_monotonic_increasing
    walk.save(tmp_path / "api")
    words = ["--robot", str(file), "--set", "gait.slope_forward=4 deg"]
    assert exit_code(["walk", *words, "--samples", "51", "--out", str(tmp_path / "cli")]) == 0
    files = {path.name: path.read_bytes() for path in (tmp_path / "cli").iterdir()}
    assert {path.name: path.read_bytes() for path in (tmp_path / "api").iterdir()} == files


def test_values_add_up_and_are_those_that_load_takes(machine):
    values = {"gait.slope_forward": "1 deg", KEY: 1.0, "hip_spacing": 300}
    changed = machine
    for name, value in values.items():
        changed = changed.with_values({name: value})
    loaded = lw.load(machine.path, changes=values)
    assert changed.changes == loaded.changes == values
    assert machine.changes == {}
    one, other = (lw.demand(m, samples=51).series for m in (changed, loaded))
    np.testing.assert_array_equal(one.torque, other.torque)
    assert changed.with_values({KEY: 1.0}).robot is changed.robot
    assert machine.with_values({"gait.lift": "60 mm"}).robot.model is machine.robot.model


def test_an_effect_is_that_of_a_model_file(machine, demand, tmp_path):
    friction = "coulomb_friction", "rm_joint_1", {"torque": 2.0}
    stiff = machine.with_effect(*friction, alternative="reversible")
    more = total(stiff, demand) - total(machine, demand)
    assert more > 0.1
    energy = lw.walk(machine, samples=51).energy.set_index(["alternative", "leg"])
    joules = energy.loc[("reversible", "robot"), "electrical_J"]
    assert total(machine, demand) == pytest.approx(joules, rel=1e-12)
    both = stiff.with_effect("coulomb_friction", ["lm_joint_1"], {"torque": 2.0})
    assert total(both, demand) == pytest.approx(total(machine, demand) + 2 * more, rel=1e-6)
    read = lw.load(model=both.save(tmp_path / "model.toml"))
    assert [e.values for e in read.model_file.edits] == [{"torque": 2.0}] * 2
    assert not read.model_file.changed
    assert total(read, demand) == total(both, demand)


def test_errors_are_one_line_in_python_s_words(machine, tmp_path):
    """No option of the command line is named."""
    leg = lw.load(ROOT / "urdf" / "leg.toml")
    trials = [
        lambda: lw.load(tmp_path / "no.toml"),
        lambda: lw.load("solo21"),
        lambda: machine.with_values({"hip_spacin": 1}),
        lambda: lw.walk(machine, "reversibel"),
        lambda: lw.walk(machine, samples=3),
        lambda: lw.walk(machine, "reversible", regeneration="buss"),
        lambda: lw.read_log(tmp_path / "no.csv", machine),
        lambda: lw.gap(DEMO, machine, step="shrink"),
        lambda: lw.gap(DEMO, machine, step="shirnk"),
        lambda: lw.choose(machine, mission=tmp_path / "no.csv"),
        lambda: lw.choose(machine, draws=1),
        lambda: lw.sweep(machine, ["speed=x"], tmp_path / "sweep"),
        lambda: lw.init_actuator("own", tmp_path / "own", source="a sheet"),
        lambda: machine.with_effect("coulomb_frictoin", "rm_joint_1", {}),
        lambda: machine.save(tmp_path / "model.toml"),
        lambda: lw.stand(leg),
        lambda: lw.energy(leg, lw.demand(machine)),
    ]
    said = []
    for call in trials:
        with pytest.raises(LegwattError) as error:
            call()
        said.append(str(error.value))
    assert not [line for line in said if "\n" in line or "--" in line]


@pytest.mark.parametrize("last", ["lw.read_log", pytest.param("", marks=pytest.mark.slow)])
def test_the_example_of_the_package_is_true(monkeypatch, last):
    """What walks by the fast tests, logs and choice by the long ones."""
    monkeypatch.chdir(ROOT)
    (example,) = doctest.DocTestFinder(recurse=False).find(lw)
    texts = [one.source for one in example.examples]
    end = next((k for k, text in enumerate(texts) if last and last in text), len(texts))
    example.examples = example.examples[:end]
    assert end >= 5
    assert doctest.DocTestRunner().run(example).failed == 0


def ten_lines(*shown: object) -> None:
    for one in shown:
        lines = str(one).splitlines()
        assert 1 <= len(lines) <= 10, f"{type(one)}: {len(lines)} lines"
        assert max(map(len, lines)) < 300, type(one)


def test_what_is_printed_is_ten_readable_lines(machine, short_demo, tmp_path):
    ten_lines(machine, lw.stand(machine), lw.walk(machine, "rotor", samples=51))
    ten_lines(lw.demand(machine, samples=51), lw.check(machine.path), lw.components())
    ten_lines(lw.init("solo12", tmp_path / "solo12.toml"), lw.read_log(short_demo, machine))
    ten_lines(run(tmp_path / "sweep", ["speed=0.08,0.1 m/s"]))


VARY = ("speed=0.1:0.3:2 m/s", "payload_mass=0,5,600 kg", "body_pitch=0,80 deg")


def run(folder: Path, vary: Any = VARY, **more: Any) -> sweeps.Swept:
    return lw.sweep(lw.load(), vary, folder, samples=51, **more)


@pytest.fixture(scope="module")
def frame(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """A finished sweep of twelve cases, in one process."""
    return run(tmp_path_factory.mktemp("sweep")).rows


def test_a_row_is_what_walk_says_of_the_same_machine(frame):
    case = frame[
        (frame.speed_m_s == 0.3) & (frame.payload_mass_kg == 5) & (frame.body_pitch_deg == 0)
    ]
    machine = lw.load().with_values({"gait.speed": "0.3 m/s", "gait.payload_mass": "5 kg"})
    walk = lw.walk(machine, samples=51)
    energy = walk.table("robot_energy")
    for name in energy.columns.intersection(case.columns):
        assert case[name].tolist() == energy[name].tolist()
    torque = np.concatenate([part.torque for part in walk.result.demand.segments])
    assert case.peak_torque_Nm.iloc[0] == np.abs(torque).max()
    limits = walk.table("motor_limits")
    for row in case.itertuples():
        own = limits[limits.alternative == row.alternative]
        assert row.peak_voltage_V == own[own.quantity == "voltage"].peak.max()
        assert bool(row.beyond) == bool((own.peak > own.limit).any())


def test_every_case_is_there_once_and_a_refused_one_says_why(frame):
    assert sorted(set(frame.case)) == list(range(12))
    refused, done = frame[frame.refusal != ""], frame[frame.refusal == ""]
    assert len(refused) == refused.case.nunique() > 0
    assert refused.average_power_W.isna().all()
    assert not refused.refusal.str.contains("/").any()  # the same wherever files lie
    assert done.groupby("case").alternative.nunique().eq(4).all()


def test_the_command_writes_table_figure_and_record_alone(tmp_path):
    command = ["sweep", "--vary", "speed=0.1,0.3 m/s", "--samples", "51", "--out", str(tmp_path)]
    assert main([*command, "--workers", "1"]) == 0
    assert {p.name for p in tmp_path.iterdir()} == {"sweep.csv", "sweep.svg", "datapackage.json"}
    table = pd.read_csv(tmp_path / "sweep.csv")
    assert table.groupby("speed_m_s").alternative.nunique().eq(4).all()


@pytest.mark.slow
def test_a_cluster_gives_the_same_rows_though_a_worker_is_killed(tmp_path):
    vary, alone = ["speed=0.02:0.12:20 m/s"], {"threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(n_workers=2, **alone) as cluster, Client(cluster) as client:
        first = min(client.run(os.getpid).values())
        Timer(4.0, os.kill, (first, signal.SIGKILL)).start()
        spread_out = run(tmp_path / "spread", vary, workers=cluster.scheduler_address)
        assert first not in client.run(os.getpid).values()
    assert spread_out.rows.equals(run(tmp_path / "alone", vary).rows)


FEW = ["--only", "maxon_634043", "--only", "maxon_496661", "--only", "hd_csg_20"]
QUICK = ["--draws", "16", "--unlisted", "--margin-torque", "1", "--margin-speed", "1"]


def chosen(folder: Path, day: str, *options: str) -> Path:
    """Runs the verb on a day's table; the folder of its answer."""
    (folder / "day.csv").write_text(day)
    words = ["--mission", str(folder / "day.csv"), "--out", str(folder / "out")]
    assert main(["choose", *words, *FEW, *QUICK, *options]) == 0
    return folder / "out"


def test_answer_of_few_parts_balances_and_names_them(tmp_path, capsys):
    day = "mode,share,gait\nwalk,0.4,\nstand,0.6,stand\n"
    out = chosen(tmp_path, day, "--without", "brake", "--margin-speed", "1.05")
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("hexapod, knee: ")
    answer = pd.read_csv(out / "answer.csv").set_index("group")
    groups = answer.drop("robot")
    assert groups.power_W.sum() == pytest.approx(answer.power_W["robot"])
    answers = pd.read_csv(out / "answers.csv").set_index("answer")
    assert answers.recommended["knee"]
    assert answers.power_W["least power"] <= answers.power_W["knee"] <= answers.power_W["lightest"]
    assert answers.power_W["knee"] == pytest.approx(answer.power_W["robot"])
    limits = lw.walk(lw.load("urdf/hexapod.toml"), "irreversible").table("motor_limits")
    volts = limits[(limits.alternative == "irreversible") & (limits.quantity == "voltage")]
    used = 1.05 * (volts.peak / volts.limit).max()
    assert not volts.breach.any()
    assert answers.limit_use["today: irreversible"] == pytest.approx(used, rel=0.01)
    assert (pd.read_csv(out / "limits.csv").use <= 1.0).all()
    assert groups.motor.isin(["maxon_634043", "maxon_496661"]).all()
    low, high = answer.loc["robot", ["power_low_W", "power_high_W"]]
    assert low < answer.power_W["robot"] < high
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "In 4 of 7 rows the band" in page
    use = pd.read_csv(out / "limits.csv")
    assert page.count("<meter") == len(use[["group", "limit", "kind"]].drop_duplicates())
    drawn = {"front.svg", "motor_planes.svg"}
    assert drawn <= {*checked(out).targets}


def test_the_share_of_standing_from_which_on_locking_pays(tmp_path, capsys):
    text = "mode,share,gait,hold,drivers\nwalk,0.1,,,\nwait,0.9,stand,brake,off\n"
    out = chosen(tmp_path, text, "--regeneration", "0.5", "--idle", "4 W")
    share = pd.read_csv(out / "standing_share.csv").set_index(["family", "share"]).power_W
    assert share["none locks", 0.0] < share["all lock", 0.0]
    assert share["none locks", 1.0] > share["all lock", 1.0]
    assert "joints that lock take less from" in capsys.readouterr().out
    modes = pd.read_csv(out / "day.csv").set_index(["mode", "group"])
    walk = modes.loc["walk"]
    assert walk.idle_W["robot"] == pytest.approx(18 * 4.0)
    assert walk.power_W["robot"] == pytest.approx(walk.drop("robot").power_W.sum())
