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
    """What is searched, and what is counted.

    Attributes:
        parts: Folder of parts.
        kinds: Kinds of gears; all where empty.
        only: Names of which a design's motors and gears must be, or begin with; all where empty.
        without: Names that no part may be, or begin with.
        voltage: Of the supply: motors for less are left out [V]; by default that of each motor.
        driver: Part that drives every motor.
        idle: Of a driver that is on, in place of its part's [W].
        brakes: Whether brakes are among the parts.
        groups: ``NAME=PATTERN,...``; by default joints that are alike in all legs.
        account: Hotel load, returned energy.
        pack: Part that is the battery.
        battery: Energy of it when full, in place of its part's [J].
        present: Mass of an actuator, with its driver, that the robot's bodies hold already, each
            joint's [kg]; by default that of the motors of its actuator files.
        present_battery: Mass of a battery that they hold already [kg]; by default the pack's own.
        springs: ``PATTERN=STIFFNESS@ANGLE`` of springs beside the actuators of some joints; a
            PATTERN alone is for one that is to be found.
        draws: Over what is not printed.
    """

    parts: Path = PARTS
    kinds: tuple[str, ...] = ()
    only: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    voltage: float | None = None
    driver: str = DRIVER
    idle: Number | None = None
    brakes: bool = True
    groups: tuple[str, ...] = ()
    account: Account = field(default_factory=Account)
    pack: str = PACK
    battery: float | None = None
    present: float | None = None
    present_battery: float | None = None
    springs: tuple[str, ...] = ()
    draws: int = 256


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
