"""The page of any robot: what it costs, torque, ground forces, stability, limits, what went in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipeline.machine.own_actuators import Motors
from pipeline.motion.footfall import OWN
from pipeline.motion.gait import Gait, gait_of
from pipeline.simulation.settings import Settings
from reports.page import FOOTER, FigureBlock, Number, Page, files_of
from reports.pages.robot_words import (
    ROBOT,
    conditions,
    gait_and_conditions,
    greatest_friction,
    leg_words,
    limits_text,
    motors_text,
    names_text,
    pace,
    short_titles,
    shown_leg,
    slips,
    tightest,
)
from reports.table import Table
from reports.typeset import number
from reports.words import Shown, Words, sections

#: Rows of a long table that a page shows.
_ROWS = 24


def robot_page(
    given: Settings, tables: Mapping[str, Table], out: Path, remarks: Sequence[str] = ()
) -> Page:
    """The page.

    Args:
        out: Folder; the figures must be there before it is written.
    """
    robot, motors = given.robot, given.motors
    titles, friction = short_titles(given.catalog), given.forces.friction_coefficient
    whose, limits = motors_text(motors), limits_text(tables, titles, friction)
    run, stable, over = Run(given, tables), _stability(tables["walking_stability"]), _over(tables)
    return Page(
        title=f"What it costs to actuate {robot.spec.name}, {gait_and_conditions(robot.spec)}",
        notices=limits if motors.stated else (whose, *limits),
        numbers=_numbers_first(given, motors, tables),
        picture=first_picture(out),
        answer=((whose,) if motors.stated else ()) + _answer(given, tables),
        sections=sections(SECTIONS.text("robot", run, remarks, stable, *over), run, out),
        files=files_of(tables.values()),
        footer=FOOTER,
    )


def first_picture(out: Path) -> FigureBlock:
    """The picture at first sight."""
    file = out / "electrical_energy.svg"
    return FigureBlock(file, alt="Electrical energy of one cycle by alternative and joint.")


def _numbers_first(
    given: Settings, motors: Motors, tables: Mapping[str, Table]
) -> tuple[Number, ...]:
    """Power, the motors' mass, friction, and the limit that is nearest."""
    energy, titles = tables["robot_energy"].columns, short_titles(given.catalog)
    powers = dict(zip(energy["alternative"], energy["average_power_W"], strict=True))
    powers = {n: p for n, p in powers.items() if n == given.own.usual} or powers
    least, most = min(powers, key=powers.__getitem__), max(powers, key=powers.__getitem__)
    ends = dict.fromkeys((least, most))
    _, friction = greatest_friction(tables)
    joint, quantity, share = tightest(tables["motor_limits"])
    return (
        Number(
            f"{' to '.join(number(powers[n]) for n in ends)} W",
            f"to walk, by type of drive: {' to '.join(titles[n] for n in ends)}",
        ),
        Number(
            f"{number(motors.total)} kg" if motors.total else "\N{EN DASH}",
            f"would these motors weigh; the robot's file says {number(motors.robot)} kg in all"
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
            f"{100 * share:.0f} %",
            f"of the motor's {quantity.replace('_', ' ')} limit, `{joint}`",
            "bad" if share > 1 else "good",
        ),
    )


def _answer(given: Settings, tables: Mapping[str, Table]) -> tuple[str, ...]:
    """A sentence each on the walk, its cost, what was fitted and predicted, and what is known."""
    robot, energy, c = given.robot, tables["robot_energy"].columns, tables["parameters"].columns
    joints = [len(leg.joints) for leg in robot.spec.legs]
    held, titles = len(robot.joints) - sum(joints), short_titles(given.catalog)
    powers = zip(energy["alternative"], energy["average_power_W"], strict=True)
    groups = zip(c["group"], c["basis"], strict=True)
    own = [str(basis) for group, basis in groups if group != robot.spec.name]
    count = Counter(own)
    effects = given.effects.names if given.effects else ()
    return (
        ROBOT("walks", given, sorted(set(joints)), held, _walk(given, gait_of(robot.spec))),
        ROBOT("costs", [(titles[name], power) for name, power in powers]),
        ROBOT("fitted", effects, count["calibrated"] + count["identified"], len(own)),
        ROBOT("predicted"),
        ROBOT(
            "known", count["datasheet"] + count["published"] + count["derived"], count["assumed"]
        ),
    )


def _walk(given: Settings, gait: Gait) -> str:
    """The gait, how fast, where to, on what ground, with what load, and whether it sways."""
    article = "its" if gait.footfall.name == OWN else "the"
    said = [f"{article} {gait.title} {pace(gait)}", *conditions(given.robot.spec)]
    if gait.margin is not None:
        said.append("its body swaying to keep its balance")
    return ", ".join(said)


def _stability(table: Table) -> str:
    frame = table.frame()
    worst = frame.iloc[frame["least_margin_m"].argmin()]
    least = worst[["least_margin_m", "segment", "at_time_s"]]
    return ROBOT("stability", *least, frame["least_normal_force_N"].min())


class Run(Shown):
    """What the sections of a run's page are about."""

    def __init__(self, given: Settings, tables: Mapping[str, Table]) -> None:
        """Collect it."""
        super().__init__(tables)
        robot, leg = given.robot, shown_leg(given.robot)
        self.robot, self.leg = robot.spec.name, leg_words(leg)
        self.names, self.titles = names_text(given), short_titles(given.catalog)
        self.joints = next(entry.joints for entry in robot.spec.legs if entry.name == leg)
        legs = tables["walking_energy"].columns["leg"]
        self.rows_of_leg = [name in (leg, "robot") for name in legs]


def _over(tables: Mapping[str, Table]) -> tuple[list[bool], int]:
    """The worst rows of motors beyond their data sheet, none where all is well; of how many."""
    frame = tables["motor_limits"].frame()
    share = (frame["peak"] / frame["limit"])[frame["breach"].astype(bool)]
    worst = share.sort_values(ascending=False, kind="stable").index[:_ROWS]
    return (frame.index.isin(worst).tolist() if worst.size else []), share.size


SECTIONS = Words("run")
