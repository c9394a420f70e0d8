"""Whose motors were assumed, and what a run asks beyond what motors and ground give."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pipeline.machine.own_actuators import Motors
from reports.table import Table
from reports.words import Words

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
    c = table.columns
    over: dict[str, list[int]] = {}
    for i in np.flatnonzero(np.asarray(c["breach"], dtype=bool)).tolist():
        over.setdefault(str(c["quantity"][i]), []).append(i)
    said = []
    for quantity, rows in over.items():
        # Of alternatives that are alike the first, whatever their last digits are.
        worst = max(rows, key=lambda i: round(float(c["peak"][i] / c["limit"][i]), 9))
        name, count = str(c["alternative"][worst]), len({c["alternative"][i] for i in rows})
        of = (quantity, c["peak"][worst], c["limit"][worst], c["joint"][worst])
        said.append(ROBOT("breach", *of, titles[name], count, len(set(c["alternative"]))))
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
