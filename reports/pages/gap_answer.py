"""The answer of `gap` in at most ten sentences, which its page and the terminal show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from pipeline.effects.base import EVERY
from pipeline.effects.bodies import AXES, RigidBodyParameters
from pipeline.effects.friction import FrictionFactor
from pipeline.identification.results import UNEXPLAINED
from pipeline.identification.where import WHOLE
from pipeline.identification.workflow.changed import BODY
from pipeline.identification.workflow.outcome import Outcome
from pipeline.simulation.found_bodies import FoundBodies
from pipeline.simulation.walk_stand import IDEAL
from reports.pages.robot_page import motors_text
from reports.typeset import number, percent, unit_text

if TYPE_CHECKING:
    from pandas import DataFrame

Tables = Mapping[str, "DataFrame"]
URDF_FILE: Final = "model.urdf"
#: Sentences of an answer; names, bodies or joints in one of them.
_SENTENCES, _MANY = 10, 3
_INDISTINGUISHABLE: Final = "indistinguishable from "


def answer(outcome: Outcome, bodies: FoundBodies, tables: Tables) -> list[str]:
    """What is missing, where, how much smaller the gap is with it, what is left, what it costs."""
    (before, after), unit = outcome.gaps, unit_text(outcome.unit)
    suspected = outcome.suspected
    lines = [
        f"**A column is not what its name says:** {'; '.join(suspected[:_MANY])}; nothing below "
        "is an explanation while this stands."
        if suspected
        else "",
        changed(tables),
        *_found(outcome, tables),
        where_line(tables["where"]),
        "" if "changed" in tables else _bodies(bodies),
        f"**Gap of all joints** on test data, root mean square: {number(before)} {unit} of the "
        f"model as it was, {number(after)} {unit} as written; noise floor "
        f"{number(outcome.noise)} {unit}.",
        _rest(tables),
        _left(outcome),
        _cost(outcome.energy) if outcome.energy is not None else "",
        _motors(outcome),
    ]
    return list(filter(None, lines))[:_SENTENCES]


def _found(outcome: Outcome, tables: Tables) -> list[str]:
    """A sentence for each law: where it stands, how large, how sure; those written first."""
    found = tables["found"]
    if found.empty:
        tried = len(tables["candidates"])
        why = f"none of the {tried} that were tried gains enough" if tried else "it holds no effect"
        return [f"**Missing:** no effect has a name here; {why}."]
    joints, classes = outcome.given.model.joints, _classes(tables["candidates"])
    names = found[found["effect"] != RigidBodyParameters.name]
    if "changed" in tables:
        names = names[names["effect"] != FrictionFactor.name]
    laws = [*names.groupby(["written", "effect"], sort=False)]
    laws.sort(key=lambda law: (not law[0][0], -law[1]["place"].nunique()))
    lines = []
    for (written, effect), rows in laws[:_MANY]:
        places = list(dict.fromkeys(rows["place"]))
        name = f"{law_words(effect)} at {_places(places, joints)}"
        like = [other for place in places for other in classes.get((effect, place), ())]
        one = f"one of {name} or {', '.join(like[:_MANY])}" if like else name
        every = [_size(own) for _, own in rows.groupby("parameter", sort=False)]
        reason = next(filter(None, rows["reason"]), "") if not like else ""
        levels = rows.drop_duplicates("place")["level"].value_counts(sort=False)
        each = len(levels) > 1
        state = " and ".join(
            f"{count} {level}" if each else level for level, count in levels.items()
        )
        state += "" if written else ", not written"
        why = f"; {reason}" if reason else ""
        lines.append(f"**Missing, {state}: {one}:** {'; '.join(every[:_MANY])}{why}.")
    if len(laws) > _MANY:
        lines[-1] += f" {len(laws) - _MANY} more are in `found.csv`."
    return lines


def changed(tables: Tables) -> str:
    """What is another than in the model file that was given; empty where nothing is, or no file."""
    if "changed" not in tables:
        return ""
    rows, said = tables["changed"], []
    for link, own in rows[rows["what"] == BODY].groupby("place", sort=False):
        by = {row["quantity"]: row for row in own.to_dict("records")}
        mass = by["mass"]
        if f"centre {AXES[0]}" in by:
            at = ", ".join(_place(axis, by[f"centre {axis}"]) for axis in AXES)
            more = "more" if mass["value"] > 0.0 else "less"
            low, high = sorted(abs(mass[end]) for end in ("ci_low", "ci_high"))
            said.append(
                f"{number(abs(mass['value']))} kg {more} on {link} (95 % {number(low)} to "
                f"{number(high)}), at {at} m of its joint's frame"
            )
        else:
            far = ", ".join(number(by[f"first moment {axis}"]["value"], 2) for axis in AXES)
            said.append(f"first moment of {link} by {far} kg·m")
    for row in rows[rows["what"] == FrictionFactor.name].to_dict("records"):
        more, ends = row["value"] - 1.0, (row["ci_low"] - 1.0, row["ci_high"] - 1.0)
        low, high = sorted(abs(100.0 * end) for end in ends)
        said.append(
            f"friction at {row['place']} {percent(abs(more))} {'higher' if more > 0 else 'lower'} "
            f"(95 % {low:.0f} to {high:.0f} %)"
        )
    return f"**Changed since the model file:** {'; '.join(said[:_MANY])}." if said else ""


def _place(axis: str, row: Mapping[Any, Any]) -> str:
    wide = 0.5 * (row["ci_high"] - row["ci_low"])
    return f"{axis} {number(row['value'], 2)} ± {number(wide, 1)}"


def _classes(candidates: DataFrame) -> dict[tuple[str, str], list[str]]:
    """Effect and place to the names that explain the log as well."""
    like = candidates[candidates["verdict"].str.startswith(_INDISTINGUISHABLE)]
    out = {}
    for row in like.to_dict("records"):
        names = row["verdict"].removeprefix(_INDISTINGUISHABLE).split("; ")
        parts = [name.partition(" at ") for name in names]
        others = [
            f"{law_words(effect)}{at}{'all joints' if place == EVERY else place}"
            for effect, at, place in parts
        ]
        out[row["effect"], row["place"]] = others
    return out


def law_words(effect: str) -> str:
    """An effect's name as people write it."""
    text = effect.replace("_", " ")
    return text.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck")


