"""The answer of a run of `gap`: what the paragraphs of `templates/gap.jinja` are about."""

from __future__ import annotations

import inspect
import math
from collections.abc import Sequence

import numpy as np

from pipeline.effects.base import CHANNEL_COLUMNS, place_text
from pipeline.effects.motor import TorqueConstantError
from pipeline.effects.registry import effect_named, told_apart
from pipeline.effects.sensors import EffortGain
from pipeline.identification.compare.circumstances import WHOLE, Where
from pipeline.identification.results import (
    APPROXIMATE,
    CONFIRMED,
    SUSPECTED,
    UNEXPLAINED,
    Estimate,
    Found,
    Member,
    named,
)
from pipeline.identification.workflow.outcome import Outcome
from pipeline.logs.errors import EffectError
from pipeline.simulation.cycle_energy import PAIR, EnergyChange
from pipeline.simulation.found_bodies import FoundBodies, FoundBody
from reports.page import TableBlock
from reports.typeset import MINUS, number
from reports.words import Words, listed

#: Of the folder of results, beside the model file.
URDF_FILE = "model.urdf"
#: A band is worth a word when its gap is this many times the joint's.
STANDS_OUT = 1.25
#: Effects, bodies or remarks that a sentence names.
MANY_EFFECTS = 3
#: Parameters of one effect that a sentence names.
MANY = 6
#: A change of energy below this is none, as a share.
NO_CHANGE = 5e-4
#: Verdicts to how they look.
TONES = {
    **dict.fromkeys(("accepted", "noise", "ok"), "good"),
    **dict.fromkeys(("unexplained", "warning", "refused"), "bad"),
    **dict.fromkeys(("rejected", "not identifiable on this motion", "masked"), "quiet"),
}
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
        f"{f' {own[0].unit}' if own[0].unit not in ('', '1') else ''}"
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


def smaller_words(
    found: Sequence[Found],
    joints: Sequence[str],
    whole: tuple[float, float],
    unit: str,
    noise: float,
) -> str:
    """How much smaller the gap of the model as written is, on held-out data.

    Args:
        joints: Per effect, the joint at which it shows.
        whole: Gap of all joints of the model as it was and as written.
    """
    pairs = [(f, joint) for f, joint in zip(found, joints, strict=True) if f.written]
    return WORDS("smaller", pairs, len(found) - len(pairs), whole, unit, noise)


def priced(change: EnergyChange, alternative: str) -> list[str]:
    """The actuators whose energy is worth a word."""
    return [n for n in dict.fromkeys((*PAIR, alternative)) if n in change.before]


def energy_words(change: EnergyChange, alternative: str) -> str:
    """What it costs in joules, and the break-even."""
    return WORDS("energy", change, priced(change, alternative), alternative)


def low_confidence(found: Sequence[Found]) -> list[str]:
    """Names that are not certain, each in words."""
    parts = []
    for f in found:
        if f.rivals:
            others = listed([f"{name} at {place_text(place)}" for name, place in f.rivals])
            shown = told_apart(f.effect, *(name for name, _ in f.rivals))
            parts.append(f"{named(f)} cannot be told from {others} on this motion ({shown})")
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


WORDS = Words(
    "gap",
    named=named,
    ranges=_ranges,
    sized=_sized,
    body_value=_body_value,
    many_effects=MANY_EFFECTS,
    many_parameters=MANY,
    no_change=NO_CHANGE,
    minus=MINUS,
    urdf_file=URDF_FILE,
    inf=math.inf,
    block=TableBlock,
    tones=TONES,
    unexplained=UNEXPLAINED,
)
