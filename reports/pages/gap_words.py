"""The answer of a run of `gap` in words."""

from __future__ import annotations

import inspect
import math
from collections import Counter
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
    Naming,
    Remainder,
    named,
)
from pipeline.logs.errors import EffectError
from pipeline.logs.prepared.measurement import PROVE, Measurement
from pipeline.simulation.energy_change import PAIR, EnergyChange
from reports.page import cell_text

#: A band is worth a word when its gap is this many times the joint's.
STANDS_OUT = 1.25
#: Names of a column's wrong scale, and of what is the same in a log of current alone.
GAIN, CONSTANT = EffortGain.name, TorqueConstantError.name
#: Effects that the first lines tell in full.
TOLD = 3
#: Parameters of one effect that a sentence tells.
MANY = 6
#: Held-out rows turn one way where less than this share turns the other way.
ONE_WAY = 0.05
#: A change of energy below this is none, as a share.
NO_CHANGE = 5e-4


def number(value: float, digits: int = 3) -> str:
    """A rounded number."""
    return cell_text(float(value), digits)


def where_words(rows: Sequence[Where]) -> str:
    """Where the model as it was misses most."""
    whole = [row for row in rows if row.by == WHOLE]
    if not whole:
        return "No joint has enough rows to compare."
    worst = whole[0]
    ratio = worst.gap / worst.noise_floor if worst.noise_floor > 0 else math.inf
    text = (
        f"**Where:** model and machine disagree most at **{worst.joint}**: the gap (root mean "
        f"square of measured minus predicted) is {number(worst.gap)} {worst.unit}, "
        f"{number(ratio, 2)} times the noise floor and {percent(worst.share_of_total)} of the "
        "squared gap of all joints"
    )
    bands = [
        row
        for row in rows
        if row.joint == worst.joint and row.by != WHOLE and row.gap > STANDS_OUT * worst.gap
    ]
    if bands:
        top = max(bands, key=lambda row: row.gap)
        text += f"; it is largest {_circumstance(top)} ({number(top.gap)} {worst.unit})"
    return text + "."


def where_short(rows: Sequence[Where]) -> str:
    """At which joint the model as it was misses most, and by how much."""
    worst = next((row for row in rows if row.by == WHOLE), None)
    if worst is None:
        return "No joint has enough rows to compare."
    return (
        f"**Where:** most at **{worst.joint}**, {number(worst.gap)} {worst.unit} root mean square, "
        f"{percent(worst.share_of_total)} of the squared gap of all joints."
    )


def fitted_words(naming: Naming) -> str:
    """What was fitted to the logs, with its values."""
    if not naming.found:
        return "**Fitted:** nothing beside the tolerances of the machine's parts."
    levels = Counter(f.level for f in naming.found)
    sure = ", ".join(f"{count} {level}" for level, count in levels.items())
    sure = sure if len(naming.found) > 1 else naming.found[0].level
    return f"**Fitted:** {_named(naming.found)}; {sure}."


def _circumstance(row: Where) -> str:
    """A band in words."""
    return {
        "phase": f"in {row.band}",
        "direction": f"in the {row.band} direction",
        "speed": f"at {row.band} speed",
        "load": f"under {row.band} load",
        "power": f"where the joint is {row.band}",
        "reversal": "near reversals" if row.band == "near" else "away from reversals",
        "position": f"in the {row.band} third of its travel",
        "time": f"in the {row.band} third of the log",
    }.get(row.by, f"by {row.by}: {row.band}")


