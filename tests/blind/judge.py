"""An answer against the truth: every written name right or wrong, and rates of many trials.

Background is not free: bodies that are named where they are the URDF's are wrong, and every term of
friction that is written is held against the joint's own terms. Where a log cannot tell names apart
(`machines/visible.py`), the answer is the class: a name of it counts as right where the
answer says that it cannot be told from the hidden one.
"""

import csv
import math
import tomllib
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd
from scipy.stats import binomtest

#: Terms of friction by name.
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
#: Names that say the same of a machine, each on its left.
EQUIVALENT: Final = {
    "effort_gain": "torque_constant_error",
    "load_dependent_friction": "backdrive_loss",
}
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
RIGHT, CLASS, WRONG = "right", "class", "wrong"
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
    edits = tomllib.loads(files.get("model.toml", "")).get("edit", [])
    for edit in (edit for edit in edits if "table" not in edit):  # a table is no name
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
        product = truth["machine"] == "pendulum" and hidden["effect"] in SCALES
        if near and product and name.effect in SCALES:
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


def found(truth: Truth, hidden: Truth, verdicts: Sequence[tuple[Name, str]]) -> bool:
    """Whether the written names say a hidden effect: by one name, by terms, or by a class."""
    if any(said == CLASS and _near(name, hidden) for name, said in verdicts):
        return True
    right = [name for name, said in verdicts if said == RIGHT]
    if any(says(name, hidden) for name in right):
        return truth["machine"] != "pendulum" or hidden["effect"] not in SCALES
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


_KEYS: Final = ["source", "trial", "kind", "machine"]
_JUDGED: Final = ["verdict", "why", "intervals", "covered"]
NAMES: Final = [*_KEYS, "effect", "place", "level", "rivals", "values", *_JUDGED]
#: Rate, least and most aimed at, what counts, and what of it is a hit; of trials, then of names.
RATES: Final = {
    "trials": (
        ("single right", (0.9, 1.0), "kind == 'single' and visible", "all_found"),
        ("several right", (0.7, 1.0), "kind == 'several' and visible", "all_found"),
        ("wrong name confirmed", (0.0, 0.01), "index >= 0", "wrong_confirmed"),
        ("wrong name written", None, "index >= 0", "wrong"),
        ("empty silent", (0.97, 1.0), "kind == 'empty'", "silent"),
        ("outside not confirmed", (0.97, 1.0), "kind == 'outside'", "answered > wrong_confirmed"),
        ("outside unexplained", (0.9, 1.0), "kind == 'outside' and visible", "unexplained"),
        ("answered", (1.0, 1.0), "index >= 0", "answered"),
    ),
    "names": (
        ("names wrong", (0.0, 0.05), "counts", "verdict == 'wrong'"),
        ("confirmed names right", (0.97, 1.0), "counts and level == 'confirmed'", "fits"),
        ("intervals cover", (0.93, 0.97), "intervals", "covered"),
    ),
}


def judged(truth: Truth, answer: Truth) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """A trial's row, and the rows of its written names."""
    names, hidden, rows = read_names(answer["files"]), truth["hidden"], []
    for name in names:
        said, why = verdict(truth, name)
        row = {"effect": name.effect, "place": "+".join(name.place), "level": name.level}
        row |= {"rivals": " ".join(name.rivals), "verdict": said, "why": why}
        row["values"] = " ".join(
            f"{k}={x:.4g}[{low:.4g},{high:.4g}]" for k, (x, low, high) in name.values.items()
        )
        own = next((h for h in hidden if said == RIGHT and says(name, h)), None)
        row["intervals"], row["covered"] = coverage(name, own) if own else (0, 0)
        rows.append({key: truth[key] for key in _KEYS} | row)
    verdicts = [(name, row["verdict"]) for name, row in zip(names, rows, strict=True)]
    seen = [found(truth, h, verdicts) for h in hidden]
    wrong = [name.level for name, said in verdicts if said == WRONG]
    trial = {key: truth[key] for key in (*_KEYS, "off", "rate_Hz", "bits", "sides")} | {
        "hidden": ";".join(h["effect"] for h in hidden),
        "z": min((h["z"] for h in hidden), default=np.nan),
        "visible": all(h["visible"] for h in hidden),
        "exit_code": answer["code"],
        "answered": answer["code"] in (0, 1),
        "unexplained": answer["code"] == 1,
        "message": answer["message"],
        "cpu_s": answer["seconds"],
        "written": len(names),
        "all_found": all(seen) and bool(seen),
        "wrong": bool(wrong),
        "wrong_confirmed": "confirmed" in wrong,
        "silent": answer["code"] == 0 and not wrong,
    }
    return trial, rows


def tables(records: Sequence[dict[str, Any]]) -> dict[str, pd.DataFrame]:
    """Trials, names and rates, of what `run_trials` returned."""
    rows = [judged(record["truth"], record["answer"]) for record in records]
    trials = pd.DataFrame([trial for trial, _ in rows])
    names = pd.DataFrame([name for _, part in rows for name in part], columns=NAMES)
    # Bodies are fitted link by link, and are one name.
    again = (names["effect"] == WHOLE) & names.duplicated([*_KEYS, "effect"], keep="last")
    names["counts"] = ~again
    names["fits"] = names["verdict"].isin([RIGHT, CLASS])
    rates, sources = [], sorted(trials["source"].unique())
    for source in [*sources, "all"] if len(sources) > 1 else sources:
        for table, of in (("trials", trials), ("names", names)):
            part = of if source == "all" else of[of["source"] == source]
            for rate, aim, among, hit in RATES[table]:
                count = part.eval(among).astype(int)
                k, n = int(np.minimum(count, part.eval(hit)).sum()), int(count.sum())
                if n:
                    low, high = binomtest(k, n).proportion_ci(method="wilson")
                    least, most = aim or (np.nan, np.nan)
                    # An aim with two ends is missed above only beyond chance.
                    most_seen = low if least > 0.0 and most < 1.0 else k / n
                    reached = k / n >= least and most_seen <= most if aim else None
                    rates.append((source, rate, k, n, k / n, low, high, least, most, reached))
    header = ["source", "rate", "hits", "count", "share", "low", "high"]
    shares = pd.DataFrame(rates, columns=[*header, "aim_low", "aim_high", "reached"])
    return {"trials": trials, "names": names, "rates": shares}
