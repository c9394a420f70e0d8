"""The choice: groups searched one by one, mass fed back, winners drawn and recomputed in full."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from actuators.elements.position_torque import ParallelSpring
from actuators.loading.parts import Part, load_parts
from actuators.supply.battery import Battery
from actuators.supply.from_parts import battery_of
from pipeline.choice.answer.full import Full, through
from pipeline.choice.doubt import Design, Doubt, doubt, drawn
from pipeline.choice.errors import ChoiceError
from pipeline.choice.group import Found, groups_of, merged, search
from pipeline.choice.loads import Load, loads_of
from pipeline.choice.mission import Mode
from pipeline.choice.parts.designs import Designs
from pipeline.choice.parts.shelf import Shelf, combinations, named
from pipeline.choice.search import Demanded, Feedback
from pipeline.choice.settle import NUDGE, Robots
from pipeline.choice.springs import found_springs, springs_of
from pipeline.choice.track import Account
from pipeline.choice.wanted import Wanted, filtered
from pipeline.progress import Progress

if TYPE_CHECKING:
    from pipeline.api.machine import Machine

Array = NDArray[np.float64]
#: Rounds of mass fed back, at most; two or three settle it.
_ROUNDS: Final = 5
_POOL: Final = 8  # designs of each search, by score and by mass, among which a robot is settled
_SEARCHES: Final = 4  # of all designs, each with drawn values of all parts
_FEW: Final = 8  # draws of a design while it is settled


@dataclass(frozen=True, eq=False)
class Chosen:
    """The answer.

    Attributes:
        machine: The robot.
        wanted: What was asked.
        loads: The mission's modes, with the answer's masses in the robot.
        found: The search of each group.
        candidates: Designs of each group that are drawn: the answer, the best by the middle of
            every range, and those among which the answer settled.
        doubts: Draws over the candidates of each group.
        answer: Design of each group.
        sides: The best of each group that can be driven back, ``reversible``, and that locks by a
            gear or a closed brake, ``irreversible``; the answer's where none is within limits.
            Each with its own demand.
        first: What the first search, before mass was fed back, took the answer's power for [W].
        present: Mass of an actuator that the bodies hold already [kg].
        spring: Beside the actuators of all joints; None without any.
        shelf: The parts.
        battery: Of the answer, at the highest voltage of its groups.
    """

    machine: Machine
    wanted: Wanted
    loads: Sequence[Load]
    found: Mapping[str, Found]
    candidates: Mapping[str, list[Design]]
    doubts: Mapping[str, Doubt]
    answer: Mapping[str, Design]
    sides: Mapping[str, tuple[Mapping[str, Design], Sequence[Load]]]
    first: Mapping[str, float]
    present: float
    spring: ParallelSpring | None
    shelf: Shelf
    battery: Battery

    @property
    def hours(self) -> float:
        """Of the mission in a day [h]."""
        return sum(load.mode.hours for load in self.loads)

    def designs(self, group: str) -> Designs:
        """The answer of one group, as one design."""
        return self.shelf.designs([self.answer[group]])

    @cached_property
    def day(self) -> list[Full]:
        """Every mode through the chains of the answer."""
        return self.through(self.answer, self.loads)

    def through(self, robot: Mapping[str, Design], loads: Sequence[Load]) -> list[Full]:
        """Every mode through full chains."""
        built = {
            g: (f.demanded.joints, self.shelf.designs([robot[g]])) for g, f in self.found.items()
        }
        return [through(load, built, self.wanted.account) for load in loads]

    @property
    def least_voltage(self) -> float:
        """Of the supply, below which a driver stops or gives a motor less than it needs [V]."""
        sheet = self.shelf.numbers[self.shelf.driver]
        out = sheet["least_voltage"].value if "least_voltage" in sheet else 0.0
        for g, f in self.found.items():
            design = self.designs(g)
            use = f.demanded.limits(design)["voltage"] * design.bus
            out = max(out, float(use[0]))
        return out

    def robots(self) -> tuple[Array, Array, NDArray[np.intp]]:
        """Front of robots: power with hotel load [W], mass [kg], design of each group."""
        fronts = [(f.score[f.front], f.mass[f.front]) for f in self.found.values()]
        power, mass, taken = merged(fronts)
        return power + self.wanted.account.hotel, mass, taken


def choose(
    machine: Machine,
    modes: Sequence[Mode],
    wanted: Wanted | None = None,
    progress: Progress | None = None,
) -> Chosen:
    """Which motor, gear and brake for each group of joints.

    Args:
        machine: From `load`.
        modes: Of the mission.
        wanted: What is searched and counted.
        progress: Told of each step.

    Raises:
        PipelineError: A mode cannot be done, or no design is within limits.
        ActuatorError: Parts cannot be read.
    """
    wanted = wanted or Wanted()
    told = progress.step if progress else lambda words: None
    asked = _asked(machine, modes, wanted)
    every = combinations(asked.shelf, brakes=wanted.brakes)
    designs = asked.shelf.designs(every)
    if any("=" not in text for text in wanted.springs):
        wanted = replace(wanted, springs=asked.springs(designs, wanted.springs))
        asked = _asked(machine, modes, wanted)
    told("the mission's demand")
    robots = asked.robots(dict.fromkeys(asked.groups, asked.present))
    price = dict.fromkeys(asked.groups, Feedback())
    answer: dict[str, Design] = {}
    pool: dict[str, dict[Design, None]] = {g: {} for g in asked.groups}
    first: dict[str, float] = {}
    for turn in range(_ROUNDS):
        told(f"{len(every)} designs for each of {len(asked.groups)} groups, round {turn + 1}")
        found = asked.searched(designs, robots.loads, price)
        first = first or {g: float(f.power[f.finalists[0]]) for g, f in found.items()}
        for g, f in found.items():
            pool[g] |= dict.fromkeys(_named(f, [*f.finalists[:_POOL], *f.front[:_POOL]]))
        if turn == 1:  # with masses that are near
            for g, f in asked.drawn(every, robots.loads, price):
                pool[g] |= dict.fromkeys(_named(f, f.finalists[:_POOL]))
        start = answer or {g: _named(f, f.finalists)[0] for g, f in found.items()}
        better = robots.settled(start, pool)
        if better == answer:
            break
        answer = better
        robots = asked.robots(asked.masses(answer))
        price = robots.prices(answer)
    asked.check(answer, robots)
    found = asked.searched(designs, robots.loads, price)
    told("draws over what no sheet prints")
    candidates = {g: _candidates(answer[g], f, pool[g]) for g, f in found.items()}
    doubts = asked.doubts(found, candidates, price, wanted.draws)
    return Chosen(
        *(machine, wanted, robots.loads, found, candidates, doubts, answer),
        *(asked.sides(answer, found, price, robots), first, asked.present),
        spring=asked.spring,
        shelf=asked.shelf,
        battery=asked.battery(answer),
    )


def _asked(machine: Machine, modes: Sequence[Mode], wanted: Wanted) -> _Asked:
    """What stays the same; parts that are named have to be there."""
    robot = machine.ready.robot
    if robot.sliding_joints:
        raise ChoiceError(f"joint '{robot.sliding_joints[0]}' slides; the parts here turn")
    groups = groups_of(robot.spec, wanted.groups)
    parts = load_parts(wanted.parts)
    driver, pack = named(parts, "driver", wanted.driver), named(parts, "battery", wanted.pack)
    left = filtered(parts, wanted)
    shelf = Shelf.of(left, driver, idle=wanted.idle, voltage=wanted.voltage)
    held = machine.ready.motors.mass[0]
    present = held if wanted.present is None else wanted.present
    asked = _Asked(
        *(machine, modes, groups, shelf, wanted.account, present, pack, wanted.battery),
        spring=springs_of(robot.joints, wanted.springs),
    )
    if wanted.present_battery is None or not robot.floating:
        return asked
    return replace(asked, on_base=asked.pack_mass - wanted.present_battery)


def _candidates(answer: Design, found: Found, pool: Iterable[Design]) -> list[Design]:
    return list(dict.fromkeys([answer, *_named(found, found.finalists), *pool]))


def _named(found: Found, which: Sequence[int] | NDArray[np.intp]) -> list[Design]:
    return [found.designs.parts[i] for i in found.looked[which]]


@dataclass(frozen=True, eq=False)
class _Asked:
    """What stays the same while mass is fed back."""

    machine: Machine
    modes: Sequence[Mode]
    groups: Mapping[str, tuple[str, ...]]
    shelf: Shelf
    account: Account
    present: float
    pack: Part
    energy: float | None = None
    on_base: float = 0.0
    spring: ParallelSpring | None = None

    def searched(
        self, designs: Designs, loads: Sequence[Load], price: Mapping[str, Feedback]
    ) -> dict[str, Found]:
        """Every group's search."""
        return {
            g: search(Demanded.of(g, joints, loads), designs, self.account, price[g])
            for g, joints in self.groups.items()
        }

    def springs(self, designs: Designs, given: Sequence[str]) -> tuple[str, ...]:
        """Those that are stated, and those of least power; see `found_springs`."""
        robots = self.robots(dict.fromkeys(self.groups, self.present))
        return found_springs(given, self.groups, robots.loads, designs, self.account)

    @property
    def pack_mass(self) -> float:
        """Of the battery [kg].

        Raises:
            ChoiceError: Its file states neither mass nor specific energy.
        """
        sheet = {entry: number.value for entry, number in self.pack.printed.items()}
        if not {"mass", "specific_energy"} & sheet.keys():
            raise ChoiceError(f"--present-battery: part '{self.pack.name}' states no mass")
        any_voltage = {"voltage": 1.0} | sheet
        return battery_of(self.pack.name, any_voltage, energy=self.energy).mass

    def battery(self, answer: Mapping[str, Design]) -> Battery:
        """At the highest voltage of an answer's groups."""
        sheet = {entry: number.value for entry, number in self.pack.printed.items()}
        bus = float(self.shelf.designs([*answer.values()]).bus.max())
        return battery_of(self.pack.name, sheet, energy=self.energy, voltage=bus)

    def sides(
        self,
        answer: Mapping[str, Design],
        found: Mapping[str, Found],
        price: Mapping[str, Feedback],
        robots: Robots,
    ) -> dict[str, tuple[dict[str, Design], list[Load]]]:
        """The best robot that can be driven back, and that locks; see `Chosen`."""
        out = {}
        for name, locked in (("reversible", False), ("irreversible", True)):
            best = {
                g: f.best(f.designs.locks(True) == locked, self.account, price[g]) or answer[g]
                for g, f in found.items()
            }
            out[name] = best, robots.at(self.masses(best))
        return out

    def masses(self, answer: Mapping[str, Design]) -> dict[str, float]:
        """Of one actuator of each group [kg]."""
        return {g: float(self.shelf.designs([answer[g]]).mass[0]) for g in self.groups}

    def drawn(
        self, every: Sequence[Design], loads: Sequence[Load], price: Mapping[str, Feedback]
    ) -> Iterator[tuple[str, Found]]:
        """Every group's search in some draws of all parts."""
        for sheet in drawn(self.shelf, every, _SEARCHES, seed=1)[2]:
            yield from self.searched(self.shelf.designs(every, sheet), loads, price).items()

    def doubts(
        self,
        found: Mapping[str, Found],
        candidates: Mapping[str, Sequence[Design]],
        price: Mapping[str, Feedback],
        draws: int,
    ) -> dict[str, Doubt]:
        """Every group's candidates in draws of what is not printed of them."""
        return {
            g: doubt(f.demanded, self.shelf, candidates[g], self.account, price[g], draws=draws)
            for g, f in found.items()
        }

    def robots(self, mass: Mapping[str, float]) -> Robots:
        """All robots about masses of one actuator of each group [kg]."""
        added = {j: mass[g] - self.present for g, joints in self.groups.items() for j in joints}
        added |= {self.machine.ready.robot.model.names[1]: self.on_base} if self.on_base else {}
        loads = loads_of(self.machine, self.modes, added, spring=self.spring)
        nudged = {
            g: loads_of(
                self.machine,
                self.modes,
                {j: m + NUDGE * (j in joints) for j, m in added.items()},
                along=loads,
                spring=self.spring,
            )
            for g, joints in self.groups.items()
        }
        return Robots(self.groups, mass, loads, nudged, self.account, self.draws)

    @cached_property
    def draws(self) -> Callable[[Design], Designs]:
        """A design in the middle of its ranges and in some draws of them."""

        @cache
        def made(design: Design) -> Designs:
            sheets = drawn(self.shelf, [design], _FEW)[2]
            return Designs.together([self.shelf.designs([design], x) for x in ({}, *sheets)])

        return made

    def check(self, answer: Mapping[str, Design], robots: Robots) -> None:
        """An answer's limits with its own masses and motions.

        Raises:
            ChoiceError: One is exceeded: none was found that stays within all.
        """
        for g, joints in self.groups.items():
            demanded = Demanded.of(g, joints, robots.loads)
            limits = demanded.limits(self.shelf.designs([answer[g]]))
            worst = max(limits, key=lambda name: float(limits[name][0]))
            if limits[worst][0] > 1.0:
                raise ChoiceError(
                    f"no robot found that stays within limits with its own actuators' mass: group "
                    f"'{g}' with {robots.mass[g]:.3g} kg a joint takes {limits[worst][0]:.3g} "
                    f"of its {worst}; add lighter or stronger parts, or state --present"
                )
