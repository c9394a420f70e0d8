"""The page of any robot, and its gait, motors and limits in a few words."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from actuators.loading.build import Catalog
from pipeline.machine.own_actuators import Motors
from pipeline.motion.gait import gait_of, gait_table
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine
from reports.page import Block, FigureBlock, Number, Page, Section, files_of, table_block
from reports.typeset import number

if TYPE_CHECKING:
    from pandas import DataFrame

#: Rows of a long table that a page shows.
_ROWS = 24
PICTURE = FigureBlock("electrical_energy", "Electrical energy of one cycle by joint.")
_INPUTS = ("group", "parameter", "value", "unit", "basis", "source")


def robot_page(
    given: Machine, tables: Mapping[str, DataFrame], remarks: Sequence[str] = ()
) -> Page:
    """The page; its figures are those of `pipeline.api.figures`."""
    whose = motors_text(given.motors)
    limits = limits_text(tables, short_titles(given.catalog), given.forces.friction_coefficient)
    stated = given.motors.stated
    stability = table_block(tables, "walking_stability", caption="By set of standing feet.")
    inertia: tuple[Block, ...] = ()
    if "quasi_static_torque" in tables:
        caption = "Largest torque of every joint, and what the links' inertia adds."
        inertia = (table_block(tables, "quasi_static_torque", caption=caption),)
    frame = tables["motor_limits"]
    share = (frame["peak"] / frame["limit"])[frame["breach"].astype(bool)]
    worst = share.sort_values(ascending=False, kind="stable").index[:_ROWS]
    first: Block = "No motor leaves its data sheet; `motor_limits.csv` has every peak."
    if share.size:
        caption = f"Motors beyond their data sheet: {worst.size} of {share.size} rows."
        first = table_block(
            tables, "motor_limits", keep=frame.index.isin(worst).tolist(), caption=caption
        )
    titles = short_titles(given.catalog)
    figures = (FigureBlock(f"motor_limits_{n}", f"Motors of the {t}.") for n, t in titles.items())
    sections = (
        *((Section("Notes", (tuple(remarks),)),) if remarks else ()),
        Section("What it costs", energy_blocks(given, tables)),
        Section("The robot and its gait", gait_blocks(f"{given.robot.spec.name}, standing.")),
        Section("Torque, ground forces, stability", (stability, *torque_blocks(given), *inertia)),
        Section("Motors against their data sheets", (first, *figures)),
        Section(
            "Standing still",
            (
                table_block(tables, "standing_energy", caption="By leg."),
                table_block(
                    tables,
                    "standing_contacts",
                    caption="Feet and ground forces.",
                ),
            ),
        ),
        Section("What went in", (inputs_block(tables),)),
    )
    return Page(
        title=f"What it costs to actuate {given.robot.spec.name}, "
        f"{gait_and_conditions(given.robot.spec)}",
        notices=limits if stated else (whose, *limits),
        numbers=_numbers(given, tables),
        picture=PICTURE,
        answer=((whose,) if stated else ()) + _answer(given, tables),
        sections=sections,
        files=files_of(tables),
    )


def _numbers(given: Machine, tables: Mapping[str, DataFrame]) -> tuple[Number, ...]:
    """Power, the motors' mass, friction, and the limit that is nearest."""
    energy, titles = tables["robot_energy"], short_titles(given.catalog)
    powers = dict(zip(energy["alternative"], energy["average_power_W"], strict=True))
    powers = {n: p for n, p in powers.items() if n == given.own.usual} or powers
    ends = dict.fromkeys((min(powers, key=powers.__getitem__), max(powers, key=powers.__getitem__)))
    motors, (_, friction) = given.motors, greatest_friction(tables)
    frame = tables["motor_limits"]
    share = frame["peak"] / frame["limit"]
    nearest = frame.iloc[share.argmax()]
    return (
        Number(
            f"{' to '.join(number(powers[n]) for n in ends)} W",
            f"to walk, by type of drive: {' to '.join(titles[n] for n in ends)}",
        ),
        Number(
            f"{number(motors.total)} kg" if motors.total else "\N{EN DASH}",
            f"these motors; the robot's file says {number(motors.robot)} kg in all"
            if motors.total
            else "the motors' mass, which their files do not state",
            "bad" if motors.too_heavy else "quiet",
        ),
        Number(
            number(friction),
            "coefficient of friction that the feet need",
            "bad" if slips(friction, given.forces.friction_coefficient) else "good",
        ),
        Number(
            f"{100 * share.max():.0f} %",
            f"of the motor's {nearest['quantity'].replace('_', ' ')} limit, `{nearest['joint']}`",
            "bad" if share.max() > 1 else "good",
        ),
    )


