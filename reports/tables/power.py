"""Tables of `gap power`: shares of the supply's power, drives, samples."""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import ClassVar

from pipeline.column import column as declared
from pipeline.identification.supply.account import Account
from reports.table import Table, table_of


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
    samples = [
        SampleRow(
            log=balance.logs[rows.log[k]],
            begin_s=float(rows.begin[k]),
            end_s=float(rows.end[k]),
            measured_W=float(rows.power[k]),
            model_W=float(rows.predicted[k]),
            explained_W=float(balance.explained[k]),
            proves=bool(balance.proves[k]),
        )
        for k in range(len(rows))
    ]
    return [
        table_of(PowerRow, balance.shares),
        table_of(DriveRow, balance.drives),
        table_of(SampleRow, samples),
    ]
