"""What the paper's page says at first sight and in full: what `templates/summary.jinja` is about.

Every number and every count in it is computed elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from pipeline.paper.hexapod import PUBLISHED_LEG
from pipeline.paper.judgement.evidence import Interval
from pipeline.paper.judgement.judge import NOTABLE, Judgement
from pipeline.paper.judgement.rows import REPRODUCED, Row, headline
from pipeline.paper.motor_constants import UNMET, asked_frictions
from pipeline.paper.published import CYCLE, EVEN, EXTRA, ROLES
from reports.page import Number
from reports.table import Table
from reports.typeset import TIMES, number
from reports.words import Words, percent

_REAL = ("rotor", "reversible", "irreversible")
#: Sentences of the paper whose numbers stand first, where the run has them.
_FIRST = ("walking_ratio_reversible", "walking_ratio_irreversible", EVEN)


def numbers_first(judged: Judgement) -> tuple[Number, ...]:
    """What the paper's main sentences come to here, and how many of its numbers are predicted."""
    said = {c.id: c for c in judged.conclusions}
    out = []
    for row in (said[name] for name in _FIRST if name in said):
        share = row.id == EVEN
        value = percent(row.computed, 1) if share else f"{number(row.computed)} {TIMES}"
        part = "computed anew" if judged.by.results is None else row.role
        tone = "quiet" if row.holds else "bad"
        out.append(Number(value, f"*{part}:* {row.sentence}", tone))
    met, of = headline(judged.reproduction)["prediction"]
    if of and judged.by.results is not None:
        label = (
            "*predicted:* printed numbers that nothing put in or fitted decides, and that come out"
        )
        out.append(Number(f"{met} of {of}", label, "quiet" if met == of else "bad"))
    return tuple(out)


def first_sentences(judged: Judgement) -> tuple[str, ...]:
    """What it is about, what was fitted, what is predicted, and what is known without the fit."""
    rows = _rows(judged)
    mass = rows["robot_mass"].published if "robot_mass" in rows else None
    about = WORDS("about", mass)
    if judged.by.results is None:
        return about, changed(judged)
    count, total = _count(judged)
    predicted = [row for row in rows.values() if row.role == "prediction"]
    met = sum(row.verdict == REPRODUCED for row in predicted)
    ratios = [c for c in judged.conclusions if c.id in _FIRST and c.id != EVEN]
    said = (
        about,
        WORDS("fitted_short", count, total),
        WORDS("predicted_short", predicted, met),
        WORDS("known", ratios),
        changed(judged) if judged.by.word else "",
    )
    return tuple(filter(None, said))


def answer(judged: Judgement, tables: Mapping[str, Table]) -> tuple[str, ...]:
    """The paragraphs a reader in a hurry reads."""
    if judged.by.results is None:
        return (changed(judged), _energies(judged, tables), _counted(judged))
    others = (changed(judged),) if judged.by.word else ()
    return (first_paragraph(judged), _energies(judged, tables), _posterior(judged), *others)


def first_paragraph(judged: Judgement) -> str:
    """What is fitted, predicted and contradicted, and what the fit costs, for a cold reader."""
    rows = _rows(judged)
    ratios = [f"{rows[f'walking_ratio_{name}'].computed:.1f}" for name in _REAL]
    fitted = WORDS("fitted", rows["robot_mass"].published, ratios, rows[EVEN].computed)
    assert judged.price is not None  # asked for with all the paper's actuators alone
    return f"{fitted} {_counted(judged)} {WORDS('price', judged.price)}"


def _rows(judged: Judgement) -> dict[str, Row]:
    return {row.id: row for row in judged.reproduction}


def _count(judged: Judgement) -> tuple[Mapping[str, tuple[int, int]], int]:
    """By role, how many printed numbers are met of how many; and how many there are."""
    count = headline(judged.reproduction)
    return count, sum(of for _, of in count.values())


def _counted(judged: Judgement) -> str:
    """How many printed numbers play which part; what is predicted, contradicted, missed."""
    count, total = _count(judged)
    if judged.missing:
        met = sum(reproduced for reproduced, _ in count.values())
        return WORDS("reproduced", met, total, len(judged.missing))
    rows = judged.reproduction
    predicted = [row for row in rows if row.role == "prediction"]
    missed = [row for row in rows if row.verdict != REPRODUCED]
    unmet = [_beside(row) for row in missed if row.role == "contradicted"]
    frictions = [1e3 * friction for friction, _ in asked_frictions(judged.by.published).values()]
    said = (
        WORDS("predicted", predicted, count, total, judged.by.results is not None),
        WORDS("contradicted", *count["contradicted"], frictions, unmet),
        WORDS("missed", [row.id for row in missed if row.role != "contradicted"]),
    )
    return " ".join(filter(None, said))


def _beside(row: Row) -> str:
    """Ours instead of the paper's, with the printed digits."""
    scale, unit = (1e3, "mN·m") if row.unit == "N*m" else (1.0, row.unit)
    half = scale * row.half_width
    digits = max(0, -math.floor(math.log10(half))) - 1 if half > 0 else 3
    ours, published = (f"{scale * x:.{digits}f}" for x in (row.computed, row.published))
    joint = f" of joint {row.joint}" if row.joint else ""
    return f"{row.quantity}{joint}, {ours} where {published} {unit} is printed"


def _energies(judged: Judgement, tables: Mapping[str, Table]) -> str:
    """What a leg draws, and when the irreversible drive pays."""
    c = tables["walking_energy"].columns
    every = zip(c["alternative"], c["leg"], c["electrical_J"], strict=True)
    legs = {name: joules for name, leg, joules in every if leg == PUBLISHED_LEG}
    if judged.missing:
        return WORDS("cost_some", legs)
    rows, known = _rows(judged), None
    power = {name: rows[f"{name}_leg_energy_3s"].computed / CYCLE for name in _REAL[1:]}  # [W]
    if judged.by.results is not None:
        conclusions = {row.id: row for row in judged.conclusions}
        known = (rows["walking_ratio_irreversible"], conclusions[EVEN], conclusions[EXTRA])
    return WORDS("cost", legs, power, rows[EVEN].computed, known)


def _posterior(judged: Judgement) -> str:
    """What is known of the numbers behind, and how well it was computed."""
    results, (count, _) = judged.by.results, _count(judged)
    assert results is not None
    return WORDS("posterior", count, results, [_rows(judged)[name] for name in UNMET])


def changed(judged: Judgement) -> str:
    """What of the run is not the paper's."""
    return f"**Not the paper's:** {judged.by.word}."


def roles_text() -> str:
    """What the roles of printed numbers mean."""
    return " ".join(f"*{role}*: {meaning}." for role, meaning in ROLES.items())


def _span(interval: Interval) -> str:
    return f"{interval[0]:.1f} to {interval[1]:.1f}"


WORDS = Words("summary", span=_span, reproduced_word=REPRODUCED, notable=NOTABLE)
