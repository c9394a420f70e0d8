"""Rows of the standard matrix's tables: every trial, the rates, shares by effect, reliability."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from csv import DictReader
from pathlib import Path
from typing import Any, Final

import numpy as np

from pipeline.blind.rates import Rate, wilson
from pipeline.blind.standard.score import CONFIRMED, StandardScore
from pipeline.blind.truth import place_text
from pipeline.blind.twin.fixed.hidden import EFFECTS, UNKNOWN
from pipeline.blind.twin.fixed.matrix import StandardSpec

Row = dict[str, Any]
_TRUTHS: Final = ("in_catalogue", "visible", "right_first", "all_right")
_NUMBERS: Final = ("exit_code", "intervals", "intervals_that_cover")
#: Effects that are read off two positions.
TWO_SIDED: Final = ("joint_elasticity", "backlash")


def trial_row(spec: StandardSpec, s: StandardScore, sha256: str) -> Row:
    """One row of `blind_standard_trials.csv`."""
    named = s.answer.named
    hidden = s.hidden
    payload = next((h for h in hidden if h["effect"] == "link_mass"), None)
    return {
        "trial": spec.number,
        "seed": spec.seed,
        "machine": spec.machine,
        "background": spec.background,
        "positions": s.truth["sides"],
        "hidden": _join(h["effect"] for h in hidden),
        "hidden_place": _join(place_text(h["place"]) for h in hidden),
        "hidden_values": _join(
            " ".join(f"{k}={v:.6g}" for k, v in h["values"].items()) for h in hidden
        ),
        "in_catalogue": s.in_catalogue,
        "misfit": min((float(h["misfit"]) for h in hidden), default=None),
        "visible": s.visible,
        "sealed_sha256": sha256,
        "exit_code": s.answer.code,
        "named": _join(n.effect for n in named),
        "named_place": _join(place_text(n.place) for n in named),
        "named_level": _join(n.level for n in named),
        "named_written": _join("yes" if n.written else "no" for n in named),
        "named_share": _join(f"{n.share:.6g}" for n in named),
        "named_right": _join(_right(n, s) for n in named),
        "right_first": s.first,
        "all_right": bool(hidden) and len(s.right) == len(hidden),
        "wrong_names": _join(f"{n.effect} at {place_text(n.place)}" for n in s.wrong),
        "wrong_confirmed": _join(
            f"{n.effect} at {place_text(n.place)}" for n in s.wrong if n.level == CONFIRMED
        ),
        "intervals": s.intervals,
        "intervals_that_cover": s.covered,
        "payload_mass": _payload(payload, s) if payload else "",
        "message": s.answer.message if s.answer.code not in (0, 1) else "",
    }


def _right(n: Any, s: StandardScore) -> str:
    if n not in s.counted:
        return "background"
    if n in s.wrong:
        return "wrong"
    # A law of several terms is right by the one that is hidden, two halves by the whole.
    told = (n.effect, *n.amounts_to)
    hit = any(h["effect"] in told and list(n.place) == list(h["place"]) for h in s.hidden)
    return "right" if hit or n.written else "wrong"


def _payload(hidden: Any, s: StandardScore) -> str:
    """Whether a payload's mass is within 5 % or inside its interval."""
    mass = hidden["values"]["mass"]
    for n in s.counted:
        if n.effect == "link_mass" and list(n.place) == list(hidden["place"]) and n.written:
            value, low, high = n.intervals.get("mass", (np.nan, np.nan, np.nan))
            good = abs(value / mass - 1.0) <= 0.05 or low <= mass <= high
            return "right" if good else "wrong"
    return "not named"


def rates(rows: Sequence[Row]) -> list[Rate]:
    """What the matrix is made for, from the rows of `blind_standard_trials.csv` alone."""
    out = []
    for name, (meaning, aim, among, hit) in _RATES.items():
        chosen = [row for row in rows if among(row)]
        out.append(Rate(name, meaning, sum(bool(hit(r)) for r in chosen), len(chosen), aim))
    named = [row for row in rows if _known(row)]
    cover = sum(row["intervals_that_cover"] for row in named)
    meaning = "95 % intervals of right names that are written and hold the truth"
    count = sum(row["intervals"] for row in named)
    out.append(Rate("intervals_that_cover", meaning, cover, count, (0.9, 0.99)))
    return out


def _known(row: Row) -> bool:
    return bool(row["hidden"]) and bool(row["in_catalogue"])


def _unknown(row: Row) -> bool:
    return bool(row["hidden"]) and not row["in_catalogue"]


def _answered(row: Row) -> bool:
    return row["exit_code"] in (0, 1)


def _silent(row: Row) -> bool:
    return row["exit_code"] == 0 and "wrong" not in several(row["named_right"])


def _sides(row: Row) -> bool:
    return row["hidden"] in TWO_SIDED and row["positions"] == "both"


def single(row: Row) -> bool:
    """Whether one effect of the catalogue is hidden."""
    return bool(row["in_catalogue"]) and len(several(row["hidden"])) == 1


