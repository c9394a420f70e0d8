"""What stays the same while a choice settles: robot, day, parts and what is counted."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cache, cached_property
from pathlib import Path
from typing import Final

import numpy as np

from actuators.elements.position_torque import ParallelSpring
from actuators.errors import LegwattError, closest, one_line
from actuators.loading.data_sheet import Number
from actuators.loading.parts import DRIVER, PACK, PARTS, Part, load_parts
from actuators.supply import Battery, battery_of
from actuators.units import quantity
from pipeline.api.machine import Machine
from pipeline.choice.doubt import Design, drawn
from pipeline.choice.group import Found, groups_of, search
from pipeline.choice.loads import Load
from pipeline.choice.missions.mission import Mode
from pipeline.choice.parts.designs import Designs
from pipeline.choice.parts.shelf import GEARS, Shelf, named
from pipeline.choice.search import Demanded, Feedback
from pipeline.choice.track import Account

_FEW: Final = 8  # draws of a design while it is settled
#: Dimensions of a spring's stiffness and angle without torque.
_SPRING: Final = ("rotational stiffness", "angle")


@dataclass(frozen=True, eq=False)
class Asked:
    """What stays the same while mass is fed back."""

    machine: Machine
    modes: Sequence[Mode]
    groups: Mapping[str, tuple[str, ...]]  #: Joints of each group.
    shelf: Shelf
    account: Account
    present: float  #: Mass of an actuator that the bodies hold already [kg].
    pack: Part  #: The battery.
    energy: float | None = None  #: Of it, in place of its part's [J].
    on_base: float = 0.0  #: Mass on the base beside what the bodies hold [kg].
    spring: ParallelSpring | None = None  #: Beside the actuators of all joints; None without any.

    def demanded(self, loads: Sequence[Load]) -> dict[str, Demanded]:
        """Every group's part of a day."""
        return {g: Demanded.of(g, joints, loads) for g, joints in self.groups.items()}

    def searched(
        self, designs: Designs, loads: Sequence[Load], price: Mapping[str, Feedback]
    ) -> dict[str, Found]:
        """Every group's search."""
        each = self.demanded(loads).items()
        return {g: search(own, designs, self.account, price[g]) for g, own in each}

    def battery(self, answer: Mapping[str, Design]) -> Battery:
        """At the highest voltage of an answer's groups."""
        sheet = {entry: number.value for entry, number in self.pack.printed.items()}
        bus = float(self.shelf.designs([*answer.values()]).bus.max())
        return battery_of(self.pack.name, sheet, energy=self.energy, voltage=bus)

    def masses(self, answer: Mapping[str, Design]) -> dict[str, float]:
        """Of one actuator of each group [kg]."""
        return {g: float(self.shelf.designs([answer[g]]).mass[0]) for g in self.groups}

    def added(self, mass: Mapping[str, float]) -> dict[str, float]:
        """What the bodies do not hold, by joint, with masses of one actuator of each group [kg]."""
        out = {j: mass[g] - self.present for g, joints in self.groups.items() for j in joints}
        base = self.machine.ready.robot.model.names[1]
        return out | ({base: self.on_base} if self.on_base else {})

    @cached_property
    def draws(self) -> Callable[[Design], Designs]:
        """A design in the middle of its ranges and in some draws of them."""

        @cache
        def made(design: Design) -> Designs:
            sheets = drawn(self.shelf, [design], _FEW)[2]
            return Designs.together([self.shelf.designs([design], x) for x in ({}, *sheets)])

        return made


def asked_of(machine: Machine, modes: Sequence[Mode], wanted: Wanted) -> Asked:
    """What stays the same; parts that are named have to be there."""
    robot = machine.ready.robot
    if robot.sliding_joints:
        raise LegwattError(f"joint '{robot.sliding_joints[0]}' slides; the parts here turn")
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
    sheet = {entry: number.value for entry, number in pack.printed.items()}
    if not {"mass", "specific_energy"} & sheet.keys():
        raise LegwattError(f"--present-battery: part '{pack.name}' states no mass")
    any_voltage = {"voltage": 1.0} | sheet
    mass = battery_of(pack.name, any_voltage, energy=wanted.battery).mass
    return replace(asked, on_base=mass - wanted.present_battery)


