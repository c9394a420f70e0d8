"""Rows of the trials' tables, and rates with Wilson's intervals computed from these rows alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, ClassVar, Final

from pipeline.blind.answer import CONFIRMED
from pipeline.blind.score import CLASS, DRAWN, RIGHT, WHOLE, WRONG, Score, Verdict
from pipeline.column import column

Aim = tuple[float, float]
#: Normal quantile of a two-sided 95 % interval.
_QUANTILE: Final = NormalDist().inv_cdf(0.975)


@dataclass(frozen=True)
class TrialRow:
    """One blind trial."""

    table: ClassVar = "trials"
    about: ClassVar = "Every blind trial, judged."
    source: str = column("of the machine: own or mujoco")
    seed: int = column("of everything drawn", "1")
    trial: int = column("number", "1")
    kind: str = column("empty, single, several or outside the catalogue")
    machine: str = column("pendulum, leg, arm or walk")
    joints: int = column("of the machine", "1")
    bodies_off: float = column("largest error of the URDF's bodies", "1")
    background_friction: bool = column(
        "whether all joints have friction in addition to what is hidden"
    )
    motions: str = column("of the training log and of the test log")
    rate_Hz: float = column("of the logs", "Hz")
    encoder_bits: int = column("of the joints' encoders", "1")
    positions: str = column("measured at joints, motors or both")
    hidden: str = column("effects hidden, empty for none; several by semicolons")
    hidden_place: str = column("where")
    hidden_values: str = column("parameters in SI units")
    z: float | None = column("standard deviations in the log, of the weakest", "sd")
    visible: bool = column("whether the log could show all that is hidden")
    alike: str = column("names that this log cannot tell from it")
    exit_code: int = column("0 explained, 1 a part unexplained; 2 refused, -1 no answer", "1")
    cpu_s: float = column("of the answer", "s")
    written: int = column("names in the model file", "1")
    found: str = column("for every hidden effect whether it is named and written")
    all_found: bool = column("whether all are")
    wrong: str = column("written and not in the machine")
    wrong_confirmed: str = column("of them, those that are confirmed")
    message: str = column("of gap, where it gave no answer")


@dataclass(frozen=True)
class NameRow:
    """One written name."""

    table: ClassVar = "names"
    about: ClassVar = "Every written name, judged."
    source: str = column("of the machine")
    trial: int = column("number", "1")
    kind: str = column("of the trial")
    machine: str = column("of the trial")
    effect: str = column("in the catalogue's words")
    place: str = column("where")
    level: str = column("confirmed or approximate")
    rivals: str = column("names that the answer calls indistinguishable from it")
    values: str = column("parameters with 95 % intervals, SI")
    verdict: str = column("right, class (right as one of a class), wrong, flexible (no name)")
    why: str = column("what it is right by, or what the machine lacks")
    intervals: int = column("parameters that were hidden", "1")
    intervals_that_cover: int = column("of them, those whose interval holds the truth", "1")
    mass_ratio: float | None = column("of a payload: found over true", "1")
    mass_inside: bool | None = column("of a payload: within 5 % or inside its interval")


@dataclass(frozen=True)
class RateRow:
    """How often the workflow was right."""

    table: ClassVar = "rates"
    about: ClassVar = "How often the workflow was right, with Wilson's intervals."
    source: str = column("own, mujoco, or all")
    rate: str = column("name")
    meaning: str = column("of which trials which share")
    hits: int = column("how many", "1")
    count: int = column("out of how many", "1")
    share: float | None = column("hits over count", "1")
    low: float = column("lower end of Wilson's 95 % interval", "1")
    high: float = column("upper end", "1")
    aim_low: float | None = column("what is aimed at: at least; empty where nothing is", "1")
    aim_high: float | None = column("at most", "1")
    reached: bool | None = column("whether the share lies inside the aim")


@dataclass(frozen=True)
class EffectRow:
    """How an effect fared alone."""

    table: ClassVar = "by_effect"
    about: ClassVar = "How each effect fared that was hidden alone."
    effect: str = column("hidden alone")
    source: str = column("of the machine")
    trials: int = column("with it alone", "1")
    visible: int = column("of them, those whose log could show it", "1")
    found: int = column("named and written, or its class", "1")
    unexplained: int = column("called unexplained", "1")
    wrong: int = column("trials with a wrong name written", "1")
    wrong_confirmed: int = column("trials with a wrong name confirmed", "1")


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


def trial_row(s: Score) -> TrialRow:
    """One row of `trials.csv`."""
    t, hidden = s.truth, s.truth["hidden"]
    return TrialRow(
        **{name: t[name] for name in ("source", "seed", "trial", "kind", "machine")},
        joints=len(t["joints"]),
        bodies_off=t["off"],
        background_friction=any(t["background"]),
        motions=" ".join(t["motions"]),
        rate_Hz=t["rate_Hz"],
        encoder_bits=t["bits"],
        positions=t["sides"],
        hidden=";".join(h["effect"] for h in hidden),
        hidden_place=";".join("+".join(h["place"]) for h in hidden),
        hidden_values=";".join(
            " ".join(f"{k}={v:.6g}" for k, v in h["values"].items()) for h in hidden
        ),
        z=min((float(h["z"]) for h in hidden), default=None),
        visible=all(h["visible"] for h in hidden),
        alike=";".join(" ".join(h["alike"]) for h in hidden),
        exit_code=s.answer.code,
        cpu_s=s.answer.seconds,
        written=len(s.names),
        found=";".join("yes" if f else "no" for f in s.found),
        all_found=all(s.found) and bool(hidden),
        wrong=";".join(_text(v) for v in s.wrong),
        wrong_confirmed=";".join(_text(v) for v in s.wrong_confirmed),
        message=s.answer.message,
    )


def _text(v: Verdict) -> str:
    return f"{v.name.effect} at {'+'.join(v.name.place)}"


def name_rows(s: Score) -> list[NameRow]:
    """Rows of `names.csv`, one per written name."""
    return [
        NameRow(
            **{name: s.truth[name] for name in ("source", "trial", "kind", "machine")},
            effect=v.name.effect,
            place="+".join(v.name.place),
            level=v.name.level,
            rivals=" ".join(v.name.rivals),
            values=" ".join(
                f"{k}={x:.4g}[{low:.4g},{high:.4g}]" for k, (x, low, high) in v.name.values.items()
            ),
            verdict=v.verdict,
            why=v.why,
            intervals=v.intervals,
            intervals_that_cover=v.covered,
            mass_ratio=v.kilograms,
            mass_inside=_inside(v),
        )
        for v in s.names
    ]


def blind_rows(scores: Sequence[Score]) -> dict[Any, list[Any]]:
    """Rows of every table by their kind."""
    trials = [trial_row(s) for s in scores]
    names = [row for s in scores for row in name_rows(s)]
    shares, effects = [*rate_rows(trials, names)], [*effect_rows(trials)]
    return {TrialRow: trials, NameRow: names, RateRow: shares, EffectRow: effects}


def _inside(v: Verdict) -> bool | None:
    """Whether a payload's mass is within 5 %, or its interval holds the truth."""
    if v.kilograms is None:
        return None
    value, low, high = v.name.values["mass"]
    return abs(v.kilograms - 1) <= 0.05 or low <= value / v.kilograms <= high


