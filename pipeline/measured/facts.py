"""What is known of a robot whose power was measured, and what is not: one TOML file each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field, Strict

from actuators.checked import Number, Table, Text, checked
from pipeline.errors import RobotFileError
from pipeline.robot.robot_file import read_toml

#: One file for each robot, in the order in which tables and page tell them.
FACTS: Final = Path(__file__).parent / "facts"


class Spring(Table):
    """A spring beside joints."""

    joints: Text  #: End of their names.
    stiffness: Number  #: [N*m/rad].
    rest: Number = 0.0  #: Where it gives no torque [rad].


class Way(Table):
    """One of the ways in which something that is not published may be."""

    name: Text  #: In words.
    set: dict[str, Any] = Field(default={})  #: Numbers that differ, as ``--set`` takes them.
    forces: str = ""  #: Rule of the ground's forces, where it decides that.
    spread: Number = 1.0  #: Factor on the feet's distance from the middle of the body [1].
    spring: Spring | None = None  #: Beside joints.
    #: Whether what standing takes counts as idle; motion is what is over it.
    less_standing: bool = False


class Unknown(Table):
    """Something that decides the power and is not published."""

    name: Text  #: In words.
    #: Ways in which it may be, the likeliest first.
    way: Annotated[tuple[Way, ...], Strict(False)] = ()
    #: Instead, numbers of the actuator files, which go to the ends of their intervals together.
    numbers: Annotated[tuple[str, ...], Strict(False)] = ()


class Quantity(Table):
    """A power that was measured."""

    name: Text  #: What of the robot.
    #: Measured [W]; least and greatest where a range is told, none where it was not.
    watts: Annotated[tuple[Number, ...], Strict(False), Field(max_length=2)] = ()
    #: What is computed for it; nothing where the model says nothing of it.
    does: Literal["walk", "stand", ""] = ""
    set: dict[str, Any] = Field(default={})  #: Numbers that differ, as ``--set`` takes them.
    spring: Spring | None = None  #: Beside joints.
    note: str = ""  #: What a reader should know of it.


class Ratio(Table):
    """A quotient of two powers, in which much of what is not known cancels."""

    name: Text  #: In words.
    over: Text  #: Name of a quantity.
    under: Text  #: Of another.
    measured: Number | None = None  #: Their quotient [1]; None to take it of their watts.
    note: str = ""  #: What a reader should know of it.


class Facts(Table):
    """A robot whose power was measured."""

    title: Text  #: Which robot.
    order: int  #: Place among the others.
    robot: Text  #: Its robot file, from the folder of robots.
    actuator: Text  #: Alternative as which it is built.
    source: Text  #: Who measured.
    note: str = ""  #: What stands for what.
    regeneration: str = "none"  #: What becomes of returned energy.
    #: Numbers as they were at the measurement, as ``--set`` takes them.
    set: dict[str, Any] = Field(default={})
    unknown: Annotated[tuple[Unknown, ...], Strict(False)]  #: What is not published.
    #: What was measured.
    quantity: Annotated[tuple[Quantity, ...], Strict(False), Field(min_length=1)]
    ratio: Annotated[tuple[Ratio, ...], Strict(False)] = ()  #: Quotients.


def read_facts(folder: Path = FACTS) -> Mapping[str, Facts]:
    """Every robot of a folder by the name of its file, in order.

    Raises:
        RobotFileError: There is none, or a file cannot be used; one line says where.
    """
    found = {}
    for path in sorted(folder.glob("*.toml")):
        facts = checked(Facts, read_toml(path), path.name, RobotFileError)
        names = [q.name for q in facts.quantity]
        for ratio in facts.ratio:
            if {ratio.over, ratio.under} - set(names):
                raise RobotFileError(f"{path.name}: ratio '{ratio.name}' is of no quantity here")
        for unknown in facts.unknown:
            if bool(unknown.way) == bool(unknown.numbers) or len(unknown.way) == 1:
                raise RobotFileError(
                    f"{path.name}: unknown '{unknown.name}': expected two ways or more, or numbers"
                )
        found[path.stem] = facts
    if not found:
        raise RobotFileError(f"{folder}: no files of measured robots")
    return dict(sorted(found.items(), key=lambda item: item[1].order))
