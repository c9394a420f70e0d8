"""Table V contradicts itself; the motor's constants are all that give the rest of the tables."""

import csv

import numpy as np
import pytest

from pipeline.paper.basis import STUDY
from pipeline.paper.motor_constants import KEYS, UNMET, draws, middle
from pipeline.paper.published import Published


def frictions() -> list[tuple[float, float, list[str]]]:
    """The study's: lowest and highest [mN*m], and the entries they leave unmet."""
    with (STUDY / "rotor_friction.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [(float(r["from_mNm"]), float(r["to_mNm"]), r["which"].split()) for r in rows]


def standing(k: float, r: float, friction: float, held: float) -> dict[str, float]:
    """Tables IV to VI by hand: Eq. 1, Ohm's law, P = U I, E = 3 P."""
    ideal = {2: 30.71 / 400, 3: 1.46 / 400}
    motor = {
        "ideal": ideal,
        "rotor": {j: max(g - friction, 0.0) for j, g in ideal.items()},
        "reversible": {2: held, 3: 0.0},
    }
    out: dict[str, float] = {}
    for name, torques in motor.items():
        energy = 0.0
        for joint, torque in torques.items():
            current = torque / k
            out |= {
                f"{name}_motor_torque_{joint}": torque,
                f"{name}_current_{joint}": current,
                f"{name}_voltage_{joint}": r * current,
                f"{name}_power_{joint}": r * current**2,
            }
            energy += 3 * r * current**2
        out[f"{name}_leg_energy_3s"] = energy
    return out


def unmet(published: dict[str, Published], values: dict[str, float]) -> set[str]:
    return {
        name
        for name, value in values.items()
        if abs(value - abs(published[name].value)) > published[name].half_width * (1 + 1e-6) + 1e-12
    }


def test_the_two_motor_torques_of_table_v_exclude_each_other(
    published: dict[str, Published],
) -> None:
    """Each asks for a rotor friction: Table III over the ratio, less what it prints."""
    asked = []
    for joint in (2, 3):
        row, demand = (published[f"{x}_{joint}"] for x in ("rotor_motor_torque", "standing_torque"))
        asked.append(abs(demand.value) / 400 - abs(row.value))
        assert row.half_width + demand.half_width / 400 == pytest.approx(0.0175e-3)
        assert f"{1e3 * asked[-1]:.4g}" in published["rotor_motor_torque_2"].note
    assert asked[1] - asked[0] > 2 * 0.0175e-3


@pytest.mark.parametrize("friction", [3.50, 3.575, 3.62])
def test_no_torque_constant_and_resistance_on_a_fine_grid_do_better(
    published: dict[str, Published], friction: float
) -> None:
    """By brute force, with a calculation of its own."""
    (*_, (_, _, stated)) = (row for row in frictions() if row[0] <= friction + 1e-6)
    k, r = np.meshgrid(np.linspace(30.1, 30.3, 201) * 1e-3, np.linspace(0.314, 0.318, 201))
    count = np.zeros(k.shape)
    values = standing(k, r, friction * 1e-3, 0.04998)  # type: ignore[arg-type]
    for name, value in values.items():
        row = published[name]
        count += np.abs(value - abs(row.value)) > row.half_width * (1 + 1e-9)
    assert count.min() >= len(stated)


def test_every_draw_gives_every_entry_but_the_contradicted(
    published: dict[str, Published],
) -> None:
    """What they make of the contradicted ones are the numbers that ERRATA.md quotes."""
    k, r, friction = (middle(published)[key] for key in KEYS)
    assert unmet(published, standing(k, r, friction, 0.04998)) == set(UNMET)
    rows = [standing(*own) for own in draws(published, np.random.default_rng(7), 1000)]
    assert all(unmet(published, row) == set(UNMET) for row in rows)
    torque = [1e3 * row["rotor_motor_torque_2"] for row in rows]
    energy = [row["rotor_leg_energy_3s"] for row in rows]
    assert 73.15 <= min(torque) <= max(torque) <= 73.16
    assert 5.565 <= min(energy) <= max(energy) <= 5.568
