"""The choice: groups searched one by one, mass fed back, winners drawn and recomputed in full."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from actuators.chain import ChainResult
from actuators.energy.regeneration import supply
from actuators.errors import CatalogError, closest
from actuators.loading.parts import PARTS, Part, load_parts
from pipeline.choice.designs import Designs
from pipeline.choice.doubt import Design, Doubt, doubt, drawn
from pipeline.choice.errors import ChoiceError
from pipeline.choice.group import Found, groups_of, merged, search
from pipeline.choice.loads import Load, loads_of
from pipeline.choice.mission import Mode
from pipeline.choice.search import Account, Demanded, Feedback
from pipeline.choice.settle import NUDGE, Robots
from pipeline.choice.shelf import GEARS, Shelf, combinations
from pipeline.machine.drivetrains import Drivetrains
from pipeline.machine.joint import JointModel, joints_of
from pipeline.progress import Progress

if TYPE_CHECKING:
    from pipeline.api.machine import Machine

Array = NDArray[np.float64]
#: Rounds of mass fed back, at most; two or three settle it.
_ROUNDS: Final = 5
_POOL: Final = 8  # designs of each search, by score and by mass, among which a robot is settled
_SEARCHES: Final = 4  # of all designs, each with drawn values of all parts
_FEW: Final = 8  # draws of a design while it is settled


@dataclass(frozen=True)
class Wanted:
    """What is searched, and what is counted.

    Attributes:
        parts: Folder of parts.
        kinds: Kinds of gears; all where empty.
        only: Names of which a design's motors and gears must be, or begin with; all where empty.
        without: Names that no part may be, or begin with.
        voltage: Of the supply: motors for less are left out [V].
        brakes: Whether brakes are among the parts.
        groups: ``NAME=PATTERN,...``; by default joints that are alike in all legs.
        account: Idle power, hotel load, returned energy.
        battery: Energy of the robot's battery [W*h].
        present: Mass of an actuator that the robot's bodies hold already, each joint's [kg]; by
            default that of the motors of its actuator files.
        draws: Over what is not printed.
    """

    parts: Path = PARTS
    kinds: tuple[str, ...] = ()
    only: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    voltage: float | None = None
    brakes: bool = True
    groups: tuple[str, ...] = ()
    account: Account = field(default_factory=Account)
    battery: float | None = None
    present: float | None = None
    draws: int = 256


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
        first: What the first search, before mass was fed back, took the answer's power for [W].
        present: Mass of an actuator that the bodies hold already [kg].
        shelf: The parts.
    """

    machine: Machine
    wanted: Wanted
    loads: Sequence[Load]
    found: Mapping[str, Found]
    candidates: Mapping[str, list[Design]]
    doubts: Mapping[str, Doubt]
    answer: Mapping[str, Design]
    first: Mapping[str, float]
    present: float
    shelf: Shelf

    @property
    def hours(self) -> float:
        """Of the mission in a day [h]."""
        return sum(load.mode.hours for load in self.loads)

    def designs(self, group: str) -> Designs:
        """The answer of one group, as one design."""
        return self.shelf.designs([self.answer[group]])

    def battery_hours(self, power: float) -> float | None:
        """On one charge [h]."""
        return self.wanted.battery / power if self.wanted.battery and power > 0 else None

    def full(self, load: Load) -> tuple[ChainResult, Array, Array]:
        """One mode through the chains of the answer; see `through`."""
        return through(
            load,
            {g: (f.demanded.joints, self.designs(g)) for g, f in self.found.items()},
            self.wanted.account,
        )

    def robots(self) -> tuple[Array, Array, NDArray[np.intp]]:
        """Front of robots: power with hotel load [W], mass [kg], design of each group."""
        fronts = [(f.score[f.front], f.mass[f.front]) for f in self.found.values()]
        power, mass, taken = merged(fronts)
        return power + self.wanted.account.hotel, mass, taken


