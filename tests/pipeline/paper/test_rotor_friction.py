"""Table V contradicts itself; the motor's constants are all that give the rest of the tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.paper.calibration.quantities import DIMENSIONS, IDS
from pipeline.paper.constants.motor_constants import KEYS, sliver
from pipeline.paper.constants.rotor_friction import best_frictions, friction_ranges
from pipeline.paper.judgement.contradictions import contradiction
from pipeline.paper.published import Published, load_published


@pytest.fixture(scope="module")
def published() -> dict[str, Published]:
    return load_published(IDS, DIMENSIONS)


def standing(k: float, r: float, friction: float, held: float) -> dict[str, float]:
    """Tables IV to VI by hand: Eq. 1, Ohm's law, P = U I, E = 3 P."""
    ideal = {2: 30.71 / 400, 3: 1.46 / 400}
    motor = {
        "ideal": ideal,
        "rotor": {j: max(g - friction, 0.0) for j, g in ideal.items()},
        "reversible": {2: held, 3: 0.0},
    }
    out = {}
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
    found = contradiction(published, friction_ranges(published))
    assert found.asked == pytest.approx((3.575, 3.62))
    assert found.widths == pytest.approx((0.0175, 0.0175))
    assert found.apart


def test_they_would_not_if_the_paper_printed_one_digit_less(
    published: dict[str, Published],
) -> None:
    coarse = dict(published)
    for joint in (2, 3):
        name = f"rotor_motor_torque_{joint}"
        coarse[name] = replace(published[name], half_width=5e-5)
    found = contradiction(coarse, friction_ranges(coarse))
    assert not found.apart
    assert len(found.best.unmet) < 2


def test_the_friction_chosen_leaves_the_fewest_entries_unmet(
    published: dict[str, Published],
) -> None:
    ranges = friction_ranges(published)
    best = best_frictions(ranges, published)
    assert set(best.unmet) == {"rotor_motor_torque_2", "rotor_leg_energy_3s"}
    assert all(len(r.unmet) >= 2 for r in ranges)
    assert (1e3 * best.low, 1e3 * best.high) == pytest.approx((3.615, 3.625), abs=1e-6)
    # The range that meets the other torque misses more, the voltage of joint 3 among them.
    other = next(r for r in ranges if r.low <= 3.575e-3 <= r.high)
    assert set(other.unmet) == {"rotor_motor_torque_3", "rotor_voltage_3", "rotor_leg_energy_3s"}


@pytest.mark.parametrize("friction", [3.50, 3.56, 3.575, 3.605, 3.62, 3.64])
def test_no_torque_constant_and_resistance_on_a_fine_grid_do_better_than_the_scan_says(
    published: dict[str, Published], friction: float
) -> None:
    """By brute force, with a calculation of its own."""
    ranges = friction_ranges(published)
    said = [r for r in ranges if 1e3 * r.low <= friction + 1e-6][-1]
    k, r = np.meshgrid(np.linspace(30.1, 30.3, 201) * 1e-3, np.linspace(0.314, 0.318, 201))
    count = np.zeros(k.shape)
    for name, row in published.items():
        values = standing(k, r, friction * 1e-3, 0.04998)  # type: ignore[arg-type]
        if name in values:
            count += np.abs(values[name] - abs(row.value)) > row.half_width * (1 + 1e-9)
    assert count.min() >= len(said.unmet)


def test_every_draw_gives_every_entry_but_the_contradicted(
    published: dict[str, Published],
) -> None:
    found = sliver(published)
    sets, held = found.draws(np.random.default_rng(7), 300)
    for (k, r, friction), torque in zip(sets, held, strict=True):
        assert unmet(published, standing(k, r, friction, torque)) == set(found.frictions.unmet)
    middle = [found.middle[key] for key in KEYS]
    assert unmet(published, standing(*middle, 0.04998)) == set(found.frictions.unmet)


def test_what_the_other_entries_make_of_the_contradicted_ones(
    published: dict[str, Published],
) -> None:
    """The numbers that ERRATA.md quotes."""
    sets, held = sliver(published).draws(np.random.default_rng(7), 4000)
    rows = [standing(k, r, f, g) for (k, r, f), g in zip(sets, held, strict=True)]
    torque = [1e3 * row["rotor_motor_torque_2"] for row in rows]
    energy = [row["rotor_leg_energy_3s"] for row in rows]
    assert 73.15 <= min(torque) <= max(torque) <= 73.16
    assert 5.565 <= min(energy) <= max(energy) <= 5.568
