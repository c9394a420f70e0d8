"""A robot, its gait and its motors in words, and what a run asks beyond motors and ground."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping

from actuators.loading.build import Catalog
from pipeline.machine.own_actuators import Motors
from pipeline.motion.gait import Gait, gait_of, gait_table
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.settings import Settings
from reports.table import Table
from reports.typeset import number
from reports.words import Words

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


#: Coefficient of friction of dry ground of which no robot file states one: handbooks print 0.6 to
#: 1.0 for rubber on dry concrete.
DRY_GROUND = 1.0
ROBOT = Words("robot")


def motors_text(motors: Motors, whose: str = "") -> str:
    """Which motors drive the joints, what they weigh, and how to put in others.

    Args:
        whose: Where they come from, where robot file and command line do not state them.
    """
    return ROBOT("motors", motors, whose)


def limits_text(
    tables: Mapping[str, Table], titles: Mapping[str, str], friction: float | None
) -> tuple[str, ...]:
    """What motors and ground cannot give; a sentence for each of the two, none where all is well.

    Args:
        tables: Of the run; those that it lacks are passed over.
        titles: Alternative to its title.
        friction: Coefficient of the ground; None where nothing states one.
    """
    asks = []
    for verb, name in (("walking", "motor_limits"), ("standing", "standing_limits")):
        if name in tables:
            over = _breaches(tables[name], titles)
            asks += [f"{verb} takes {'; '.join(over)}"] if over else []
    out = [f"**Beyond the motors:** {'; '.join(asks)}."] if asks else []
    foot, needed = greatest_friction(tables)
    if slips(needed, friction):
        out.append(ROBOT("beyond_ground", foot, needed, DRY_GROUND))
    return tuple(out)


def _breaches(table: Table, titles: Mapping[str, str]) -> list[str]:
    """For each quantity that is exceeded its worst row, and in how many alternatives it is."""
    every = table.frame()
    said = []
    for quantity, rows in every[every["breach"].astype(bool)].groupby("quantity", sort=False):
        # Of alternatives that are alike the first, whatever their last digits are.
        worst = rows.iloc[(rows["peak"] / rows["limit"]).round(9).argmax()]
        of = (quantity, worst["peak"], worst["limit"], worst["joint"], titles[worst["alternative"]])
        counts = (own["alternative"].nunique() for own in (rows, every))
        said.append(ROBOT("breach", *of, *counts))
    return said


def slips(needed: float, friction: float | None) -> bool:
    """Whether feet need more than dry ground gives; a stated friction has bound the forces."""
    return friction is None and needed > DRY_GROUND


def greatest_friction(tables: Mapping[str, Table]) -> tuple[str, float]:
    """The leg that needs the most friction, walking or standing, and its coefficient [1]."""
    found: list[tuple[str, float]] = []
    for name, leg, needed in (
        ("walking_stability", "foot_of_greatest_friction", "greatest_friction_needed"),
        ("standing_contacts", "foot", "friction_needed"),
    ):
        if name in tables:
            known = tables[name].frame()[[leg, needed]].dropna()
            found += known.itertuples(index=False, name=None)
    return max(found, key=lambda f: f[1], default=("", 0.0))


def tightest(table: Table) -> tuple[str, str, float]:
    """The joint and quantity nearest to its limit, and the share of it [1]."""
    frame = table.frame()
    share = frame["peak"] / frame["limit"]
    nearest = frame.iloc[share.argmax()]
    return nearest["joint"], nearest["quantity"], float(share.max())


#: The leg the paper follows; the first leg of a robot that has no such leg.
SHOWN_LEG = "rm"
#: What the letters of the paper's leg names stand for, the side first.
_SIDES = {"l": "left", "r": "right"}
_PLACES = {"f": "front", "m": "middle", "r": "rear"}


def shown_leg(robot: Robot) -> str:
    """The leg whose figures are drawn."""
    return SHOWN_LEG if SHOWN_LEG in robot.leg_names else robot.leg_names[0]


def leg_words(leg: str) -> str:
    """A leg's name with what it says: ``rm`` is the middle right leg."""
    if _is_two_letters(leg):
        return f"{_PLACES[leg[1]]} {_SIDES[leg[0]]} leg ({leg})"
    return f"leg {leg}"


def _is_two_letters(leg: str) -> bool:
    return len(leg) == 2 and leg[0] in _SIDES and leg[1] in _PLACES


def short_titles(catalog: Catalog) -> dict[str, str]:
    """Every alternative's title without its number; where two are alike, with the name."""
    titles = {n: a.title.split(": ", 1)[-1] for n, a in catalog.alternatives.items()}
    seen = Counter(titles.values())
    return {n: title if seen[title] == 1 else f"{title} ({n})" for n, title in titles.items()}


def names_text(given: Settings) -> str:
    """A paragraph for the first place where a reader meets the names."""
    legs = {joint for leg in given.robot.spec.legs for joint in leg.joints}
    outside = set(given.robot.joints) - legs
    titles, count = short_titles(given.catalog), len(given.robot.leg_names)
    return ROBOT("names", titles, legs_text(given.robot), count, bool(outside))


def legs_text(robot: Robot) -> str:
    """What the legs' names say and how their joints are numbered."""
    leg = shown_leg(robot)
    return ROBOT("legs", leg, leg_words(leg).split(" (")[0] if _is_two_letters(leg) else "")