def _kind(kind: str) -> Callable[[TrialRow], bool]:
    return lambda row: bool(row.kind == kind)


def _seen(kind: str) -> Callable[[TrialRow], bool]:
    return lambda row: bool(row.kind == kind and row.visible)


def _given(row: TrialRow) -> bool:
    return row.exit_code in (0, 1)


def _silent(row: TrialRow) -> bool:
    return row.exit_code == 0 and not row.wrong


Test = Callable[[TrialRow], Any]
#: Name to meaning, aim, which trials, and which of them are hits.
_OF_TRIALS: Final[dict[str, tuple[str, Aim | None, Test, Test]]] = {
    "single_right": (
        "one hidden effect the log can show: named and written, or its class",
        (0.9, 1.0),
        _seen("single"),
        lambda r: r.all_found,
    ),
    "single_right_of_all": (
        "the same of every single effect, visible or not",
        None,
        _kind("single"),
        lambda r: r.all_found,
    ),
    "several_all_found": (
        "two or three hidden effects the log can show: all named and written",
        (0.7, 1.0),
        _seen("several"),
        lambda r: r.all_found,
    ),
    "wrong_confirmed": (
        "every trial: a wrong name confirmed and written",
        (0.0, 0.01),
        lambda r: True,
        lambda r: r.wrong_confirmed,
    ),
    "wrong_trials": (
        "every trial: a wrong name written, whatever its level",
        None,
        lambda r: True,
        lambda r: r.wrong,
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
        lambda r: _given(r) and not r.wrong_confirmed,
    ),
    "outside_unexplained": (
        "a cause outside the catalogue that the log can show: called unexplained",
        (0.9, 1.0),
        _seen("outside"),
        lambda r: r.exit_code == 1,
    ),
    "answered": ("every trial: an answer was given", (1.0, 1.0), lambda r: True, _given),
}


