"""Options of a choice, and what stays the same in all of it: robot, day, parts, what is counted."""

from __future__ import annotations

import fnmatch
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from os.path import commonprefix
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

from pydantic import BeforeValidator, Field, Strict

from actuators.checked import Number as Margin
from actuators.checked import Table, checked
from actuators.energy import Battery, battery_of, recovery
from actuators.errors import LegwattError, closest, one_line
from actuators.loading.data_sheet import GEARS, KINDS, REFUSED, Entry, Number, read_entry
from actuators.loading.parts import DRIVER, PACK, PARTS, Part, load_parts, odd
from pipeline.choice.mission import Mode
from pipeline.choice.shelf import Design, Margins, PartCatalog, named, shipped
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine


@dataclass(frozen=True, eq=False)
class Problem:
    """What stays the same while mass is fed back."""

    machine: Machine
    modes: Sequence[Mode]
    groups: Mapping[str, tuple[str, ...]]  #: Joints of each group.
    shelf: PartCatalog
    present: float  #: Mass of an actuator that the bodies hold already [kg].
    pack: Part  #: The battery.
    wanted: ChooseOptions
    held_battery: float = 0.0  #: Mass of a battery that the bodies hold already [kg].
    on_base: float = 0.0  #: Mass on the base beside what the bodies hold [kg].
    assumed: bool = False  #: Whether no file and no option states `present`.
    #: Motors whose numbers contradict each other, and how.
    left_out: Mapping[str, str] = field(default_factory=dict)

    @property
    def battery(self) -> Battery:
        """On the one bus that there is."""
        sheet = {entry: number.value for entry, number in self.pack.printed.items()}
        energy = self.wanted.value("battery")
        return battery_of(self.pack.name, sheet, energy=energy, voltage=self.shelf.voltage)

    def buyable(self, robot: Sequence[Design]) -> bool:
        """Whether none of its parts is sold inside another product alone."""
        names = {name for design in robot for name in design if name}
        return self.wanted.unlisted or not any(self.shelf.parts[name].built_into for name in names)

    def masses(self, robot: Sequence[Design]) -> dict[str, float]:
        """Of one actuator of each group of a robot [kg]."""
        each = self.shelf.designs(robot).mass.tolist()
        return dict(zip(self.groups, each, strict=True))

    def added(self, mass: Mapping[str, float]) -> dict[str, float]:
        """What the bodies do not hold, by joint, with masses of one actuator of each group [kg]."""
        out = {j: mass[g] - self.present for g, joints in self.groups.items() for j in joints}
        base = self.machine.robot.model.names[1]
        return out | ({base: self.on_base} if self.on_base else {})


def problem_of(machine: Machine, modes: Sequence[Mode], wanted: ChooseOptions) -> Problem:
    """What stays the same; parts that are named have to be there."""
    robot = machine.robot
    if robot.sliding_joints:
        raise LegwattError(f"joint '{robot.sliding_joints[0]}' slides; the parts here turn")
    groups = groups_of(robot.spec, wanted.group)
    parts = shipped() if wanted.parts == PARTS else load_parts(wanted.parts)
    driver, pack = named(parts, "driver", wanted.driver), named(parts, "battery", wanted.pack)
    left = filtered(parts, wanted)
    wrong = {n: odd(part, REFUSED) for n, part in left.items()}
    left_out = {n: "; ".join(words) for n, words in wrong.items() if words}
    left = {n: part for n, part in left.items() if n not in left_out}
    if left_out and not any(part.kind == "motor" for part in left.values()):
        name, words = next(iter(left_out.items()))
        raise LegwattError(f"no motor is left; of {name}, {words}")
    voltage = wanted.number("voltage") or pack.printed.get("voltage")
    if voltage is None:
        raise LegwattError(f"pack: part '{pack.name}' states no voltage; state `voltage`")
    idle, margins = wanted.number("idle"), Margins(wanted.margin_torque, wanted.margin_speed)
    shelf = PartCatalog(left, driver, voltage=voltage.value, idle=idle, margins=margins)
    held = machine.motors.mass[0] if machine.motors.stated else 0.0
    present = wanted.value("present", held or _usual(machine))
    assumed = not held and wanted.present is None
    problem = Problem(
        machine, modes, groups, shelf, present, pack, wanted, assumed=assumed, left_out=left_out
    )
    if not robot.floating:
        return problem
    mass = problem.battery.mass
    light = mass if mass <= _PACK * machine.edited.mass else 0.0
    own_battery = wanted.value("present_battery", light)
    if wanted.present_battery and not mass:
        raise LegwattError(f"present_battery: part '{pack.name}' states no mass")
    return replace(problem, held_battery=own_battery, on_base=mass - own_battery)