def what_words(naming: Naming, channels: Sequence[str], *, unexplained: bool) -> str:
    """What is missing.

    Args:
        naming: What was found.
        channels: That were compared.
        unexplained: Whether the model as written leaves more than noise.
    """
    if not naming.found:
        if unexplained:
            return "**What:** no effect of the catalogue explains it."
        if not naming.tried:
            return "**What:** the model file holds no effect."
        return (
            f"**What:** nothing is missing. {naming.tried} candidates were tried and none is "
            "needed beyond the stated tolerances of the machine's parts."
        )
    sure, near, suspected = (
        [f for f in naming.found if f.level == level]
        for level in (CONFIRMED, APPROXIMATE, SUSPECTED)
    )
    text = "**What:** "
    if sure:
        text += f"the model lacks {_named(sure)}."
    if near:
        text += " Approximate" if sure else "approximate"
        text += (
            f", closing a large part though the law or its size is not exactly the machine's: "
            f"{_named(near)}."
        )
    if not sure and not near:
        text += "no effect of the catalogue explains it."
    if suspected:
        text += f" Suspected, and not written into the model file: {_named(suspected)}."
    if len(naming.found) == 1:
        text += f" {meaning(naming.found[0].effect)}"
    return text + scale_words(naming.found, channels)


def scale_words(found: Sequence[Found], channels: Sequence[str]) -> str:
    """What to do about columns that read a multiple of what they should; empty without any."""
    hints = [(f.place[0], 1.0 / f.values["gain"]) for f in found if f.effect == GAIN]
    text = ""
    if hints:
        text += " A column that reads a multiple is usually the log's"
    if tuple(channels) == ("current",):
        column = CHANNEL_COLUMNS["current"]
        constants = [f for f in found if f.effect == CONSTANT]
        hints += [(f"{f.place[0]}__{column}", 1.0 + f.values["relative"]) for f in constants]
        if constants:
            text += (
                " A log of current alone cannot tell a motor's torque constant from a current "
                "column that reads a multiple"
            )
    if not text:
        return ""
    listed = [f'[columns."{name}"] scale = {scale:.3g}' for name, scale in hints[:TOLD]]
    return f"{text}: {'; '.join(listed)} in a mapping file brings it to what the model expects."


def _named(found: Sequence[Found]) -> str:
    """Effects with their places, the first ones with their parameters."""
    parts = [_with_parameters(f) for f in found[:TOLD]]
    parts += [named(f) for f in found[TOLD:]]
    return _listed(parts)


def _with_parameters(f: Found) -> str:
    """One finding; of many parameters the page's table tells the rest."""
    if len(f.members) > 1:
        sizes = _ranges(f.members)
        return f"**{named(f)}**" + (f" ({sizes})" if sizes else "")
    if len(f.parameters) > MANY:
        return f"**{named(f)}**"
    return f"**{named(f)}** ({parameters_text(f.parameters)})"


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


def meaning(effect: str) -> str:
    """One sentence on what an effect is."""
    try:
        doc = inspect.getdoc(type(effect_named(effect))) or ""
    except EffectError:
        return ""
    line = doc.split("\n", 1)[0]
    return f"`{effect}`: {line[0].lower()}{line[1:]}" if line else ""


def percent(share: float) -> str:
    """A share as a whole percentage."""
    return f"{100 * share:.0f} %"


def parameters_text(parameters: Sequence[Estimate]) -> str:
    """Values with their intervals."""
    return "; ".join(
        f"{p.name} {_sized(p.value, p)}{_unit(p.unit)}, 95 % interval {_sized(p.low, p)} to "
        f"{_sized(p.high, p)}"
        for p in parameters
    )


def _sized(value: float, p: Estimate) -> str:
    """A number with the decimals that its interval is worth."""
    half = 0.5 * (p.high - p.low)
    if not 1e-4 <= half < 100.0:
        return number(value)
    decimals = max(0, -math.floor(math.log10(half)))
    text = f"{value:.{decimals}f}"
    return ("0" if float(text) == 0 else text).replace("-", "\N{MINUS SIGN}")


