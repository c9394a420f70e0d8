"""An answer against the truth, scored straight from what is written: every name right or wrong.

Background is not free: bodies that are named where they are the URDF's are wrong, and every term of
friction that is written is held against the joint's own terms. Where a log cannot tell names apart
(`pipeline.blind.machines.visible`), the answer is the class: a name of it counts as right where the
answer says that it cannot be told from the hidden one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from pipeline.blind.answer import CONFIRMED, Answer, Name

#: Terms of friction by name; those of a law with free terms are the parameters it writes.
TERMS: Final[Mapping[str, frozenset[str]]] = {
    "coulomb_friction": frozenset({"coulomb"}),
    "viscous_friction": frozenset({"viscous"}),
    "stribeck_friction": frozenset({"coulomb", "excess"}),
    "load_dependent_friction": frozenset({"load"}),
    "backdrive_loss": frozenset({"load"}),
    "direction_dependent_friction": frozenset({"coulomb", "asymmetry"}),
    "quadratic_drag": frozenset({"quadratic"}),
    "friction_drift": frozenset({"coulomb"}),
}
#: Parameters of the law with free terms, and the terms they say. Its shapes say none.
FREE_TERMS: Final[Mapping[str, str]] = {
    **{name: name for name in ("coulomb", "viscous", "excess", "quadratic", "saturating")},
    **dict.fromkeys(("load", "driving", "driven"), "load"),
    "asymmetry": "asymmetry",
}
LAW: Final = "joint_friction"
#: Names that say the same of a machine, each on its left.
EQUIVALENT: Final[Mapping[str, frozenset[str]]] = {
    "effort_gain": frozenset({"torque_constant_error"}),
    "load_dependent_friction": frozenset({"backdrive_loss"}),
}
#: Flexible members: drawn where a joint's friction or torque has no simpler law, no name.
FLEXIBLE: Final = frozenset({"friction_curve", "position_curve"})
#: All bodies at once; written link by link.
WHOLE: Final = "rigid_body_parameters"
#: Names of bodies; right where the machine's are not the URDF's.
BODIES: Final = frozenset({WHOLE, "link_mass", "center_of_mass_offset"})
#: Scales and bodies, of which a single pendulum shows only the product.
SCALES: Final = BODIES | {"effort_gain", "torque_constant_error"}
#: What else a hidden effect is named by: a constant beside Coulomb friction is friction that one
#: direction has more of.
_OFFSET: Final = "effort_offset"
#: Hidden values by the parameters of the names that say them.
VALUES: Final[Mapping[str, tuple[str, ...]]] = {
    "coulomb": ("coulomb", "torque"),
    "torque": ("torque", "coulomb"),
    "viscous": ("viscous", "coefficient"),
    "load": ("share",),
}
#: Parameters that are compared only up to conventions, or hang on what is beside them.
NOT_COMPARED: Final = frozenset({"phase", "rest", "velocity", "rise", "travel", "x", "y", "z"})
RIGHT, CLASS, WRONG, DRAWN = "right", "class", "wrong", "flexible"


@dataclass(frozen=True)
class Verdict:
    """A written name, judged."""

    name: Name  #: As written.
    verdict: str  #: `RIGHT`, `CLASS` (right, as one of a class), `WRONG` or `DRAWN` (no name).
    why: str  #: What it is right by, or what is not in the machine.
    intervals: int = 0  #: Of hidden parameters.
    covered: int = 0  #: Of them, those that hold the truth.
    kilograms: float | None = None  #: Mass of a payload over the true one; None where it is none.


@dataclass(frozen=True)
class Score:
    """A trial, judged."""

    truth: Mapping[str, Any]  #: As `pipeline.blind.machines.trial.make` wrote it.
    answer: Answer  #: Of the workflow.
    names: tuple[Verdict, ...]  #: Every written name.
    found: tuple[bool, ...]  #: For every hidden effect whether it is named and written.

    @property
    def wrong(self) -> list[Verdict]:
        """Names that are wrong."""
        return [v for v in self.names if v.verdict == WRONG]

    @property
    def wrong_confirmed(self) -> list[Verdict]:
        """Of them, those that are confirmed."""
        return [v for v in self.wrong if v.name.level == CONFIRMED]


def score(truth: Mapping[str, Any], answer: Answer) -> Score:
    """Judge one answer."""
    names = tuple(_judged(truth, answer, name) for name in answer.names)
    found = tuple(_found(truth, hidden, names) for hidden in truth["hidden"])
    return Score(truth, answer, names, found)


def terms(name: Name) -> frozenset[str]:
    """Terms of friction that a written name says, empty for other names."""
    if name.effect == LAW:
        said = {FREE_TERMS[p] for p, v in name.values.items() if p in FREE_TERMS and v[0]}
        return frozenset(said)
    return TERMS.get(name.effect, frozenset())


def _true_terms(truth: Mapping[str, Any], joint: str) -> set[str]:
    own = set(truth["friction"].get(joint, ()))
    out = {"load" if term in ("driving", "driven") else term for term in own - {"spot"}}
    # Dry friction that changes along the travel or as it warms up is dry friction still.
    return out | ({"coulomb"} if own & {"spot", "excess", "asymmetry"} else set())


def _judged(truth: Mapping[str, Any], answer: Answer, name: Name) -> Verdict:
    verdict, why = _verdict(truth, answer, name)
    hidden = next((h for h in truth["hidden"] if _says(truth, name, h)), None)
    if verdict != RIGHT or hidden is None:
        return Verdict(name, verdict, why)
    intervals, covered = _coverage(name, hidden)
    kilograms = None
    if hidden["effect"] == name.effect == "link_mass":
        kilograms = name.values["mass"][0] / hidden["values"]["mass"]
    return Verdict(name, verdict, why, intervals, covered, kilograms)


def _verdict(truth: Mapping[str, Any], answer: Answer, name: Name) -> tuple[str, str]:
    for hidden in truth["hidden"]:
        if _asks_for_class(truth, hidden) and name.effect in SCALES and _near(name, hidden):
            if name.rivals and hidden["effect"] in (name.effect, *name.rivals):
                return CLASS, f"one of a class with {', '.join(name.rivals)}"
            return WRONG, "this log shows a product only, and one factor is given"
        alike = name.effect in hidden["alike"] and _near(name, hidden)
        if alike and hidden["effect"] in name.rivals:
            return CLASS, f"said not to be told from {hidden['effect']}"
    joint = name.place[0] if name.place else ""
    if name.effect in FLEXIBLE:
        has = _true_terms(truth, joint) or any(joint in h["place"] for h in truth["hidden"])
        return (DRAWN, "a curve, no name") if has else (WRONG, "this joint has no friction")
    said = terms(name)
    if said:
        extra = said - _true_terms(truth, joint)
        return (WRONG, f"no {', '.join(sorted(extra))}") if extra else (RIGHT, "has these terms")
    if name.effect == _OFFSET and "asymmetry" in truth["friction"].get(joint, ()):
        return RIGHT, "half of friction with a level for each direction"
    if name.effect == "rotor_inertia" and joint in truth["rotors"]:
        return RIGHT, "the URDF has no rotors"
    if any(_says(truth, name, hidden) for hidden in truth["hidden"]):
        return RIGHT, "hidden"
    if name.effect in BODIES:
        exact = truth["off"] == 0.0
        return (WRONG, "the URDF's bodies are exact") if exact else (RIGHT, "bodies are off")
    return WRONG, "not in the machine"


def _asks_for_class(truth: Mapping[str, Any], hidden: Mapping[str, Any]) -> bool:
    return truth["machine"] == "pendulum" and hidden["effect"] in SCALES


def _near(name: Name, hidden: Mapping[str, Any]) -> bool:
    """Whether a name's place belongs to the joint of a hidden effect, or to everything."""
    number = str(hidden["joint"] + 1)
    own = {f"joint_{number}", f"link_{number}", f"joint_{number}__torque_Nm", *hidden["place"]}
    places = set(name.place)
    return not places or bool(places & own) or not any("_" in p for p in places) or len(places) > 1


