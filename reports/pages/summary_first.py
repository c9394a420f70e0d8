"""What the paper's page shows at first sight: four numbers, what is fitted, what is predicted."""

from __future__ import annotations

from pipeline.paper.judgement.basis import Judged
from pipeline.paper.judgement.rows import REPRODUCED, Row, headline
from pipeline.paper.published import EVEN
from reports.page import Number
from reports.pages.summary_words import changed, percent, span
from reports.typeset import number_text

#: Sentences of the paper whose numbers stand first, where the run has them.
_FIRST = ("walking_ratio_reversible", "walking_ratio_irreversible", EVEN)


def numbers_first(judged: Judged) -> tuple[Number, ...]:
    """What the paper's main sentences come to here, and how many of its numbers are predicted."""
    said = {c.id: c for c in judged.judgement.conclusions}
    out = [_number(said[name], judged) for name in _FIRST if name in said]
    met, of = headline(judged.judgement.reproduction)["prediction"]
    if of and judged.by.results is not None:
        label = (
            "*predicted:* printed numbers that nothing put in or fitted decides, and that come out"
        )
        out.append(Number(f"{met} of {of}", label, "quiet" if met == of else "bad"))
    return tuple(out)


def _number(row: Row, judged: Judged) -> Number:
    share = row.id == EVEN
    value = (
        percent(row.computed, 1)
        if share
        else f"{number_text(row.computed)} \N{MULTIPLICATION SIGN}"
    )
    part = "computed anew" if judged.by.results is None else row.role
    return Number(value, f"*{part}:* {row.sentence}", "quiet" if row.holds else "bad")


def first_sentences(judged: Judged) -> tuple[str, ...]:
    """What it is about, what was fitted, what is predicted, and what is known without the fit."""
    rows = {row.id: row for row in judged.judgement.reproduction}
    mass = f" of {rows['robot_mass'].published:g} kg" if "robot_mass" in rows else ""
    about = (
        f"A paper compares drives for the joints of a six-legged robot{mass}: an *ideal* one, one "
        "with a real motor's *rotor*, *reversible* gears, and *irreversible* gears, which lock "
        "when the motor is off. It prints energies, not the friction behind them."
    )
    if judged.by.results is None:
        return about, changed(judged)
    count = headline(judged.judgement.reproduction)
    total = sum(of for _, of in count.values())
    fitted = (
        f"**Fitted:** the friction of motors and gears, to {count['target'][1]} of the {total} "
        "numbers that the paper prints: that the model agrees with these proves nothing."
    )
    predicted = [r for r in rows.values() if r.role == "prediction"]
    each = "; ".join(
        f"{_named(r.where, r.quantity, r.joint)}: "
        f"{number_text(r.computed)} where {number_text(r.published)} is printed"
        for r in predicted
    )
    met = sum(r.verdict == REPRODUCED for r in predicted)
    words = (
        f"**Predicted:** {len(predicted)} of them, {met} reproduced ({each}). The rest were put "
        "in, follow from these, are zero by symmetry, or are contradicted by the paper itself."
    )
    return about, fitted, words, *_known(judged), *((changed(judged),) if judged.by.word else ())


def _named(where: str, quantity: str, joint: str) -> str:
    return f"{where}, {quantity}{f' of joint {joint}' if joint else ''}"


def _known(judged: Judged) -> tuple[str, ...]:
    """What data sheets and literature say of the paper's ratios before anything is fitted."""
    parts = [
        f"{span(c.prior)} (paper: {c.words}; so in {percent(c.prior_share)} of all "
        f"draws) with {c.id.rpartition('_')[2]}"
        for c in judged.judgement.conclusions
        if c.id in _FIRST and c.id != EVEN
    ]
    if not parts:
        return ()
    return (
        "**Known without the fit:** by data sheets and literature alone walking takes, times the "
        f"ideal drive's energy and with 95 % probability, {' and '.join(parts)} gears.",
    )
