"""Rows of the trials' tables, and rates with Wilson's intervals computed from these rows alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, Final

from pipeline.blind.answer import CONFIRMED
from pipeline.blind.score import CLASS, DRAWN, RIGHT, WHOLE, WRONG, Score, Verdict

Row = dict[str, Any]
#: Normal quantile of a two-sided 95 % interval.
_QUANTILE: Final = NormalDist().inv_cdf(0.975)


@dataclass(frozen=True)
class Rate:
    """How often something came out as it should, or should not."""

    name: str  #: Key.
    meaning: str  #: In words.
    hits: int  #: How often.
    count: int  #: Out of how many.
    #: Least and largest share that is aimed at; None where nothing is.
    aim: tuple[float, float] | None

    @property
    def share(self) -> float:
        """NaN of none."""
        return self.hits / self.count if self.count else float("nan")

    @property
    def reached(self) -> bool | None:
        """Whether the share lies inside the aim; None where there is none, or no trial."""
        if self.aim is None or not self.count:
            return None
        return self.aim[0] <= self.share <= self.aim[1]


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927).

    Args:
        hits: Of `count` independent trials.
        count: 0 gives 0 to 1.
    """
    if not count:
        return 0.0, 1.0
    p, square = hits / count, _QUANTILE**2 / count
    middle, half = p + square / 2, (square * (p * (1 - p) + square / 4)) ** 0.5
    return max((middle - half) / (1 + square), 0.0), min((middle + half) / (1 + square), 1.0)


def trial_row(s: Score) -> Row:
    """One row of `trials.csv`."""
    t, hidden = s.truth, s.truth["hidden"]
    return {
        **{name: t[name] for name in ("source", "seed", "trial", "kind", "machine")},
        "joints": len(t["joints"]),
        "bodies_off": t["off"],
        "background_friction": any(t["background"]),
        "motions": " ".join(t["motions"]),
        "rate_Hz": t["rate_Hz"],
        "encoder_bits": t["bits"],
        "positions": t["sides"],
        "hidden": ";".join(h["effect"] for h in hidden),
        "hidden_place": ";".join("+".join(h["place"]) for h in hidden),
        "hidden_values": ";".join(
            " ".join(f"{k}={v:.6g}" for k, v in h["values"].items()) for h in hidden
        ),
        "z": min((float(h["z"]) for h in hidden), default=None),
        "visible": all(h["visible"] for h in hidden),
        "alike": ";".join(" ".join(h["alike"]) for h in hidden),
        "exit_code": s.answer.code,
        "cpu_s": s.answer.seconds,
        "written": len(s.names),
        "found": ";".join("yes" if f else "no" for f in s.found),
        "all_found": all(s.found) and bool(hidden),
        "wrong": ";".join(_text(v) for v in s.wrong),
        "wrong_confirmed": ";".join(_text(v) for v in s.wrong_confirmed),
        "message": s.answer.message,
    }


def _text(v: Verdict) -> str:
    return f"{v.name.effect} at {'+'.join(v.name.place)}"


def name_rows(s: Score) -> list[Row]:
    """Rows of `names.csv`, one per written name."""
    return [
        {
            **{name: s.truth[name] for name in ("source", "trial", "kind", "machine")},
            "effect": v.name.effect,
            "place": "+".join(v.name.place),
            "level": v.name.level,
            "rivals": " ".join(v.name.rivals),
            "values": " ".join(
                f"{k}={x:.4g}[{low:.4g},{high:.4g}]" for k, (x, low, high) in v.name.values.items()
            ),
            "verdict": v.verdict,
            "why": v.why,
            "intervals": v.intervals,
            "intervals_that_cover": v.covered,
            "mass_ratio": v.kilograms,
            "mass_inside": _inside(v),
        }
        for v in s.names
    ]


def _inside(v: Verdict) -> bool | None:
    """Whether a payload's mass is within 5 %, or its interval holds the truth."""
    if v.kilograms is None:
        return None
    value, low, high = v.name.values["mass"]
    return abs(v.kilograms - 1) <= 0.05 or low <= value / v.kilograms <= high


def _kind(kind: str) -> Callable[[Row], bool]:
    return lambda row: bool(row["kind"] == kind)


def _seen(kind: str) -> Callable[[Row], bool]:
    return lambda row: bool(row["kind"] == kind and row["visible"])


def _given(row: Row) -> bool:
    return row["exit_code"] in (0, 1)


def _silent(row: Row) -> bool:
    return row["exit_code"] == 0 and not row["wrong"]


