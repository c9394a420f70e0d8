"""The page of any robot, and its gait, motors and limits in a few words."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuators.loading.build import Catalog
from pipeline.machine.own_actuators import Motors
from pipeline.motion.gait import gait_of, gait_table
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine
from reports.page import write_page
from reports.typeset import number

if TYPE_CHECKING:
    from pandas import DataFrame

#: Rows of a long table that a page shows.
_ROWS = 24


def write_robot_page(
    given: Machine, tables: Mapping[str, DataFrame], remarks: Sequence[str], folder: Path
) -> None:
    """Write ``index.html`` of any robot; its figures are those of `reports.figures.run`."""
    whose, spec = motors_text(given.motors), given.robot.spec
    limits = limits_text(tables, short_titles(given.catalog), given.forces.friction_coefficient)
    stated = given.motors.stated
    write_page(
        "robot",
        folder,
        tables,
        title=f"What it costs to actuate {spec.name}, {gait_and_conditions(spec)}",
        notices=limits if stated else (whose, *limits),
        answer=(whose,) if stated else (),
        remarks=remarks,
        **robot_facts(given, tables),
    )


def robot_facts(given: Machine, tables: Mapping[str, DataFrame]) -> dict[str, Any]:
    """What `templates/robot.html` shows of a run beside its tables."""
    titles, leg = short_titles(given.catalog), shown_leg(given.robot)
    energy, limits = tables["robot_energy"], tables["motor_limits"]
    powers = dict(zip(energy["alternative"], energy["average_power_W"], strict=True))
    powers = {n: p for n, p in powers.items() if n == given.own.usual} or powers
    ends = dict.fromkeys((min(powers, key=powers.__getitem__), max(powers, key=powers.__getitem__)))
    share = limits["peak"] / limits["limit"]
    nearest = limits.iloc[share.argmax()]
    over = share[limits["breach"].astype(bool)].sort_values(ascending=False, kind="stable")
    _, friction = greatest_friction(tables)
    robot, gait, inputs = given.robot, gait_of(given.robot.spec), tables["parameters"]
    actuators = inputs[inputs["group"] != robot.spec.name]
    return {
        "robot": robot.spec.name,
        "mass": given.edited.mass,
        "legs": len(robot.leg_names),
        "depths": sorted({len(one.joints) for one in robot.spec.legs}),
        "held": len(robot.joints) - sum(len(one.joints) for one in robot.spec.legs),
        "gait": gait,
        "conditions": conditions(robot.spec),
        "effects": given.effects.names if given.effects else (),
        "bases": Counter(map(str, actuators["basis"])).most_common(),
        "titles": titles,
        "powers": {titles[n]: number(powers[n]) for n in ends},
        "motors": given.motors,
        "friction": friction,
        "slips": slips(friction, given.forces.friction_coefficient),
        "nearest": {
            "share": float(share.max()),
            "quantity": str(nearest["quantity"]).replace("_", " "),
            "joint": nearest["joint"],
        },
        "leg": leg_words(leg),
        "joints": next(one.joints for one in given.robot.spec.legs if one.name == leg),
        "shown_legs": tables["walking_energy"]["leg"].isin((leg, "robot")),
        "breaches": over.size,
        "worst": limits.index.isin(over.index[:_ROWS]).tolist(),
    }


#: Coefficient of friction of dry ground of which no robot file states one: handbooks print 0.6 to
#: 1.0 for rubber on dry concrete.
DRY_GROUND = 1.0
#: The leg the paper follows; the first leg of a robot that has no such leg.
SHOWN_LEG = "rm"
#: What the letters of the paper's leg names stand for, the side first.
_SIDES = {"l": "left", "r": "right"}
_PLACES = {"f": "front", "m": "middle", "r": "rear"}


def conditions(spec: RobotSpec) -> tuple[str, ...]:
    """What is not as usual: other than straight ahead on level ground without a load.

    Returns:
        Phrases, for a subtitle or a sentence; none where all is as usual.
    """
    table, gait = gait_table(spec), gait_of(spec)
    ahead, left, turn = gait.twist
    heading = math.degrees(math.atan2(left, ahead)) if gait.speed else 0.0
    slopes = math.degrees(table.slope_forward), math.degrees(table.slope_left)
    every = (
        ("heading", heading, "°", ("to the left", "to the right")),
        ("turning", turn, " rad/s", ("to the left", "to the right")),
        ("ground rising", slopes[0], "°", ("ahead", "behind")),
        ("ground rising", slopes[1], "°", ("to the left", "to the right")),
        ("payload", table.payload_mass, " kg", ("", "")),
    )
    return tuple(
        f"{what} {number(abs(size))}{unit} {way[size < 0]}".rstrip()
        for what, value, unit, way in every
        if (size := round(float(value), 6))  # without the round-off of the way through radians
    )


def gait_and_conditions(spec: RobotSpec) -> str:
    """The gait's title with what is not as usual."""
    return ", ".join((gait_of(spec).title, *conditions(spec)))


