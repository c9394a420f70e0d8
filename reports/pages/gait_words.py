"""How a robot walks, in words: where to, on what ground, with what load."""

from __future__ import annotations

import math

from pipeline.motion.gait import Gait, gait_of, gait_table
from pipeline.robot.robot_file import RobotSpec
from reports.typeset import number

#: Directions that have a name, by quarter turns to the left.
_WAYS = {0: "", 1: "to the left", 2: "backward", 3: "to the right"}


def conditions(spec: RobotSpec) -> tuple[str, ...]:
    """What is not as usual: other than straight ahead on level ground without a load.

    Returns:
        Phrases, for a subtitle or a sentence; none where all is as usual.
    """
    table, gait = gait_table(spec), gait_of(spec)
    said = [_way(gait), _ground(table.slope_forward, table.slope_left)]
    if table.payload_mass:
        said.append(f"with a payload of {number(table.payload_mass)} kg")
    return tuple(words for words in said if words)


def gait_and_conditions(spec: RobotSpec) -> str:
    """The gait's title with what is not as usual."""
    return ", ".join((gait_of(spec).title, *conditions(spec)))


def pace(gait: Gait) -> str:
    """How fast, and how often a step: ``at 0.16 m/s with a period of 3 s``."""
    rate = f"{number(abs(gait.twist[2]))} rad/s" if gait.twist[2] else ""
    if gait.speed:
        fast = f"at {number(gait.speed)} m/s" + (f" and {rate}" if rate else "")
    else:
        fast = f"at {rate}"
    return f"{fast} with a period of {number(gait.period)} s"


def _way(gait: Gait) -> str:
    """Heading and turn; empty straight ahead."""
    turn = "" if not gait.twist[2] else "to the left" if gait.twist[2] > 0 else "to the right"
    if not gait.speed:
        return f"turning on the spot {turn}"
    heading = math.degrees(math.atan2(gait.twist[1], gait.twist[0]))
    quarter = round(heading / 90)
    if abs(heading - 90 * quarter) < 1e-6:
        way = _WAYS[quarter % 4]
    else:
        side = "left" if heading > 0 else "right"
        way = f"{_degrees(heading)}° to the {side} of straight ahead"
    return ", ".join(words for words in (way, f"turning {turn}" if turn else "") if words)


def _ground(forward: float, left: float) -> str:
    said = [
        f"{_degrees(math.degrees(angle))}° {ahead if angle > 0 else behind}"
        for angle, ahead, behind in (
            (forward, "ahead", "behind"),
            (left, "to the left", "to the right"),
        )
        if angle
    ]
    return f"on ground that rises {' and '.join(said)}" if said else ""


def _degrees(angle: float) -> str:
    """Without the round-off of the way through radians."""
    return number(round(abs(angle), 6))
