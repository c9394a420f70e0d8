"""Drivers and batteries of the parts that come with the project."""

import math

import numpy as np
import pytest

from actuators.errors import DataSheetError
from actuators.loading.parts import Part, load_parts
from actuators.supply import battery_of, driver_of

PARTS = load_parts()
WH = 3600.0


def values(part: Part, share: float = 0.5) -> dict[str, float]:
    """One value for each entry: the low end of its range at 0, the high end at 1."""
    return {n: x.low + share * (x.high - x.low) for n, x in part.printed.items()}


def of_kind(kind: str) -> list[Part]:
    return [part for part in PARTS.values() if part.kind == kind]


def test_a_driver_s_efficiency_is_met_at_full_voltage_and_current():
    x = values(PARTS["maxon_escon_mod_50_5"], 0.0)
    driver = driver_of("escon", x)
    given = 0.98 * 50 * 5.0
    loss = driver.loss(np.array(5.0), 50.0)
    assert given / (given + loss) == pytest.approx(0.98)


@pytest.mark.parametrize("current_of", [1.0, 0.75, 1.5])
def test_one_driver_loses_the_same_whatever_the_motor_s_ampere(current_of):
    """The same copper loss c R I^2 is the same current; conduction goes with it."""
    x = values(PARTS["moteus_n1"])
    current = 8.0 / math.sqrt(current_of)
    loss = driver_of("n1", x, current_of=current_of)
    assert loss.resistance * current**2 == pytest.approx(2 * 2.4e-3 * 64.0)
    assert loss.voltage_share == pytest.approx(math.sqrt(current_of) * x["voltage_share"])


@pytest.mark.parametrize("part", of_kind("battery"), ids=lambda p: p.name)
def test_every_battery_makes_one_of_any_energy(part):
    b = battery_of(part.name, values(part), energy=650 * WH, voltage=48.0)
    assert b.mass == pytest.approx(650 * WH / part.printed["specific_energy"].value)
    assert b.energy == pytest.approx(650 * WH * 0.9)
    assert 0.5 * (b.full + b.empty) == pytest.approx(48.0)
    one_hour = 650.0 / 48.0  # [A]
    assert b.resistance * one_hour / 48.0 == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("build", "missing"),
    [
        (lambda: driver_of("d", {"on_resistance": 1e-3}), "idle_power, efficiency"),
        (lambda: battery_of("b", {"energy": 1.0}), "voltage, voltage_swing, sag"),
    ],
)
def test_what_is_missing_is_named(build, missing):
    with pytest.raises(DataSheetError, match=missing):
        build()
