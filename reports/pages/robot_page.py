"""The page of any robot, and its gait, motors and limits in a few words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actuators.loading.build import Catalog
from pipeline.machine.own_actuators import Motors
from pipeline.motion.gait import gait_of
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine
from reports.page import number, rendered, write_page

if TYPE_CHECKING:
    from pandas import DataFrame

#: Rows of a long table that a page shows.
_ROWS = 24
#: Coefficient of friction of dry ground of which no robot file states one: handbooks print 0.6 to
#: 1.0 for rubber on dry concrete.
DRY_GROUND = 1.0
#: The leg the paper follows; the first leg of a robot that has no such leg.
SHOWN_LEG = "rm"
#: Keys of ``[gait]`` by which the robot walks other than straight ahead, level and unloaded.
_CONDITIONS = ("heading", "yaw_rate", "slope_forward", "slope_left", "payload_mass")


def write_robot_page(
    given: Machine, tables: Mapping[str, DataFrame], remarks: Sequence[str], folder: Path
) -> None:
    """Write ``index.html`` of any robot; its figures are those of `reports.run`."""
    title = (
        f"What it costs to actuate {given.robot.spec.name}, {gait_and_conditions(given.robot.spec)}"
    )
    write_page("robot", folder, tables, title=title, remarks=remarks, **facts(given, tables))


def facts(given: Machine, tables: Mapping[str, DataFrame]) -> dict[str, Any]:
    """What `templates/robot.html` shows of a run beside its tables."""
    robot, titles, leg = given.robot, short_titles(given.catalog), shown_leg(given.robot)
    energy, limits = tables["robot_energy"], tables["motor_limits"]
    powers = dict(zip(energy["alternative"], energy["average_power_W"], strict=True))
    powers = {n: p for n, p in powers.items() if n == given.own.usual} or powers
    ends = dict.fromkeys((min(powers, key=powers.__getitem__), max(powers, key=powers.__getitem__)))
    share = limits["peak"] / limits["limit"]
    over = share[limits["breach"].astype(bool)].sort_values(ascending=False, kind="stable")
    _, friction = greatest_friction(tables)
    lines = limits_text(given, tables)
    actuators = tables["parameters"][tables["parameters"]["group"] != robot.spec.name]
    return {
        "robot": robot.spec.name,
        "mass": given.edited.mass,
        "legs": len(robot.leg_names),
        "depths": sorted({len(one.joints) for one in robot.spec.legs}),
        "gait": gait_of(robot.spec),
        "conditions": conditions(robot.spec),
        "effects": [edit.effect for edit in given.edits],
        "bases": Counter(map(str, actuators["basis"])).most_common(),
        "titles": titles,
        "powers": {titles[n]: number(powers[n]) for n in ends},
        "motors": given.motors,
        "whose": motors_text(given.motors),
        "limits": lines,
        "notices": lines if given.motors.stated else (),
        "needs": needs(tables["walking_joint_demand"], robot),
        "friction": friction,
        "slips": given.forces.friction_coefficient is None and friction > DRY_GROUND,
        "nearest": {"share": float(share.max()), **limits.iloc[share.argmax()]},
        "leg": leg,
        "zero_pose": " ".join(robot.spec.robot.zero_pose.split()).rstrip("."),
        "shown_legs": tables["walking_energy"]["leg"].isin((leg, "robot")),
        "breaches": over.size,
        "worst": limits.index.isin(over.index[:_ROWS]).tolist(),
    }


#: What is told of a joint that turns or slides, by the ends of the columns of its demand.
_NEEDS: Final = {
    **{"torque_Nm": "peak torque [N·m]", "torque_N": "peak force [N]"},
    **{"velocity_rad_s": "peak speed [rad/s]", "velocity_m_s": "peak speed [m/s]"},
}
_POWER: Final = "peak mechanical power [W]"


def needs(demand: DataFrame, robot: Robot) -> DataFrame:
    """What walking asks of every joint, whatever drives it: peaks, in N*m or N, rad/s or m/s.

    Args:
        demand: The table ``walking_joint_demand``.
        robot: Whose joints these are.
    """
    import pandas

    rows = []
    for joint in robot.joints:
        own = {x: demand[n].abs() for x in _NEEDS if (n := f"{joint}__{x}") in demand}
        effort, speed = own.values()
        peaks = {_NEEDS[x]: values.max() for x, values in own.items()}
        rows.append({"joint": joint, **peaks, _POWER: (effort * speed).max()})
    frame = pandas.DataFrame(rows)
    return frame[[name for name in ("joint", *_NEEDS.values(), _POWER) if name in frame]]


def conditions(spec: RobotSpec) -> tuple[str, ...]:
    """What the gait states beside its steps: heading, turning, slope, payload, as it is written."""
    stated = [key for key in _CONDITIONS if key in spec.gait]
    return tuple(f"{key.replace('_', ' ')} {spec.gait[key]}" for key in stated)


def gait_and_conditions(spec: RobotSpec) -> str:
    """The gait's title with what is not as usual."""
    return ", ".join((gait_of(spec).title, *conditions(spec)))


