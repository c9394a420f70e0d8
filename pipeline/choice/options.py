"""Options of a choice, and what stays the same in all of it: robot, day, parts, what is counted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

from pydantic import BeforeValidator, Field, Strict

from actuators.checked import Number as Margin
from actuators.checked import Table, checked
from actuators.energy.energy import recovery
from actuators.errors import LegwattError, closest, one_line
from actuators.loading.data_sheet import Entry, Number, read_entry
from actuators.loading.parts import DRIVER, PACK, PARTS, Part, load_parts
from actuators.supply import Battery, battery_of
from actuators.units import quantity
from pipeline.choice.evaluate import Account
from pipeline.choice.groups import groups_of
from pipeline.choice.mission import Mode
from pipeline.choice.shelf import GEARS, Design, Margins, PartCatalog, named
from pipeline.simulation.machine import Machine


@dataclass(frozen=True, eq=False)
class Problem:
    """What stays the same while mass is fed back."""

    machine: Machine
    modes: Sequence[Mode]
    groups: Mapping[str, tuple[str, ...]]  #: Joints of each group.
    shelf: PartCatalog
    account: Account
    present: float  #: Mass of an actuator that the bodies hold already [kg].
    pack: Part  #: The battery.
    energy: float | None = None  #: Of it, in place of its part's [J].
    standing: str = "drawn"  #: Where in the band of friction joints hold, `ChooseOptions.standing`.
    held_battery: float = 0.0  #: Mass of a battery that the bodies hold already [kg].
    on_base: float = 0.0  #: Mass on the base beside what the bodies hold [kg].

    @property
    def brakes(self) -> list[str]:
        """Names of those on the shelf."""
        return [name for name, part in self.shelf.parts.items() if part.kind == "brake"]

    @property
    def battery(self) -> Battery:
        """On the one bus that there is."""
        sheet = {entry: number.value for entry, number in self.pack.printed.items()}
        return battery_of(self.pack.name, sheet, energy=self.energy, voltage=self.shelf.voltage)

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
    parts = load_parts(wanted.parts)
    driver, pack = named(parts, "driver", wanted.driver), named(parts, "battery", wanted.pack)
    left = filtered(parts, wanted)
    nominal = pack.printed.get("voltage")
    shelf = PartCatalog.of(
        left,
        driver,
        idle=wanted.number("idle"),
        voltage=wanted.value("voltage") or (nominal.value if nominal else None),
        margins=Margins(wanted.margin_torque, wanted.margin_speed),
    )
    motors = machine.motors
    held = motors.mass[0] if motors.stated else 0.0
    stated = wanted.value("present")
    present = held if stated is None else stated
    battery = wanted.value("battery")
    problem = Problem(
        *(machine, modes, groups, shelf, wanted.account, present, pack, battery),
        standing=wanted.standing,
    )
    if not robot.floating:
        return problem
    sheet = {"voltage": 1.0} | {entry: number.value for entry, number in pack.printed.items()}
    mass = battery_of(pack.name, sheet, energy=battery).mass
    own_battery = wanted.value("present_battery")
    if own_battery is None:
        own_battery = mass if mass <= _PACK * machine.edited.mass else 0.0
    elif not mass:
        raise LegwattError(f"present_battery: part '{pack.name}' states no mass")
    return replace(problem, held_battery=own_battery, on_base=mass - own_battery)


#: Share of the robot's mass up to which its bodies may hold the pack: 5 to 20 % of legged robots.
_PACK: Final = 0.25
#: Numbers that are asked for, with their unit in the text.
NUMBERS: Final = {
    "idle": Entry("power", "of a driver that is on", "0.672 W"),
    "hotel": Entry("power", "of the electronics", "10 W"),
    "battery": Entry("energy", "when full, in place of the pack's", "500 Wh"),
    "voltage": Entry("voltage", "of the supply", "48 V"),
    "present": Entry("mass", "of an actuator that the bodies hold already", "0.48 kg"),
    "present_battery": Entry("mass", "of the battery that they hold; the pack if light", "0 kg"),
}


def _said(name: str) -> Any:
    """A number with its unit, as the options hold it; None where nothing is said."""
    entry = NUMBERS[name]
    return Field(default=None, description=f"{entry.kind} {entry.words}, such as '{entry.example}'")


def _names(text: str) -> Any:
    return Field(default=(), description=text)


_Texts = Annotated[tuple[str, ...], Strict(False)]


class ChooseOptions(Table):
    """What is searched, and what is counted; names and defaults are the command line's."""

    noun = "option"
    parts: Annotated[Path, BeforeValidator(lambda value: Path(value))] = Field(
        default=PARTS, description="folder with parts"
    )
    kind: _Texts = _names("kind of gears: these only")
    #: Names of which a design's motors and gears must be, or begin with; all where empty.
    only: _Texts = _names("parts: these only")
    without: _Texts = _names("parts: not these")
    no_brakes: bool = Field(default=False, description="no design with a brake")
    group: _Texts = _names(
        "joints that are built alike, NAME=PATTERN,...; by default those alike in all legs"
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
        default="none",
        description="none, bus, or a fraction of returned energy that is used again",
    )
    objective: Literal["knee", "power", "mass", "price"] = Field(
        default="knee",
        description="which robot of the front is recommended: knee, least power, lightest, or "
        "least price",
    )
    standing: Literal["drawn", "least", "middle", "most"] = Field(
        default="drawn",
        description="where in the band of friction a joint holds at rest; drawn has its middle and "
        "an interval",
    )
    unlisted: bool = Field(
        default=False,
        description="motors on gears that no maker's table lists, too; their fit is not checked",
    )
    margin_torque: Annotated[Margin, Field(ge=1)] = Field(
        default=1.5,
        description="least of permitted over problem torque: gear's peak and continuous, brake's, "
        "motor's continuous",
    )
    margin_speed: Annotated[Margin, Field(ge=1)] = Field(
        default=1.15, description="least of permitted over problem speed, and of the voltage for it"
    )
    draws: Annotated[int, Field(ge=8, le=100_000)] = Field(
        default=128, description="of what is not known"
    )

    @classmethod
    def of(cls, **options: Any) -> Self:
        """Options by name; numbers may be text with a unit.

        Raises:
            LegwattError: One does not exist or is out of range.
        """
        given = {name: value for name, value in options.items() if value is not None}
        made = checked(cls, given, "choose")
        for name in NUMBERS:
            made.number(name)
        _ = made.account
        return made

    def number(self, name: str) -> Number | None:
        """One of `NUMBERS`, SI; None where nothing is said."""
        words = getattr(self, name)
        if words is None:
            return None
        nothing = words == "0" or (words[:1] == "0" and not quantity(words, NUMBERS[name].kind))
        if nothing and name not in ("voltage", "battery"):
            return Number(0.0, 0.0, 0.0, "1", "0")
        return read_entry(name, words, NUMBERS)

    def value(self, name: str) -> float | None:
        """The same as a float."""
        number = self.number(name)
        return None if number is None else number.value

    @property
    def account(self) -> Account:
        """Hotel load and returned energy."""
        return Account(self.value("hotel") or 0.0, *recovery(self.regeneration))