def _usual(machine: Machine) -> float:
    """Mass of an actuator [kg] that the bodies of a machine hold whose file states none."""
    model, joints = machine.robot.model, machine.robot.joints
    bearing = Counter(model.parents[model.getJointId(joint)] for joint in joints)
    links = (_OF_LINK * model.inertias[b].mass / count for b, count in bearing.items() if b)
    return min([_OF_ROBOT * machine.edited.mass / len(joints), *links])


#: Share of a robot's mass that its motors are, of robots at hand that state them at least: .22 of
#: the hexapod, .25 of Solo12, motors alone.
_OF_ROBOT: Final = 0.2
#: Share of a link's mass that the actuators on it can be, so that a structure is left (assumed).
_OF_LINK: Final = 0.5
#: Share of the robot's mass up to which its bodies may hold the pack: 5 to 20 % of legged robots.
_PACK: Final = 0.25
#: Numbers that are asked for, with their unit in the text.
NUMBERS: Final = {
    "idle": Entry("power", "of a driver that is on", "0.672 W", 0.0),
    "hotel": Entry("power", "of the electronics", "10 W", 0.0),
    "battery": Entry("energy", "when full, in place of the pack's", "500 Wh"),
    "voltage": Entry("voltage", "of the supply", "48 V"),
    "present": Entry("mass", "of an actuator that the bodies hold already", "0.48 kg", 0.0),
    "present_battery": Entry("mass", "of the battery they hold; the pack if light", "0 kg", 0.0),
}


def _said(name: str) -> Any:
    """A number with its unit, as the options hold it; None where nothing is said."""
    entry = NUMBERS[name]
    return Field(default=None, description=f"{entry.kind} {entry.words}, such as '{entry.example}'")


_Texts = Annotated[tuple[str, ...], Strict(False)]


class ChooseOptions(Table):
    """What is searched, and what is counted; names and defaults are the command line's."""

    noun = "option"
    parts: Annotated[Path, BeforeValidator(lambda value: Path(value))] = Field(
        default=PARTS, description="folder with parts"
    )
    #: Names of parts or kinds, or what names begin with; a kind without any is all there.
    only: _Texts = Field(default=(), description="parts or kinds: of what they are, these only")
    without: _Texts = Field(default=(), description="parts or kinds: not these")
    group: _Texts = Field(
        default=(), description="joints built alike, NAME=PATTERN,...; else those alike in all legs"
    )
    #: By default the driver's own, which few makers print: a range, drawn with all others.
    idle: str | None = _said("idle")
    hotel: str | None = _said("hotel")
    battery: str | None = _said("battery")
    voltage: str | None = _said("voltage")
    present: str | None = _said("present")
    present_battery: str | None = _said("present_battery")
    driver: str = Field(default=DRIVER, description="part that is the driver")
    pack: str = Field(default=PACK, description="part that is the battery")
    regeneration: str = Field(
        default="none", description="none, or a fraction of what a joint returns that is used again"
    )
    objective: Literal["knee", "power", "mass", "price"] = Field(
        default="knee", description="robot of the front that is recommended"
    )
    standing: Literal["drawn", "least", "middle", "most"] = Field(
        default="drawn", description="where in the band of friction a joint holds at rest"
    )
    unlisted: bool = Field(
        default=False, description="pairs that no maker lists, too, and brakes not sold alone"
    )
    margin_torque: Annotated[Margin, Field(ge=1)] = Field(
        default=1.5, description="permitted over asked torque of gear, brake and motor"
    )
    margin_speed: Annotated[Margin, Field(ge=1)] = Field(
        default=1.15, description="permitted over asked speed, and the voltage for it"
    )
    draws: Annotated[int, Field(ge=8, le=100_000)] = Field(
        default=128, description="of what is not known"
    )

    @classmethod
    def of(cls, **options: Any) -> Self:
        """Options by name, numbers with their unit; a LegwattError where one cannot be."""
        given = {name: value for name, value in options.items() if value is not None}
        made = checked(cls, given, "choose")
        _ = made.recovered, [made.number(name) for name in NUMBERS]
        return made

    def number(self, name: str) -> Number | None:
        """One of `NUMBERS`, SI; None where nothing is said."""
        words = getattr(self, name)
        return None if words is None else read_entry(name, words, NUMBERS)

    def value(self, name: str, otherwise: Any = None) -> Any:
        """The same as a float."""
        number = self.number(name)
        return otherwise if number is None else number.value

    @property
    def recovered(self) -> float:
        """Share of what a joint returns that is used again [1]."""
        policy, fraction = recovery(self.regeneration)
        if policy == "bus":  # of robots, not of single joints that a design is weighed by
            raise LegwattError("regeneration bus: expected none or a fraction; a bus is close to 1")
        return fraction


