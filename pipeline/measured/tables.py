"""Tables of measured robots: predicted beside measured, unknowns by what they move, quotients."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Final

from pipeline.column import column
from pipeline.measured.evaluate import Prediction
from pipeline.measured.facts import Facts, Unknown

#: Predictions by name of the quantity, of one robot.
Predictions = Mapping[str, Prediction]
_WORDS: Final = ("middle", "low end", "high end")


@dataclass(frozen=True)
class Measured:
    """A power that was measured, and what is predicted of it."""

    table: ClassVar = "measured"
    about: ClassVar = (
        "Electrical power predicted before any fit beside measured; the range is over every "
        "combination of what is not published."
    )
    robot: str = column("whose power was measured")
    quantity: str = column("what of it")
    measured_W: float | None = column("measured; the least where a range is told", "W")
    measured_to_W: float | None = column("the greatest where a range is told", "W")
    low_W: float | None = column("least predicted; empty where nothing is", "W")
    nominal_W: float | None = column("predicted with what is likeliest", "W")
    high_W: float | None = column("greatest predicted", "W")
    assumed: str = column("what is taken as likeliest of what is not published")
    note: str = column("what a reader should know of it")
    source: str = column("who measured")


@dataclass(frozen=True)
class UnknownMoves:
    """Something that is not published, and what it moves."""

    table: ClassVar = "unknowns"
    about: ClassVar = "What each unknown moves with all others as likeliest; the greatest first."
    robot: str = column("whose power is predicted")
    quantity: str = column("which of it")
    unknown: str = column("what is not published")
    low: str = column("with which the least power is predicted")
    high: str = column("with which the greatest is")
    low_W: float = column("predicted with the one", "W")
    high_W: float = column("predicted with the other", "W")
    moves_by_W: float = column("difference of the two", "W")


@dataclass(frozen=True)
class MeasuredRatio:
    """A quotient of two powers, in which much of what is not known cancels."""

    table: ClassVar = "measured_ratios"
    about: ClassVar = "Quotients: both powers of a quotient are predicted with the same unknowns."
    robot: str = column("whose powers these are")
    ratio: str = column("of what")
    measured: float | None = column("as measured", "1")
    low: float = column("least predicted", "1")
    nominal: float = column("predicted with what is likeliest", "1")
    high: float = column("greatest predicted", "1")
    note: str = column("what a reader should know of it")


def measured_rows(facts: Facts, found: Predictions) -> list[Measured]:
    """One row for each quantity."""
    ways = "; ".join(f"{u.name}: {u.way[0].name}" for u in facts.unknown if u.way)
    rows = []
    for quantity in facts.quantity:
        low, nominal, high = found[quantity.name].range if quantity.name in found else (None,) * 3
        watts = [*quantity.watts, None, None]
        more = found[quantity.name].refused if quantity.name in found else ""
        note = f"{quantity.note}; left out is what cannot be: {more}" if more else quantity.note
        rows.append(
            Measured(
                facts.title, quantity.name, watts[0], watts[1], low, nominal, high,
                ways if nominal is not None else "", note, facts.source,
            )
        )  # fmt: skip
    return rows


def unknown_rows(facts: Facts, found: Predictions) -> list[UnknownMoves]:
    """One row for each unknown of each quantity, by what it moves."""
    rows = []
    for quantity in facts.quantity:
        if quantity.name not in found:
            continue
        own = []
        for at, unknown in enumerate(facts.unknown):
            ends = found[quantity.name].ends(at)
            (first, low), (last, high) = ends[0], ends[-1]
            names = (_name(unknown, first), _name(unknown, last))
            own.append(
                UnknownMoves(
                    facts.title, quantity.name, unknown.name, *names, low, high, high - low
                )
            )
        rows += sorted(own, key=lambda row: -row.moves_by_W)
    return rows


def _name(unknown: Unknown, at: int) -> str:
    if unknown.way:
        return unknown.way[at].name
    return f"{_WORDS[at]} of {', '.join(unknown.numbers)}"


def ratio_rows(facts: Facts, found: Predictions) -> list[MeasuredRatio]:
    """One row for each quotient."""
    rows = []
    for ratio in facts.ratio:
        over, under = found[ratio.over], found[ratio.under]
        both = [over.power[c] / under.power[c] for c in over.power if c in under.power]
        nominal = over.power[over.nominal] / under.power[under.nominal]
        rows.append(
            MeasuredRatio(
                facts.title, ratio.name, ratio.measured, min(both), nominal, max(both), ratio.note
            )
        )
    return rows