def _answer(given: Machine, tables: Mapping[str, DataFrame]) -> tuple[str, ...]:
    """What walks and how, and what of the numbers is fitted, assumed or known."""
    robot, gait, c = given.robot, gait_of(given.robot.spec), tables["parameters"]
    joints = sorted({len(leg.joints) for leg in robot.spec.legs})
    held = len(robot.joints) - sum(len(leg.joints) for leg in robot.spec.legs)
    pace = f"{number(gait.speed)} m/s, period {number(gait.period)} s"
    own = zip(c["group"], c["basis"], strict=True)
    count = Counter(str(basis) for group, basis in own if group != robot.spec.name)
    effects = ", ".join(given.effects.names) if given.effects else ""
    return (
        f"**{robot.spec.name}**: {number(given.edited.mass)} kg, {len(robot.leg_names)} legs of "
        f"{' or '.join(map(str, joints))} joints{f', {held} joints held outside them' * (held > 0)}"
        f"; {', '.join((gait.title, pace, *conditions(robot.spec)))}"
        f"{', the body sways to keep its balance' if gait.margin is not None else ''}.",
        f"**Fitted to this robot:** {f'{effects}, by the model file' if effects else 'nothing'}. "
        "Every watt is predicted for these motors and no others; nothing that was measured on this "
        "robot is on this page.",
        "**Numbers of the actuators by what they rest on:** "
        f"{', '.join(f'{n} {basis}' for basis, n in count.most_common())}"
        f"{'; calibrated ones were fitted to another machine' * ('calibrated' in count)}. Bodies "
        "and joints are the URDF's. Every number with its source is under What went in.",
    )


def energy_blocks(given: Machine, tables: Mapping[str, DataFrame]) -> tuple[Block, ...]:
    """Energy by alternative, leg and stage; first what the alternatives' names stand for."""
    leg, titles = shown_leg(given.robot), short_titles(given.catalog)
    shown = tables["walking_energy"]["leg"].isin((leg, "robot"))
    return (
        "Alternatives, ways to build the actuators of all joints: "
        f"{'; '.join(f'`{name}` {title}' for name, title in titles.items())}. Shown: "
        f"{leg_words(leg)}, its joints in order from the body outward; `robot` is all of it.",
        table_block(tables, "robot_energy", caption="The whole robot, walking."),
        table_block(
            tables,
            "walking_energy",
            keep=shown,
            caption="Energy drawn from the supply in one walking cycle.",
        ),
        *(
            FigureBlock(f"stage_energy_{name}", f"Stages of the {title}.")
            for name, title in titles.items()
            if name not in ("ideal", "rotor")
        ),
    )


def gait_blocks(robot: str) -> tuple[Block, ...]:
    """The gait in motion and in print, and the robot."""
    return (
        FigureBlock("robot", robot),
        FigureBlock("zero_pose", "Zero pose and positive directions."),
        FigureBlock("gait", "Foot paths, support polygons, footfall."),
    )


def torque_blocks(given: Machine, first_figure: int = 0) -> tuple[Block, ...]:
    """Torque of all joints and of those of the shown leg, and ground forces.

    Args:
        first_figure: Number of the paper's figure that shows joint 1; 0 for none.
    """
    leg = shown_leg(given.robot)
    joints = next(entry.joints for entry in given.robot.spec.legs if entry.name == leg)
    return (
        FigureBlock("joint_torques", "Torque of every joint, all legs."),
        FigureBlock("ground_forces", "Ground forces of all feet, margin of stability."),
        *(
            FigureBlock(
                f"joint_demand_{joint}",
                f"Joint {k + 1} of the {leg_words(leg)}: `{joint}`"
                + (f", as in Fig. {first_figure + k}." if first_figure else "."),
            )
            for k, joint in enumerate(joints)
        ),
    )


def inputs_block(tables: Mapping[str, DataFrame]) -> Block:
    """Every number that went in, with its source."""
    return table_block(tables, "parameters", _INPUTS, caption="Every number that went in.")


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