def _rates(
    trials: Sequence[TrialRow], names: Sequence[NameRow]
) -> Iterator[tuple[str, str, Aim | None, list[bool]]]:
    """Name, meaning and aim of every rate of some trials, and for each that counts whether it hits.

    Args:
        trials: Rows of `trials.csv`.
        names: Those rows of `names.csv` that belong to them.
    """
    for name, (meaning, aim, among, hit) in _OF_TRIALS.items():
        yield name, meaning, aim, [bool(hit(row)) for row in trials if among(row)]
    for least, most in ((1, 1), (2, 4), (5, 9), (10, 99)):
        own = [r for r in trials if r.kind == "empty" and least <= r.joints <= most]
        text = f"{least} to {most} joints" if most > 1 else "one joint"
        text = f"the same of machines with {text}"
        yield f"empty_{least}_joints", text, None, [_silent(row) for row in own]
    # Bodies are fitted link by link, and are one name.
    bodies = {(r.source, r.trial): r for r in names if r.effect == WHOLE}
    judged = [r for r in names if r.verdict != DRAWN and r.effect != WHOLE]
    judged += bodies.values()
    wrong = [row.verdict == WRONG for row in judged]
    yield "wrong_names", "written names that are wrong", (0.0, 0.05), wrong
    sure = [row.verdict in (RIGHT, CLASS) for row in judged if row.level == CONFIRMED]
    yield "confirmed_right", "confirmed names that are right", (0.97, 1.0), sure
    text = "95 % intervals of hidden parameters that hold the truth"
    hold = sum(row.intervals_that_cover for row in names)
    miss = sum(row.intervals for row in names) - hold
    yield "intervals_cover", text, (0.93, 0.97), [True] * hold + [False] * miss
    text = "payloads that were named: kilograms within 5 % or inside their interval"
    inside = [row.mass_inside for row in names if row.mass_inside is not None]
    yield "payload_mass", text, None, inside


def rate_rows(trials: Sequence[TrialRow], names: Sequence[NameRow]) -> Iterator[RateRow]:
    """Rows of `rates.csv`: by source, and of both together where there are two."""
    sources = sorted({row.source for row in trials})
    for source in [*sources, *(["all"] if len(sources) > 1 else [])]:
        trials_ = [row for row in trials if source in ("all", row.source)]
        names_ = [row for row in names if source in ("all", row.source)]
        for name, meaning, aim, hits in _rates(trials_, names_):
            share = sum(hits) / len(hits) if hits else None
            low, high = wilson(sum(hits), len(hits))
            least, most = aim or (None, None)
            reached = aim[0] <= share <= aim[1] if aim and share is not None else None
            yield RateRow(
                *(source, name, meaning, sum(hits), len(hits), share),
                *(low, high, least, most, reached),
            )


def effect_rows(trials: Sequence[TrialRow]) -> Iterator[EffectRow]:
    """Rows of `by_effect.csv`: how each effect fared that was hidden alone."""
    alone = [row for row in trials if row.kind in ("single", "outside")]
    for effect, source in sorted({(row.hidden, row.source) for row in alone}):
        own = [r for r in alone if (r.hidden, r.source) == (effect, source)]
        yield EffectRow(
            effect,
            source,
            trials=len(own),
            visible=sum(r.visible for r in own),
            found=sum(r.all_found for r in own),
            unexplained=sum(r.exit_code == 1 for r in own),
            wrong=sum(bool(r.wrong) for r in own),
            wrong_confirmed=sum(bool(r.wrong_confirmed) for r in own),
        )
