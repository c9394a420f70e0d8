"""What the paper leaves out: break-even and walking ratios with it, and how far they move.

Every row of `omissions.csv` changes one thing against the run's own numbers. Friction and
winding go through the same chains as everything else; drivers and brakes add a constant power to
what these draw.

Idle power P of n drivers cancels between two actuators that walk. Standing, a reversible joint
needs its driver to hold, an irreversible one may switch it off, so that with the break-even f0 and
the holding power p without drivers

    f = f0 p / (f0 p + (1 - f0) (p + n P)).

Costs are arrays (4, 3): what each of `ALTERNATIVES` takes per cycle in the middle left and in the
middle right leg [J], and to stand [W].
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
from actuators.checked import read_toml
from actuators.elements.heating import COPPER
from actuators.energy.energy import BUS, supply
from actuators.loading.build import Catalog
from actuators.parameters import parameters_from_table
from pipeline.columns import frame
from pipeline.paper import hexapod
from pipeline.paper.hexapod import Demand, Outcome, outcomes, printed_leg
from pipeline.paper.published import ALTERNATIVES, CYCLE, PAIR
from pipeline.simulation.walk_stand import break_even

if TYPE_CHECKING:
    from pandas import DataFrame

ROWS_FILE, ASSUMPTIONS_FILE = (
    Path(__file__).with_name(name) for name in ("omissions.csv", "assumptions.toml")
)
_KINDS = {
    **dict.fromkeys(("gate_driver_idle", "driver_idle", "brake_open", "brake_latching"), "power"),
    **dict.fromkeys(("grease_at_0_degC", "grease_at_40_degC"), "ratio"),
    **dict.fromkeys(("hold_middle", "hold_most"), "ratio"),
    "winding_rise": "temperature",
}
#: Friction without load of what runs in grease.
_GREASED = (
    *("harmonic_drive.coulomb", "harmonic_drive.viscous", "planetary.coulomb"),
    *("pinion.coulomb", "pinion.viscous", "output_bearing.coulomb", "output_bearing.viscous"),
)
_REVERSIBLE, _IRREVERSIBLE = (ALTERNATIVES.index(name) for name in PAIR)
#: What a watt per joint adds to the costs of an alternative that walks, and to one that stands.
_WALKING = np.array([len(hexapod.JOINTS) * CYCLE, len(hexapod.JOINTS) * CYCLE, 0.0])
_STANDING = np.array([0.0, 0.0, hexapod.COLUMNS])


def costs_of(found: Mapping[str, Outcome], *, net: bool = False) -> Array:
    """Costs (4, 3), net of what flows back or not; the loaded leg alone stands."""
    rows = []
    for o in (found[name] for name in ALTERNATIVES):
        drawn, returned = (energy[0] for energy in o.energy)
        stand = printed_leg(o.holding.power).sum()
        rows.append([*(drawn - returned if net else drawn), stand])
    return np.array(rows)


def shared_bus(found: Mapping[str, Outcome], costs: Array) -> Array:
    """Costs (4, 3) with what flows back from a motor driving the others of its leg."""
    out = costs.copy()
    for k, walking in enumerate(found[name].walking for name in ALTERNATIVES):
        power = np.split(walking.electrical_power, len(hexapod.MIDDLE_LEGS), axis=1)
        legs = (supply(replace(walking, electrical_power=own), BUS) for own in power)
        out[k, :2] = [leg.supplied_energy.sum() for leg in legs]
    return out


def _standing_power(outcome: Outcome, share: float) -> float:
    """What the printed leg draws to stand at a place in the band of torques that hold [W].

    `share` goes from the torque of least magnitude (0) to that of the greatest (1).
    """
    held, motor = outcome.holding, outcome.chain.driven
    least = held.motor_torque
    most = np.where(np.abs(held.low) > np.abs(held.high), held.low, held.high)
    current = (least + share * (most - least)) / motor.torque_constant
    return float(printed_leg(current**2 * motor.resistance).sum())


def answers(costs: Array) -> Array:
    """Break-even, NaN where there is none, and the printed leg's walking ratios, (4,)."""
    more = costs[_IRREVERSIBLE] - costs[_REVERSIBLE]
    even = break_even(float(more[:2].sum()), float(-more[2] * CYCLE))
    return np.array([even, *(costs[1:, hexapod.PRINTED] / costs[0, hexapod.PRINTED])])


def omissions(demand: Demand, catalog: Catalog) -> DataFrame:
    """Every row, the paper's own way first; the catalogue has the paper's four alternatives."""
    found = outcomes(demand, catalog)
    base = costs_of(found)
    motors = {catalog.alternatives[name].motor for name in ALTERNATIVES}

    def scaled(keys: Iterable[str], factor: float) -> Array:
        values = {key: factor * catalog.parameter(key).value for key in keys}
        return costs_of(outcomes(demand, catalog, values))

    def braked(watt: float) -> Array:
        out = base.copy()
        out[_REVERSIBLE] = [1, 1, 0] * base[_REVERSIBLE] + watt * _WALKING
        return out

    def held(share: float) -> Array:
        out = base.copy()
        for k, name in enumerate(ALTERNATIVES[:_IRREVERSIBLE]):
            out[k, 2] = _standing_power(found[name], share)
        return out

    stands_on = np.arange(len(ALTERNATIVES)) != _IRREVERSIBLE  # with its drivers on
    ways: dict[str, Callable[[float], Array]] = {
        "nothing": lambda _: base,
        "drivers": lambda watt: base + watt * (_WALKING + stands_on[:, None] * _STANDING),
        "grease": lambda times: scaled(_GREASED, times),
        "winding": lambda rise: scaled([f"{m}.resistance" for m in motors], 1 + COPPER * rise),
        "shared": lambda _: shared_bus(found, base),
        "stored": lambda _: costs_of(found, net=True),
        "brakes": braked,
        "hold": held,
    }
    stated = parameters_from_table(read_toml(ASSUMPTIONS_FILE), _KINDS, ASSUMPTIONS_FILE.name)
    rows = []
    with ROWS_FILE.open(encoding="utf-8", newline="") as file:
        for way, name, left_out, assumption, note in [*csv.reader(file)][1:]:
            number = stated.parameter(name) if name else None
            costs = ways[way](number.value if number else 0.0)
            cells: list[Any] = [None, "", "", ""]
            if number:
                cells = [number.value_as_written, number.unit, number.basis, number.source]
            even, *ratios = answers(costs)
            even_change, *changes = answers(costs) - answers(base)
            numeric = [even, even_change, *ratios, *changes]
            rows.append([left_out, assumption, *cells, *map(float, numeric), note])
    return frame("omissions", rows)
