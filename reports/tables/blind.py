"""Tables of the blind trials: every trial, the rates, the confusion matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reports.table import Table, table_from_rows

TRIALS = {
    "trial": ("number in the matrix", "1"),
    "seed": ("of everything drawn", "1"),
    "motion": ("leg on its stand, or walk of the hexapod", ""),
    "noise": ("level of the sensors' noise", ""),
    "hidden": ("effects hidden, empty for none; several by semicolons", ""),
    "hidden_place": ("where", ""),
    "hidden_values": ("parameters in SI units", ""),
    "in_catalogue": ("whether the workflow has names for all of them", ""),
    "strength": ("expected RMS torque over the noise within 20 Hz, of the weakest", "1"),
    "misfit_of_nothing": ("what tolerances alone leave of the effect, of the weakest", "sd"),
    "nearest_rival": ("effect that could best pass for it", ""),
    "nearest_rival_place": ("where", ""),
    "misfit_of_rival": ("what that rival leaves of it", "sd"),
    "visible": ("whether the log could show all that is hidden", ""),
    "tellable": ("whether it could tell it from every rival", ""),
    "same_class": ("rivals that this log cannot tell from it", ""),
    "sealed_sha256": ("hash of the sealed truth", ""),
    "exit_code": ("of gap: 0 explained, 1 a part unexplained; -1 no answer", "1"),
    "named": ("effects found, in order", ""),
    "named_place": ("where", ""),
    "named_rivals": ("what the answer calls indistinguishable from them", ""),
    "named_doubts": ("why the answer does not trust them", ""),
    "named_values": ("parameters with 95 % intervals", ""),
    "outcome": ("of the first name: right, wrong place, wrong name, unexplained, nothing", ""),
    "right_and_written": ("whether the first name is right and the model file holds it", ""),
    "right_names": ("hidden effects that were named, or whose class was", ""),
    "written_names": ("of them, those whose name the model file holds", ""),
    "wrong_names": ("given with confidence, neither hidden nor of a hidden one's class", ""),
    "intervals": ("parameters of rightly named effects, not doubted", "1"),
    "intervals_that_cover": ("of them, those whose interval holds the truth", "1"),
    "gap_closed": ("share of the gap above the noise floor, in squares, closed on prove", "1"),
    "message": ("of gap, where it gave no answer", ""),
}
RATES = {
    "rate": ("name", ""),
    "meaning": ("of which trials which share", ""),
    "hits": ("how many", "1"),
    "trials": ("out of how many", "1"),
    "share": ("hits over trials", "1"),
    "low": ("lower end of Wilson's 95 % interval", "1"),
    "high": ("upper end", "1"),
    "aim_low": ("what is aimed at: at least; empty where nothing is", "1"),
    "aim_high": ("at most", "1"),
    "reached": (
        "whether the share lies inside the aim; above one with two ends, by chance, is no miss",
        "",
    ),
}


BY_EFFECT = {
    "effect": ("hidden alone", ""),
    "in_catalogue": ("whether the workflow has a name for it", ""),
    "trials": ("with it alone", "1"),
    "visible": ("of them, those whose log could show it", "1"),
    "right_first": ("of the visible, those where the first name is right", "1"),
    "right_and_written": ("of the visible, those where the model file holds that name too", "1"),
    "right_and_written_of_all": ("the same of all trials", "1"),
    "called_unexplained": ("of all trials", "1"),
    "wrong": ("of all trials, those with a wrong name given with confidence", "1"),
}


STANDARD_TRIALS = {
    "trial": ("number in the matrix", "1"),
    "seed": ("of everything drawn", "1"),
    "machine": ("pendulum, leg or arm on a fixed base", ""),
    "background": (
        "machine: friction everywhere, bodies off by 10 to 20 %; weighed: 3 %; bare",
        "",
    ),
    "positions": ("measured at joints, motors or both", ""),
    "hidden": ("effects hidden, empty for none; several by semicolons", ""),
    "hidden_place": ("where", ""),
    "hidden_values": ("parameters in SI units", ""),
    "in_catalogue": ("whether the workflow has names for all of them", ""),
    "misfit": ("what the background alone leaves of the weakest", "sd"),
    "visible": ("whether the log could show all that is hidden", ""),
    "sealed_sha256": ("hash of the sealed truth", ""),
    "exit_code": ("of gap: 0 explained, 1 a part unexplained; 2 refused, -1 no answer", "1"),
    "named": ("effects found, in order", ""),
    "named_place": ("where", ""),
    "named_level": ("confirmed, approximate or suspected", ""),
    "named_written": ("whether the model file holds it", ""),
    "named_share": ("how often the name wins on redrawn blocks; nan where not stated", ""),
    "named_right": ("right, wrong, or background: what every machine has", ""),
    "right_first": ("the first name that counts is hidden, at its place, and written", ""),
    "all_right": ("every hidden effect is named at its place and written", ""),
    "wrong_names": ("written and neither hidden nor background", ""),
    "wrong_confirmed": ("of them, those that are confirmed", ""),
    "intervals": ("parameters of right names that are written", "1"),
    "intervals_that_cover": ("of them, those whose interval holds the truth", "1"),
    "payload_mass": ("right within 5 % or its interval; wrong; not named; empty: no payload", ""),
    "message": ("of gap, where it gave no answer", ""),
}
STANDARD_BY_EFFECT = {
    "effect": ("hidden alone", ""),
    "in_catalogue": ("whether the workflow has a name for it", ""),
    "trials": ("with it alone", "1"),
    "visible": ("of them, those whose log could show it", "1"),
    "right_and_written": ("of the visible: named first, at its place, and written", "1"),
    "right_and_written_of_all": ("the same of all trials", "1"),
    "called_unexplained": ("of all trials", "1"),
    "wrong": ("of all trials, those with a wrong name written", "1"),
    "wrong_confirmed": ("of all trials, those with a wrong name confirmed", "1"),
}
RELIABILITY = {
    "stated_as": ("level, or share of redrawn blocks on which the name wins", ""),
    "band": ("the level, or the range of shares", ""),
    "stated": ("mean of the stated shares; empty where none is stated", "1"),
    "names": ("so stated that count", "1"),
    "right": ("of them, those that are right", "1"),
    "actual": ("right over names", "1"),
    "low": ("lower end of Wilson's 95 % interval", "1"),
    "high": ("upper end", "1"),
}


def standard_trials(rows: Sequence[Mapping[str, Any]]) -> Table:
    """One row per trial of the standard matrix."""
    return table_from_rows(
        "blind_standard_trials",
        rows,
        STANDARD_TRIALS,
        "Every trial of the standard matrix, judged.",
    )


def standard_rates(rows: Sequence[Mapping[str, Any]]) -> Table:
    """One row per rate of the standard matrix."""
    return table_from_rows(
        "blind_standard_rates", rows, RATES, "Standard matrix: rates, with Wilson's intervals."
    )


def standard_by_effect(rows: Sequence[Mapping[str, Any]]) -> Table:
    """One row per effect of the standard matrix."""
    return table_from_rows(
        "blind_standard_by_effect", rows, STANDARD_BY_EFFECT, "How each effect fared alone."
    )


def standard_reliability(rows: Sequence[Mapping[str, Any]]) -> Table:
    """One row per level and per range of stated shares."""
    return table_from_rows(
        "blind_standard_reliability", rows, RELIABILITY, "How sure names are, stated and actual."
    )


def blind_trials(rows: Sequence[Mapping[str, Any]]) -> Table:
    """One row per trial."""
    return table_from_rows("blind_trials", rows, TRIALS, "Every blind trial, judged.")


def blind_rates(rows: Sequence[Mapping[str, Any]]) -> Table:
    """One row per rate."""
    return table_from_rows(
        "blind_rates", rows, RATES, "How often the workflow was right, with Wilson's intervals."
    )


def blind_by_effect(rows: Sequence[Mapping[str, Any]]) -> Table:
    """One row per effect."""
    return table_from_rows("blind_by_effect", rows, BY_EFFECT, "How each effect fared alone.")


def confusion(hidden: Sequence[str], named: Sequence[str], counts: NDArray[np.int_]) -> Table:
    """Hidden effect against the first name.

    Args:
        hidden: Rows.
        named: Columns.
        counts: Shape (rows, columns).
    """
    columns: dict[str, Any] = {"hidden": list(hidden)}
    meanings = {"hidden": ("what was in the log, where the log could show it", "")}
    for k, name in enumerate(named):
        header = "named_" + name.strip("()").replace(" ", "_").replace(",", "")
        columns[header] = counts[:, k]
        meanings[header] = (f"trials in which the first answer was {name}", "1")
    return Table(
        "blind_confusion", columns, meanings, "Hidden effect against the first name given."
    )
