"""Tables of the gap workflow: quality, where, candidates, found, bodies, deciding motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from actuators.arrays import Array
from pipeline.column import column as declared
from pipeline.simulation.found_bodies import FoundBody
from reports.table import Meaning, Table


@dataclass(frozen=True)
class QualityRow:
    """One check of one column of a log."""

    table: ClassVar = "quality"
    about: ClassVar = "What the logs are worth, check by check."
    log: str = declared("name of the log")
    column: str = declared("header in the log format; empty for the log as a whole")
    check: str = declared("what was looked at")
    value: float = declared("what was found", "see unit")
    unit: str = declared("unit of value")
    verdict: str = declared("ok, masked (rows left out), warning or refused")
    detail: str = declared("in words, with the remedy where there is one")


@dataclass(frozen=True)
class WhereRow:
    """Where model and machine disagree."""

    table: ClassVar = "where"
    about: ClassVar = "Measured minus predicted, by joint and circumstance; ranked."
    rank: int = declared("1 is the largest part of the gap above the noise floor", "1")
    joint: str = declared("name of the joint")
    by: str = declared("what the rows are sorted by")
    band: str = declared("which of them")
    rows: int = declared("rows compared", "1")
    gap: float = declared("root mean square of measured minus predicted", "see unit")
    mean: float = declared("mean of measured minus predicted", "see unit")
    noise_floor: float = declared(
        "standard deviation of the sensor's noise in the same bandwidth", "see unit"
    )
    unit: str = declared("unit of gap, mean and noise_floor")
    share_of_total: float = declared("share of the squared gap of all joints", "1", "share of all")
    share_above_noise: float = declared(
        "of it, beyond the squared noise floor", "1", "of it above noise"
    )


@dataclass(frozen=True)
class CandidateRow:
    """An effect at a place that was tried."""

    table: ClassVar = "candidates"
    about: ClassVar = "Every effect at every place that was tried."
    effect: str = declared("name in the catalogue of effects")
    joint: str = declared("joint it acts at; empty where it acts on all")
    place: str = declared("joints, link or ground it acts on")
    validation_before: float | None = declared(
        "gap without it on validation rows, by the others", "see unit"
    )
    validation_after: float | None = declared(
        "the same with it; empty where it was not tried in earnest", "see unit"
    )
    unit: str = declared("unit of both")
    identifiable: bool = declared("whether this motion could show it")
    verdict: str = declared(
        "accepted, rejected, not identifiable on this motion, indistinguishable from"
    )
    reason: str = declared("in words")


@dataclass(frozen=True)
class FoundRow:
    """A parameter of an accepted effect."""

    table: ClassVar = "found"
    about: ClassVar = "What the model lacked."
    order: int = declared("in which it was accepted; one row per parameter", "1", "no.")
    effect: str = declared("name in the catalogue of effects")
    law: str = declared("which of the effect's laws; empty where it has but one")
    amounts_to: str = declared("effects of one term each that the law is the sum of, joined by +")
    joint: str = declared("joint it acts at; empty where it acts on all")
    place: str = declared("joints, link, column or ground it acts on, joined by +")
    parameter: str = declared("of the effect")
    value: float = declared("best estimate", "see unit")
    ci_low: float = declared("lower end of the 95 % interval", "see unit", "95 % from")
    ci_high: float = declared("upper end of the 95 % interval", "see unit", "to")
    unit: str = declared("unit of value and interval")
    gap_before: float | None = declared(
        "gap without it, held-out data, root mean square; empty without rows", "see gap_unit"
    )
    gap_after: float | None = declared("the same with it", "see gap_unit")
    gap_unit: str = declared("unit of both gaps and the noise floor")
    noise_floor: float = declared("of the joints it acts on", "see gap_unit")
    level: str = declared("confirmed, approximate (both written) or suspected (not written)")
    reason: str = declared("why it is not confirmed; empty where it is")
    written: bool = declared(
        "whether model.toml holds it; one that it leaves out: gap beside the file's"
    )


_BODY = {"mass_kg": "mass", **{f"center_{axis}_m": f"centre of mass, {axis}" for axis in "xyz"}}


def bodies(found: Sequence[FoundBody]) -> Table:
    """Bodies by the URDF and as found: mass and centre of mass, each with its interval."""
    columns: dict[str, list[Any]] = {"link": [body.link for body in found]}
    meanings: dict[str, Meaning] = {"link": ("with all that is fixed to it", "")}
    for k, (name, what) in enumerate(_BODY.items()):
        for source, tail in (
            ("urdf", " by the URDF, in the link's frame"),
            ("found", " as found"),
            ("low", ": lower end of the 95 % interval; empty where there is none"),
            ("high", ": upper end of the 95 % interval; empty where there is none"),
        ):
            values = [float(getattr(body, source)[k]) for body in found]
            columns[f"{source}_{name}"] = [x if np.isfinite(x) else None for x in values]
            meanings[f"{source}_{name}"] = (f"{what}{tail}", name.rpartition("_")[2])
    columns["differs_in"] = ["+".join(body.differs_in) for body in found]
    meanings["differs_in"] = ("where the URDF's value lies outside the interval, joined by +", "")
    text = "Bodies by the URDF and as found, the largest change first."
    return Table("bodies", columns, meanings, text)


def deciding_motion(time: Array, joints: Sequence[str], position: Array) -> Table:
    """A trajectory in the columns of a log.

    Args:
        time: Shape (N,) [s].
        position: Shape (N, J) [rad].
    """
    headers = [f"{joint}__position_rad" for joint in joints]
    meanings = {h: (f"target of {joint}", "rad") for h, joint in zip(headers, joints, strict=True)}
    return Table(
        "deciding_motion",
        {"time_s": time, **dict(zip(headers, position.T, strict=True))},
        {"time_s": ("time", "s"), **meanings},
        "Motion inside the robot's limits that tells the indistinguishable effects apart.",
    )
