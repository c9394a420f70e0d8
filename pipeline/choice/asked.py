"""What stays the same while a choice settles, and the searches that it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Final

from actuators.elements.position_torque import ParallelSpring
from actuators.loading.parts import Part, load_parts
from actuators.supply.battery import Battery
from actuators.supply.from_parts import battery_of
from pipeline.choice.doubt import Design, Doubt, doubt, drawn, drawn_machines, effects_of
from pipeline.choice.errors import ChoiceError
from pipeline.choice.group import Found, groups_of, search
from pipeline.choice.loads import Load, loads_of
from pipeline.choice.missions.mission import Mode
from pipeline.choice.parts.designs import Designs
from pipeline.choice.parts.shelf import Shelf, named
from pipeline.choice.search import Demanded, Feedback
from pipeline.choice.settle import NUDGE, Robots
from pipeline.choice.springs import found_springs, springs_of
from pipeline.choice.track import Account
from pipeline.choice.wanted import Wanted, filtered

if TYPE_CHECKING:
    from pipeline.api.machine import Machine


_SEARCHES: Final = 4  # of all designs, each with drawn values of all parts
_FEW: Final = 8  # draws of a design while it is settled


@dataclass(frozen=True, eq=False)
class Asked:
    """What stays the same while mass is fed back: robot, day, parts and what is counted."""

    machine: Machine  #: The robot.
    modes: Sequence[Mode]  #: Of the mission.
    groups: Mapping[str, tuple[str, ...]]  #: Joints of each group.
    shelf: Shelf  #: The parts.
    account: Account  #: What is counted.
    present: float  #: Mass of an actuator that the bodies hold already [kg].
    pack: Part  #: The battery.
    energy: float | None = None  #: Of it, in place of its part's [J].
    on_base: float = 0.0  #: Mass on the base beside what the bodies hold [kg].
    spring: ParallelSpring | None = None  #: Beside the actuators of all joints; None without any.

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
        robots: Robots,
    ) -> dict[str, Doubt]:
        """Every group's candidates in draws of what is not printed, and of found effects."""
        effects = effects_of(self.machine)
        days = [
            (
                values,
                loads_of(
                    *(own, self.modes, self.added(robots.mass)),
                    along=robots.loads,
                    spring=self.spring,
                ),
            )
            for values, own in drawn_machines(self.machine)
        ]
        out = {}
        for g, f in found.items():
            each = [(x, Demanded.of(g, self.groups[g], loads)) for x, loads in days]
            out[g] = doubt(
                *(f.demanded, self.shelf, candidates[g], self.account, price[g]),
                draws=draws,
                effects=effects,
                found=each,
            )
        return out

    def added(self, mass: Mapping[str, float]) -> dict[str, float]:
        """What the bodies do not hold, by joint, with masses of one actuator of each group [kg]."""
        out = {j: mass[g] - self.present for g, joints in self.groups.items() for j in joints}
        base = self.machine.ready.robot.model.names[1]
        return out | ({base: self.on_base} if self.on_base else {})

    def robots(self, mass: Mapping[str, float]) -> Robots:
        """All robots about masses of one actuator of each group [kg]."""
        added = self.added(mass)
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


def asked_of(machine: Machine, modes: Sequence[Mode], wanted: Wanted) -> Asked:
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
    asked = Asked(
        *(machine, modes, groups, shelf, wanted.account, present, pack, wanted.battery),
        spring=springs_of(robot.joints, wanted.springs),
    )
    if wanted.present_battery is None or not robot.floating:
        return asked
    return replace(asked, on_base=asked.pack_mass - wanted.present_battery)