def filtered(parts: Mapping[str, Part], wanted: ChooseOptions) -> dict[str, Part]:
    """Motors, gears and brakes that the options leave; a LegwattError for a name of nothing."""
    for name in (*wanted.only, *wanted.without):
        if not any(_is(part, (name,)) for part in parts.values()):
            near = closest(name, [*KINDS, *parts])
            raise LegwattError(f"no part or kind '{one_line(name)}', or one that begins so: {near}")
    kinds = {n: "gear" if part.kind in GEARS else part.kind for n, part in parts.items()}
    # A filter of motors alone leaves all gears and brakes.
    narrowed = {kinds[n] for n, part in parts.items() if _is(part, wanted.only)}
    return {
        n: part
        for n, part in parts.items()
        if kinds[n] in ("motor", "gear", "brake")
        and not _is(part, wanted.without)
        and (kinds[n] not in narrowed or _is(part, wanted.only))
    }


def _is(part: Part, names: tuple[str, ...]) -> bool:
    return part.kind in names or part.name.startswith(names)


def groups_of(spec: RobotSpec, given: Sequence[str] = ()) -> dict[str, tuple[str, ...]]:
    """Joints that are built alike, by the name of their group.

    By default the first joints of all legs, the second ones, and so on, and those outside the legs
    (each joint without legs); else `given`, ``NAME=PATTERN,PATTERN``.

    Raises:
        LegwattError: A group has no name or no joint, or a joint is in no group or in two.
    """
    out: dict[str, tuple[str, ...]] = {}
    for text in given:
        name, _, patterns = text.partition("=")
        each = [p.strip() for p in patterns.split(",") if p.strip()]
        joints = tuple(j for j in spec.joints if any(fnmatch.fnmatchcase(j, p) for p in each))
        if not name or not joints or name in out:
            raise LegwattError(f"group {text}: expected NAME=PATTERN,PATTERN, each name once")
        out[name] = joints
    if not given:
        for k in range(max((len(leg.joints) for leg in spec.legs), default=0)):
            alike = tuple(leg.joints[k] for leg in spec.legs if k < len(leg.joints))
            out[_shared(alike, f"joint {k + 1}", out)] = alike
        legs = {joint for leg in spec.legs for joint in leg.joints}
        others = tuple(joint for joint in spec.joints if joint not in legs)
        out |= {"held": others} if legs and others else {joint: (joint,) for joint in others}
    for joint in spec.joints:
        if (count := sum(joint in joints for joints in out.values())) != 1:
            raise LegwattError(f"group: joint '{joint}' is in {count} groups, not in one")
    return out


def _shared(joints: Sequence[str], otherwise: str, taken: Mapping[str, object]) -> str:
    """What the names of joints end in, or begin with, alike: whole words of an end."""
    end = commonprefix([joint[::-1] for joint in joints])[::-1]  # noqa: RUF071 (letters are meant)
    begin = commonprefix(joints).strip("_- ")  # noqa: RUF071
    name = re.sub("^[^_-]*[_-]", "", end) or begin
    return otherwise if not name or name in taken else name
