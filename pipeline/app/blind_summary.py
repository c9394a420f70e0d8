"""From scores to the rates that are aimed at, the confusion matrix and rows of tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.app.blind_rates import Rate
from pipeline.app.blind_score import Score
from pipeline.app.blind_truth import place_text
from pipeline.gap.effects.registry import EFFECTS
from pipeline.gap.twin.effects import UNCATALOGUED
from pipeline.gap.twin.matrix import TrialSpec

NOTHING, UNEXPLAINED, FAILED = "(nothing)", "(unexplained)", "(no answer)"
WRONG_PLACE = "(right name, wrong place)"


@dataclass(frozen=True)
class Scored:
    """One trial of the matrix and how it went."""

    spec: TrialSpec
    score: Score
    sha256: str

    @property
    def known(self) -> bool:
        """Whether everything hidden is in the catalogue, and something is hidden."""
        return bool(self.score.hidden) and all(one.in_catalogue for one in self.score.hidden)


def rates(trials: Sequence[Scored]) -> list[Rate]:
    """What the trials were made for."""

    def rate(
        name: str,
        meaning: str,
        aim: tuple[float, float],
        among: Callable[[Scored], bool],
        hit: Callable[[Scored], bool],
    ) -> Rate:
        chosen = [t for t in trials if among(t)]
        return Rate(name, meaning, sum(hit(t) for t in chosen), len(chosen), aim)

    def single(t: Scored) -> bool:
        return t.known and len(t.score.hidden) == 1

    def pair(t: Scored) -> bool:
        return t.known and len(t.score.hidden) == 2

    def empty(t: Scored) -> bool:
        return not t.score.hidden

    def unknown(t: Scored) -> bool:
        return bool(t.score.hidden) and not t.known

    out = [
        rate(
            "right_name_and_place_first",
            "one hidden effect the log can show: named first, with its place (or its class)",
            (0.95, 1.0),
            lambda t: single(t) and t.score.visible,
            lambda t: t.score.outcome == "right",
        ),
        rate(
            "right_where_no_class",
            "the same, where the log can tell the effect from every other",
            (0.95, 1.0),
            lambda t: single(t) and t.score.alone,
            lambda t: t.score.outcome == "right",
        ),
        rate(
            "confident_wrong_name",
            "one or two hidden effects: any name given with confidence that was not hidden",
            (0.0, 0.01),
            lambda t: t.known,
            lambda t: bool(t.score.wrong),
        ),
        rate(
            "confident_wrong_name_first",
            "the same, the first name only",
            (0.0, 0.01),
            lambda t: t.known,
            lambda t: _first_is_wrong(t.score),
        ),
        rate(
            "nothing_found_in_empty_logs",
            "nothing hidden: nothing named",
            (0.98, 1.0),
            empty,
            lambda t: t.score.answer.code in (0, 1) and not t.score.answer.named,
        ),
        rate(
            "empty_logs_called_explained",
            "nothing hidden: nothing named and no part called unexplained",
            (0.98, 1.0),
            empty,
            lambda t: t.score.outcome == "nothing",
        ),
        rate(
            "both_of_a_pair",
            "two hidden effects the log can show: both named, nothing wrong with confidence",
            (0.9, 1.0),
            lambda t: pair(t) and t.score.visible,
            lambda t: len(t.score.right) == 2 and not t.score.wrong,
        ),
        rate(
            "unknown_called_unexplained",
            "an effect outside the catalogue that the log can tell from all in it: called "
            "unexplained",
            (0.95, 1.0),
            lambda t: unknown(t) and t.score.alone,
            lambda t: t.score.answer.code == 1,
        ),
        rate(
            "unknown_not_misnamed",
            "the same: no name given with confidence",
            (0.95, 1.0),
            lambda t: unknown(t) and t.score.alone,
            lambda t: t.score.answer.code in (0, 1) and not t.score.wrong,
        ),
    ]
    named = [t.score for t in trials if t.known and t.score.intervals]
    out.append(
        Rate(
            "intervals_that_cover",
            "95 % intervals of rightly named effects, not doubted, that hold the truth",
            sum(s.covered for s in named),
            sum(s.intervals for s in named),
            (0.90, 0.99),
        )
    )
    closed = [t for t in trials if single(t) and t.score.outcome == "right"]
    closed = [t for t in closed if np.isfinite(t.score.closed)]
    out.append(
        Rate(
            "gap_closed",
            "rightly named effects, of a gap above the noise floor at least 90 % closed on prove",
            sum(t.score.closed >= 0.9 for t in closed),
            len(closed),
            (0.95, 1.0),
        )
    )
    return out


def _first_is_wrong(score: Score) -> bool:
    named = score.answer.named
    return bool(named) and (named[0].effect, named[0].place) in score.wrong


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


def trial_rows(trials: Sequence[Scored]) -> list[dict[str, Any]]:
    """Rows of `blind_trials.csv`."""
    return [_row(t) for t in trials]


def _row(t: Scored) -> dict[str, Any]:
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
        "wrong_names": _join(f"{effect} at {place_text(place)}" for effect, place in s.wrong),
        "intervals": s.intervals,
        "intervals_that_cover": s.covered,
        "gap_closed": s.closed,
        "message": s.answer.message if s.answer.code not in (0, 1) else "",
    }


def _join(parts: Any) -> str:
    return "; ".join(parts)
