"""What is known of a robot whose power was measured, and what is not: one TOML file each."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field, Strict

from actuators.checked import Number, Table, Text, checked
from pipeline.dynamics.force_rules import LEAST_TANGENTIAL
from pipeline.errors import RobotFileError
from pipeline.robot.robot_file import read_toml

#: One file for each robot, in the order in which tables and page tell them.
FACTS: Final = Path(__file__).parent / "facts"


class Spring(Table):
    """A spring beside joints.

    Attributes:
        joints: End of their names.
        stiffness: [N*m/rad].
        rest: Where it gives no torque [rad].
    """

    joints: Text
    stiffness: Number
    rest: Number = 0.0


class Way(Table):
    """One of the ways in which something that is not published may be.

    Attributes:
        name: In words.
        set: Numbers that differ, as ``--set`` takes them.
        forces: Rule of the ground's forces, where it decides that.
        spread: Factor on the feet's distance from the middle of the body [1].
        spring: Beside joints.
        less_standing: Whether what standing takes counts as idle; motion is what is over it.
    """

    name: Text
    set: dict[str, Any] = Field(default={})
    forces: str = ""
    spread: Number = 1.0
    spring: Spring | None = None
    less_standing: bool = False


class Unknown(Table):
    """Something that decides the power and is not published.

    Attributes:
        name: In words.
        way: Ways in which it may be, the likeliest first.
        numbers: Instead, numbers of the actuator files, which go to the ends of their intervals
            together.
    """

    name: Text
    way: Annotated[tuple[Way, ...], Strict(False)] = ()
    numbers: Annotated[tuple[str, ...], Strict(False)] = ()


class Quantity(Table):
    """A power that was measured.

    Attributes:
        name: What of the robot.
        watts: Measured [W]; least and greatest where a range is told, none where it was not.
        does: What is computed for it; nothing where the model says nothing of it.
        set: Numbers that differ, as ``--set`` takes them.
        spring: Beside joints.
        note: What a reader should know of it.
    """

    name: Text
    watts: Annotated[tuple[Number, ...], Strict(False), Field(max_length=2)] = ()
    does: Literal["walk", "stand", ""] = ""
    set: dict[str, Any] = Field(default={})
    spring: Spring | None = None
    note: str = ""


class Ratio(Table):
    """A quotient of two powers, in which much of what is not known cancels.

    Attributes:
        name: In words.
        over: Name of a quantity.
        under: Of another.
        measured: Their quotient [1]; None to take it of their watts.
        note: What a reader should know of it.
    """

    name: Text
    over: Text
    under: Text
    measured: Number | None = None
    note: str = ""


class Facts(Table):
    """A robot whose power was measured.

    Attributes:
        title: Which robot.
        order: Place among the others.
        robot: Its robot file, from the folder of robots.
        actuator: Alternative as which it is built.
        source: Who measured.
        note: What stands for what.
        regeneration: What becomes of returned energy.
        set: Numbers as they were at the measurement, as ``--set`` takes them.
        unknown: What is not published.
        quantity: What was measured.
        ratio: Quotients.
    """

    title: Text
    order: int
    robot: Text
    actuator: Text
    source: Text
    note: str = ""
    regeneration: str = "none"
    set: dict[str, Any] = Field(default={})
    unknown: Annotated[tuple[Unknown, ...], Strict(False)]
    quantity: Annotated[tuple[Quantity, ...], Strict(False), Field(min_length=1)]
    ratio: Annotated[tuple[Ratio, ...], Strict(False)] = ()


#: Where nothing is said of the ground's forces.
USUAL_FORCES: Final = LEAST_TANGENTIAL


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