def motors_text(motors: Motors, whose: str = "") -> str:
    """Which motors drive the joints, what they weigh, and how to put in others.

    Args:
        whose: Where they come from, where robot file and command line do not state them.
    """
    return rendered("motors.j2", motors=motors, whose=whose)[0]


def limits_text(machine: Machine, tables: Mapping[str, DataFrame]) -> tuple[str, ...]:
    """What motors and ground cannot give; a line for each of the two, none where all is well.

    Args:
        machine: That stood or walked.
        tables: Of the run; those that it lacks are passed over.
    """
    titles, friction = short_titles(machine.catalog), machine.forces.friction_coefficient
    asks = []
    for verb, name in (("walking", "motor_limits"), ("standing", "standing_limits")):
        every = tables.get(name)
        if every is None:
            continue
        for quantity, rows in every[every["breach"].astype(bool)].groupby("quantity", sort=False):
            # Of options that are alike the first, whatever their last digits are.
            worst = rows.iloc[(rows["peak"] / rows["limit"]).round(9).argmax()]
            count, of = (own["alternative"].nunique() for own in (rows, every))
            others = f", {count} of {of} options" if of > 1 else ""
            asks.append(
                f"{verb} takes {str(quantity).replace('_', ' ')} {number(worst['peak'])}, limit "
                f"{number(worst['limit'])} {worst['unit']} (`{worst['joint']}`, "
                f"{titles[worst['alternative']]}{others})"
            )
    out = [f"**Beyond the motors:** {'; '.join(asks)}."] if asks else []
    foot, needed = greatest_friction(tables)
    if friction is None and needed > DRY_GROUND:  # a stated one has bound the forces
        out.append(
            f"**Beyond the ground:** leg `{foot}` needs a coefficient of friction of "
            f"**{number(needed)}** by this rule of forces, dry ground seldom offers more than "
            f"{number(DRY_GROUND)}; a stated `friction_coefficient` looks for forces within it, or "
            "says that the robot slides."
        )
    return tuple(out)


def greatest_friction(tables: Mapping[str, DataFrame]) -> tuple[str, float]:
    """The leg that needs the most friction, walking or standing, and its coefficient [1]."""
    columns = {
        "walking_stability": ["foot_of_greatest_friction", "greatest_friction_needed"],
        "standing_contacts": ["foot", "friction_needed"],
    }
    known = [tables[name][own].dropna() for name, own in columns.items() if name in tables]
    found = [row for rows in known for row in rows.itertuples(index=False, name=None)]
    return max(found, key=lambda f: f[1], default=("", 0.0))


def shown_leg(robot: Robot) -> str:
    """The leg whose figures are drawn."""
    return SHOWN_LEG if SHOWN_LEG in robot.leg_names else robot.leg_names[0]


def short_titles(catalog: Catalog) -> dict[str, str]:
    """Every option's title without its number; where two are alike, with the name."""
    titles = {n: a.title.split(": ", 1)[-1] for n, a in catalog.alternatives.items()}
    seen = Counter(titles.values())
    return {n: title if seen[title] == 1 else f"{title} ({n})" for n, title in titles.items()}