def filtered(parts: Mapping[str, Part], wanted: ChooseOptions) -> dict[str, Part]:
    """Parts that the options leave.

    Raises:
        LegwattError: A name is no part's, nor the beginning of one's. A kind is none of a gear.
    """
    for name in (*wanted.only, *wanted.without):
        if not any(part.startswith(name) for part in parts):
            near = closest(name, [*parts])  # not 195 names
            near = "`pipeline components` lists them" if near.startswith("known") else near
            raise LegwattError(f"no part '{one_line(name)}', nor one that begins so: {near}")
    for kind in wanted.kind:
        if kind not in GEARS:
            raise LegwattError(f"kind {kind}: {closest(kind, GEARS)}")
    kinds = {n: "gear" if part.kind in GEARS else part.kind for n, part in parts.items()}
    # A filter of motors alone leaves all gears, and brakes are not filtered by it.
    narrowed = {kinds[n] for n in parts if n.startswith(wanted.only)} & {"motor", "gear"}
    return {
        n: part
        for n, part in parts.items()
        if kinds[n] in ("motor", "gear", *(() if wanted.no_brakes else ("brake",)))
        and not n.startswith(wanted.without)
        and (kinds[n] != "gear" or not wanted.kind or part.kind in wanted.kind)
        and (kinds[n] not in narrowed or n.startswith(wanted.only))
    }
