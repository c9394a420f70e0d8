"""The answer of a run of `gap`: what the paragraphs of `templates/gap.jinja` are about."""

from __future__ import annotations

import inspect
import math
from collections.abc import Sequence

import numpy as np

from pipeline.effects.base import CHANNEL_COLUMNS, place_text
from pipeline.effects.drive.torque_constant_error import TorqueConstantError
from pipeline.effects.registry import effect_named
from pipeline.effects.sensing.effort_gain import EffortGain
from pipeline.identification.compare.circumstances import WHOLE, Where
from pipeline.identification.results import (
    APPROXIMATE,
    CONFIRMED,
    SUSPECTED,
    Estimate,
    Found,
    Member,
    named,
)
from pipeline.identification.workflow.outcome import Outcome
from pipeline.logs.errors import EffectError
from pipeline.logs.prepared.measurement import TEST, Measurement
from pipeline.logs.signals.grid import runs_of
from pipeline.simulation.energy_change import PAIR, EnergyChange
from pipeline.simulation.found_bodies import FoundBodies, FoundBody
from reports.page import Block, Points, TableBlock, Text
from reports.typeset import MINUS
from reports.words import Words, listed, number

#: Of the folder of results, beside the model file.
URDF_FILE = "model.urdf"
#: A band is worth a word when its gap is this many times the joint's.
STANDS_OUT = 1.25
#: Effects, bodies or remarks that a sentence names.
MANY_EFFECTS = 3
#: Parameters of one effect that a sentence names.
MANY = 6
#: Held-out rows turn one way where less than this share turns the other way.
ONE_WAY = 0.05
#: A change of energy below this is none, as a share.
NO_CHANGE = 5e-4
#: A band in words, by how rows are sorted.
_CIRCUMSTANCES = {
    "phase": "in {}",
    "direction": "in the {} direction",
    "speed": "at {} speed",
    "load": "under {} load",
    "power": "where the joint is {}",
    "reversal": "{} reversals",
    "position": "in the {} third of its travel",
    "time": "in the {} third of the log",
}


def where_words(rows: Sequence[Where]) -> str:
    """Where the model as it was misses most."""
    whole = whole_joints(rows)
    own = [r for r in rows if whole and r.joint == whole[0].joint and r.by != WHOLE]
    bands = [r for r in own if r.gap > STANDS_OUT * whole[0].gap]
    top = max(bands, key=lambda row: row.gap, default=None)
    circumstance = ""
    if top is not None:
        near = {"near": "near"}.get(top.band, "away from")
        band = near if top.by == "reversal" else top.band
        circumstance = _CIRCUMSTANCES.get(top.by, f"by {top.by}: {{}}").format(band)
    return WORDS("where", whole, top, circumstance)


def whole_joints(rows: Sequence[Where]) -> list[Where]:
    """The rows that leave a joint whole, the worst first."""
    return [row for row in rows if row.by == WHOLE]


def what_words(outcome: Outcome) -> str:
    """What is missing, and what to do about columns that read a multiple of what they should."""
    naming, found = outcome.naming, outcome.naming.found
    levels = [[f for f in found if f.level == x] for x in (CONFIRMED, APPROXIMATE, SUSPECTED)]
    hints = [(f.place[0], 1.0 / f.values["gain"]) for f in found if f.effect == EffortGain.name]
    columns, constants = bool(hints), []
    if tuple(outcome.compared.measurements[0].channels) == ("current",):
        constants = [f for f in found if f.effect == TorqueConstantError.name]
        own = CHANNEL_COLUMNS["current"]
        hints += [(f"{f.place[0]}__{own}", 1.0 + f.values["relative"]) for f in constants]
    listed = [f'[columns."{name}"] scale = {x:.3g}' for name, x in hints[:MANY_EFFECTS]]
    meaning = _effect_meaning(found[0].effect) if len(found) == 1 else ""
    return WORDS(
        "what", naming, outcome.unexplained, *levels, meaning, columns, listed, bool(constants)
    )


def left_words(outcome: Outcome) -> str:
    """What stays unexplained and what it looks like."""
    left = outcome.validated.left
    significant = [r for r in left if r.significant]
    significant.sort(key=lambda r: -r.error / max(r.noise_floor, 1e-300))
    return WORDS("left", significant, list(dict.fromkeys(r.joint for r in left if not r.rows)))


def _ranges(members: Sequence[Member]) -> str:
    """From the least to the largest of every parameter of like findings; empty where many."""
    by: dict[str, list[Estimate]] = {}
    for member in members:
        for p in member.parameters:
            by.setdefault(p.name, []).append(p)
    if len(by) > MANY:
        return ""
    return "; ".join(
        f"{name} {number(min(p.value for p in own))} to {number(max(p.value for p in own))}"
        f"{_unit(own[0].unit)}"
        for name, own in by.items()
    )


def _effect_meaning(effect: str) -> str:
    """One sentence on what an effect is."""
    try:
        doc = inspect.getdoc(type(effect_named(effect))) or ""
    except EffectError:
        return ""
    line = doc.split("\n", 1)[0]
    return f"`{effect}`: {line[0].lower()}{line[1:]}" if line else ""


def _sized(value: float, p: Estimate) -> str:
    """A number with the decimals that its interval is worth."""
    half = 0.5 * (p.high - p.low)
    if not 1e-4 <= half < 100.0:
        return number(value)
    text = f"{value:.{max(0, -math.floor(math.log10(half)))}f}"
    return ("0" if float(text) == 0 else text).replace("-", MINUS)


def _unit(unit: str) -> str:
    return "" if unit in ("", "1") else f" {unit}"