def shrink_words(
    found: Sequence[Found],
    joints: Sequence[str],
    whole: tuple[float, float, float],
    unit: str,
    noise: float,
) -> str:
    """How much smaller the gap of the model as written is, on held-out data.

    Args:
        found: Effects with their proof.
        joints: Per effect, the joint at which it shows.
        whole: Gap of all joints of the model as it was, with tolerances, and as written.
        unit: Of the gap.
        noise: Noise floor of all joints.
    """
    before, tolerances, after = whole
    pairs = [(f, joint) for f, joint in zip(found, joints, strict=True) if f.written]
    left_out = len(found) - len(pairs)
    text = (
        "**How much smaller:** on held-out data, which had no say in what is named, how far it is "
        "trusted or with which value, "
    )
    if not pairs:
        text += (
            f"the gap over all joints is {number(before)} {unit} of the model as it was and "
            f"{number(tolerances)} {unit} with the tolerances of its parts"
        )
        if left_out:
            text += "; no name is sure enough to be written into the model file"
    else:
        parts = [_fall(f, joint) for f, joint in pairs[:TOLD]]
        text += "; ".join(parts)
        if len(pairs) > TOLD:
            text += f"; and so on with {len(pairs) - TOLD} more"
        text += (
            f". Over all joints it {_moves(before, after)} from {number(before)} {unit} of the "
            f"model as it was to {number(after)} {unit} of the model file as written"
        )
    text += f", root mean square (noise floor {number(noise)} {unit})."
    if left_out and pairs:
        names = "suspected name is" if left_out == 1 else "suspected names are"
        text += f" {left_out} {names} not in that file, nor in that number."
    return text


def _fall(f: Found, joint: str) -> str:
    """What one effect closes at the joint where it shows."""
    effect = named(f)
    if math.isnan(f.gap_before):
        return f"{effect} cannot be proved: no row of {joint} is held out"
    share = removed(f.gap_before, f.gap_after, f.noise_floor)
    closed = "" if share is None else f", {percent(share)} of what lies above the noise"
    return (
        f"with {effect} the gap of {joint} {_moves(f.gap_before, f.gap_after)} from "
        f"{number(f.gap_before)} to {number(f.gap_after)} {f.unit}{closed} (noise floor "
        f"{number(f.noise_floor)} {f.unit})"
    )


def _moves(before: float, after: float) -> str:
    return "rises" if after > before else "falls"


def removed(before: float, after: float, noise: float) -> float | None:
    """Share of the gap above the noise floor that an effect removes; None where there is none."""
    above = before**2 - noise**2
    if above <= 0:
        return None
    left = max(after**2 - noise**2, 0.0)
    return 1.0 - math.sqrt(min(left / above, 1.0))


def _priced(change: EnergyChange, alternative: str) -> list[str]:
    return [n for n in dict.fromkeys((*PAIR, alternative)) if n in change.before]


def cost_words(change: EnergyChange, alternative: str) -> str:
    """Energy of one gait cycle before and after, by actuator; empty where none can be told."""
    parts = []
    for name in _priced(change, alternative):
        if name not in change.after:
            continue
        old, new = change.before[name].cycle, change.after[name].cycle
        if abs(new - old) <= NO_CHANGE * old:
            parts.append(f"{name} stays at {number(old, 4)} J")
        else:
            share = f"{100 * (new - old) / old:+.1f}".replace("-", "\N{MINUS SIGN}")
            parts.append(f"{name} {old:.1f} to {new:.1f} J ({share} %)")
    return "; ".join(parts)


def energy_words(change: EnergyChange, alternative: str) -> str:
    """What it costs in joules, and the break-even."""
    names, parts = _priced(change, alternative), cost_words(change, alternative)
    text = "**What it costs:** "
    if parts:
        text += f"electrical energy of one gait cycle of the whole robot, by actuator: {parts}."
    silent = [name for name in names if name not in change.after]
    if silent:
        against = f"against `{alternative}`" if alternative else "against a joint without actuator"
        return f"{text}{' ' * bool(parts)}" + (
            f"No number is given for {_listed(silent)}, nor a break-even: friction and inertia "
            f"were found {against}, other actuators have gears with losses of their own in the "
            "catalogue, and the one cannot be added to the other."
        )
    before, after = change.break_even_before, change.break_even_after
    if math.isnan(before) and math.isnan(after):
        return text + (
            " Reversible and irreversible actuators have no break-even in the middle legs, with or "
            "without what was found."
        )
    return text + (
        " Break-even: in the middle legs the irreversible actuator uses less energy than the "
        f"reversible one where the robot stands still for more than {_share(before)} of the time, "
        f"and with what was found for more than {_share(after)}."
    )


