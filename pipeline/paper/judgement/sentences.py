"""The sentences of sections V and IV.A as numbers that can be true or not.

Section IV.A compares energies through the stages of each actuator (Fig. 14, 16, 18 and 20) in
words. *Much higher* has no number in it: here it means at least `MUCH` times as high, at the joint
in question.
"""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from actuators.elements.inertia import Inertia
from actuators.energy.energy import integral, stage_energies
from actuators.loading.build import WINDING
from pipeline.paper.hexapod import MIDDLE_LEGS, PUBLISHED_LEG, Outcome, by_leg
from pipeline.paper.judgement.rows import FITTED, FOLLOWS, PREDICTED_BY, PUT_IN, Row
from pipeline.paper.published import EVEN, EXTRA

SECTION_IV_A_FILE = Path(__file__).parent / "section_iv_a.csv"
#: Times as high that count as "much higher".
MUCH = 2.0
#: By which two energies may differ and be the same: what integration leaves, and more [1].
_SAME = 1e-3
#: Energies of the leg that stands for 3 s, by alternative.
_STANDING = {a: f"{a}_leg_energy_3s" for a in ("ideal", "rotor", "reversible", "irreversible")}
_OF_WALKING = "walking energy of the middle right leg over the ideal actuator's"
_OF_STANDING = "energy of the loaded leg in 3 s"


def ideal_margin(values: Mapping[str, float]) -> float:
    """By how much the ideal actuator draws more, standing, than any other [J in 3 s]."""
    ideal, *others = (values[name] for name in _STANDING.values())
    return ideal - max(others)


def least_drop(values: Mapping[str, float]) -> float:
    """Least step from one actuator to the next with more friction, standing [J in 3 s]."""
    energies = [values[name] for name in _STANDING.values()]
    return min(a - b for a, b in itertools.pairwise(energies))


def _section_v(
    name: str,
    sentence: str,
    quantity: str,
    unit: str,
    words: str,
    test: Callable[[float], bool],
    role: str = FITTED,
    value: Callable[[Mapping[str, float]], float] | None = None,
) -> Row:
    return Row(
        name,
        "Section V",
        quantity,
        unit,
        math.nan,
        role,
        value or (lambda values: values[name]),
        test,
        tuple(_STANDING.values()) if value else (name,),
        sentence,
        words,
        left_out_by=(PREDICTED_BY | {EXTRA: PREDICTED_BY[EVEN]}).get(name, ""),
    )


SECTION_V = (
    _section_v(
        "walking_ratio_rotor",
        "rotor inertia and friction make walking 4 times as costly as the ideal actuator",
        *(_OF_WALKING, "1", "4"),
        lambda ratio: 3.5 <= ratio <= 4.5,
    ),
    _section_v(
        "walking_ratio_reversible",
        "the reversible actuator needs more than 10 times the ideal energy",
        *(_OF_WALKING, "1", "more than 10"),
        lambda ratio: ratio > 10,
    ),
    _section_v(
        "walking_ratio_irreversible",
        "the ratio is almost 15 for the irreversible actuator",
        *(_OF_WALKING, "1", "almost 15"),
        lambda ratio: 14.5 <= ratio <= 15,
    ),
    _section_v(
        EXTRA,
        "walking, the irreversible actuator needs more than the reversible one",
        *("irreversible less reversible, per middle leg and cycle", "J", "more"),
        lambda extra: extra > 0,
    ),
    _section_v(
        "ideal_most",
        "standing, friction saves: the ideal actuator draws most",
        *(f"{_OF_STANDING}, ideal less the most of the others", "J", "most"),
        lambda margin: margin > 0,
        FOLLOWS,
        ideal_margin,
    ),
    _section_v(
        "ordered",
        "standing, the more friction matters, the less is drawn",
        *(f"{_OF_STANDING}, least step from one actuator to the next", "J", "less"),
        lambda drop: drop > 0,
        FOLLOWS,
        least_drop,
    ),
    _section_v(
        "irreversible_leg_energy_3s",
        "standing, the irreversible actuator draws nothing",
        *(_OF_STANDING, "J", "0"),
        lambda energy: energy == 0,
        PUT_IN,
    ),
    _section_v(
        EVEN,
        "the reversible actuator is cheaper unless the robot stands over 94 % of the time",
        *("break-even fraction of time standing, both middle legs", "1", "0.94"),
        lambda share: 0.935 <= share <= 0.945,
    ),
)

_TESTS: dict[str, Callable[[float], bool]] = {
    "the same": lambda ratio: abs(ratio - 1.0) <= _SAME,
    "higher": lambda ratio: ratio > 1.0 + _SAME,
    "much higher": lambda ratio: ratio >= MUCH,
}


def _section_iv_a(said: dict[str, str], joint: str) -> Row:
    """One line of the file at one joint of the middle right leg."""
    above, below = (f"{said[energy]}:{joint}" for energy in ("over", "under"))
    return Row(
        f"{above} / {below}",
        f"Section {said['section']}",
        said["ratio"],
        "1",
        math.nan,
        FOLLOWS,
        lambda values: values[above] / values[below] if values[below] else math.nan,
        _TESTS[said["said"]],
        (above, below),
        said["sentence"],
        said["said"] + (f" (at least {MUCH:g} times)" if said["said"] == "much higher" else ""),
        joint,
    )


@cache
def section_iv_a() -> tuple[Row, ...]:
    """Every sentence of section IV.A at every joint that it speaks of."""
    with SECTION_IV_A_FILE.open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    return tuple(_section_iv_a(said, joint) for said in lines for joint in said["joints"].split())


def stage_values(outcomes: Mapping[str, Outcome]) -> dict[str, float]:
    """What the sentences of section IV.A compare: energies of the middle right leg per cycle [J].

    Args:
        outcomes: The middle legs' walk with the paper's alternatives, or some of them.
    """
    walks = {name: outcome.walking for name, outcome in outcomes.items()}
    if "rotor" in walks:
        chain = outcomes["rotor"].chain
        rotor = chain.element("rotor_inertia")
        assert isinstance(rotor, Inertia)
        light = chain.replaced(replace(rotor, inertia=0.0))
        walks["rotor without inertia"] = light.inverse(walks["rotor"].joint)
    out: dict[str, float] = {}
    for name, walk in walks.items():
        energies = {f"{e.stage}+": e.forward for e in stage_energies(walk)}
        energies |= {f"{e.stage}-": e.reverse for e in stage_energies(walk)}
        losses = [power for element, power in walk.losses.items() if element != WINDING]
        if losses:
            energies["dissipated"] = integral(walk.joint.time, np.sum(losses, axis=0))
        for what, energy in energies.items():
            leg = by_leg(energy)[0, MIDDLE_LEGS.index(PUBLISHED_LEG)]
            out |= {f"{name}:{what}:{joint}": float(e) for joint, e in enumerate(leg, start=1)}
    return out