def through(
    load: Load, built: Mapping[str, tuple[tuple[str, ...], Designs]], account: Account
) -> tuple[ChainResult, Array, Array]:
    """One mode through full chains: result, mean power out of the supply [W], drivers on, (J,).

    Args:
        load: The mode.
        built: Joints of each group, and their one design.
        account: What is counted; drivers that are on are, the hotel load is not.
    """
    mode, names = load.mode, load.series.joints
    models: dict[str, JointModel] = {}
    locks: dict[str, bool] = {}
    for joints, design in built.values():
        engaged = not mode.stands or mode.hold == "brake"
        chain = design.chain(0, engaged=engaged)
        models |= {model.name: model for model in joints_of(chain, joints)}
        locks |= dict.fromkeys(joints, bool(design.locks(engaged)[0]))
    result = Drivetrains("answer", tuple(models[j] for j in names)).moving(load.series)
    share = account.recovered
    out = supply(result, "fraction" if share else "none", share).supplied_energy / load.duration
    free = ~np.array([locks[joint] for joint in names])
    on = np.where(mode.drivers | free | (result.current != 0.0).any(axis=0), 1.0, 0.0)
    return result, out + account.idle * on, on


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
    robot = machine.ready.robot
    if robot.sliding_joints:
        raise ChoiceError(f"joint '{robot.sliding_joints[0]}' slides; the parts here turn")
    groups = groups_of(robot.spec, wanted.groups)
    shelf = Shelf.of(filtered(load_parts(wanted.parts), wanted))
    every = combinations(shelf, brakes=wanted.brakes, voltage=wanted.voltage)
    designs = shelf.designs(every)
    held = machine.ready.motors.mass[0]
    present = held if wanted.present is None else wanted.present
    told("the mission's demand")
    asked = _Asked(machine, modes, groups, shelf, wanted.account, present)
    robots = asked.robots(dict.fromkeys(groups, present))
    price = dict.fromkeys(groups, Feedback())
    answer: dict[str, Design] = {}
    pool: dict[str, dict[Design, None]] = {g: {} for g in groups}
    first: dict[str, float] = {}
    for turn in range(_ROUNDS):
        told(f"{len(every)} designs for each of {len(groups)} groups, round {turn + 1}")
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
        machine, wanted, robots.loads, found, candidates, doubts, answer, first, present, shelf
    )


def _candidates(answer: Design, found: Found, pool: Iterable[Design]) -> list[Design]:
    return list(dict.fromkeys([answer, *_named(found, found.finalists), *pool]))


def _named(found: Found, which: Sequence[int] | NDArray[np.intp]) -> list[Design]:
    return [found.designs.parts[i] for i in found.looked[which]]


def filtered(parts: Mapping[str, Part], wanted: Wanted) -> dict[str, Part]:
    """Parts that the options leave.

    Raises:
        CatalogError: A name is no part's, nor the beginning of one's.
        ChoiceError: A kind is none of a gear.
    """
    for name in (*wanted.only, *wanted.without):
        if not any(part.startswith(name) for part in parts):
            raise CatalogError(f"no part '{name}': {closest(name, [*parts])}")
    for kind in wanted.kinds:
        if kind not in GEARS:
            raise ChoiceError(f"--kind {kind}: {closest(kind, GEARS)}")
    named = {kind: False for kind in ("motor", "gear")}
    for name, part in parts.items():
        what = "gear" if part.kind in GEARS else part.kind
        if what in named and name.startswith(wanted.only or ("\0",)):
            named[what] = True  # a filter of motors alone leaves all gears

    def kept(name: str, part: Part) -> bool:
        what = "gear" if part.kind in GEARS else part.kind
        if what not in (*named, "brake") or (wanted.without and name.startswith(wanted.without)):
            return False
        if what == "gear" and wanted.kinds and part.kind not in wanted.kinds:
            return False
        return not named.get(what) or name.startswith(wanted.only)

    return {name: part for name, part in parts.items() if kept(name, part)}


@dataclass(frozen=True, eq=False)
class _Asked:
    """What stays the same while mass is fed back."""

    machine: Machine
    modes: Sequence[Mode]
    groups: Mapping[str, tuple[str, ...]]
    shelf: Shelf
    account: Account
    present: float

    def searched(
        self, designs: Designs, loads: Sequence[Load], price: Mapping[str, Feedback]
    ) -> dict[str, Found]:
        """Every group's search."""
        return {
            g: search(Demanded.of(g, joints, loads), designs, self.account, price[g])
            for g, joints in self.groups.items()
        }

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
        loads = loads_of(self.machine, self.modes, added)
        nudged = {
            g: loads_of(
                self.machine,
                self.modes,
                {j: m + NUDGE * (j in joints) for j, m in added.items()},
                along=loads,
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
