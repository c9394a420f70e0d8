"""A loaded machine is changed without reading its files again, and asked often."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pipeline as lw
from actuators.errors import LegwattError

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
    again = changed.with_values({KEY: 1.0})
    assert again.robot is changed.robot
    assert machine.with_values({"gait.lift": "60 mm"}).robot.model is machine.robot.model
    with pytest.raises(LegwattError, match="did you mean 'hip_spacing'"):
        machine.with_values({"hip_spacin": 1})


def test_an_effect_is_that_of_a_model_file(
    machine: lw.Machine, demand: lw.Demand, tmp_path: Path
) -> None:
    stiff = machine.with_effect(
        "coulomb_friction", "rm_joint_1", {"torque": 2.0}, alternative="reversible"
    )
    more = total(stiff, demand) - total(machine, demand)
    assert more > 0.1
    both = stiff.with_effect("coulomb_friction", ["lm_joint_1"], {"torque": 2.0})
    assert total(both, demand) == pytest.approx(total(machine, demand) + 2 * more, rel=1e-6)
    read = lw.load(model=both.save(tmp_path / "model.toml"))
    assert read.model_file is not None
    assert [e.values for e in read.model_file.edits] == [{"torque": 2.0}] * 2
    assert not read.model_file.changed
    assert total(read, demand) == total(both, demand)
