"""What the paper leaves out: break-even and walking ratios with it, and how far they move.

Every row changes one thing against the run's own numbers. Friction, winding and gear go through the
same chains as everything else; drivers and brakes add a constant power to what these chains draw.

Idle power P of n drivers cancels between two actuators that walk. Standing, a reversible joint
needs its driver to hold, an irreversible one may switch it off, so that with the break-even f0 and
the holding power p without drivers

    f = f0 p / (f0 p + (1 - f0) (p + n P)).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import brentq

from actuators.arrays import Array
from actuators.chain import Chain
from actuators.elements.heating import COPPER
from actuators.elements.hypoid import Hypoid
from actuators.energy.energy import BUS, supply
from actuators.loading.build import Catalog
from actuators.parameters import Parameter, ParameterSet, parameters_from_table, read_toml
from pipeline.columns import frame
from pipeline.paper.hexapod import (
    JOINTS_PER_LEG,
    MIDDLE_LEGS,
    PUBLISHED_LEG,
    Demand,
    Outcome,
    outcomes,
    printed_leg,
)
from pipeline.paper.published import ALTERNATIVES, CYCLE, EVEN, PAIR, Published
from pipeline.paper.quantities import pair_break_even

if TYPE_CHECKING:
    from pandas import DataFrame

ASSUMPTIONS_FILE = Path(__file__).parent / "assumptions.toml"
_REVERSIBLE, _IRREVERSIBLE = PAIR
_SCHEMA = {
    "gate_driver_idle": "power",
    "driver_idle": "power",
    "grease_at_0_degC": "ratio",
    "grease_at_40_degC": "ratio",
    "winding_rise": "temperature",
    "brake_open": "power",
    "brake_latching": "power",
}
_HYPOID_FRICTION = "hypoid.friction"
#: Friction without load of what runs in grease.
_GREASED = (
    *("harmonic_drive.coulomb", "harmonic_drive.viscous", "planetary.coulomb"),
    *("pinion.coulomb", "pinion.viscous", "output_bearing.coulomb", "output_bearing.viscous"),
)
_JOINTS = JOINTS_PER_LEG * len(MIDDLE_LEGS)


@dataclass(frozen=True)
class Costs:
    """What the paper's four alternatives cost both middle legs."""

    cycle: Mapping[str, Mapping[str, float]]  #: Energy per cycle by alternative and leg [J].
    stand: Mapping[str, float]  #: Power standing by alternative [W].

    @property
    def figures(self) -> Array:
        """Break-even, NaN where there is none, and the middle right leg's walking ratios (4,)."""
        saved = self.stand[_REVERSIBLE] - self.stand[_IRREVERSIBLE]
        ideal, *others = (self.cycle[name][PUBLISHED_LEG] for name in ALTERNATIVES)
        return np.array([pair_break_even(self.cycle, saved), *(e / ideal for e in others)])

    def with_power(self, each: float, walking: Collection[str], standing: Collection[str]) -> Costs:
        """With a constant power per joint [W] in some alternatives walking, in some standing."""
        cycle = {
            n: {leg: e + (n in walking) * each * JOINTS_PER_LEG * CYCLE for leg, e in legs.items()}
            for n, legs in self.cycle.items()
        }
        return Costs(
            cycle, {n: p + (n in standing) * each * _JOINTS for n, p in self.stand.items()}
        )


#: What is left out, how it is put in, with which number, what it then costs, and a note.
_Change = tuple[str, str, Parameter | None, Costs, str]


@cache
def assumptions() -> ParameterSet:
    """The numbers that are put in.

    Raises:
        LegwattError: The file cannot be read, or a number is wrong.
    """
    return parameters_from_table(read_toml(ASSUMPTIONS_FILE), _SCHEMA, ASSUMPTIONS_FILE.name)


def idle_break_even(even: float, holding: float, idle: float) -> float:
    """Break-even with drivers that idle [W, all together], in closed form; see the module.

    `even` is the break-even without them, `holding` the power of the reversible actuators standing
    on both middle legs [W].
    """
    return even * holding / (even * holding + (1 - even) * (holding + idle))


def holding_friction(chain: Chain, gear: Hypoid, torque: Array) -> float:
    """Least friction at a hypoid's teeth with which its actuator holds joints without current [1].

    Bearings, gears and rotor help to hold, so that it is less than the gear's `locking_friction`;
    zero where they hold the torque (J,) [N*m] alone.
    """

    def spare(friction: float) -> float:
        """How far the motor torque zero is inside what holds [N*m]; negative outside."""
        held = chain.replaced(replace(gear, friction=friction)).holding(torque)
        return float(np.minimum(held.high, -held.low).min())

    if spare(0.0) >= 0.0:
        return 0.0
    return float(brentq(spare, 0.0, float(gear.locking_friction)))


def costs_of(found: Mapping[str, Outcome], *, net: bool = False) -> Costs:
    """What the alternatives cost, net of what returns or not; the loaded leg alone stands."""
    cycle = {n: {leg: o.consumed(leg, net=net) for leg in MIDDLE_LEGS} for n, o in found.items()}
    return Costs(cycle, {n: float(o.held["power"].sum()) for n, o in found.items()})