def motors_text(motors: Motors, whose: str = "") -> str:
    """Which motors drive the joints, what they weigh, and how to put in others.

    Args:
        whose: Where they come from, where robot file and command line do not state them.
    """
    assumed = not (motors.stated or whose)
    first = f"{whose or 'as stated for this robot'},"
    if assumed:
        first = "none are stated for this robot; assumed at every joint is the catalogue's"
    known = motors.mass[1] > 0
    mass = f", {_span(motors.mass)} kg each" if known else ", whose files state no `mass`"
    titles, ratio = " or ".join(motors.titles), _span(motors.ratio)
    text = f"**Whose motors:** {first} {titles} at {ratio}:1{mass}."
    if motors.total:
        text += (
            f" All {motors.joints} weigh **{number(motors.total)} kg** without gears, the robot "
            f"{number(motors.robot)} kg."
        )
    if assumed and motors.too_heavy:
        text += (
            " The assumed motors weigh more than the robot they would move: no watt below is that "
            "of a machine that can be built."
        )
    if assumed:
        text += (
            " Put in your own: `python -m pipeline init-actuator`, then `--actuators FOLDER`, or "
            "`[actuators]` in the robot file."
        )
    return text


def _span(ends: tuple[float, float]) -> str:
    return " to ".join(dict.fromkeys(number(end) for end in ends))


def limits_text(
    tables: Mapping[str, DataFrame], titles: Mapping[str, str], friction: float | None
) -> tuple[str, ...]:
    """What motors and ground cannot give; a line for each of the two, none where all is well.

    Args:
        tables: Of the run; those that it lacks are passed over.
        titles: Alternative to its title.
        friction: Coefficient of the ground; None where nothing states one.
    """
    asks = []
    for verb, name in (("walking", "motor_limits"), ("standing", "standing_limits")):
        if name in tables:
            every = tables[name]
            over = []
            for quantity, rows in every[every["breach"].astype(bool)].groupby(
                "quantity", sort=False
            ):
                # Of alternatives that are alike the first, whatever their last digits are.
                worst = rows.iloc[(rows["peak"] / rows["limit"]).round(9).argmax()]
                unit = worst["unit"]
                count, of = (own["alternative"].nunique() for own in (rows, every))
                others = f", {count} of {of} alternatives" if of > 1 else ""
                over.append(
                    f"{str(quantity).replace('_', ' ')} {number(worst['peak'])} {unit}, limit "
                    f"{number(worst['limit'])} {unit} (`{worst['joint']}`, "
                    f"{titles[worst['alternative']]}{others})"
                )
            asks += [f"{verb} takes {'; '.join(over)}"] if over else []
    out = [f"**Beyond the motors:** {'; '.join(asks)}."] if asks else []
    foot, needed = greatest_friction(tables)
    if slips(needed, friction):
        out.append(
            f"**Beyond the ground:** leg `{foot}` needs a coefficient of friction of "
            f"**{number(needed)}** by this rule of forces, dry ground seldom offers more than "
            f"{number(DRY_GROUND)}; `--friction-coefficient 0.8` looks for forces within it, or "
            "says that the robot slides."
        )
    return tuple(out)


def slips(needed: float, friction: float | None) -> bool:
    """Whether feet need more than dry ground gives; a stated friction has bound the forces."""
    return friction is None and needed > DRY_GROUND


def greatest_friction(tables: Mapping[str, DataFrame]) -> tuple[str, float]:
    """The leg that needs the most friction, walking or standing, and its coefficient [1]."""
    found: list[tuple[str, float]] = []
    for name, leg, needed in (
        ("walking_stability", "foot_of_greatest_friction", "greatest_friction_needed"),
        ("standing_contacts", "foot", "friction_needed"),
    ):
        if name in tables:
            known = tables[name][[leg, needed]].dropna()
            found += known.itertuples(index=False, name=None)
    return max(found, key=lambda f: f[1], default=("", 0.0))


def shown_leg(robot: Robot) -> str:
    """The leg whose figures are drawn."""
    return SHOWN_LEG if SHOWN_LEG in robot.leg_names else robot.leg_names[0]


def leg_words(leg: str) -> str:
    """A leg's name with what it says: ``rm`` is the middle right leg."""
    if len(leg) == 2 and leg[0] in _SIDES and leg[1] in _PLACES:
        return f"{_PLACES[leg[1]]} {_SIDES[leg[0]]} leg ({leg})"
    return f"leg {leg}"


def short_titles(catalog: Catalog) -> dict[str, str]:
    """Every alternative's title without its number; where two are alike, with the name."""
    titles = {n: a.title.split(": ", 1)[-1] for n, a in catalog.alternatives.items()}
    seen = Counter(titles.values())
    return {n: title if seen[title] == 1 else f"{title} ({n})" for n, title in titles.items()}
