"""What is searched and what is counted: the options of a choice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from actuators.errors import CatalogError, closest, one_line
from actuators.loading.data_sheet import Number
from actuators.loading.parts import DRIVER, PACK, PARTS, Part
from pipeline.choice.errors import ChoiceError
from pipeline.choice.parts.shelf import GEARS
from pipeline.choice.track import Account


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
    #: ``PATTERN=STIFFNESS@ANGLE`` of springs beside the actuators of some joints; a PATTERN alone
    #: is for one that is to be found.
    springs: tuple[str, ...] = ()
    draws: int = 256  #: Over what is not printed.


def filtered(parts: Mapping[str, Part], wanted: Wanted) -> dict[str, Part]:
    """Parts that the options leave.

    Raises:
        CatalogError: A name is no part's, nor the beginning of one's.
        ChoiceError: A kind is none of a gear.
    """
    for name in (*wanted.only, *wanted.without):
        if not any(part.startswith(name) for part in parts):
            near = closest(name, [*parts])  # not 195 names
            near = "`pipeline components` lists them" if near.startswith("known") else near
            raise CatalogError(f"no part '{one_line(name)}', nor one that begins so: {near}")
    for kind in wanted.kinds:
        if kind not in GEARS:
            raise ChoiceError(f"--kind {kind}: {closest(kind, GEARS)}")
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
