"""An answer against the truth, scored straight from what is written: every name right or wrong.

Background is not free: bodies that are named where they are the URDF's are wrong, and every term of
friction that is written is held against the joint's own terms. Where a log cannot tell names apart
(`tests.blind.machines.visible`), the answer is the class: a name of it counts as right where the
answer says that it cannot be told from the hidden one.
"""

from __future__ import annotations

import csv
import math
import tomllib
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

#: Terms of friction by name; those of `joint_friction` are parameters that it writes.
TERMS: Final = {
    "coulomb_friction": {"coulomb"},
    "viscous_friction": {"viscous"},
    "stribeck_friction": {"coulomb", "excess"},
    "load_dependent_friction": {"load"},
    "backdrive_loss": {"load"},
    "direction_dependent_friction": {"coulomb", "asymmetry"},
    "quadratic_drag": {"quadratic"},
    "friction_drift": {"coulomb"},
}
#: Its shapes, such as the speed of a rise, say no term.
FREE: Final = {"saturating"}.union(*TERMS.values())
#: Names that say the same of a machine, each on its left.
EQUIVALENT: Final = {
    "effort_gain": "torque_constant_error",
    "load_dependent_friction": "backdrive_loss",
}
#: Flexible members: drawn where a joint's friction or torque has no simpler law, no name.
FLEXIBLE: Final = ("friction_curve", "position_curve")
#: All bodies at once; written link by link.
WHOLE: Final = "rigid_body_parameters"
#: Names of bodies; right where the machine's are not the URDF's.
BODIES: Final = (WHOLE, "link_mass", "center_of_mass_offset")
#: Scales and bodies, of which a single pendulum shows only the product.
SCALES: Final = (*BODIES, "effort_gain", "torque_constant_error")
#: Hidden values by parameters of other names that say them.
VALUES: Final = {
    "coulomb": "torque",
    "torque": "coulomb",
    "viscous": "coefficient",
    "load": "share",
}
#: Parameters that are compared only up to conventions, or hang on what is beside them.
NOT_COMPARED: Final = ("phase", "rest", "velocity", "rise", "travel", "x", "y", "z")
RIGHT, CLASS, WRONG, DRAWN = "right", "class", "wrong", "flexible"
_CLASS: Final = "indistinguishable from "
Truth = Mapping[str, Any]


@dataclass(frozen=True)
class Name:
    """One name that the model file holds."""

    effect: str  #: In the catalogue's words.
    place: tuple[str, ...]  #: Where.
    level: str  #: ``"confirmed"`` or ``"approximate"``.
    #: Parameter to value and ends of the 95 % interval; NaN where there is none.
    values: dict[str, tuple[float, float, float]]
    rivals: tuple[str, ...] = ()  #: Names that the answer calls indistinguishable from it.

    @property
    def terms(self) -> set[str]:
        """Terms of friction that it says, empty for other names."""
        if self.effect == "joint_friction":
            return _terms(p for p, v in self.values.items() if v[0]) & FREE
        return TERMS.get(self.effect, set())


def _terms(words: Iterable[str]) -> set[str]:
    return {"load" if word in ("driving", "driven") else word for word in words}


def read_names(files: Mapping[str, str]) -> list[Name]:
    """Names of `model.toml`, with those that `candidates.csv` cannot tell from them, both ways."""
    rows = list(csv.DictReader(files.get("candidates.csv", "").splitlines()))
    rivals: dict[tuple[str, str], dict[str, None]] = defaultdict(dict)
    for row in (row for row in rows if row["verdict"].startswith(_CLASS)):
        for other in (x for x in rows if x["effect"] in row["verdict"].removeprefix(_CLASS)):
            rivals[row["effect"], row["place"]][other["effect"]] = None
            if other["place"] in row["verdict"]:
                rivals[other["effect"], other["place"]][row["effect"]] = None
    names = []
    for edit in tomllib.loads(files.get("model.toml", "")).get("edit", []):
        effect, place = edit["effect"], tuple(edit.get("place", ()))
        values = {
            name: (float(entry["value"]), *entry.get("interval", (math.nan, math.nan)))
            for name, entry in edit["parameters"].items()
        }
        others = tuple(rivals[effect, "+".join(place)])
        names.append(Name(effect, place, edit.get("level", ""), values, others))
    return names