def smaller_words(
    found: Sequence[Found],
    joints: Sequence[str],
    whole: tuple[float, float],
    unit: str,
    noise: float,
) -> str:
    """How much smaller the gap of the model as written is, on held-out data.

    Args:
        found: Effects, validated.
        joints: Per effect, the joint at which it shows.
        whole: Gap of all joints of the model as it was and as written.
        unit: Of the gap.
        noise: Noise floor of all joints.
    """
    pairs = [(f, joint) for f, joint in zip(found, joints, strict=True) if f.written]
    return WORDS("smaller", pairs, len(found) - len(pairs), whole, unit, noise)


def _removed(before: float, after: float, noise: float) -> float | None:
    """Share of the gap above the noise floor that an effect removes; None where there is none."""
    above = before**2 - noise**2
    if above <= 0:
        return None
    return 1.0 - math.sqrt(min(max(after**2 - noise**2, 0.0) / above, 1.0))


def priced(change: EnergyChange, alternative: str) -> list[str]:
    """The actuators whose energy is worth a word."""
    return [n for n in dict.fromkeys((*PAIR, alternative)) if n in change.before]


def energy_words(change: EnergyChange, alternative: str) -> str:
    """What it costs in joules, and the break-even."""
    return WORDS("energy", change, priced(change, alternative), alternative)


def held_out_words(measurements: Sequence[Measurement]) -> str:
    """Which stretches are held out."""
    spans, seconds = [], 0.0
    for m in measurements:
        first, after = runs_of(m.part == TEST)
        for start, stop in zip(m.time[first], m.time[after - 1], strict=True):
            spans.append(f"{start:.2f} to {stop:.2f} s of log '{m.name}'")
            seconds += stop - start
    return WORDS("held_out", spans, seconds)


def one_way_words(measurements: Sequence[Measurement], joints: Sequence[int]) -> list[str]:
    """Joints with an effect whose held-out rows all turn one way, a remark each."""
    out = []
    for j in dict.fromkeys(joints):
        speeds = np.concatenate([m.v[(m.part == TEST) & m.mask[:, j], j] for m in measurements])
        ahead = float((speeds > 0).mean()) if speeds.size else 0.5
        if min(ahead, 1.0 - ahead) < ONE_WAY:
            way = "positive" if ahead > 0.5 else "negative"
            out.append(WORDS("one_way", measurements[0].joints[j], way))
    return out


def low_confidence(found: Sequence[Found]) -> list[str]:
    """Names that are not certain, each in words."""
    parts = []
    for f in found:
        if f.rivals:
            others = listed([f"{name} at {place_text(place)}" for name, place in f.rivals])
            parts.append(f"{named(f)} cannot be told from {others} on this motion")
        if f.reason:
            parts.append(f"{named(f)} is {f.level}: {f.reason}")
    return parts


def bodies_words(found: FoundBodies) -> str:
    """A paragraph of the answer; empty where no body was found to be another."""
    clear = [body_words(body) for body in found.bodies if body.differs_in]
    return WORDS("bodies", found, clear)


def body_words(body: FoundBody) -> str:
    """What differs in one link, e.g. ``forearm +0.5 kg``."""
    return WORDS("body", body)


def _body_value(body: FoundBody, k: int, unit: str) -> str:
    """A value as found with its interval, where it has one."""
    scale = 1e3 if unit == "mm" else 1.0
    value, low, high = (float(scale * x[k]) for x in (body.found, body.low, body.high))
    if not (np.isfinite([low, high]).all() and low < high):
        return f"{number(value)} {unit}"
    return WORDS("parameters", [Estimate("", value, low, high, unit)])


def bodies_blocks(found: FoundBodies) -> tuple[Block, ...]:
    """The table, and what the corrected URDF holds; nothing without bodies."""
    if not found.bodies:
        return ()
    rows = tuple(
        (
            body.link,
            f"**{', '.join(body.differs_in)}**" if body.differs_in else "nothing",
            float(body.urdf[0]),
            float(body.found[0]),
            *(float(end[0]) if np.isfinite(end[0]) else None for end in (body.low, body.high)),
            *(_place(point) for point in (body.urdf, body.found)),
        )
        for body in found.bodies
    )
    table = TableBlock(
        ("link", "differs in", "mass by URDF [kg]", "as found [kg]", "95 % from", "to")
        + ("centre of mass by URDF [mm]", "as found [mm]"),
        rows,
        "Links with all that is fixed to them, largest change first; centre of mass in the link's "
        "frame. A link differs where the URDF's value lies outside the 95 % interval, that of the "
        "centre of mass as wide as those of mass and first moment allow. What one motion tells of "
        "a chain of links are combinations of their parameters, so that single masses may be open "
        "where the torque is not.",
        "bodies.csv",
        {"nothing": "quiet"},
        3,
    )
    if not found.urdf:
        return (table,)
    text = (
        f"[{URDF_FILE}]({URDF_FILE}) is the robot's URDF with these bodies in its inertial "
        "elements; comments, meshes' names and all else are those of the file given."
    )
    if not found.elsewhere:
        return table, Text(text)
    text += " A URDF's inertial elements cannot carry, so that they stand in model.toml alone:"
    return table, Text(text), Points(found.elsewhere)


def _place(point: np.ndarray) -> str:
    return ", ".join(number(1e3 * x, 3) for x in point[1:])


WORDS = Words(
    "gap",
    named=named,
    ranges=_ranges,
    sized=_sized,
    unit_after=_unit,
    removed=_removed,
    body_value=_body_value,
    many_effects=MANY_EFFECTS,
    many_parameters=MANY,
    no_change=NO_CHANGE,
    minus=MINUS,
    urdf_file=URDF_FILE,
    inf=math.inf,
)
