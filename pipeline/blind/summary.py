"""From scores to the rates that are aimed at, the confusion matrix and rows of tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from csv import DictReader
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.rates import Rate
from pipeline.blind.score import Score
from pipeline.blind.truth import place_text
from pipeline.blind.twin.effects import UNCATALOGUED
from pipeline.blind.twin.matrix import TrialSpec
from pipeline.effects.registry import EFFECTS

Row = dict[str, Any]
NOTHING, UNEXPLAINED, FAILED = "(nothing)", "(unexplained)", "(no answer)"
WRONG_PLACE = "(right name, wrong place)"


@dataclass(frozen=True)
class Scored:
    """One trial of the matrix and how it went."""

    spec: TrialSpec
    score: Score
    sha256: str


def rates(rows: Sequence[Row]) -> list[Rate]:
    """What the trials were made for, from the rows of `blind_trials.csv` alone.

    Args:
        rows: From `trial_rows` or `read_rows`.
    """

    def rate(
        name: str,
        meaning: str,
        aim: tuple[float, float] | None,
        among: Callable[[Row], bool],
        hit: Callable[[Row], bool],
    ) -> Rate:
        chosen = [row for row in rows if among(row)]
        return Rate(name, meaning, sum(hit(row) for row in chosen), len(chosen), aim)

    def pair(row: Row) -> bool:
        return row["in_catalogue"] and len(_several(row["hidden"])) == 2

    def empty(row: Row) -> bool:
        return not row["hidden"]

    def unknown(row: Row) -> bool:
        return bool(row["hidden"]) and not row["in_catalogue"]

    def answered(row: Row) -> bool:
        return row["exit_code"] in (0, 1)

    out = [
        rate(
            "right_and_written",
            "one hidden effect the log can show: the first name is right (name and place, or its "
            "class) and the model file holds it",
            (0.95, 1.0),
            lambda row: single(row) and row["visible"],
            lambda row: row["right_and_written"],
        ),
        rate(
            "right_and_written_where_no_class",
            "the same, where the log can tell the effect from every other",
            (0.95, 1.0),
            lambda row: single(row) and row["tellable"],
            lambda row: row["right_and_written"],
        ),
        rate(
            "right_and_written_of_all",
            "the same of every hidden effect, whether the log can show it or not",
            None,
            single,
            lambda row: row["right_and_written"],
        ),
        rate(
            "right_first",
            "one hidden effect the log can show: the first name is right, trusted or doubted",
            None,
            lambda row: single(row) and row["visible"],
            lambda row: row["outcome"] == "right",
        ),
        rate(
            "wrong_name",
            "anything hidden, effects without a name in the catalogue among it: any wrong name "
            "given with confidence",
            (0.0, 0.01),
            lambda row: bool(row["hidden"]),
            lambda row: bool(row["wrong_names"]),
        ),
        rate(
            "wrong_name_of_known",
            "the same, where the catalogue has a name for all that is hidden",
            (0.0, 0.01),
            lambda row: bool(row["hidden"]) and row["in_catalogue"],
            lambda row: bool(row["wrong_names"]),
        ),
        rate(
            "nothing_found_in_empty_logs",
            "nothing hidden: nothing named",
            (0.98, 1.0),
            empty,
            lambda row: answered(row) and not row["named"],
        ),
        rate(
            "empty_logs_called_explained",
            "nothing hidden: nothing named and no part called unexplained",
            (0.98, 1.0),
            empty,
            lambda row: row["exit_code"] == 0 and not row["named"],
        ),
        rate(
            "both_of_a_pair",
            "two hidden effects the log can show: both named, nothing wrong with confidence",
            (0.9, 1.0),
            lambda row: pair(row) and row["visible"],
            lambda row: len(_several(row["right_names"])) == 2 and not row["wrong_names"],
        ),
        rate(
            "both_of_a_pair_written",
            "the same, and the model file holds both",
            (0.9, 1.0),
            lambda row: pair(row) and row["visible"],
            lambda row: len(_several(row["written_names"])) == 2 and not row["wrong_names"],
        ),
        rate(
            "unknown_called_unexplained",
            "an effect outside the catalogue that the log can tell from all in it: called "
            "unexplained",
            (0.95, 1.0),
            lambda row: unknown(row) and row["tellable"],
            lambda row: row["exit_code"] == 1,
        ),
        rate(
            "unknown_not_misnamed",
            "the same: no name given with confidence",
            (0.95, 1.0),
            lambda row: unknown(row) and row["tellable"],
            lambda row: answered(row) and not row["wrong_names"],
        ),
    ]
    named = [row for row in rows if row["hidden"] and row["in_catalogue"]]
    out.append(
        Rate(
            "intervals_that_cover",
            "95 % intervals of rightly named effects, not doubted, that hold the truth",
            sum(row["intervals_that_cover"] for row in named),
            sum(row["intervals"] for row in named),
            (0.90, 0.99),
        )
    )
    closed = [row["gap_closed"] for row in rows if single(row) and row["outcome"] == "right"]
    closed = [share for share in closed if share is not None and np.isfinite(share)]
    out.append(
        Rate(
            "gap_closed",
            "rightly named effects, of a gap above the noise floor at least 90 % closed on "
            "held-out data",
            sum(share >= 0.9 for share in closed),
            len(closed),
            (0.95, 1.0),
        )
    )
    return out


def single(row: Row) -> bool:
    """Whether one effect of the catalogue is hidden."""
    return bool(row["in_catalogue"]) and len(_several(row["hidden"])) == 1


def by_effect(rows: Sequence[Row]) -> list[Row]:
    """How each effect that was hidden alone fared, in the catalogue's order, then the others."""
    alone = [row for row in rows if len(_several(row["hidden"])) == 1]
    out = []
    for effect in dict.fromkeys((*EFFECTS, *UNCATALOGUED)):
        own = [row for row in alone if row["hidden"] == effect]
        if not own:
            continue
        seen = [row for row in own if row["visible"]]
        out.append(
            {
                "effect": effect,
                "in_catalogue": effect in EFFECTS,
                "trials": len(own),
                "visible": len(seen),
                "right_first": sum(row["outcome"] == "right" for row in seen),
                "right_and_written": sum(row["right_and_written"] for row in seen),
                "right_and_written_of_all": sum(row["right_and_written"] for row in own),
                "called_unexplained": sum(row["exit_code"] == 1 for row in own),
                "wrong": sum(bool(row["wrong_names"]) for row in own),
            }
        )
    return out