def _places(places: Sequence[str], joints: Sequence[str]) -> str:
    """Places in words: all joints, all but the others where these are fewer, or each by name."""
    if len(places) < 3 or not {*places} <= {*joints}:
        words = {EVERY: "all joints", "": "the whole machine"}
        return " and ".join(words.get(p, p.replace("+", " with ")) for p in places)
    others = [joint for joint in joints if joint not in places]
    if not others:
        return f"all {len(joints)} joints"
    few = len(others) < len(places)
    names = f"{'not ' * few}{', '.join(others if few else places)}"
    return f"{len(places)} of {len(joints)} joints ({names})"


def _size(rows: DataFrame) -> str:
    """One parameter of a law: its value and interval at one place, its range at several."""
    row = rows.iloc[0]
    unit = "" if row["unit"] in ("", "1") else f" {unit_text(row['unit'])}"
    if len(rows) > 1:
        low, high = number(rows["value"].min()), number(rows["value"].max())
        return f"{row['parameter']} {low} to {high}{unit}"
    ends = f"{number(row['ci_low'])} to {number(row['ci_high'])}"
    return f"{row['parameter']} {number(row['value'])}{unit}, 95 % {ends}"


def where_line(where: DataFrame) -> str:
    """Where the model as it was misses most."""
    whole = where[where["by"] == WHOLE]
    if whole.empty:
        return "No joint has enough rows to compare."
    worst = whole.iloc[0]
    return (
        f"**Where:** most at {worst['joint']}, {number(worst['gap'])} {unit_text(worst['unit'])} "
        f"root mean square: {percent(worst['share_of_total'])} of the squared gap of all "
        "joints."
    )