def omissions(demand: Demand, catalog: Catalog, published: Mapping[str, Published]) -> DataFrame:
    """Every row, the paper's own way first; the catalogue has the paper's four alternatives."""
    found = outcomes(demand, catalog)
    base = costs_of(found)

    def costs(values: Mapping[str, float]) -> Costs:
        """With some numbers of the catalogue replaced, SI, wherever their bounds are."""
        return costs_of(outcomes(demand, catalog, values))

    (torque,) = printed_leg(demand.standing)
    changes = (
        ("nothing", "as the paper has it", None, base, ""),
        *_drivers(base, published),
        *_friction_and_winding(catalog, costs),
        *_buses(found, base),
        *_brakes(base),
        *_sliding(found[_IRREVERSIBLE].chain, torque, catalog, costs),
    )
    return frame("omissions", [_row(*change, base) for change in changes])


def _row(
    name: str, assumption: str, number: Parameter | None, costs: Costs, note: str, base: Costs
) -> list[Any]:
    cells: list[Any] = [None, "", "", ""]
    if number:
        cells = [number.value_as_written, number.unit, number.basis, number.source]
    even, *ratios = costs.figures.tolist()
    even_change, *changes = (costs.figures - base.figures).tolist()
    return [name, assumption, *cells, even, even_change, *ratios, *changes, note]


def _drivers(base: Costs, published: Mapping[str, Published]) -> Iterator[_Change]:
    even = published[EVEN].value
    printed = sum(published[f"{_REVERSIBLE}_power_{j}"].value for j in (2, 3))  # [W]
    standing = set(ALTERNATIVES) - {_IRREVERSIBLE}
    for key in ("gate_driver_idle", "driver_idle"):
        number = assumptions().parameter(key)
        closed = idle_break_even(even, printed, _JOINTS * number.value)
        yield (
            "idle power of the drivers",
            "every joint's driver draws it, walking and standing; irreversible joints switch "
            "theirs off to stand",
            number,
            base.with_power(number.value, ALTERNATIVES, standing),
            f"the printed {100 * even:g} % and {printed:g} W alone give "
            f"{100 * closed:.1f} % in closed form; where irreversible joints leave their "
            "drivers on the break-even stays",
        )


def _friction_and_winding(
    catalog: Catalog, costs: Callable[[Mapping[str, float]], Costs]
) -> Iterator[_Change]:
    def scaled(keys: Collection[str], factor: float) -> Costs:
        return costs({key: factor * catalog.parameter(key).value for key in keys})

    for celsius in (0, 40):
        number = assumptions().parameter(f"grease_at_{celsius}_degC")
        yield (
            f"grease of the gears at {celsius} °C",
            "friction without load of gears and bearings is so many times that at 20 °C",
            number,
            scaled(_GREASED, number.value),
            "at standstill, too: the laws have one friction for both",
        )
    number = assumptions().parameter("winding_rise")
    factor = 1.0 + COPPER * number.value
    motors = {catalog.alternatives[name].motor for name in ALTERNATIVES}
    yield (
        "warming of the winding",
        f"warmer than the data sheet's 25 °C by so much: {factor:.3f} times the resistance",
        number,
        scaled({f"{motor}.resistance" for motor in motors}, factor),
        "",
    )


def _buses(found: Mapping[str, Outcome], base: Costs) -> Iterator[_Change]:
    cycle: dict[str, dict[str, float]] = {name: {} for name in found}
    for name, outcome in found.items():
        power = np.split(outcome.walking.electrical_power, len(MIDDLE_LEGS), axis=1)
        for leg, own in zip(MIDDLE_LEGS, power, strict=True):
            alone = supply(replace(outcome.walking, electrical_power=own), BUS)
            cycle[name][leg] = float(alone.supplied_energy.sum())
    yield (
        "bus shared by a leg",
        "what flows back from a motor drives the others of its leg, the rest is lost",
        None,
        Costs(cycle, base.stand),
        "in the paper all that flows back is lost, as in a braking resistor",
    )
    stored = costs_of(found, net=True)
    yield "bus that stores what flows back", "all of it is used again", None, stored, ""


def _brakes(base: Costs) -> Iterator[_Change]:
    reversible, irreversible = (sum(base.cycle[n].values()) for n in PAIR)  # [J]
    equal = (irreversible - reversible) / (_JOINTS * CYCLE)  # [W]
    for key in ("brake_open", "brake_latching"):
        number = assumptions().parameter(key)
        costs = base.with_power(number.value, {_REVERSIBLE}, ())
        better = _REVERSIBLE if number.value < equal else _IRREVERSIBLE
        yield (
            "brakes on reversible joints",
            "each holds without power; open, while walking, it draws so much",
            number,
            replace(costs, stand={**costs.stand, _REVERSIBLE: 0.0}),
            f"walking, the {better} one draws less; both draw the same with {equal:.2f} W per "
            "open brake; standing, the reversible one draws nothing any more",
        )


def _sliding(
    chain: Chain, torque: Array, catalog: Catalog, costs: Callable[[Mapping[str, float]], Costs]
) -> Iterator[_Change]:
    gear = next(e for e in chain.elements if isinstance(e, Hypoid))
    now = catalog.parameter(_HYPOID_FRICTION).value
    together = holding_friction(chain, gear, torque)
    for part, friction, source, what in (
        (
            "gear",
            float(gear.locking_friction),
            "1 / tan(pinion_angle)",
            "the gear no longer locks itself",
        ),
        ("leg", together, "root of the chain's holding torque", "the standing leg slides"),
    ):
        yield (
            f"hypoid's friction, {part} sliding",
            f"friction at its teeth below which {what}",
            Parameter("friction", friction, "1", friction, "derived", source),
            costs({_HYPOID_FRICTION: friction}),
            f"{100 * (1 - friction / now):.1f} % less than the {now:.4f} of the run"
            if now > friction
            else f"the {now:.4f} of the run is no more than that",
        )
