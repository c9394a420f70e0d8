"""Tables of the gap workflow: quality, where, candidates, found, bodies, forward, power."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, ClassVar

import numpy as np

from actuators.errors import LegwattError
from pipeline.column import column
from pipeline.column import column as declared
from pipeline.effects.registry import effect_named
from pipeline.identification.results import INDISTINGUISHABLE, SUSPECTED, Candidate, Found
from pipeline.identification.supply.account import Account
from pipeline.identification.workflow.forward import Drive, by_model
from pipeline.machine.machine import MachineModel
from pipeline.simulation.found_bodies import FoundBody
from reports.table import Meaning, Quantity, Table, table_of, wide_series


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


@dataclass(frozen=True)
class ForwardRow:
    """Position error of a model that drives itself under the servos' law."""

    table: ClassVar = "forward"
    about: ClassVar = (
        "Measured minus simulated position; nothing but the first instant is taken from the log."
    )
    model: str = column("what the model has that the one of the rows before has not")
    log: str = column("name of the log; all: of all logs together")
    joint: str = column("name of the joint")
    position_rms_rad: float = column("root mean square of measured minus simulated position", "rad")
    position_mean_abs_rad: float = column("mean of its magnitude", "rad")
    position_largest_rad: float = column("largest magnitude", "rad")
    rows: int = column("rows compared", "1")


@dataclass(frozen=True)
class PowerRow:
    """One term of the supply's power."""

    table: ClassVar = "power"
    about: ClassVar = (
        "Mean power at the supply on held-out samples, term by term; the terms, measured and "
        "unexplained: the last is the one before less all above."
    )
    term: str = declared("name of the term")
    meaning: str = declared("what it is", of=attrgetter("words"))
    basis: str = declared("model: as log and model say; found: estimated; empty for sums")
    mean_W: float = declared("mean power, positive out of the supply", "W", of=attrgetter("watts"))
    mean_low_W: float = declared(
        "lower end of its 95 % interval", "W", "95 % from", of=attrgetter("watts_low")
    )
    mean_high_W: float = declared("upper end", "W", "to", of=attrgetter("watts_high"))
    coefficient: float | None = declared(
        "of the term's column, 1 for terms of the model; empty for sums", "see unit"
    )
    ci_low: float | None = declared(
        "lower end of its 95 % interval; empty where nothing was estimated",
        "see unit",
        "95 % from",
        of=attrgetter("low"),
    )
    ci_high: float | None = declared("upper end", "see unit", "to", of=attrgetter("high"))
    unit: str = declared("unit of coefficient and interval")
    indistinguishable_from: str = declared(
        "terms that predict as well in its place, joined by +",
        of=lambda share: "+".join(share.rivals),
    )


@dataclass(frozen=True)
class DriveRow:
    """One drive by log and model."""

    table: ClassVar = "power_drives"
    about: ClassVar = "Mean power into every drive by log and model, over all usable rows."
    joint: str = declared("name of the joint")
    leg: str = declared("its leg, or its own name without legs")
    torque: str = declared("whether the motor's torque is the log's or the model's")
    work_W: float = declared("motion of the bodies", "W", of=attrgetter("work"))
    friction_W: float = declared("of gears, bearings, rotors", "W", of=attrgetter("friction"))
    copper_W: float = declared("windings", "W", of=attrgetter("copper"))
    returned_W: float = declared(
        "out of the motor's terminals while it brakes, negative; in none of the others",
        "W",
        of=attrgetter("returned"),
    )


@dataclass(frozen=True)
class SampleRow:
    """One sample of the supply."""

    table: ClassVar = "power_samples"
    about: ClassVar = "Every sample of the supply, with the model's sum and all terms."
    log: str = declared("name of the log")
    begin_s: float = declared("since when it is averaged", "s")
    end_s: float = declared("its time", "s")
    measured_W: float = declared("by the supply", "W")
    model_W: float = declared("sum over the drives", "W")
    explained_W: float = declared("the same with all terms found", "W")
    proves: bool = declared("held out: nothing is estimated or chosen by it")


def power_tables(balance: Account) -> list[Table]:
    """Tables of an answer."""
    rows = balance.rows
    logs = [balance.logs[k] for k in rows.log]
    every = (rows.begin, rows.end, rows.power, rows.predicted, balance.explained, balance.proves)
    columns = zip(logs, *(values.tolist() for values in every), strict=True)
    samples = [SampleRow(*row) for row in columns]
    return [
        table_of(PowerRow, balance.shares),
        table_of(DriveRow, balance.drives),
        table_of(SampleRow, samples),
    ]