def verdict(truth: Truth, name: Name) -> tuple[str, str]:
    """Right, of a class, wrong or no name; and what it is right by, or what is not there."""
    for hidden in truth["hidden"]:
        near = _near(name, hidden)
        if near and _asks_for_class(truth, hidden) and name.effect in SCALES:
            if name.rivals and hidden["effect"] in (name.effect, *name.rivals):
                return CLASS, f"one of a class with {', '.join(name.rivals)}"
            return WRONG, "this log shows a product only, and one factor is given"
        if near and name.effect in hidden["alike"] and hidden["effect"] in name.rivals:
            return CLASS, f"said not to be told from {hidden['effect']}"
    joint = name.place[0] if name.place else ""
    there = set(truth["friction"].get(joint, ()))
    # Dry friction that changes along the travel or as it warms up is dry friction still.
    dry = {"coulomb"} if there & {"spot", "excess", "asymmetry"} else set()
    terms = _terms(there - {"spot"}) | dry
    if name.effect in FLEXIBLE:
        has = terms or any(joint in hidden["place"] for hidden in truth["hidden"])
        return (DRAWN, "a curve, no name") if has else (WRONG, "this joint has no friction")
    if name.terms:
        extra = ", ".join(sorted(name.terms - terms))
        return (WRONG, f"no {extra}") if extra else (RIGHT, "has these terms")
    if name.effect == "effort_offset" and "asymmetry" in there:
        return RIGHT, "half of friction with a level for each direction"
    if name.effect == "rotor_inertia" and joint in truth["rotors"]:
        return RIGHT, "the URDF has no rotors"
    if any(says(name, hidden) for hidden in truth["hidden"]):
        return RIGHT, "hidden"
    if name.effect in BODIES:
        exact = truth["off"] == 0.0
        return (WRONG, "the URDF's bodies are exact") if exact else (RIGHT, "bodies are off")
    return WRONG, "not in the machine"


def _asks_for_class(truth: Truth, hidden: Truth) -> bool:
    return truth["machine"] == "pendulum" and hidden["effect"] in SCALES


def _near(name: Name, hidden: Truth) -> bool:
    """Whether a name's place belongs to the joint of a hidden effect, or to everything."""
    number = hidden["joint"] + 1
    own = {f"joint_{number}", f"link_{number}", f"joint_{number}__torque_Nm", *hidden["place"]}
    alone = len(name.place) == 1 and "_" in name.place[0]
    return not alone or name.place[0] in own


def says(name: Name, hidden: Truth) -> bool:
    """Whether a name is that of a hidden effect, at its place."""
    effect, other = hidden["effect"], EQUIVALENT.get(hidden["effect"])
    wanted, places = (
        [place.removesuffix("__torque_Nm") for place in x] for x in (hidden["place"], name.place)
    )
    if effect in TERMS:
        return TERMS[effect] <= name.terms and places[0] == wanted[0]
    anywhere = effect in ("time_delay", "base_tilt")
    return name.effect in (effect, other) and (anywhere or set(places) == set(wanted))


def found(truth: Truth, hidden: Truth, verdicts: Iterable[tuple[Name, str]]) -> bool:
    """Whether the written names say a hidden effect: by one name, by terms, or by a class."""
    verdicts = list(verdicts)
    if any(said == CLASS and _near(name, hidden) for name, said in verdicts):
        return True
    right = [name for name, said in verdicts if said == RIGHT]
    if any(says(name, hidden) for name in right):
        return not _asks_for_class(truth, hidden)
    own = [name for name in right if name.place[:1] == tuple(hidden["place"][:1])]
    terms = set().union(*(name.terms for name in own))
    # A constant beside dry friction is friction that one direction has more of.
    terms |= {"asymmetry"} if any(name.effect == "effort_offset" for name in own) else set()
    return hidden["effect"] in TERMS and TERMS[hidden["effect"]] <= terms


def coverage(name: Name, hidden: Truth) -> tuple[int, int]:
    """Intervals of hidden parameters, and those that hold what the machine has."""
    values, holds = hidden["values"], []
    for parameter, (_, low, high) in name.values.items():
        known = parameter if parameter in values else VALUES.get(parameter)
        if known in values and parameter not in NOT_COMPARED:
            ends = [values[known]]
            if known == "share":  # per torque of the motor: a value in either quadrant
                ends += [values[q] for q in ("driving", "driven") if q in values]
            holds.append(low <= max(ends) and min(ends) <= high)
    return len(holds), sum(holds)
