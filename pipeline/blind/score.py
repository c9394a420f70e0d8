"""How an answer compares with the truth: one row of `blind_trials.csv`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from pipeline.blind.answer import Answer, Named
from pipeline.blind.identifiable import Identifiability
from pipeline.blind.truth import HiddenTruth
from pipeline.effects.registry import EFFECTS

Key = tuple[str, tuple[str, ...]]
#: Pairs that are one effect by definition: its two halves at the same joint name it, too.
SAME_AS: Final[Mapping[str, frozenset[str]]] = {
    "direction_dependent_friction": frozenset({"coulomb_friction", "effort_offset"}),
}
#: Parameters that are compared only up to conventions (a phase) or drawn beside the size.
NOT_COVERED: Final = frozenset({"phase", "rest", "velocity", "order", "time_constant"})
#: A gap counts as removable where its square, above the floor's, is this many squared noise floors:
#: of less, some hundred samples on *prove* do not tell nine tenths from all.
LEAST_GAP: Final = 1.0
OUTCOMES: Final = {
    "right": "name and place first, or a member of its class",
    "wrong place": "the right name at another place first",
    "wrong name": "another name first, without calling the truth indistinguishable from it",
    "unexplained": "no name, or doubted ones that are not right; the gap called unexplained",
    "nothing": "no name, or doubted ones that are not right; the gap called noise",
    "failed": "no answer",
}


@dataclass(frozen=True)
class Score:
    """One trial, judged.

    Attributes:
        number: Of the trial.
        hidden: What was in it.
        judged: What its log could tell of each.
        answer: Of the workflow.
        outcome: Key of `OUTCOMES`; by the first name.
        wrong: Names given with confidence that are neither hidden nor of a hidden one's class.
        right: Hidden effects that were named, or whose class was.
        written: Of them, those whose name the model file holds.
        intervals: Parameters of rightly named effects, not doubted, with an interval.
        covered: Of them, those whose interval holds the truth.
        closed: Share of the removable gap on *prove* that is closed; NaN without a name.
    """

    number: int
    hidden: tuple[HiddenTruth, ...]
    judged: tuple[Identifiability, ...]
    answer: Answer
    outcome: str
    wrong: tuple[Key, ...]
    right: tuple[Key, ...]
    written: tuple[Key, ...]
    intervals: int
    covered: int
    closed: float

    @property
    def right_and_written(self) -> bool:
        """Whether the first name is right and the model file holds it."""
        return self.outcome == "right" and self.answer.named[0].written

    @property
    def visible(self) -> bool:
        """Whether the log could show every hidden effect."""
        return bool(self.judged) and all(one.visible for one in self.judged)

    @property
    def alone(self) -> bool:
        """Whether the log could tell every hidden effect from all others."""
        return bool(self.judged) and all(one.alone for one in self.judged)


def score(
    number: int,
    hidden: Sequence[HiddenTruth],
    judged: Sequence[Identifiability],
    answer: Answer,
) -> Score:
    """Judge one answer."""
    classes = [
        {(one.effect, one.place), *((r.effect, r.place) for r in j.like)}
        for one, j in zip(hidden, judged, strict=True)
    ]
    excused = [_excused(one, j) for one, j in zip(hidden, judged, strict=True)]
    given = {(n.effect, n.place) for n in answer.named}
    for k, one in enumerate(hidden):
        halves = {(name, one.place) for name in SAME_AS.get(one.effect, ())}
        if halves and halves <= given:
            classes[k] |= halves
            excused[k] |= halves
    wrong, right, written = [], set(), set()
    for n in answer.named:
        hits = [k for k, members in enumerate(classes) if _meets(n, members)]
        met = {(hidden[k].effect, hidden[k].place) for k in hits}
        right |= met
        written |= met if n.written else set()
        if n.confident and not any(_meets(n, members) for members in excused):
            wrong.append((n.effect, n.place))
    intervals, covered = _coverage(hidden, answer.named)
    return Score(
        number=number,
        hidden=tuple(hidden),
        judged=tuple(judged),
        answer=answer,
        outcome=_outcome(hidden, classes, answer),
        wrong=tuple(wrong),
        right=tuple(sorted(right)),
        written=tuple(sorted(written)),
        intervals=intervals,
        covered=covered,
        closed=_closed(answer.named),
    )


def _excused(one: HiddenTruth, judged: Identifiability) -> set[Key]:
    """Names that are not wrong: the truth, what explains most of it, its own special cases."""
    contains = EFFECTS[one.effect].contains if one.effect in EFFECTS else ()
    cases = {
        (r.effect, r.place) for r in judged.like if r.effect in contains and r.place == one.place
    }
    return {(one.effect, one.place), *((r.effect, r.place) for r in judged.stand_ins), *cases}


def _meets(named: Named, members: set[Key]) -> bool:
    """Whether a name, or one it calls indistinguishable, is in a class."""
    if any((name, named.place) in members for name in (named.effect, *named.amounts_to)):
        return True
    return any(
        effect in named.rivals and all(part in named.rivals for part in place)
        for effect, place in members
    )


def _outcome(hidden: Sequence[HiddenTruth], classes: Sequence[set[Key]], answer: Answer) -> str:
    if answer.code not in (0, 1):
        return "failed"
    if answer.named and any(_meets(answer.named[0], members) for members in classes):
        return "right"
    if all(n.doubt for n in answer.named):
        return "unexplained" if answer.code == 1 else "nothing"
    first = answer.named[0]
    return "wrong place" if first.effect in {one.effect for one in hidden} else "wrong name"


def _coverage(hidden: Sequence[HiddenTruth], named: Sequence[Named]) -> tuple[int, int]:
    count = covered = 0
    truths = {(one.effect, one.place): one for one in hidden}
    for n in named:
        truth = truths.get((n.effect, n.place))
        if truth is None or n.doubt:
            continue
        for parameter, (_, low, high) in n.intervals.items():
            if parameter not in truth.total or parameter in NOT_COVERED or not low < high:
                continue
            count += 1
            covered += low <= truth.total[parameter] <= high
    return count, covered


def _closed(named: Sequence[Named]) -> float:
    """Of what lies above the noise floor in squares, before the first name and after the last.

    NaN where there was hardly anything above the floor (tolerances had taken it up), or no row.
    """
    before: dict[tuple[str, ...], float] = {}
    after: dict[tuple[str, ...], float] = {}
    # What the model file leaves out closes nothing.
    named = [n for n in named if n.written and not math.isnan(n.gap_before)]
    for n in named:
        before.setdefault(n.place, max(n.gap_before**2 - n.noise_floor**2, 0.0))
        after[n.place] = max(n.gap_after**2 - n.noise_floor**2, 0.0)
    total = sum(before.values())
    floor = sum({n.place: n.noise_floor**2 for n in named}.values())
    if not named or total <= LEAST_GAP * floor:
        return float("nan")
    return 1.0 - sum(after.values()) / total