def candidates_table(
    candidates: Sequence[Candidate], found: Sequence[Found], model: MachineModel
) -> Table:
    """Rows of `candidates.csv`; what was found and has rivals says so, too."""
    rivals = {(f.effect, f.place): f.rivals for f in found}
    rows = [
        CandidateRow(
            effect=c.effect,
            joint=joint_of(model, c.effect, c.place),
            place="+".join(c.place),
            validation_before=_known(c.before),
            validation_after=_known(c.after),
            unit=c.unit,
            identifiable=c.identifiable,
            verdict=INDISTINGUISHABLE + "; ".join(f"{n} at {', '.join(p)}" for n, p in others)
            if (others := rivals.get((c.effect, c.place)))
            else c.verdict,
            reason=c.reason,
        )
        for c in candidates
    ]
    return table_of(CandidateRow, rows)


def found_table(found: Sequence[Found], model: MachineModel) -> Table:
    """Rows of `found.csv`, one per parameter."""
    rows: list[FoundRow] = []
    for f in found:
        for one in f.each:
            effect = effect_named(f.effect)
            rows += [
                FoundRow(
                    order=f.order,
                    effect=f.effect,
                    law=f.law,
                    amounts_to="+".join(effect.amounts_to(one.values)),
                    joint=joint_of(model, f.effect, one.place),
                    place="+".join(one.place),
                    parameter=p.name,
                    value=p.value,
                    ci_low=p.low,
                    ci_high=p.high,
                    unit=p.unit,
                    gap_before=_known(f.gap_before),
                    gap_after=_known(f.gap_after),
                    gap_unit=f.unit,
                    noise_floor=f.noise_floor,
                    level=SUSPECTED if f.level == SUSPECTED else one.level,
                    reason=f.reason,
                    written=f.written,
                )
                for p in one.parameters
            ]
    return table_of(FoundRow, rows)


def _known(value: float) -> float | None:
    """A number, or an empty cell where there is none."""
    return value if math.isfinite(value) else None


def joint_of(model: MachineModel, effect: str, place: Sequence[str]) -> str:
    """The joint at which an effect acts: that carries its link; empty where it acts on all."""
    if not place:
        return ""
    try:
        kind = effect_named(effect).place_kind
    except LegwattError:
        kind = "joint"
    if kind == "link":
        return model.links.get(place[0], "")
    if kind == "effort column":
        owner = place[0].partition("__")[0]
        return owner if owner in model.joints else ""
    return "+".join(name for name in place if name in model.joints)


def forward_table(drives: Sequence[Drive], joints: Sequence[str]) -> Table:
    """Rows of `forward.csv`: by model, log and joint, then over all logs."""
    rows = []
    for model, own in by_model(drives).items():
        for j, joint in enumerate(joints):
            misses = [(d.log.name, d.miss[:, j]) for d in own]
            misses.append(("all", np.concatenate([miss for _, miss in misses])))
            for log, miss in misses:
                size = np.abs(miss[np.isfinite(miss)])
                rms = float(np.sqrt(np.mean(size**2)))
                errors = (rms, float(np.mean(size)), float(size.max()))
                rows.append(ForwardRow(model, log, joint, *errors, int(size.size)))
    return table_of(ForwardRow, rows)


def rollout_tables(drives: Sequence[Drive], joints: Sequence[str]) -> list[Table]:
    """One wide table per log: what the machine did, the model as it was, and with all effects."""
    models = by_model(drives)
    first, last = next(iter(models.values())), list(models.values())[-1]
    tables = []
    for before, after in zip(first, last, strict=True):
        log, old, new = before.log, before.rollout, after.rollout
        tables.append(
            wide_series(
                f"rollout_{log.name}",
                log.time,
                joints,
                (
                    Quantity(
                        "measured_position",
                        "rad",
                        "position that the machine reached",
                        log.position,
                    ),
                    Quantity(
                        "before_position", "rad", "position of the model as it was", old.position
                    ),
                    Quantity(
                        "after_position",
                        "rad",
                        "position of the model with all effects",
                        new.position,
                    ),
                    Quantity(
                        "after_voltage",
                        "V",
                        "that its servo applies; empty with an open bridge",
                        new.voltage,
                    ),
                ),
                description=f"Forward simulation of log {log.name} under the servos' own law.",
            )
        )
    return tables
