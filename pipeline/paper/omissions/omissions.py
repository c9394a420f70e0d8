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

from actuators.elements.heating import warm_resistance
from actuators.elements.hypoid import Hypoid
from actuators.energy.regeneration import BUS, supply
from actuators.loading.build import Catalog
from actuators.parameters import Parameter, ParameterSet, parameters_from_table, read_toml
from pipeline.paper.calibration.machine import MIDDLE_LEGS, RobotPart, actuator_part, leg_joints
from pipeline.paper.calibration.problem import EVEN
from pipeline.paper.calibration.quantities import PAIR
from pipeline.paper.judgement.fig_21 import CYCLE
from pipeline.paper.omissions.costs import (
    JOINTS_PER_LEG,
    NEEDED,
    Costs,
    costs_of,
    holding_friction,
    with_factors,
)
from pipeline.paper.published import Published

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


def omissions(
    part: RobotPart, catalog: Catalog, published: Mapping[str, Published]
) -> tuple[Omission, ...]:
    """Every row, the paper's own way first.

    Args:
        part: What the robot asks of its middle legs.
        catalog: With the paper's four alternatives.
        published: The printed values, for the closed form.
    """
    base = costs_of(part, catalog)
    none = _row("", "as the paper has it", None, base, base)
    return (
        none,
        *_drivers(base, published),
        *_grease(part, catalog, base),
        _winding(part, catalog, base),
        *_returned(part, catalog, base),
        *_brakes(base),
        *_hypoid(part, catalog, base),
    )


def _row(
    name: str,
    assumption: str,
    number: Parameter | None,
    costs: Costs,
    base: Costs,
    note: str = "",
) -> Omission:
    moved = {n: ratio - base.ratios[n] for n, ratio in costs.ratios.items()}
    even = costs.break_even
    return Omission(
        name, assumption, number, even, even - base.break_even, costs.ratios, moved, note
    )


def _drivers(base: Costs, published: Mapping[str, Published]) -> list[Omission]:
    printed = sum(published[f"{_REVERSIBLE}_power_{joint}"].value for joint in (2, 3))  # [W]
    rows = []
    for key in ("gate_driver_idle", "driver_idle"):
        number = assumptions().parameter(key)
        costs = base.with_power(number.value, set(base.cycle), set(base.stand) - {_IRREVERSIBLE})
        drivers = JOINTS_PER_LEG * len(MIDDLE_LEGS) * number.value  # [W]
        closed = idle_break_even(published[EVEN].value, printed, drivers)
        rows.append(
            _row(
                "idle power of the drivers",
                "every joint's driver draws it, walking and standing; irreversible joints switch "
                "theirs off to stand",
                number,
                costs,
                base,
                f"the printed {100 * published[EVEN].value:g} % and {printed:g} W alone give "
                f"{100 * closed:.1f} % in closed form; where irreversible joints leave their "
                "drivers on the break-even stays",
            )
        )
    return rows


def _grease(part: RobotPart, catalog: Catalog, base: Costs) -> list[Omission]:
    rows = []
    for key, at in (("grease_at_0_degC", "0"), ("grease_at_40_degC", "40")):
        number = assumptions().parameter(key)
        warm = with_factors(catalog, dict.fromkeys(_GREASED, number.value))
        rows.append(
            _row(
                f"grease of the gears at {at} °C",
                "friction without load of gears and bearings is so many times that at 20 °C",
                number,
                costs_of(part, warm),
                base,
                "at standstill, too: the laws have one friction for both",
            )
        )
    return rows


def _winding(part: RobotPart, catalog: Catalog, base: Costs) -> Omission:
    number = assumptions().parameter("winding_rise")
    factor = float(warm_resistance(1.0, np.array(number.value)))
    motors = {catalog.alternatives[name].motor for name in NEEDED}
    warm = with_factors(catalog, {f"{motor}.resistance": factor for motor in motors})
    return _row(
        "warming of the winding",
        f"warmer than the data sheet's 25 °C by so much: {factor:.3f} times the resistance",
        number,
        costs_of(part, warm),
        base,
    )


def _returned(part: RobotPart, catalog: Catalog, base: Costs) -> list[Omission]:
    found = actuator_part(part, catalog)
    columns = {
        leg: [part.series.joints.index(j) for j in leg_joints(part.robot.spec, leg)]
        for leg in MIDDLE_LEGS
    }
    shared = {
        name: {
            leg: float(
                supply(replace(walk, electrical_power=walk.electrical_power[:, own]), BUS)
                .supplied_energy.sum()
            )
            for leg, own in columns.items()
        }
        for name, walk in found.walking.items()
    }  # fmt: skip
    return [
        _row(
            "bus shared by a leg",
            "what flows back from a motor drives the others of its leg, the rest is lost",
            None,
            Costs(shared, base.stand),
            base,
            "in the paper all that flows back is lost, as in a braking resistor",
        ),
        _row(
            "bus that stores what flows back",
            "all of it is used again",
            None,
            costs_of(part, catalog, net=True),
            base,
        ),
    ]


def _brakes(base: Costs) -> list[Omission]:
    walking = {n: sum(base.cycle[n].values()) for n in PAIR}  # [J]
    extra = walking[_IRREVERSIBLE] - walking[_REVERSIBLE]
    equal = extra / (JOINTS_PER_LEG * len(MIDDLE_LEGS) * CYCLE)  # [W]
    rows = []
    for key in ("brake_open", "brake_latching"):
        number = assumptions().parameter(key)
        costs = base.with_power(number.value, {_REVERSIBLE}, set())
        costs = replace(costs, stand={**costs.stand, _REVERSIBLE: 0.0})
        better = _REVERSIBLE if number.value < equal else _IRREVERSIBLE
        rows.append(
            _row(
                "brakes on reversible joints",
                "each holds without power; open, while walking, it draws so much",
                number,
                costs,
                base,
                f"walking, the {better} one draws less; both draw the same with {equal:.2f} W per "
                "open brake; standing, the reversible one draws nothing any more",
            )
        )
    return rows


def _hypoid(part: RobotPart, catalog: Catalog, base: Costs) -> list[Omission]:
    chain, now = catalog.chain(_IRREVERSIBLE), catalog.parameter(_HYPOID_FRICTION).value
    gear = next(e for e in chain.elements if isinstance(e, Hypoid))
    alone = float(gear.locking_friction)
    together = holding_friction(chain, gear, part.standing_torque)
    rows = []
    for part_sliding, friction, source, what in (
        ("gear", alone, "1 / tan(pinion_angle)", "the gear no longer locks itself"),
        ("leg", together, "root of the chain's holding torque", "the standing leg slides"),
    ):
        number = Parameter("friction", friction, "1", friction, "derived", source)
        costs = costs_of(part, catalog.replaced(_HYPOID_FRICTION, friction, bounds=None))
        rows.append(
            _row(
                f"hypoid's friction, {part_sliding} sliding",
                f"friction at its teeth below which {what}",
                number,
                costs,
                base,
                f"{100 * (1 - friction / now):.1f} % less than the {now:.4f} of the run"
                if now > friction
                else f"the {now:.4f} of the run is no more than that",
            )
        )
    return rows