def held_out_words(measurements: Sequence[Measurement]) -> str:
    """Which stretches prove."""
    spans = []
    for m in measurements:
        inside = np.concatenate([[0], (m.part == PROVE).astype(np.int8), [0]])
        edges = np.flatnonzero(np.diff(inside))
        for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            spans.append((m.name, float(m.time[start]), float(m.time[stop - 1])))
    whole = sum(stop - start for _, start, stop in spans)
    text = f"Held out are {number(whole)} s in {len(spans)} stretch{'es' * (len(spans) != 1)}"
    if len(spans) <= TOLD:
        listed = [f"{start:.2f} to {stop:.2f} s of log '{name}'" for name, start, stop in spans]
        text += f": {_listed(listed)}"
    return text + "."


def one_way_words(measurements: Sequence[Measurement], joints: Sequence[int]) -> list[str]:
    """Joints with an effect whose held-out rows all turn one way, a remark each."""
    out = []
    for j in dict.fromkeys(joints):
        speeds = np.concatenate([m.v[(m.part == PROVE) & m.mask[:, j], j] for m in measurements])
        ahead = float((speeds > 0).mean()) if speeds.size else 0.5
        if min(ahead, 1.0 - ahead) < ONE_WAY:
            way = "positive" if ahead > 0.5 else "negative"
            out.append(
                f"**Note:** the held-out rows of {measurements[0].joints[j]} turn in its {way} "
                "direction only; the other is fitted, not proved. A second log with `--holdout` "
                "proves both."
            )
    return out


def suspected_words(suspected: Sequence[str]) -> tuple[str, ...]:
    """What speaks against the log itself, before anything that was found in it."""
    return tuple(
        f"**Nothing below is an explanation while this stands:** {text}." for text in suspected
    )


def left_words(remainders: Sequence[Remainder]) -> str:
    """What stays unexplained and what it looks like."""
    left = [r for r in remainders if r.significant]
    if not left:
        text = (
            "**What is left** by the model as written is noise: nothing significant stays "
            "unexplained."
        )
        blind = list(dict.fromkeys(r.joint for r in remainders if not r.rows))
        if blind:
            text += f" Of {_listed(blind)} no row is held out: there only the fitted rows say so."
        return text
    parts = [
        f"{r.joint}: {number(r.error)} {r.unit}, {number(r.error / r.noise_floor, 2)} times the "
        f"noise floor{'; ' + r.description if r.description else ''}"
        for r in sorted(left, key=lambda r: -r.error / max(r.noise_floor, 1e-300))
    ]
    more = f" and {len(parts) - 3} more joints" if len(parts) > 3 else ""
    return f"**What stays unexplained** by the model as written: {'. '.join(parts[:3])}{more}."


def doubts(found: Sequence[Found]) -> list[str]:
    """Names that are not certain, each in words."""
    parts = []
    for f in found:
        if f.rivals:
            others = _listed([f"{name} at {place_text(place)}" for name, place in f.rivals])
            parts.append(f"{named(f)} cannot be told from {others} on this motion")
        if f.reason:
            parts.append(f"{named(f)} is {f.level}: {f.reason}")
    return parts


def rival_words(found: Sequence[Found], decides: bool) -> str:
    """Effects that cannot be told apart, and what would decide; empty without any."""
    parts = doubts(found)
    if not parts:
        return ""
    more = f"; {len(parts) - TOLD} more remarks of this kind below" if len(parts) > TOLD else ""
    text = f"**Not decided:** {'; '.join(parts[:TOLD])}{more}."
    if any(f.rivals for f in found):
        text += (
            " Log the motion of [deciding_motion.csv](deciding_motion.csv), which stays inside the "
            "robot's limits, and give it with `--holdout`."
            if decides
            else " A motion that would decide: "
            + "; ".join(dict.fromkeys(f.excitation for f in found if f.rivals))
            + "."
        )
    return text


def _listed(items: Sequence[str]) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def _unit(unit: str) -> str:
    return "" if unit in ("", "1") else f" {unit}"


def _share(value: float) -> str:
    return "no share" if math.isnan(value) else f"{100 * value:.1f} %"