def springs_of(joints: Sequence[str], given: Sequence[str]) -> ParallelSpring | None:
    """The springs beside the actuators of all joints; None without any.

    One of stiffness k without torque at q0 acts -k (q - q0) on the joint, so that the actuator
    gives tau + k (q - q0).

    Args:
        joints: Of the robot, in order.
        given: ``PATTERN=STIFFNESS@ANGLE`` each, with units.

    Raises:
        LegwattError: It is written otherwise, a number or unit is wrong, or its pattern fits no
            joint, or one that has a spring.
    """
    stiffness, rest = np.zeros(len(joints)), np.zeros(len(joints))
    for text in given:
        pattern, _, numbers = text.partition("=")
        which = np.array([fnmatchcase(joint, pattern) for joint in joints])
        if not which.any():
            hint = closest(pattern, joints)
            raise LegwattError(f"--spring {one_line(text)}: no joint '{pattern}': {hint}")
        if numbers.count("@") != 1:
            form = "'PATTERN=STIFFNESS@ANGLE', such as '*_knee=3 N*m/rad@40 deg'; none is searched"
            raise LegwattError(f"--spring {one_line(text)}: expected {form}")
        if (stiffness[which] != 0.0).any():
            raise LegwattError(f"--spring {one_line(text)}: a joint of it has a spring already")
        try:
            k, q = (quantity(x, kind) for x, kind in zip(numbers.split("@"), _SPRING, strict=True))
        except LegwattError as error:
            raise LegwattError(f"--spring {one_line(text)}: {error}") from None
        if k <= 0.0:
            raise LegwattError(f"--spring {one_line(text)}: the stiffness has to be above 0")
        stiffness[which], rest[which] = k, q
    return ParallelSpring("spring", stiffness, rest) if stiffness.any() else None


@dataclass(frozen=True)
class Wanted:
    """What is searched, and what is counted."""

    parts: Path = PARTS  #: Folder of parts.
    kinds: tuple[str, ...] = ()  #: Kinds of gears; all where empty.
    #: Names of which a design's motors and gears must be, or begin with; all where empty.
    only: tuple[str, ...] = ()
    without: tuple[str, ...] = ()  #: Names that no part may be, or begin with.
    #: Of the supply: motors for less are left out [V]; by default that of each motor.
    voltage: float | None = None
    driver: str = DRIVER  #: Part that drives every motor.
    idle: Number | None = None  #: Of a driver that is on, in place of its part's [W].
    brakes: bool = True  #: Whether brakes are among the parts.
    #: ``NAME=PATTERN,...``; by default joints that are alike in all legs.
    groups: tuple[str, ...] = ()
    account: Account = field(default_factory=Account)  #: Hotel load, returned energy.
    pack: str = PACK  #: Part that is the battery.
    battery: float | None = None  #: Energy of it when full, in place of its part's [J].
    #: Mass of an actuator, with its driver, that the robot's bodies hold already, each joint's
    #: [kg]; by default that of the motors of its actuator files.
    present: float | None = None
    #: Mass of a battery that they hold already [kg]; by default the pack's own.
    present_battery: float | None = None
    #: ``PATTERN=STIFFNESS@ANGLE`` of springs beside the actuators of some joints.
    springs: tuple[str, ...] = ()
    draws: int = 256  #: Over what is not printed.


def filtered(parts: Mapping[str, Part], wanted: Wanted) -> dict[str, Part]:
    """Parts that the options leave.

    Raises:
        LegwattError: A name is no part's, nor the beginning of one's. A kind is none of a gear.
    """
    for name in (*wanted.only, *wanted.without):
        if not any(part.startswith(name) for part in parts):
            near = closest(name, [*parts])  # not 195 names
            near = "`pipeline components` lists them" if near.startswith("known") else near
            raise LegwattError(f"no part '{one_line(name)}', nor one that begins so: {near}")
    for kind in wanted.kinds:
        if kind not in GEARS:
            raise LegwattError(f"--kind {kind}: {closest(kind, GEARS)}")
    kinds = {n: "gear" if part.kind in GEARS else part.kind for n, part in parts.items()}
    # A filter of motors alone leaves all gears, and brakes are not filtered by it.
    narrowed = {kinds[n] for n in parts if n.startswith(wanted.only)} & {"motor", "gear"}
    return {
        n: part
        for n, part in parts.items()
        if kinds[n] in ("motor", "gear", "brake")
        and not n.startswith(wanted.without)
        and (kinds[n] != "gear" or not wanted.kinds or part.kind in wanted.kinds)
        and (kinds[n] not in narrowed or n.startswith(wanted.only))
    }
