"""The paper's sentences as numbers: ours, before the fit, and with fitted rows left out."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from pipeline.paper.calibration.problem import EVEN, EXTRA
from pipeline.paper.judgement.evidence import NONE, Evidence, Interval, quantiles, share
from pipeline.paper.judgement.reproduction import PREDICTED_BY

Values = Mapping[str, float]
PUT_IN, FITTED, FOLLOWS = "put in", "fitted", "follows"
_IRREVERSIBLE = PREDICTED_BY["walking_ratio_irreversible"]
#: Energies of the leg that stands for 3 s, by alternative.
_STANDING = {a: f"{a}_leg_energy_3s" for a in ("ideal", "rotor", "reversible", "irreversible")}


@dataclass(frozen=True)
class Sentence:
    """One sentence of the paper and how it is tested.

    Attributes:
        name: Short name: of the printed value it rests on, where there is one.
        text: In the paper's terms.
        quantity: What is computed.
        unit: Of it.
        printed: What the paper says.
        part: `PUT_IN`, `FITTED` or `FOLLOWS` (from fitted and put-in numbers).
        left_out: Key of the sets that predict it; empty where none do.
        value: The quantity from the printed values' computed counterparts, SI.
        holds: Whether the sentence holds for them.
        rests_on: The computed counterparts it needs; the one of its own name by default.
        where: Section.
        joint: Of the middle right leg; empty for all of it.
    """

    name: str
    text: str
    quantity: str
    unit: str
    printed: str
    part: str
    left_out: str
    value: Callable[[Values], float]
    holds: Callable[[Values], bool]
    rests_on: tuple[str, ...] = ()
    where: str = "Section V"
    joint: str = ""

    @property
    def needs(self) -> tuple[str, ...]:
        """Names without which it cannot be tested."""
        return self.rests_on or (self.name,)


@dataclass(frozen=True)
class Conclusion:
    """A sentence, tested.

    Attributes:
        sentence: Which.
        computed: Ours.
        holds: Whether it holds for ours.
        prior: 95 % of what data sheets and literature say.
        prior_share: Share of the prior's draws in which the sentence holds.
        left_out: 95 % of what the other targets predict; NaN where it is not fitted.
        left_out_share: Share of these sets in which the sentence holds.
        posterior_share: Share of the posterior in which it holds; NaN where that was asked for.
    """

    sentence: Sentence
    computed: float
    holds: bool
    prior: Interval
    prior_share: float
    left_out: Interval
    left_out_share: float
    posterior_share: float


def ideal_margin(values: Values) -> float:
    """By how much the ideal actuator draws more, standing, than any other [J in 3 s]."""
    return values[_STANDING["ideal"]] - max(
        values[name] for alternative, name in _STANDING.items() if alternative != "ideal"
    )


def least_drop(values: Values) -> float:
    """Least step from one actuator to the next with more friction, standing [J in 3 s]."""
    energies = [values[name] for name in _STANDING.values()]
    return min(a - b for a, b in itertools.pairwise(energies))


def _ratio(alternative: str) -> Callable[[Values], float]:
    return lambda v: v[f"walking_ratio_{alternative}"]


#: Of section V; those of section IV.A stand in `stage_sentences`.
SENTENCES = (
    Sentence(
        "walking_ratio_rotor",
        "rotor inertia and friction make walking 4 times as costly as the ideal actuator",
        "walking energy of the middle right leg over the ideal actuator's",
        "1",
        "4",
        FITTED,
        PREDICTED_BY["walking_ratio_rotor"],
        _ratio("rotor"),
        lambda v: 3.5 <= v["walking_ratio_rotor"] <= 4.5,
    ),
    Sentence(
        "walking_ratio_reversible",
        "the reversible actuator needs more than 10 times the ideal energy",
        "walking energy of the middle right leg over the ideal actuator's",
        "1",
        "more than 10",
        FITTED,
        PREDICTED_BY["walking_ratio_reversible"],
        _ratio("reversible"),
        lambda v: v["walking_ratio_reversible"] > 10,
    ),
    Sentence(
        "walking_ratio_irreversible",
        "the ratio is almost 15 for the irreversible actuator",
        "walking energy of the middle right leg over the ideal actuator's",
        "1",
        "almost 15",
        FITTED,
        _IRREVERSIBLE,
        _ratio("irreversible"),
        lambda v: 14.5 <= v["walking_ratio_irreversible"] <= 15,
    ),
    Sentence(
        EXTRA,
        "walking, the irreversible actuator needs more than the reversible one",
        "irreversible less reversible, per middle leg and cycle",
        "J",
        "more",
        FITTED,
        _IRREVERSIBLE,
        lambda v: v[EXTRA],
        lambda v: v[EXTRA] > 0,
    ),
    Sentence(
        "ideal_most",
        "standing, friction saves: the ideal actuator draws most",
        "energy of the loaded leg in 3 s, ideal less the most of the others",
        "J",
        "most",
        FOLLOWS,
        "",
        ideal_margin,
        lambda v: ideal_margin(v) > 0,
        tuple(_STANDING.values()),
    ),
    Sentence(
        "ordered",
        "standing, the more friction matters, the less is drawn",
        "energy of the loaded leg in 3 s, least step from one actuator to the next",
        "J",
        "less",
        FOLLOWS,
        "",
        least_drop,
        lambda v: least_drop(v) > 0,
        tuple(_STANDING.values()),
    ),
    Sentence(
        "irreversible_leg_energy_3s",
        "standing, the irreversible actuator draws nothing",
        "energy of the loaded leg in 3 s",
        "J",
        "0",
        PUT_IN,
        "",
        lambda v: v[_STANDING["irreversible"]],
        lambda v: v[_STANDING["irreversible"]] == 0,
    ),
    Sentence(
        EVEN,
        "the reversible actuator is cheaper unless the robot stands over 94 % of the time",
        "break-even fraction of time standing, both middle legs",
        "1",
        "0.94",
        FITTED,
        PREDICTED_BY[EVEN],
        lambda v: v[EVEN],
        lambda v: 0.935 <= v[EVEN] <= 0.945,
    ),
)


def conclusions(
    ours: Values, known: Evidence | None, sentences: Sequence[Sentence] = SENTENCES
) -> tuple[Conclusion, ...]:
    """Every sentence that can be tested, on ours and on the sets of the calibration.

    Args:
        ours: Computed counterparts of the printed values, and the energy difference, SI; without
            those for which the catalogue has no actuator.
        known: The calibration's sets; None where they belong to other numbers, or do not hold
            what the sentences rest on.
        sentences: Which.
    """
    return tuple(
        _conclusion(sentence, ours, known)
        for sentence in sentences
        if all(name in ours for name in sentence.needs)
    )


def _conclusion(s: Sentence, ours: Values, known: Evidence | None) -> Conclusion:
    prior, left_out = NONE, NONE
    shares = [math.nan, math.nan, math.nan]
    if known is not None:
        prior = quantiles([s.value(p.values) for p in known.prior])
        shares[0] = share(known.prior, s.holds)
        if s.left_out:
            sets: Sequence = known.left_out[s.left_out]
            left_out = quantiles([s.value(p.values) for p in sets])
            shares[1] = share(sets, s.holds)
        if s.part == FOLLOWS:
            shares[2] = share(known.posterior, s.holds)
    return Conclusion(s, s.value(ours), s.holds(ours), prior, shares[0], left_out, *shares[1:])
