"""Whose motors were assumed, and what a run asks beyond what motors and ground give."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pipeline.machine.motors import Motors
from reports.table import Table
from reports.typeset import number_text

#: Coefficient of friction of dry ground of which no robot file states one: handbooks print 0.6 to
#: 1.0 for rubber on dry concrete.
DRY_GROUND = 1.0
OWN = (
    "Put in your own: `python -m pipeline init-actuator`, then `--actuators FOLDER`, or "
    "`[actuators]` in the robot file"
)
#: Quantity of `motor_limits` to how its breach is said.
_ASKS = {
    "voltage": "{peak} V where the supply has {limit} V",
    "current": "{peak} A where the motor bears {limit} A at most",
    "rms_current": "{peak} A root mean square where the motor bears {limit} A continuously",
    "speed": "{peak} rad/s where the motor is permitted {limit} rad/s",
}


def motors_text(motors: Motors, whose: str = "") -> str:
    """Which motors drive the joints, what they weigh, and how to put in others.

    Args:
        motors: Of the machine.
        whose: Where they come from, where robot file and command line do not state them.
    """
    which = " or ".join(motors.titles)
    ratio = _span(motors.ratio, ":1")
    if motors.mass[1] > 0:
        each = f", {_span(motors.mass, ' kg')} each"
    else:
        each = ", whose files state no `mass`"
    weight = (
        f" All {motors.joints} weigh **{number_text(motors.total)} kg** without gears, the robot "
        f"{number_text(motors.robot)} kg."
        if motors.total
        else ""
    )
    if motors.stated or whose:
        whose = whose or "as stated for this robot"
        return f"**Whose motors:** {whose}, {which} at {ratio}{each}.{weight}"
    heavy = (
        " The assumed motors weigh more than the robot they would move: no watt below is that of a "
        "machine that can be built."
        if motors.too_heavy
        else ""
    )
    return (
        f"**Whose motors:** none are stated for this robot; assumed at every joint is the "
        f"catalogue's {which} at {ratio}{each}.{weight}{heavy} {OWN}."
    )


def _span(pair: tuple[float, float], unit: str) -> str:
    low, high = (f"{number_text(x)}" for x in pair)
    return f"{low}{unit}" if low == high else f"{low} to {high}{unit}"


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
        out.append(
            f"**Beyond the ground:** leg `{foot}` needs a coefficient of friction of "
            f"**{number_text(needed)}** by this rule of forces, dry ground seldom offers more than "
            f"{number_text(DRY_GROUND)}; `--friction-coefficient 0.8` looks for forces within it, "
            "or says that the robot slides."
        )
    return tuple(out)


def _breaches(table: Table, titles: Mapping[str, str]) -> list[str]:
    """For each quantity that is exceeded its worst row, and in how many alternatives it is."""
    c = table.columns
    over: dict[str, list[int]] = {}
    for i in np.flatnonzero(np.asarray(c["breach"], dtype=bool)).tolist():
        over.setdefault(str(c["quantity"][i]), []).append(i)
    said = []
    for quantity, rows in over.items():
        # Of alternatives that are alike the first, whatever their last digits are.
        worst = max(rows, key=lambda i: round(float(c["peak"][i] / c["limit"][i]), 9))
        name, count = str(c["alternative"][worst]), len({c["alternative"][i] for i in rows})
        every = len(set(c["alternative"]))
        others = f", {count} of {every} alternatives" if every > 1 else ""
        ask = _ASKS[quantity].format(
            peak=number_text(c["peak"][worst]), limit=number_text(c["limit"][worst])
        )
        said.append(f"{ask} (`{c['joint'][worst]}`, {titles[name]}{others})")
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
            c = tables[name].columns
            found += zip(map(str, c[leg]), map(float, c[needed]), strict=True)
    return max((f for f in found if not np.isnan(f[1])), key=lambda f: f[1], default=("", 0.0))


def tightest(table: Table) -> tuple[str, str, float]:
    """The joint and quantity nearest to its limit, and the share of it [1]."""
    c = table.columns
    share = np.asarray(c["peak"], dtype=float) / np.asarray(c["limit"], dtype=float)
    at = int(share.argmax())
    return str(c["joint"][at]), str(c["quantity"][at]), float(share[at])
