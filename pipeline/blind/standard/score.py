"""An answer against the truth, scored straight: what is named first, where, and what is written.

Every machine of the matrix has friction and bodies of its own beside what is hidden: naming those
is neither right nor wrong. All other names count. *Right* is a hidden effect that is the first of
them, at its place, and stands in the model file. *Wrong* is any other that stands there, whatever
its level: a class of effects that look alike excuses nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from pipeline.blind.answer import Answer, Named
from pipeline.blind.twin.fixed.visible import THRESHOLD

#: Names for what every machine has: friction of some law, and bodies that are not the URDF's.
FRICTION: Final = frozenset(
    {
        *("coulomb_friction", "viscous_friction", "stribeck_friction", "load_dependent_friction"),
        *("direction_dependent_friction", "backdrive_loss", "friction_curve", "joint_friction"),
    }
)
BODIES: Final = frozenset(
    {"rigid_body_parameters", "link_mass", "center_of_mass_offset", "link_inertia"}
)
#: One effect by definition, and the two halves at the same joint that name it, too.
HALVES: Final[Mapping[str, frozenset[str]]] = {
    "direction_dependent_friction": frozenset({"coulomb_friction", "effort_offset"}),
}
#: Effects of which others are a part.
PARTS: Final[Mapping[str, frozenset[str]]] = {
    "stribeck_friction": frozenset({"coulomb_friction"}),
}
#: Sizes of single laws, and what a law of several terms calls them.
TERMS: Final = {"torque": "coulomb", "coefficient": "viscous", "share": "load"}
#: Parameters that are compared only up to conventions, or depend on what is beside them.
NOT_COVERED: Final = frozenset({"phase", "rest", "velocity", "x", "y", "z"})
CONFIRMED: Final = "confirmed"


@dataclass(frozen=True)
class StandardScore:
    """One trial, judged.

    Attributes:
        truth: As sealed.
        answer: Of the workflow.
        counted: Names that count, in the order given.
        right: Hidden effects that were named at their place and written.
        first: Whether the first name that counts is a hidden one at its place, and written.
        wrong: Written names that count and are not hidden.
        intervals: Parameters of written right names with an interval.
        covered: Of them, those that hold the truth.
    """

    truth: Mapping[str, Any]
    answer: Answer
    counted: tuple[Named, ...]
    right: tuple[str, ...]
    first: bool
    wrong: tuple[Named, ...]
    intervals: int
    covered: int

    @property
    def hidden(self) -> list[Mapping[str, Any]]:
        """What was hidden."""
        return list(self.truth["hidden"])

    @property
    def visible(self) -> bool:
        """Whether the log could show all of it."""
        return bool(self.hidden) and all(h["misfit"] >= THRESHOLD for h in self.hidden)

    @property
    def in_catalogue(self) -> bool:
        """Whether the workflow has names for all of it."""
        return all(h["in_catalogue"] for h in self.hidden)


def score_straight(truth: Mapping[str, Any], answer: Answer) -> StandardScore:
    """Judge one answer.

    Args:
        truth: As sealed.
        answer: Of the workflow.
    """
    hidden = truth["hidden"]
    counted = tuple(n for n in answer.named if not _background(n, truth))
    halves = _halves(hidden, answer.named)
    right = tuple(
        h["effect"]
        for h in hidden
        if h["effect"] in halves or any(_is(n, h) and n.written for n in counted)
    )
    first = bool(counted) and counted[0].written and any(_is(counted[0], h) for h in hidden)
    wrong = tuple(n for n in counted if n.written and _astray(n, hidden, halves))
    intervals, covered = _coverage(truth, counted)
    return StandardScore(
        truth, answer, counted, right, first or bool(halves), wrong, intervals, covered
    )


def _is(named: Named, hidden: Mapping[str, Any]) -> bool:
    """Whether a name is that of a hidden effect, or its law has the hidden one among its terms."""
    told = (named.effect, *named.amounts_to)
    return hidden["effect"] in told and list(named.place) == list(hidden["place"])


def _astray(named: Named, hidden: Sequence[Mapping[str, Any]], halves: Collection[str]) -> bool:
    """Whether a name, or a term of its law, is that of nothing hidden."""
    own = {h["effect"] for h in hidden if list(h["place"]) == list(named.place)}
    own |= {half for effect in own & set(halves) for half in HALVES[effect]}
    told = set(named.amounts_to) or {named.effect}
    own |= {part for effect in own & told for part in PARTS.get(effect, ())}
    return not told <= own


def _background(named: Named, truth: Mapping[str, Any]) -> bool:
    """Whether a name is for what the machine has beside what is hidden."""
    hidden = truth["hidden"]
    if named.effect in FRICTION:
        # Where a joint's friction is what is hidden, its law has to be right.
        own = {p for h in hidden if h["effect"] in FRICTION for p in h["place"]}
        return bool(truth["friction"]) and not own & set(named.place)
    if named.effect == "effort_offset":  # as any friction that one direction has more of
        alike = FRICTION | {"effort_offset"}
        gone = {p for h in hidden if h["effect"] in alike for p in h["place"]}
        return set(named.place) <= set(truth["uneven"]) - gone
    if named.effect in BODIES:
        return not any(h["effect"] in BODIES for h in hidden) or named.effect != "link_mass"
    delays = truth["delays_s"]
    if named.effect != "time_delay" or not any(h["effect"] == "time_delay" for h in hidden):
        return named.effect == "time_delay" and any(d > 0 for d in delays)
    # Beside a delay of all that is hidden, joints are late by themselves, none as the next.
    alone = set(named.place).isdisjoint(p for h in hidden for p in h["place"])
    return alone and max(delays) > min(delays)


def _halves(hidden: Sequence[Mapping[str, Any]], named: Sequence[Named]) -> set[str]:
    """Hidden effects that two written names say together."""
    out = set()
    for h in hidden:
        halves = HALVES.get(h["effect"], frozenset())
        place = list(h["place"])
        own = [n for n in named if n.written and list(n.place) == place]
        given = {name for n in own for name in (n.effect, *n.amounts_to)}
        if halves and halves <= given:
            out.add(h["effect"])
    return out


def _coverage(truth: Mapping[str, Any], counted: Sequence[Named]) -> tuple[int, int]:
    """Intervals of hidden parameters, and those that hold what the machine has."""
    count = covered = 0
    for n in counted:
        values = next((h["values"] for h in truth["hidden"] if _is(n, h)), None)
        if values is None or not n.written:
            continue
        terms = {TERMS.get(name, name): value for name, value in values.items()}
        values = terms if n.amounts_to else values
        for parameter, (_, low, high) in n.intervals.items():
            if parameter in values and parameter not in NOT_COVERED and low < high:
                ends = _true(truth, n, values[parameter])
                count += 1
                covered += low <= ends[1] and high >= ends[0]
    return count, covered


def _true(truth: Mapping[str, Any], named: Named, value: float) -> tuple[float, float]:
    """A hidden value, or the least and the largest that the machine has of it.

    What hides a delay adds it to those that the sensors have, joint by joint.
    """
    delays = truth["delays_s"]
    return (min(delays), max(delays)) if named.effect == "time_delay" else (value, value)