Test = Callable[[Row], Any]
#: Name to meaning, aim, which trials, and which of them are hits.
_OF_TRIALS: Final[dict[str, tuple[str, tuple[float, float] | None, Test, Test]]] = {
    "single_right": (
        "one hidden effect the log can show: named and written, or its class",
        (0.9, 1.0),
        _seen("single"),
        lambda r: r["all_found"],
    ),
    "single_right_of_all": (
        "the same of every single effect, visible or not",
        None,
        _kind("single"),
        lambda r: r["all_found"],
    ),
    "several_all_found": (
        "two or three hidden effects the log can show: all named and written",
        (0.7, 1.0),
        _seen("several"),
        lambda r: r["all_found"],
    ),
    "wrong_confirmed": (
        "every trial: a wrong name confirmed and written",
        (0.0, 0.01),
        lambda r: True,
        lambda r: r["wrong_confirmed"],
    ),
    "wrong_trials": (
        "every trial: a wrong name written, whatever its level",
        None,
        lambda r: True,
        lambda r: r["wrong"],
    ),
    "empty_silent_and_explained": (
        "nothing hidden: no wrong name written, and called explained",
        (0.97, 1.0),
        _kind("empty"),
        _silent,
    ),
    "outside_not_confirmed": (
        "a cause outside the catalogue: no wrong name confirmed",
        (0.97, 1.0),
        _kind("outside"),
        lambda r: _given(r) and not r["wrong_confirmed"],
    ),
    "outside_unexplained": (
        "a cause outside the catalogue that the log can show: called unexplained",
        (0.9, 1.0),
        _seen("outside"),
        lambda r: r["exit_code"] == 1,
    ),
    "answered": ("every trial: an answer was given", (1.0, 1.0), lambda r: True, _given),
}


def rates(trials: Sequence[Row], names: Sequence[Row]) -> list[Rate]:
    """All rates of some trials.

    Args:
        trials: Rows of `trials.csv`.
        names: Those rows of `names.csv` that belong to them.
    """
    out = []
    for name, (meaning, aim, among, hit) in _OF_TRIALS.items():
        chosen = [row for row in trials if among(row)]
        out.append(Rate(name, meaning, sum(bool(hit(r)) for r in chosen), len(chosen), aim))
    for joints in ((1, 1), (2, 4), (5, 9), (10, 99)):
        own = [r for r in trials if r["kind"] == "empty" and joints[0] <= r["joints"] <= joints[1]]
        text = f"{joints[0]} to {joints[1]} joints" if joints[1] > 1 else "one joint"
        name = f"empty_{joints[0]}_joints"
        out.append(
            Rate(name, f"the same of machines with {text}", sum(map(_silent, own)), len(own), None)
        )
    # Bodies are fitted link by link, and are one name.
    bodies = {(r["source"], r["trial"]): r for r in names if r["effect"] == WHOLE}
    judged = [r for r in names if r["verdict"] != DRAWN and r["effect"] != WHOLE]
    judged += bodies.values()
    sure = [row for row in judged if row["level"] == CONFIRMED]
    out += [
        _names("wrong_names", "written names that are wrong", (0.0, 0.05), judged, (WRONG,)),
        _names("confirmed_right", "confirmed names that are right", (0.97, 1.0), sure, _GOOD),
        Rate(
            "intervals_cover",
            "95 % intervals of hidden parameters that hold the truth",
            sum(row["intervals_that_cover"] for row in names),
            sum(row["intervals"] for row in names),
            (0.93, 0.97),
        ),
    ]
    weights = [row for row in names if row["mass_inside"] is not None]
    hits = sum(bool(row["mass_inside"]) for row in weights)
    text = "payloads that were named: kilograms within 5 % or inside their interval"
    return [*out, Rate("payload_mass", text, hits, len(weights), None)]


_GOOD: Final = (RIGHT, CLASS)


def _names(
    name: str, text: str, aim: tuple[float, float], rows: Sequence[Row], verdicts: tuple[str, ...]
) -> Rate:
    return Rate(name, text, sum(r["verdict"] in verdicts for r in rows), len(rows), aim)


def rate_rows(trials: Sequence[Row], names: Sequence[Row]) -> Iterator[Row]:
    """Rows of `rates.csv`: by source, and of both together where there are two."""
    sources = sorted({str(row["source"]) for row in trials})
    for source in [*sources, *(["all"] if len(sources) > 1 else [])]:
        own = [[r for r in rows if source in ("all", r["source"])] for rows in (trials, names)]
        for rate in rates(*own):
            low, high = wilson(rate.hits, rate.count)
            yield {
                "source": source,
                "rate": rate.name,
                "meaning": rate.meaning,
                "hits": rate.hits,
                "count": rate.count,
                "share": rate.share if rate.count else None,
                "low": low,
                "high": high,
                "aim_low": rate.aim[0] if rate.aim else None,
                "aim_high": rate.aim[1] if rate.aim else None,
                "reached": rate.reached,
            }


def effect_rows(trials: Sequence[Row]) -> Iterator[Row]:
    """Rows of `by_effect.csv`: how each effect fared that was hidden alone."""
    alone = [row for row in trials if row["kind"] in ("single", "outside")]
    for effect in sorted({row["hidden"] for row in alone}):
        for source in sorted({row["source"] for row in alone}):
            own = [r for r in alone if r["hidden"] == effect and r["source"] == source]
            if own:
                yield {
                    "effect": effect,
                    "source": source,
                    "trials": len(own),
                    "visible": sum(bool(r["visible"]) for r in own),
                    "found": sum(bool(r["all_found"]) for r in own),
                    "unexplained": sum(r["exit_code"] == 1 for r in own),
                    "wrong": sum(bool(r["wrong"]) for r in own),
                    "wrong_confirmed": sum(bool(r["wrong_confirmed"]) for r in own),
                }
