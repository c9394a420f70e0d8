"""What the paper leaves out: break-even and walking ratios with it, and how far they move.

Every row changes one thing against the run's own numbers. Friction, winding and gear go through the
same chains as everything else; drivers and brakes add a constant power to what these chains draw.

Idle power P of n drivers cancels between two actuators that walk. Standing, a reversible joint
needs its driver to hold, an irreversible one may switch it off, so that with the break-even f0 and
the holding power p without drivers

    f = f0 p / (f0 p + (1 - f0) (p + n P)).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from actuators.arrays import Array
from actuators.chain import Chain
from actuators.elements.heating import warm_resistance
from actuators.elements.hypoid import Hypoid
from actuators.energy.regeneration import BUS, supply
from actuators.loading.build import Catalog
from actuators.parameters import Parameter, ParameterSet, parameters_from_table, read_toml
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
    """Energy per cycle by alternative and leg [J]; power standing, both middle legs [W]."""

    cycle: Mapping[str, Mapping[str, float]]
    stand: Mapping[str, float]

    @property
    def break_even(self) -> float:
        """Fraction of time standing; NaN where there is none."""
        saved = self.stand[_REVERSIBLE] - self.stand[_IRREVERSIBLE]
        return pair_break_even(self.cycle, saved, 1)

    @property
    def ratios(self) -> dict[str, float]:
        """Of the middle right leg."""
        ideal, *others = ALTERNATIVES
        return {n: self.cycle[n][PUBLISHED_LEG] / self.cycle[ideal][PUBLISHED_LEG] for n in others}

    def with_power(self, each: float, walking: set[str], standing: set[str]) -> Costs:
        """With a constant power per joint in some alternatives.

        Args:
            each: Per joint of both legs [W].
            walking: Alternatives that draw it walking.
            standing: Alternatives that draw it standing.
        """
        cycle = {
            n: {leg: e + (n in walking) * each * JOINTS_PER_LEG * CYCLE for leg, e in legs.items()}
            for n, legs in self.cycle.items()
        }
        return Costs(
            cycle, {n: p + (n in standing) * each * _JOINTS for n, p in self.stand.items()}
        )


@dataclass(frozen=True)
class Omission:
    """One thing that the paper leaves out, put in.

    Attributes:
        name: What is left out; empty for the paper's own way.
        assumption: How it is put in.
        number: With which value; None where there is none.
        break_even: Fraction of time standing; NaN where there is none.
        moved: By how much that is more than without it.
        ratios: Walking energy of the middle right leg over the ideal actuator's, by alternative.
        ratios_moved: By how much they are more.
        note: In words.
    """

    name: str
    assumption: str
    number: Parameter | None
    break_even: float
    moved: float
    ratios: Mapping[str, float]
    ratios_moved: Mapping[str, float]
    note: str = ""


@cache
def assumptions() -> ParameterSet:
    """The numbers that are put in.

    Raises:
        ParameterError: The file cannot be read, or a number is wrong.
    """
    return parameters_from_table(read_toml(ASSUMPTIONS_FILE), _SCHEMA, ASSUMPTIONS_FILE.name)


def idle_break_even(even: float, holding: float, idle: float) -> float:
    """Break-even with drivers that idle, in closed form; see the module.

    Args:
        even: Without them, fraction of time standing.
        holding: Power of the reversible actuators standing, both middle legs [W].
        idle: Of all their drivers together [W].
    """
    return even * holding / (even * holding + (1 - even) * (holding + idle))


def holding_friction(chain: Chain, gear: Hypoid, torque: Array) -> float:
    """Least friction at a hypoid's teeth with which its actuator holds joints without current [1].

    Bearings, gears and rotor help to hold, so that it is less than the gear's `locking_friction`;
    zero where they hold alone.

    Args:
        chain: The actuator.
        gear: The hypoid gear in it.
        torque: To hold (J,) [N*m].
    """

    def spare(friction: float) -> float:
        """How far the motor torque zero is inside what holds [N*m]; negative outside."""
        held = chain.replaced(replace(gear, friction=friction)).holding(torque)
        return float(np.minimum(held.high, -held.low).min())

    if spare(0.0) >= 0.0:
        return 0.0
    return float(brentq(spare, 0.0, float(gear.locking_friction)))


@dataclass(frozen=True)
class _Omissions:
    """The rows about one demand, held against what the actuators cost as they are."""

    demand: Demand
    catalog: Catalog
    published: Mapping[str, Published]
    found: Mapping[str, Outcome]
    base: Costs

    def row(
        self, name: str, assumption: str, number: Parameter | None, costs: Costs, note: str = ""
    ) -> Omission:
        moved = {n: ratio - self.base.ratios[n] for n, ratio in costs.ratios.items()}
        even = costs.break_even
        change = even - self.base.break_even
        return Omission(name, assumption, number, even, change, costs.ratios, moved, note)

    def costs(self, values: Mapping[str, float]) -> Costs:
        """With some numbers of the catalogue replaced, SI, wherever their bounds are."""
        return costs_of(outcomes(self.demand, self.catalog, values))

    def scaled(self, keys: set[str], factor: float) -> Costs:
        return self.costs({key: factor * self.catalog.parameter(key).value for key in keys})

    def drivers(self, key: str) -> Omission:
        number, even = assumptions().parameter(key), self.published[EVEN].value
        printed = sum(self.published[f"{_REVERSIBLE}_power_{j}"].value for j in (2, 3))  # [W]
        closed = idle_break_even(even, printed, _JOINTS * number.value)
        standing = set(ALTERNATIVES) - {_IRREVERSIBLE}
        return self.row(
            "idle power of the drivers",
            "every joint's driver draws it, walking and standing; irreversible joints switch "
            "theirs off to stand",
            number,
            self.base.with_power(number.value, set(ALTERNATIVES), standing),
            f"the printed {100 * even:g} % and {printed:g} W alone give "
            f"{100 * closed:.1f} % in closed form; where irreversible joints leave their "
            "drivers on the break-even stays",
        )

    def grease(self, celsius: int) -> Omission:
        number = assumptions().parameter(f"grease_at_{celsius}_degC")
        return self.row(
            f"grease of the gears at {celsius} °C",
            "friction without load of gears and bearings is so many times that at 20 °C",
            number,
            self.scaled(set(_GREASED), number.value),
            "at standstill, too: the laws have one friction for both",
        )

    def winding(self) -> Omission:
        number = assumptions().parameter("winding_rise")
        factor = float(warm_resistance(1.0, np.array(number.value)))
        motors = {self.catalog.alternatives[name].motor for name in ALTERNATIVES}
        return self.row(
            "warming of the winding",
            f"warmer than the data sheet's 25 °C by so much: {factor:.3f} times the resistance",
            number,
            self.scaled({f"{motor}.resistance" for motor in motors}, factor),
        )

    def shared_bus(self) -> Omission:
        cycle: dict[str, dict[str, float]] = {name: {} for name in self.found}
        for name, outcome in self.found.items():
            power = np.split(outcome.walking.electrical_power, len(MIDDLE_LEGS), axis=1)
            for leg, own in zip(MIDDLE_LEGS, power, strict=True):
                alone = supply(replace(outcome.walking, electrical_power=own), BUS)
                cycle[name][leg] = float(alone.supplied_energy.sum())
        return self.row(
            "bus shared by a leg",
            "what flows back from a motor drives the others of its leg, the rest is lost",
            None,
            Costs(cycle, self.base.stand),
            "in the paper all that flows back is lost, as in a braking resistor",
        )

    def storing_bus(self) -> Omission:
        stored = costs_of(self.found, net=True)
        return self.row("bus that stores what flows back", "all of it is used again", None, stored)

    def brakes(self, key: str) -> Omission:
        number = assumptions().parameter(key)
        reversible, irreversible = (sum(self.base.cycle[n].values()) for n in PAIR)  # [J]
        equal = (irreversible - reversible) / (_JOINTS * CYCLE)  # [W]
        costs = self.base.with_power(number.value, {_REVERSIBLE}, set())
        better = _REVERSIBLE if number.value < equal else _IRREVERSIBLE
        return self.row(
            "brakes on reversible joints",
            "each holds without power; open, while walking, it draws so much",
            number,
            replace(costs, stand={**costs.stand, _REVERSIBLE: 0.0}),
            f"walking, the {better} one draws less; both draw the same with {equal:.2f} W per "
            "open brake; standing, the reversible one draws nothing any more",
        )

    def sliding(self, part: str, friction: float, source: str, what: str) -> Omission:
        now = self.catalog.parameter(_HYPOID_FRICTION).value
        return self.row(
            f"hypoid's friction, {part} sliding",
            f"friction at its teeth below which {what}",
            Parameter("friction", friction, "1", friction, "derived", source),
            self.costs({_HYPOID_FRICTION: friction}),
            f"{100 * (1 - friction / now):.1f} % less than the {now:.4f} of the run"
            if now > friction
            else f"the {now:.4f} of the run is no more than that",
        )


def costs_of(found: Mapping[str, Outcome], *, net: bool = False) -> Costs:
    """What the alternatives cost, net of what returns or not; the loaded leg alone stands."""
    cycle = {n: {leg: o.consumed(leg, net=net) for leg in MIDDLE_LEGS} for n, o in found.items()}
    return Costs(cycle, {n: float(o.held["power"].sum()) for n, o in found.items()})


def omissions(
    demand: Demand, catalog: Catalog, published: Mapping[str, Published]
) -> tuple[Omission, ...]:
    """Every row, the paper's own way first.

    Args:
        demand: What the robot asks of its middle legs.
        catalog: With the paper's four alternatives.
        published: The printed values, for the closed form.
    """
    found = outcomes(demand, catalog)
    rows = _Omissions(demand, catalog, published, found, costs_of(found))
    chain = found[_IRREVERSIBLE].chain
    gear = next(e for e in chain.elements if isinstance(e, Hypoid))
    (torque,) = printed_leg(demand.standing)
    alone, together = float(gear.locking_friction), holding_friction(chain, gear, torque)
    return (
        rows.row("", "as the paper has it", None, rows.base),
        *(rows.drivers(key) for key in ("gate_driver_idle", "driver_idle")),
        *(rows.grease(celsius) for celsius in (0, 40)),
        rows.winding(),
        rows.shared_bus(),
        rows.storing_bus(),
        *(rows.brakes(key) for key in ("brake_open", "brake_latching")),
        rows.sliding("gear", alone, "1 / tan(pinion_angle)", "the gear no longer locks itself"),
        rows.sliding(
            "leg", together, "root of the chain's holding torque", "the standing leg slides"
        ),
    )