Test = Callable[[Row], Any]
#: Name to meaning, aim, which trials, and which of them are hits.
_RATES: Final[dict[str, tuple[str, tuple[float, float] | None, Test, Test]]] = {
    "right_and_written": (
        "one hidden effect the log can show: named first, at its place, and written",
        (0.9, 1.0),
        lambda r: single(r) and r["visible"],
        lambda r: r["right_first"],
    ),
    "right_and_written_of_all": (
        "the same of every single hidden effect, visible or not",
        None,
        lambda r: single(r),
        lambda r: r["right_first"],
    ),
    "all_of_several": (
        "two or three hidden effects the log can show: all named and written",
        None,
        lambda r: _known(r) and not single(r) and r["visible"],
        lambda r: r["all_right"],
    ),
    "wrong_and_written": (
        "every trial: a wrong name written, whatever its level",
        (0.0, 0.01),
        lambda r: True,
        lambda r: r["wrong_names"],
    ),
    "wrong_and_confirmed": (
        "every trial: a wrong name confirmed and written",
        (0.0, 0.02),
        lambda r: True,
        lambda r: r["wrong_confirmed"],
    ),
    "empty_silent_and_explained": (
        "nothing hidden: nothing named beside what every machine has, and called explained",
        (0.98, 1.0),
        lambda r: not r["hidden"],
        _silent,
    ),
    "unknown_not_confirmed": (
        "an effect outside the catalogue: no other name confirmed for it",
        (0.95, 1.0),
        _unknown,
        lambda r: _answered(r) and not r["wrong_confirmed"],
    ),
    "payload_mass": (
        "payloads that were named: mass within 5 % or inside its interval",
        None,
        lambda r: r["payload_mass"] in ("right", "wrong"),
        lambda r: r["payload_mass"] == "right",
    ),
    "two_sides": (
        "elasticity or play where the log holds both positions: right and written",
        (0.8, 1.0),
        _sides,
        lambda r: r["right_first"],
    ),
    "answered": ("every trial: an answer was given", None, lambda r: True, _answered),
}


def by_effect(rows: Sequence[Row]) -> list[Row]:
    """How each effect that was hidden alone fared."""
    out = []
    for effect in (*EFFECTS, *UNKNOWN):
        own = [row for row in rows if several(row["hidden"]) == [effect]]
        if not own:
            continue
        seen = [row for row in own if row["visible"]]
        out.append(
            {
                "effect": effect,
                "in_catalogue": effect in EFFECTS,
                "trials": len(own),
                "visible": len(seen),
                "right_and_written": sum(row["right_first"] for row in seen),
                "right_and_written_of_all": sum(row["right_first"] for row in own),
                "called_unexplained": sum(row["exit_code"] == 1 for row in own),
                "wrong": sum(bool(row["wrong_names"]) for row in own),
                "wrong_confirmed": sum(bool(row["wrong_confirmed"]) for row in own),
            }
        )
    return out


def reliability(rows: Sequence[Row]) -> list[Row]:
    """Stated against actual: of names of a level, and of a stated share, how many are right."""
    names = [
        (level, float(share) if share != "nan" else float("nan"), right == "right")
        for row in rows
        for level, share, right in zip(
            several(row["named_level"]),
            several(row["named_share"]),
            several(row["named_right"]),
            strict=True,
        )
        if right != "background"
    ]
    out = []
    for level in dict.fromkeys(level for level, _, _ in names):
        out.append(_stated("level", level, [n for n in names if n[0] == level]))
    for low, high in ((0.0, 0.5), (0.5, 0.8), (0.8, 0.95), (0.95, 1.01)):
        within = [n for n in names if low <= n[1] < high]
        if within:
            out.append(_stated("share", f"{low:g} to {min(high, 1.0):g}", within))
    return out


def _stated(kind: str, band: str, names: Sequence[tuple[str, float, bool]]) -> Row:
    hits, count = sum(right for _, _, right in names), len(names)
    low, high = wilson(hits, count)
    shares = [share for _, share, _ in names if np.isfinite(share)]
    return {
        "stated_as": kind,
        "band": band,
        "stated": float(np.mean(shares)) if shares else None,
        "names": count,
        "right": hits,
        "actual": hits / count,
        "low": low,
        "high": high,
    }


def read_rows(path: Path) -> list[Row]:
    """The rows of a `blind_standard_trials.csv`, with the types that `trial_row` gives them."""
    with path.open(encoding="utf-8", newline="") as file:
        return [{key: _typed(key, text) for key, text in row.items()} for row in DictReader(file)]


def _typed(key: str, text: str) -> Any:
    if key in _TRUTHS:
        return text == "true"
    return int(text) if key in _NUMBERS else text


def several(text: str) -> list[str]:
    """Parts of a cell that holds several."""
    return [part for part in text.split("; ") if part]


def _join(parts: Any) -> str:
    return "; ".join(parts)
