"""The Python API says what the command line writes, and asks a machine often without its files."""

import contextlib
import doctest
import io
import runpy
from pathlib import Path

import numpy as np
import pytest

import pipeline as lw
from actuators.errors import LegwattError
from tests.command_line import DEMO, exit_code

ROOT = Path(__file__).parents[3]
KEY = "harmonic_drive.viscous"
#: The one that identifies from logs is run by the long tests.
EXAMPLES = [
    pytest.param(path.stem, marks=pytest.mark.slow if path.stem == "log_with_a_gap" else ())
    for path in sorted((ROOT / "pipeline" / "examples").glob("*.py"))
]


@pytest.fixture(scope="module")
def machine() -> lw.Machine:
    return lw.load(ROOT / "urdf" / "hexapod.toml")


@pytest.fixture(scope="module")
def demand(machine: lw.Machine) -> lw.Demand:
    return lw.demand(machine, samples=51)


def total(machine: lw.Machine, demand: lw.Demand) -> float:
    return float(lw.energy(machine, demand, "reversible")["reversible"].sum())


def test_saved_files_are_those_of_the_command_line(machine: lw.Machine, tmp_path: Path) -> None:
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


def test_an_energy_is_the_one_of_the_walk(machine: lw.Machine, demand: lw.Demand) -> None:
    walk = lw.walk(machine, samples=51)
    frame = walk.energy.set_index(["alternative", "leg"])["electrical_J"]
    for name, joules in lw.energy(machine, demand).items():
        assert joules.shape == (18,)
        assert joules.sum() == pytest.approx(frame[name, "robot"], rel=1e-12)
    shared = lw.energy(machine, demand, "rotor", regeneration="bus")["rotor"]
    assert shared.shape == (1,)
    assert shared.sum() < lw.energy(machine, demand, "rotor")["rotor"].sum()
    assert list(demand.frame().columns) == list(walk.demand.columns)


def test_values_add_up_and_are_those_that_load_takes(machine: lw.Machine) -> None:
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


def test_an_effect_is_that_of_a_model_file(
    machine: lw.Machine, demand: lw.Demand, tmp_path: Path
) -> None:
    friction = "coulomb_friction", "rm_joint_1", {"torque": 2.0}
    stiff = machine.with_effect(*friction, alternative="reversible")
    more = total(stiff, demand) - total(machine, demand)
    assert more > 0.1
    both = stiff.with_effect("coulomb_friction", ["lm_joint_1"], {"torque": 2.0})
    assert total(both, demand) == pytest.approx(total(machine, demand) + 2 * more, rel=1e-6)
    read = lw.load(model=both.save(tmp_path / "model.toml"))
    assert read.model_file is not None
    assert [e.values for e in read.model_file.edits] == [{"torque": 2.0}] * 2
    assert not read.model_file.changed
    assert total(read, demand) == total(both, demand)


def test_errors_are_one_line_in_python_s_words(machine: lw.Machine, tmp_path: Path) -> None:
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


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_run(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    with contextlib.redirect_stdout(io.StringIO()) as said:
        runpy.run_path(str(ROOT / "pipeline" / "examples" / f"{name}.py"))
    assert said.getvalue().count("\n") >= 2


@pytest.mark.parametrize("last", ["lw.read_log", pytest.param("", marks=pytest.mark.slow)])
def test_the_example_of_the_package_is_true(monkeypatch: pytest.MonkeyPatch, last: str) -> None:
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


def test_what_is_printed_is_ten_readable_lines(
    machine: lw.Machine, short_demo: Path, tmp_path: Path
) -> None:
    ten_lines(machine, lw.stand(machine), lw.walk(machine, "rotor", samples=51))
    ten_lines(lw.demand(machine, samples=51), lw.check(machine.path), lw.components())
    ten_lines(lw.init("solo12", tmp_path / "solo12.toml"), lw.read_log(short_demo, machine))
    ten_lines(lw.sweep(machine, ["speed=0.08,0.1 m/s"], tmp_path / "sweep", samples=51))


@pytest.mark.slow
def test_long_answers_are_ten_readable_lines_too(machine: lw.Machine) -> None:
    ten_lines(lw.gap(DEMO, machine), lw.choose(machine))
