"""The fast machine of the calibration against the general functions, and its own pieces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from actuators.loading.build import load_catalog
from pipeline.paper.calibration.checkpoint import Checkpoint
from pipeline.paper.calibration.machine import (
    SAMPLES,
    actuator_part,
    catalog_with,
    part_of,
    solve_posture,
    standing_state,
)
from pipeline.paper.calibration.quantities import computed, pair_break_even
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.simulation.walk_stand import walk


def test_the_machine_agrees_with_a_whole_walk(hexapod: Robot) -> None:
    """At the same sampling the middle legs' energies are those of `walk`; at 81 within 0.2 %."""
    catalog = load_catalog()
    walking = walk(hexapod, catalog.chains(), samples=751)
    for samples, tolerance in ((751, 1e-9), (SAMPLES, 2e-3)):
        part = actuator_part(part_of(hexapod.spec, samples), catalog)
        for name, supply in walking.supplies.items():
            energy = dict(zip(supply.accounts, supply.supplied_energy, strict=True))
            leg = sum(energy[f"rm_joint_{k}"] for k in (1, 2, 3))
            assert part.energy[name]["rm"] == pytest.approx(leg, rel=tolerance)


def test_posture_is_solved_from_elsewhere(root: Path) -> None:
    spec = load_robot_file(root / "urdf" / "hexapod.toml").with_parameters(
        {"femur_mass": 1.0, "trunk_com_left": 0.0, "joint_2_lateral": 0.1, "body_height": 0.29}
    )
    target = np.array([192.6, -30.71, 1.46])
    _, reaction, torque = standing_state(solve_posture(spec, target))
    np.testing.assert_allclose([reaction, torque[1], torque[2]], target, atol=1e-6)
    assert torque[0] == pytest.approx(0, abs=1e-9)


def test_split_ratios_keep_their_product() -> None:
    catalog = catalog_with(
        load_catalog(), {"harmonic_drive.ratio": 120.0, "planetary.ratio": 10.0}, 400.0
    )
    for chain in catalog.chains().values():
        assert float(np.asarray(chain.ratio)) == pytest.approx(400)


def test_break_even_solves_its_own_equation() -> None:
    energy = {"reversible": {"lm": 50.0, "rm": 50.0}, "irreversible": {"lm": 70.0, "rm": 71.0}}
    power, legs = 0.866, 1
    f = pair_break_even(energy, power, legs)
    walking = [(1 - f) * sum(energy[name].values()) for name in ("reversible", "irreversible")]
    assert walking[0] + f * legs * power * 3 == pytest.approx(walking[1])
    assert np.isnan(
        pair_break_even({"reversible": {"rm": 2.0}, "irreversible": {"rm": 1.0}}, power, 1)
    )


def test_every_id_is_a_number(hexapod: Robot) -> None:
    part = part_of(hexapod.spec)
    values = computed(part, actuator_part(part, load_catalog()), 1)
    assert all(isinstance(v, float) for v in values.values())


def test_checkpoint_survives_a_kill(tmp_path: Path) -> None:
    path = tmp_path / "work" / "tasks.jsonl"
    store = Checkpoint(path, "inputs-1")
    store.add("a", {"x": 1})
    store.add("b", [1.5])
    with path.open("a", encoding="utf-8") as file:
        file.write('{"task": "c", "resu')  # cut short
    again = Checkpoint(path, "inputs-1")
    assert again.done == {"a": {"x": 1}, "b": [1.5]}
    again.add("c", 3)
    assert Checkpoint(path, "inputs-1").done["c"] == 3
    assert Checkpoint(path, "other inputs").done == {}