def read_rows(path: Path) -> list[Row]:
    """The rows of a `blind_trials.csv`, with the types that `trial_rows` gives them."""
    with path.open(encoding="utf-8", newline="") as file:
        return [{key: _typed(key, text) for key, text in row.items()} for row in DictReader(file)]


def _typed(key: str, text: str) -> Any:
    if key in ("in_catalogue", "visible", "tellable", "right_and_written"):
        return text == "true"
    if key in ("exit_code", "intervals", "intervals_that_cover"):
        return int(text)
    if key == "gap_closed":
        return float(text) if text else None
    return text


def _several(text: str) -> list[str]:
    return [part for part in text.split("; ") if part]


def confusion(trials: Sequence[Scored]) -> tuple[list[str], list[str], NDArray[np.int_]]:
    """Hidden effect against the first name, for trials with one or nothing hidden.

    A hidden effect that the log could not show has a row of its own, named with a question mark;
    a class named for its member counts as the member.

    Returns:
        Rows, columns and counts of shape (rows, columns).
    """
    names = list(EFFECTS)
    rows = [*names, *UNCATALOGUED, NOTHING]
    columns = [*names, WRONG_PLACE, UNEXPLAINED, NOTHING, FAILED]
    counts = np.zeros((len(rows), len(columns)), dtype=np.int_)
    for t in trials:
        if len(t.score.hidden) > 1:
            continue
        row = t.score.hidden[0].effect if t.score.hidden else NOTHING
        if t.score.hidden and not t.score.visible:
            continue
        counts[rows.index(row), columns.index(_said(t.score))] += 1
    return rows, columns, counts


def _said(score: Score) -> str:
    if score.outcome == "right" and score.hidden[0].in_catalogue:
        return score.hidden[0].effect
    special = {"failed": FAILED, "nothing": NOTHING, "unexplained": UNEXPLAINED}
    if score.outcome in special:
        return special[score.outcome]
    return WRONG_PLACE if score.outcome == "wrong place" else score.answer.named[0].effect


def trial_rows(trials: Sequence[Scored]) -> list[Row]:
    """Rows of `blind_trials.csv`."""
    return [_row(t) for t in trials]


def _row(t: Scored) -> Row:
    s, named = t.score, t.score.answer.named
    worst = min(s.judged, key=lambda j: j.nearest.misfit, default=None)
    return {
        "trial": t.spec.number,
        "seed": t.spec.seed,
        "motion": t.spec.motion,
        "noise": t.spec.noise,
        "hidden": _join(one.effect for one in s.hidden),
        "hidden_place": _join(place_text(one.place) for one in s.hidden),
        "hidden_values": _join(
            " ".join(f"{k}={v:.6g}" for k, v in one.values.items()) for one in s.hidden
        ),
        "in_catalogue": all(one.in_catalogue for one in s.hidden),
        "strength": min((one.strength for one in s.hidden), default=None),
        "misfit_of_nothing": min((j.nothing for j in s.judged), default=None),
        "nearest_rival": worst.rivals[0].effect if worst and worst.rivals else "",
        "nearest_rival_place": place_text(worst.rivals[0].place) if worst and worst.rivals else "",
        "misfit_of_rival": worst.rivals[0].misfit if worst and worst.rivals else None,
        "visible": s.visible,
        "tellable": s.alone,
        "same_class": _join(
            f"{r.effect} at {place_text(r.place)}" for j in s.judged for r in j.like
        ),
        "sealed_sha256": t.sha256,
        "exit_code": s.answer.code,
        "named": _join(n.effect for n in named),
        "named_place": _join(place_text(n.place) for n in named),
        "named_rivals": _join(n.rivals for n in named if n.rivals),
        "named_doubts": _join(n.doubt for n in named if n.doubt),
        "named_values": _join(
            " ".join(
                f"{k}={value:.6g} ({low:.6g} to {high:.6g})"
                for k, (value, low, high) in n.intervals.items()
            )
            for n in named
        ),
        "outcome": s.outcome,
        "right_and_written": s.right_and_written,
        "right_names": _join(f"{effect} at {place_text(place)}" for effect, place in s.right),
        "written_names": _join(f"{effect} at {place_text(place)}" for effect, place in s.written),
        "wrong_names": _join(f"{effect} at {place_text(place)}" for effect, place in s.wrong),
        "intervals": s.intervals,
        "intervals_that_cover": s.covered,
        "gap_closed": s.closed,
        "message": s.answer.message if s.answer.code not in (0, 1) else "",
    }


def _join(parts: Any) -> str:
    return "; ".join(parts)
