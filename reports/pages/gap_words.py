"""The answer of a run of `gap` in a few lines, which its page and the terminal show."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from pandas import DataFrame

from pipeline.effects.base import CHANNEL_COLUMNS, place_text
from pipeline.effects.motor import TorqueConstantError
from pipeline.effects.registry import told_apart
from pipeline.effects.sensors import EffortGain
from pipeline.identification.compare.circumstances import WHOLE, Where
from pipeline.identification.results import (
    CONFIRMED,
    Estimate,
    Found,
    Member,
    common_laws,
    named,
)
from pipeline.identification.workflow.outcome import Outcome
from pipeline.simulation.found_bodies import FoundBodies
from pipeline.simulation.walk_stand import IDEAL
from reports.pages.robot_page import motors_text
from reports.typeset import number, percent, unit_text

#: Of the folder of results, beside the model file.
URDF_FILE = "model.urdf"
#: A band is worth a word when its gap is this many times the joint's.
_STANDS_OUT = 1.25
#: Effects, bodies or remarks that the answer names; tables have all.
MANY_EFFECTS = 3
#: Parameters of one effect that it names.
_MANY = 6


def answer(outcome: Outcome, bodies: FoundBodies) -> tuple[str, ...]:
    """Where, what, bodies, the gap without and with it, its cost, what is left, whose motors."""
    found, energy = outcome.naming.found, outcome.energy
    joints = [outcome.given.model.joints[j] for j in outcome.validated.joints]
    (before, after), unit = outcome.gaps, outcome.naming.unit
    remarks = low_confidence(found)
    more = len(remarks) - MANY_EFFECTS
    others = f"; {more} more remarks of this kind on the page" if more > 0 else ""
    undecided = f"**Not decided:** {'; '.join(remarks[:MANY_EFFECTS])}{others}."
    said = (
        *(
            f"**Nothing below is an explanation while this stands:** {text}."
            for text in outcome.suspected
        ),
        _where(outcome.compared.rows),
        *found_lines(found, joints, outcome.given.model.joints),
        *(() if found else (_nothing(outcome),)),
        _mapping_hint(outcome),
        bodies_line(bodies),
        f"**Gap of all joints** on test data, root mean square: {number(before)} {unit} of the "
        f"model as it was, {number(after)} {unit} of the model file as written; noise floor "
        f"{number(outcome.noise)} {unit}.",
        energy_line(energy, outcome.given.alternative) if energy is not None else "",
        undecided if remarks else "",
        _left(outcome) if outcome.validated.unexplained or not outcome.suspected else "",
        _whose_motors(outcome),
    )
    return tuple(filter(None, said))


def _where(rows: Sequence[Where]) -> str:
    """Where the model as it was misses most."""
    whole = [row for row in rows if row.by == WHOLE]
    if not whole:
        return "No joint has enough rows to compare."
    worst = whole[0]
    ratio = worst.gap / worst.noise_floor if worst.noise_floor > 0 else math.inf
    own = [r for r in rows if r.joint == worst.joint and r.gap > _STANDS_OUT * worst.gap]
    top = max(own, key=lambda row: row.gap, default=None)
    band = f"; largest by {top.by}: {top.band}, {number(top.gap)} {worst.unit}" if top else ""
    return (
        f"**Where:** most at **{worst.joint}**, measured minus predicted {number(worst.gap)} "
        f"{worst.unit} root mean square, {number(ratio, 2)} times the noise floor and "
        f"{percent(worst.share_of_total)} of the squared gap of all joints{band}."
    )


def found_lines(
    found: Sequence[Found], joints: Sequence[str], machine: Sequence[str] = ()
) -> list[str]:
    """The first laws with parameters, level and what each closes where it shows.

    Laws that stand at the same joints are one line, and come first.

    Args:
        found: Findings.
        joints: Where each shows.
        machine: All joints.
    """
    shown = {f.key: joint for f, joint in zip(found, joints, strict=True)}
    groups = common_laws(found)
    out = []
    for group in groups[:MANY_EFFECTS]:
        if len(group) > 1:
            out.append(_common_line(group, machine))
            continue
        f, joint = group[0], shown[group[0].key]
        left_out = "" if f.written else ", not written into the model file"
        gap = f"cannot be tested: no row of {joint} is test data"
        if f.gap_before == f.gap_before:
            gap = (
                f"gap of {joint} {number(f.gap_before)} to {number(f.gap_after)} {f.unit}, noise "
                f"floor {number(f.noise_floor)} {f.unit}"
            )
        out.append(f"**Found, {f.level}{left_out}:** **{named(f)}**{_sizes(f)}; {gap}.")
    if len(groups) > MANY_EFFECTS:
        more = sum(len(group) for group in groups[MANY_EFFECTS:])
        out.append(f"**Found:** {more} more, in `found.csv`.")
    return out


def _common_line(group: Sequence[Found], joints: Sequence[str]) -> str:
    """Laws that stand at the same joints: which, where, and from what to what."""
    laws = {f.effect: [g for g in group if g.effect == f.effect] for f in group}
    places = list(dict.fromkeys(f.place[0] for f in group))
    every = set(places) == {*joints}
    where = f"all {len(places)} joints" if every else ", ".join(places)
    names = [f"{name}{_sizes(_together(own))}" for name, own in laws.items()]
    sure = sum(f.level == CONFIRMED for f in group)
    kept = sum(f.written for f in group)
    return (
        f"**Found:** **{' and '.join(laws)} at {where}** ({sure} of {len(group)} confirmed, {kept} "
        f"written): {'; '.join(names)}; each with its interval in `found.csv`."
    )


def _together(own: Sequence[Found]) -> Found:
    members = tuple(Member(f.place, f.parameters, f.level) for f in own)
    return replace(own[0], members=members)


def _sizes(f: Found) -> str:
    """Parameters with their intervals; of several like findings the least and the largest."""
    by: dict[str, list[Estimate]] = {}
    for member in f.each:
        for p in member.parameters:
            by.setdefault(p.name, []).append(p)
    if not 0 < len(by) <= _MANY:
        return ""
    said = []
    for name, own in by.items():
        unit = "" if own[0].unit in ("", "1") else f" {unit_text(own[0].unit)}"
        low, high = min(p.value for p in own), max(p.value for p in own)
        known = f"{number(low)} to {number(high)}{unit}"
        if len(own) == 1:
            interval = f"{number(own[0].low)} to {number(own[0].high)}"
            known = f"{number(low)}{unit}, 95 % interval {interval}"
        said.append(f"{name} {known}")
    return f" ({'; '.join(said)})"


def _nothing(outcome: Outcome) -> str:
    if outcome.unexplained:
        return "**Found:** no effect of the catalogue explains it."
    if not outcome.naming.tried:
        return "**Found:** the model file holds no effect."
    return (
        f"**Found:** nothing is missing. {outcome.naming.tried} candidates were tried and none is "
        "needed beyond the stated tolerances of the machine's parts."
    )


def _mapping_hint(outcome: Outcome) -> str:
    """What to do about columns that read a multiple of what they should."""
    found = outcome.naming.found
    hints = [(f.place[0], 1.0 / f.values["gain"]) for f in found if f.effect == EffortGain.name]
    cause = "A column that reads a multiple is usually the log's"
    if tuple(outcome.compared.measurements[0].channels) == ("current",):
        own = CHANNEL_COLUMNS["current"]
        constants = [f for f in found if f.effect == TorqueConstantError.name]
        hints += [(f"{f.place[0]}__{own}", 1.0 + f.values["relative"]) for f in constants]
        cause += "; its current alone cannot tell that from a motor's torque constant"
    scales = "; ".join(f'[columns."{name}"] scale = {x:.3g}' for name, x in hints[:MANY_EFFECTS])
    return f"{cause}: {scales} in a mapping file brings it to the model's." if hints else ""


def bodies_line(found: FoundBodies) -> str:
    """Which links differ beyond their interval; empty where no body was found to be another."""
    every = found.table.to_dict("records")
    if not every:
        return ""
    clear = []
    for row in (row for row in every if row["differs_in"]):
        more = row["found_mass_kg"] - row["urdf_mass_kg"]
        mass = f" {more:+.2g} kg" if "mass" in row["differs_in"] else ""
        clear.append(f"{row['link']}{mass} ({row['differs_in'].replace('+', ', ')})")
    file = f"; the robot with them is {URDF_FILE}" if found.urdf else ""
    return (
        f"**Bodies:** of {len(every)} links fitted anew, {len(clear)} differ from the "
        f"URDF's beyond the 95 % interval{': ' * bool(clear)}{'; '.join(clear)}{file}."
    )


def energy_line(change: DataFrame, alternative: str) -> str:
    """Joules of a gait cycle without and with the effects, by drivetrain option."""
    said = [
        f"{name} {number(old, 4)} to {number(new, 4)} J ({100 * (new - old) / old:+.1f} %)"
        for name, old, new in change[["cycle_J", "cycle_J_after"]].itertuples()
        if name != IDEAL and not math.isnan(new)
    ]
    silent = change.index[change["cycle_J_after"].isna()]
    if len(silent):
        said.append(
            f"no number for {' and '.join(silent)}: friction and inertia were "
            f"found against {f'`{alternative}`' if alternative else 'a joint without actuator'}, "
            "other actuators have gears with losses of their own"
        )
    return f"**What it costs,** one gait cycle of the whole robot: {'; '.join(said)}."


def low_confidence(found: Sequence[Found]) -> list[str]:
    """Names that are not certain, each with the reason."""
    parts = []
    for f in found:
        if f.rivals:
            others = ", ".join(f"{name} at {place_text(place)}" for name, place in f.rivals)
            shown = told_apart(f.effect, *(name for name, _ in f.rivals))
            parts.append(f"{named(f)} cannot be told from {others} on this motion ({shown})")
        if f.reason:
            parts.append(f"{named(f)} is {f.level}: {f.reason}")
    return parts


def _left(outcome: Outcome) -> str:
    """What stays unexplained and what it looks like."""
    every = outcome.validated.left
    left = [r for r in every if r.significant]
    left.sort(key=lambda r: -r.error / max(r.noise_floor, 1e-300))
    if not left:
        without = list(dict.fromkeys(r.joint for r in every if not r.rows))
        only = f" Of {', '.join(without)} no row is test data: there only the fitted rows say so."
        return (
            "**What is left** by the model as written is noise: nothing significant stays "
            f"unexplained.{only if without else ''}"
        )
    said = [
        f"{r.joint} {number(r.error)} {r.unit}, {number(r.ratio, 2)} times the noise floor"
        f"{', ' * bool(r.description)}{r.description.removeprefix(f'what is left in {r.joint} ')}"
        for r in left[:MANY_EFFECTS]
    ]
    more = f"; {len(left) - MANY_EFFECTS} more" if len(left) > MANY_EFFECTS else ""
    return f"**What stays unexplained** by the model as written: {'; '.join(said)}{more}."


def _whose_motors(outcome: Outcome) -> str:
    """Which motors turn the log's currents into torque."""
    motors = outcome.given.motors if outcome.given.alternative else None
    if motors is None:
        read = (one.recording for one in outcome.compared.measurements)
        laws = (log.derived.get("torque") for log in read if log is not None)
        law = next(filter(None, laws), "")
        torque = f"torque by the servos' law ({law}), not measured," if law else "the log's torque"
        return f"**Whose motors:** none; {torque} is compared at the joints."
    return motors_text(motors)
