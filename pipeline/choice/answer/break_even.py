"""Two candidates over the share of standing, the speed of walking and the idle power of drivers.

With w and h the power walking and standing, n drivers on and P each one's idle power, the mean at
a share of standing f is (1 - f) (w + n_w P) + f (h + n_h P); both candidates take the same at

    f = dw / (dw - dh),      d the difference of the two in the brackets.

Walking, all drivers are on; standing, those of joints that lock and hold without current are off.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Final

import numpy as np

from actuators.arrays import Mask
from actuators.energy.energy import supply
from actuators.errors import CatalogError, closest
from pipeline.choice.errors import ChoiceError
from pipeline.choice.full import through
from pipeline.choice.loads import Load, loads_of
from pipeline.choice.missions.mission import Mode
from pipeline.choice.track import Account
from pipeline.machine.joint import Actuators
from reports.tables.choice import BreakEvenRow

if TYPE_CHECKING:
    from pipeline.api.machine import Machine
    from pipeline.choice.choose import Chosen

#: The candidate that the search chose, among the names of alternatives.
ANSWER: Final = "answer"
SHARES: Final = tuple(round(0.05 * k, 2) for k in range(21))
#: Of the gait's own speed.
SPEEDS: Final = (0.5, 0.75, 1.0)
#: Besides the one asked for: none, and a driver with more around its gates [W].
IDLES: Final = (0.0, 2.0)
#: A load that only what locks by itself holds without current [N*m].
_GREAT: Final = 1e9


@dataclass(frozen=True)
class Cost:
    """Of one candidate in one mode."""

    power: float  #: Without drivers [W].
    drivers: float  #: That are on.


def break_even(first: tuple[Cost, Cost], second: tuple[Cost, Cost], idle: float) -> float | None:
    """Share of standing at which two candidates take the same; None where there is none.

    Each has its cost of walking and standing; a driver that is on takes `idle` [W].
    """
    walk, stand = (
        b.power - a.power + idle * (b.drivers - a.drivers)
        for a, b in zip(first, second, strict=True)
    )
    return walk / (walk - stand) if walk * stand < 0.0 else None


def rows(
    machine: Machine,
    names: Sequence[str],
    *,
    idle: float,
    chosen: Chosen | None = None,
    joints: str = "*",
    samples: int = 201,
) -> Iterator[BreakEvenRow]:
    """The map of two candidates.

    Args:
        machine: From `load`.
        names: Two alternatives of its actuator files, or `ANSWER`.
        idle: Of a driver that is on [W].
        chosen: The search, for `ANSWER`.
        joints: Pattern of the joints that count.
        samples: Per half period of the gait.

    Raises:
        CatalogError: No such alternative.
        ChoiceError: The pattern fits no joint.
        PipelineError: A speed cannot be walked.
    """
    one, two = names
    stand = Mode("stand", 1.0, True, None, {}, "motor", False, "standing")
    walk = Mode("walk", 1.0, False, None, {}, "motor", True, "walking")
    spring = chosen.asked.spring if chosen else None
    (still, own) = loads_of(machine, [stand, walk], samples=samples, spring=spring)
    counted = [k for k, j in enumerate(own.series.joints) if fnmatchcase(j, joints)]
    if not counted:
        hint = closest(joints, own.series.joints)
        raise ChoiceError(f"--compare-joints {joints}: no such joint: {hint}")
    for share in SPEEDS:
        speed = share * own.speed
        mode = replace(walk, changes={"gait.speed": f"{speed!r} m/s"} if share != 1.0 else {})
        (moved,) = loads_of(machine, [mode], samples=samples, spring=spring)
        costs = {
            name: tuple(cost(machine, name, load, counted, chosen) for load in (moved, still))
            for name in (one, two)
        }
        for power in dict.fromkeys((IDLES[0], idle, *IDLES[1:])):
            yield from _rows(costs, speed, power)


def _rows(
    costs: Mapping[str, tuple[Cost, ...]], speed: float, idle: float
) -> Iterator[BreakEvenRow]:
    (one, (walk1, stand1)), (two, (walk2, stand2)) = costs.items()
    even = break_even((walk1, stand1), (walk2, stand2), idle)
    for share in SHARES:
        first, second = (
            (1 - share) * (walk.power + idle * walk.drivers)
            + share * (stand.power + idle * stand.drivers)
            for walk, stand in ((walk1, stand1), (walk2, stand2))
        )
        better = one if first <= second else two
        yield BreakEvenRow(share, speed, idle, one, two, first, second, better, even)


def cost(
    machine: Machine, name: str, load: Load, counted: Sequence[int], chosen: Chosen | None
) -> Cost:
    """One candidate, by name, in one mode, through its full chain; see `rows`.

    Raises:
        CatalogError: No such alternative.
    """
    if name == ANSWER and chosen is not None:
        # As alternatives have none of a driver's conduction and switching, here neither has it.
        none, built = np.zeros(1), {}
        for g, joints in chosen.asked.groups.items():
            bare = replace(chosen.designs(g), driver_resistance=none, switching=none)
            built[g] = joints, bare
        full = through(load, built, Account())
        power = (full.power - full.idle)[counted].sum()
        return Cost(float(power), float(full.on[counted].sum()))
    chain = machine.ready.chain(name)
    result = chain.inverse(load.series)
    power = supply(result).supplied_energy / load.duration
    idle = load.mode.stands & _locks(chain, load) & (result.current == 0.0).all(axis=0)
    return Cost(float(power[counted].sum()), float((~idle)[counted].sum()))


def known_candidate(machine: Machine, name: str) -> None:
    """Refuse a candidate that cannot be compared.

    Raises:
        CatalogError: No such alternative.
    """
    known = [*machine.ready.catalog.alternatives, ANSWER]
    if name not in known:
        raise CatalogError(f"--compare: no alternative '{name}': {closest(name, known)}")


def _locks(chain: Actuators, load: Load) -> Mask:
    """Whether joints hold any load without current, (J,)."""
    position = load.series.position[0]
    ends = [chain.holding(sign * _GREAT + 0.0 * position, position).current for sign in (-1, 1)]
    return np.all([end == 0.0 for end in ends], axis=0)