def _says(truth: Mapping[str, Any], name: Name, hidden: Mapping[str, Any]) -> bool:
    """Whether a name is that of a hidden effect, at its place."""
    effect, joint = hidden["effect"], hidden["place"][0].removesuffix("__torque_Nm")
    needed = TERMS.get(effect)
    if needed is not None:
        return needed <= terms(name) and name.place[0] == joint
    if name.effect not in {effect, *EQUIVALENT.get(effect, ())}:
        return False
    if effect == "time_delay":
        return True
    places = {place.removesuffix("__torque_Nm") for place in name.place}
    wanted = {place.removesuffix("__torque_Nm") for place in hidden["place"]}
    return places == wanted or effect == "base_tilt"


def _found(truth: Mapping[str, Any], hidden: Mapping[str, Any], names: tuple[Verdict, ...]) -> bool:
    """Whether the written names say a hidden effect: by one name, by terms, or by a class."""
    if any(v.verdict == CLASS and _near(v.name, hidden) for v in names):
        return True
    right = [v.name for v in names if v.verdict == RIGHT]
    if any(_says(truth, name, hidden) for name in right):
        return not _asks_for_class(truth, hidden)
    needed, joint = TERMS.get(hidden["effect"]), hidden["place"][0]
    if needed is None:
        return False
    own = [name for name in right if name.place and name.place[0] == joint]
    said = frozenset().union(*(terms(name) for name in own))
    if any(name.effect == _OFFSET for name in own):
        said |= {"asymmetry"}
    return needed <= said


def _coverage(name: Name, hidden: Mapping[str, Any]) -> tuple[int, int]:
    """Intervals of hidden parameters, and those that hold what the machine has."""
    count = covered = 0
    for parameter, (_, low, high) in name.values.items():
        known = [p for p in VALUES.get(parameter, (parameter,)) if p in hidden["values"]]
        if known and parameter not in NOT_COMPARED:
            ends = [hidden["values"][known[0]]]
            if known[0] == "share":  # per torque of the motor: a value in either quadrant
                ends += [hidden["values"].get(q, ends[0]) for q in ("driving", "driven")]
            count += 1
            covered += low <= max(ends) and min(ends) <= high
    return count, covered