def _bodies(found: FoundBodies) -> str:
    """Which links differ beyond their interval; empty where no body was found to be another."""
    every = found.table.to_dict("records")
    if not every:
        return ""
    differing = []
    for row in (row for row in every if row["differs_in"]):
        before, after = row["urdf_mass_kg"], row["found_mass_kg"]
        mass = ""
        if "mass" in row["differs_in"]:
            mass = f" {'+' * (after > before)}{number(after - before, 2)} kg"
        if mass and after > before:  # as one thing mounted
            moments = [
                (a, after * row[f"found_center_{a}_m"] - before * row[f"urdf_center_{a}_m"])
                for a in "xyz"
                if a in row["differs_in"].split("+")
            ]
            at = ", ".join(f"{a} {number(m / (after - before), 2)}" for a, m in moments)
            mass += f" at {at} m" * bool(at)
        differing.append(f"{row['link']}{mass} ({row['differs_in'].replace('+', ', ')})")
    more = f" and {len(differing) - _MANY} more" if len(differing) > _MANY else ""
    named = f": {'; '.join(differing[:_MANY])}{more}" if differing else ""
    file = f"; the robot with them is {URDF_FILE}" if found.urdf else ""
    return (
        f"**Bodies:** {len(differing)} of {len(every)} links fitted anew differ from the URDF's "
        f"beyond the 95 % interval{named}{file}."
    )


_KINDS: Final = {
    "memory": "on the way it came, as hysteresis does",
    "angle": "on the angle",
    "fine angle": "on the angle, finely, as cogging and teeth do",
    "friction by angle": "on angle and direction, as uneven friction does",
    "friction by speed": "on the speed, as friction of no law here does",
    "time": "on the time, as warming does",
}


def _rest(tables: Tables) -> str:
    """What has no name, by joint and kind."""
    if "rest" not in tables or tables["rest"].empty:
        return ""
    rows = tables["rest"].sort_values("share", ascending=False).to_dict("records")
    parts = [
        f"at {row['joint']}, {percent(row['share'])} of the gap depends "
        f"{_KINDS.get(str(row['kind']), row['kind'])}"
        for row in rows[:_MANY]
    ]
    more = f"; {len(rows) - _MANY} more in `rest.csv`" if len(rows) > _MANY else ""
    return f"**What has no name,** a table in the model file: {'; '.join(parts)}{more}."


def _left(outcome: Outcome) -> str:
    """What stays unexplained; noise only where no joint leaves more than its floor."""
    every = outcome.held.left
    left = sorted((r for r in every if r.significant), key=lambda r: -r.ratio)
    if not left:
        untested = list(dict.fromkeys(r.joint for r in every if not r.rows))
        only = f"; of {', '.join(untested)} no row is test data" if untested else ""
        return (
            f"**What names leave** is noise: no joint leaves more than {UNEXPLAINED:g} times its "
            f"noise floor{only}."
        )
    said = [
        f"{r.joint} {number(r.error)} {unit_text(r.unit)}, {number(r.ratio, 2)} times its floor"
        f"{', ' * bool(r.description)}{r.description.removeprefix(f'what is left in {r.joint} ')}"
        for r in left[:_MANY]
    ]
    more = f"; {len(left) - _MANY} more" if len(left) > _MANY else ""
    return f"**What no name explains:** {'; '.join(said)}{more}."


def _cost(change: DataFrame) -> str:
    """Joules of a gait cycle without and with the effects, by drivetrain option."""
    said = [
        f"{name} {number(old, 4)} to {number(new, 4)} J ({100 * (new - old) / old:+.1f} %)"
        for name, old, new in change[["cycle_J", "cycle_J_after"]].itertuples()
        if name != IDEAL and not math.isnan(new)
    ]
    if silent := [str(name) for name in change.index[change["cycle_J_after"].isna()]]:
        said.append(f"not known for {' and '.join(silent)}, whose gears lose otherwise")
    return f"**What it costs,** one gait cycle of the whole robot: {'; '.join(said)}."


def _motors(outcome: Outcome) -> str:
    """Which motors turn the log's currents into torque."""
    motors = outcome.given.motors if outcome.given.alternative else None
    if motors is not None:
        return motors_text(motors)
    read = (one.recording for one in outcome.compared.logs)
    laws = (log.derived.get("torque") for log in read if log is not None)
    law = next(filter(None, laws), "")
    torque = f"torque by the servos' law ({law}), not measured," if law else "the log's torque"
    return f"**Whose motors:** none; {torque} is compared at the joints."
