"""Tables of the blind trials: every trial, the rates, the confusion matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from reports.column import column
from reports.table import Meaning, Table, table_of


@dataclass(frozen=True)
class TrialRow:
    """One blind trial."""

    table: ClassVar = "blind_trials"
    about: ClassVar = "Every blind trial, judged."
    trial: float = column("number in the matrix", "1")
    seed: float = column("of everything drawn", "1")
    motion: str = column("leg on its stand, or walk of the hexapod")
    noise: str = column("level of the sensors' noise")
    hidden: str = column("effects hidden, empty for none; several by semicolons")
    hidden_place: str = column("where")
    hidden_values: str = column("parameters in SI units")
    in_catalogue: str = column("whether the workflow has names for all of them")
    strength: float = column("expected RMS torque over the noise within 20 Hz, of the weakest", "1")
    misfit_of_nothing: float = column(
        "what tolerances alone leave of the effect, of the weakest", "sd"
    )
    nearest_rival: str = column("effect that could best pass for it")
    nearest_rival_place: str = column("where")
    misfit_of_rival: float = column("what that rival leaves of it", "sd")
    visible: str = column("whether the log could show all that is hidden")
    tellable: str = column("whether it could tell it from every rival")
    same_class: str = column("rivals that this log cannot tell from it")
    sealed_sha256: str = column("hash of the sealed truth")
    exit_code: float = column("of gap: 0 explained, 1 a part unexplained; -1 no answer", "1")
    named: str = column("effects found, in order")
    named_place: str = column("where")
    named_rivals: str = column("what the answer calls indistinguishable from them")
    named_doubts: str = column("why the answer does not trust them")
    named_values: str = column("parameters with 95 % intervals")
    outcome: str = column("of the first name: right, wrong place, wrong name, unexplained, nothing")
    right_and_written: str = column("whether the first name is right and the model file holds it")
    right_names: str = column("hidden effects that were named, or whose class was")
    written_names: str = column("of them, those whose name the model file holds")
    wrong_names: str = column("given with confidence, neither hidden nor of a hidden one's class")
    intervals: float = column("parameters of rightly named effects, not doubted", "1")
    intervals_that_cover: float = column("of them, those whose interval holds the truth", "1")
    gap_closed: float = column(
        "share of the gap above the noise floor, in squares, closed on prove", "1"
    )
    message: str = column("of gap, where it gave no answer")


@dataclass(frozen=True)
class RateRow:
    """How often the workflow was right."""

    table: ClassVar = "blind_rates"
    about: ClassVar = "How often the workflow was right, with Wilson's intervals."
    rate: str = column("name")
    meaning: str = column("of which trials which share")
    hits: float = column("how many", "1")
    trials: float = column("out of how many", "1")
    share: float = column("hits over trials", "1")
    low: float = column("lower end of Wilson's 95 % interval", "1")
    high: float = column("upper end", "1")
    aim_low: float = column("what is aimed at: at least; empty where nothing is", "1")
    aim_high: float = column("at most", "1")
    reached: str = column(
        "whether the share lies inside the aim; above one with two ends, by chance, is no miss"
    )


@dataclass(frozen=True)
class EffectRow:
    """How an effect fared alone."""

    table: ClassVar = "blind_by_effect"
    about: ClassVar = "How each effect fared alone."
    effect: str = column("hidden alone")
    in_catalogue: str = column("whether the workflow has a name for it")
    trials: float = column("with it alone", "1")
    visible: float = column("of them, those whose log could show it", "1")
    right_first: float = column("of the visible, those where the first name is right", "1")
    right_and_written: float = column(
        "of the visible, those where the model file holds that name too", "1"
    )
    right_and_written_of_all: float = column("the same of all trials", "1")
    called_unexplained: float = column("of all trials", "1")
    wrong: float = column("of all trials, those with a wrong name given with confidence", "1")


@dataclass(frozen=True)
class StandardTrialRow:
    """One trial of the standard matrix."""

    table: ClassVar = "blind_standard_trials"
    about: ClassVar = "Every trial of the standard matrix, judged."
    trial: float = column("number in the matrix", "1")
    seed: float = column("of everything drawn", "1")
    machine: str = column("pendulum, leg or arm on a fixed base")
    background: str = column(
        "machine: friction everywhere, bodies off by 10 to 20 %; weighed: 3 %; bare"
    )
    positions: str = column("measured at joints, motors or both")
    hidden: str = column("effects hidden, empty for none; several by semicolons")
    hidden_place: str = column("where")
    hidden_values: str = column("parameters in SI units")
    in_catalogue: str = column("whether the workflow has names for all of them")
    misfit: float = column("what the background alone leaves of the weakest", "sd")
    visible: str = column("whether the log could show all that is hidden")
    sealed_sha256: str = column("hash of the sealed truth")
    exit_code: float = column(
        "of gap: 0 explained, 1 a part unexplained; 2 refused, -1 no answer", "1"
    )
    named: str = column("effects found, in order")
    named_place: str = column("where")
    named_level: str = column("confirmed, approximate or suspected")
    named_written: str = column("whether the model file holds it")
    named_share: str = column("how often the name wins on redrawn blocks; nan where not stated")
    named_right: str = column("right, wrong, or background: what every machine has")
    right_first: str = column("the first name that counts is hidden, at its place, and written")
    all_right: str = column("every hidden effect is named at its place and written")
    wrong_names: str = column("written and neither hidden nor background")
    wrong_confirmed: str = column("of them, those that are confirmed")
    intervals: float = column("parameters of right names that are written", "1")
    intervals_that_cover: float = column("of them, those whose interval holds the truth", "1")
    payload_mass: str = column(
        "right within 5 % or its interval; wrong; not named; empty: no payload"
    )
    message: str = column("of gap, where it gave no answer")


@dataclass(frozen=True)
class StandardEffectRow:
    """How an effect fared alone in the standard matrix."""

    table: ClassVar = "blind_standard_by_effect"
    about: ClassVar = "How each effect fared alone."
    effect: str = column("hidden alone")
    in_catalogue: str = column("whether the workflow has a name for it")
    trials: float = column("with it alone", "1")
    visible: float = column("of them, those whose log could show it", "1")
    right_and_written: float = column("of the visible: named first, at its place, and written", "1")
    right_and_written_of_all: float = column("the same of all trials", "1")
    called_unexplained: float = column("of all trials", "1")
    wrong: float = column("of all trials, those with a wrong name written", "1")
    wrong_confirmed: float = column("of all trials, those with a wrong name confirmed", "1")


@dataclass(frozen=True)
class ReliabilityRow:
    """How often names stated as so sure are right."""

    table: ClassVar = "blind_standard_reliability"
    about: ClassVar = "How sure names are, stated and actual."
    stated_as: str = column("level, or share of redrawn blocks on which the name wins")
    band: str = column("the level, or the range of shares")
    stated: float = column("mean of the stated shares; empty where none is stated", "1")
    names: float = column("so stated that count", "1")
    right: float = column("of them, those that are right", "1")
    actual: float = column("right over names", "1")
    low: float = column("lower end of Wilson's 95 % interval", "1")
    high: float = column("upper end", "1")


def blind_table(kind: Any, rows: Sequence[Mapping[str, Any]]) -> Table:
    """A table of rows that the trials' files hold as mappings.

    Args:
        kind: One of the rows above.
        rows: Header to value.
    """
    return table_of(kind, [kind(**row) for row in rows])


def standard_rates(rows: Sequence[Mapping[str, Any]]) -> Table:
    """The rates of the standard matrix."""
    text = "Standard matrix: rates, with Wilson's intervals."
    every = [RateRow(**row) for row in rows]
    return table_of(RateRow, every, name="blind_standard_rates", about=text)


def confusion(hidden: Sequence[str], named: Sequence[str], counts: NDArray[np.int_]) -> Table:
    """Hidden effect against the first name.

    Args:
        hidden: Rows.
        named: Columns.
        counts: Shape (rows, columns).
    """
    headers = ["named_" + name.strip("()").replace(" ", "_").replace(",", "") for name in named]
    meanings: dict[str, Meaning] = {
        "hidden": ("what was in the log, where the log could show it", "")
    }
    for header, name in zip(headers, named, strict=True):
        meanings[header] = (f"trials in which the first answer was {name}", "1")
    return Table(
        "blind_confusion",
        {"hidden": list(hidden), **dict(zip(headers, counts.T, strict=True))},
        meanings,
        "Hidden effect against the first name given.",
    )
