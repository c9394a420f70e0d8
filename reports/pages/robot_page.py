"""The page of any robot: what it costs, torque, ground forces, stability, limits, what went in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from pipeline.motion.gait import gait_of
from pipeline.simulation.settings import Settings
from reports.page import Block, FigureBlock, Number, Page, Section, files_of, table_block
from reports.pages.robot_words import (
    conditions,
    gait_and_conditions,
    greatest_friction,
    leg_words,
    limits_text,
    motors_text,
    short_titles,
    shown_leg,
    slips,
)
from reports.table import Table
from reports.typeset import number

#: Rows of a long table that a page shows.
_ROWS = 24
PICTURE = FigureBlock("electrical_energy", "Electrical energy of one cycle by joint.")
_INPUTS = ("group", "parameter", "value", "unit", "basis", "source")


def robot_page(given: Settings, tables: Mapping[str, Table], remarks: Sequence[str] = ()) -> Page:
    """The page; its figures are those of `pipeline.api.figures`."""
    whose = motors_text(given.motors)
    limits = limits_text(tables, short_titles(given.catalog), given.forces.friction_coefficient)
    stated = given.motors.stated
    stability = table_block(tables["walking_stability"], caption="By set of standing feet.")
    inertia: tuple[Block, ...] = ()
    if "quasi_static_torque" in tables:
        caption = "Largest torque of every joint, and what the links' inertia adds."
        inertia = (table_block(tables["quasi_static_torque"], caption=caption),)
    table = tables["motor_limits"]
    frame = table.frame()
    share = (frame["peak"] / frame["limit"])[frame["breach"].astype(bool)]
    worst = share.sort_values(ascending=False, kind="stable").index[:_ROWS]
    first: Block = "No motor leaves its data sheet; `motor_limits.csv` has every peak."
    if share.size:
        caption = f"Motors beyond their data sheet: {worst.size} of {share.size} rows."
        first = table_block(table, keep=frame.index.isin(worst).tolist(), caption=caption)
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
                table_block(tables["standing_energy"], caption="By leg."),
                table_block(tables["standing_contacts"], caption="Feet and ground forces."),
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
        files=files_of(tables.values()),
    )


def _numbers(given: Settings, tables: Mapping[str, Table]) -> tuple[Number, ...]:
    """Power, the motors' mass, friction, and the limit that is nearest."""
    energy, titles = tables["robot_energy"].columns, short_titles(given.catalog)
    powers = dict(zip(energy["alternative"], energy["average_power_W"], strict=True))
    powers = {n: p for n, p in powers.items() if n == given.own.usual} or powers
    ends = dict.fromkeys((min(powers, key=powers.__getitem__), max(powers, key=powers.__getitem__)))
    motors, (_, friction) = given.motors, greatest_friction(tables)
    frame = tables["motor_limits"].frame()
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


def _answer(given: Settings, tables: Mapping[str, Table]) -> tuple[str, ...]:
    """What walks and how, and what of the numbers is fitted, assumed or known."""
    robot, gait, c = given.robot, gait_of(given.robot.spec), tables["parameters"].columns
    joints = sorted({len(leg.joints) for leg in robot.spec.legs})
    held = len(robot.joints) - sum(len(leg.joints) for leg in robot.spec.legs)
    pace = f"{number(gait.speed)} m/s, period {number(gait.period)} s"
    own = zip(c["group"], c["basis"], strict=True)
    count = Counter(str(basis) for group, basis in own if group != robot.spec.name)
    effects = ", ".join(given.effects.names) if given.effects else ""
    return (
        f"**{robot.spec.name}**: {number(given.machine.mass)} kg, {len(robot.leg_names)} legs of "
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


def energy_blocks(given: Settings, tables: Mapping[str, Table]) -> tuple[Block, ...]:
    """Energy by alternative, leg and stage; first what the alternatives' names stand for."""
    leg, titles = shown_leg(given.robot), short_titles(given.catalog)
    shown = [name in (leg, "robot") for name in tables["walking_energy"].columns["leg"]]
    return (
        "Alternatives, ways to build the actuators of all joints: "
        f"{'; '.join(f'`{name}` {title}' for name, title in titles.items())}. Shown: "
        f"{leg_words(leg)}, its joints in order from the body outward; `robot` is all of it.",
        table_block(tables["robot_energy"], caption="The whole robot, walking."),
        table_block(
            tables["walking_energy"],
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


def torque_blocks(given: Settings, first_figure: int = 0) -> tuple[Block, ...]:
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


def inputs_block(tables: Mapping[str, Table]) -> Block:
    """Every number that went in, with its source."""
    return table_block(tables["parameters"], _INPUTS, caption="Every number that went in.")
