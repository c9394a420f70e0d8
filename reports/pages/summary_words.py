"""The summary's first paragraphs: what was fitted, predicted, contradicted, and what it costs.

Every number and every count in them is computed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from pipeline.paper.constants.motor_constants import asked_frictions
from pipeline.paper.hexapod import PUBLISHED_LEG
from pipeline.paper.judgement.basis import Judged
from pipeline.paper.judgement.evidence import Interval
from pipeline.paper.judgement.judge import NOTABLE
from pipeline.paper.judgement.rows import REPRODUCED, Row, headline
from pipeline.paper.published import CYCLE, EVEN, EXTRA, ROLES
from reports.table import Table

_REAL = ("rotor", "reversible", "irreversible")
_WORDS = {1: "one", 2: "two", 3: "three", 4: "four"}


def answer(judged: Judged, tables: Mapping[str, Table]) -> tuple[str, ...]:
    """The paragraphs a reader in a hurry reads."""
    if judged.by.results is None:
        return (changed(judged), _energies(judged, tables), " ".join(_counted(judged)))
    others = (changed(judged),) if judged.by.word else ()
    return (first_paragraph(judged), _energies(judged, tables), _posterior(judged), *others)


def first_paragraph(judged: Judged) -> str:
    """What is fitted, predicted and contradicted, and what the fit costs, for a cold reader.

    Args:
        judged: With the calibration's sets.
    """
    rows = _rows(judged)
    mass, even = rows["robot_mass"].published, rows[EVEN].computed
    ratios = [rows[f"walking_ratio_{name}"].computed for name in _REAL]
    return " ".join(
        (
            f"A paper compares four drives for the joints of a {mass:g} kg six-legged robot: an "
            "ideal one, the same with a real motor's rotor, *reversible* gears, and *irreversible* "
            "gears, which lock when the motor is off. It prints the electrical energy that each "
            "takes, but not the friction behind it. **Fitted:** friction was chosen here so that "
            f"walking takes {_listed(f'{r:.1f}' for r in ratios)} times the ideal drive's energy "
            "(printed: 4, more than 10, almost 15) and irreversible gears pay only for a robot "
            f"that stands still over {percent(even)} of the time; that these agree is no evidence.",
            *_counted(judged),
            _price(judged),
        )
    )


def _rows(judged: Judged) -> dict[str, Row]:
    return {row.id: row for row in judged.judgement.reproduction}


def _listed(words: Iterable[str]) -> str:
    """One, two and three."""
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last


def _word(count: int) -> str:
    return _WORDS.get(count, str(count))


def _counted(judged: Judged) -> tuple[str, ...]:
    """How many printed numbers play which part; what is predicted, contradicted, missed."""
    count = headline(judged.judgement.reproduction)
    total = sum(of for _, of in count.values())
    if judged.judgement.missing:
        met = sum(reproduced for reproduced, _ in count.values())
        return (
            f"**Reproduced:** {met} of the {total} printed numbers that can be computed with these "
            f"actuators; {len(judged.judgement.missing)} cannot and are left out.",
        )
    predicted = [r for r in judged.judgement.reproduction if r.role == "prediction"]
    named = _listed(_prediction(row, judged.by.results is not None) for row in predicted)
    text = (
        f"**Predicted:** {_word(len(predicted))} of the {total} printed numbers: {named}. "
        f"Of the rest {count['input'][1]} were put in, {count['target'][1]} "
        f"{'fitted' if judged.by.results is not None else 'are what was fitted'}, "
        f"{count['consequence'][1]} follow from those by Ohm's law and the like, "
        f"{count['symmetry'][1]} is zero by symmetry."
    )
    return tuple(part for part in (text, _against(judged), _missed(judged)) if part)


def _prediction(row: Row, known: bool) -> str:
    """A prediction, whether it comes out, and in which share of the posterior."""
    unit = "" if row.published == 0 else f" {row.unit}"
    text = (
        f"{_named(row)} is {row.published:g}{unit}, which "
        f"{'comes' if row.verdict == REPRODUCED else 'does not come'} out"
    )
    return text + (f" (in {percent(row.posterior_share)} of the posterior)" if known else "")


def _against(judged: Judged) -> str:
    """The rows that the paper contradicts, with the two numbers."""
    judgement = judged.judgement
    met, of = headline(judgement.reproduction)["contradicted"]
    if of == 0:
        return ""
    first, second = (
        1e3 * friction for friction, _ in asked_frictions(judged.by.published).values()
    )
    unmet = [
        _beside(row)
        for row in judgement.reproduction
        if row.role == "contradicted" and row.verdict != REPRODUCED
    ]
    text = (
        f"**Contradicted by the paper itself:** the other {_word(of)}. Two motor torques of "
        f"Table V ask for a rotor friction of {first:.3f} and of {second:.3f} mN·m, and an energy "
        f"was computed from a rounded power: {_word(met) if met else 'none'} of them "
        f"{'is' if met < 2 else 'are'} met"
    )
    if unmet:
        text += (
            f", {_word(len(unmet))} {'is' if len(unmet) == 1 else 'are'} not ({'; '.join(unmet)})"
        )
    return text + "."


def _beside(row: Row) -> str:
    """Ours instead of the paper's, with the printed digits."""
    published, ours, unit = row.published, row.computed, row.unit
    half = row.half_width
    if unit == "N*m":
        published, ours, half, unit = 1e3 * published, 1e3 * ours, 1e3 * half, "mN·m"
    digits = max(0, -math.floor(math.log10(half))) - 1 if half > 0 else 3
    joint = f" of joint {row.joint}" if row.joint else ""
    return (
        f"{row.quantity}{joint}, {ours:.{digits}f} where {published:.{digits}f} {unit} is printed"
    )


def _named(row: Row) -> str:
    joint = f" of joint {row.joint}" if row.joint else ""
    return f"the {row.quantity}{joint} ({row.where})"


def _missed(judged: Judged) -> str:
    """Rows not reproduced that nothing contradicts."""
    missed = [
        row.id
        for row in judged.judgement.reproduction
        if row.verdict != REPRODUCED and row.role != "contradicted"
    ]
    return f"**Not reproduced:** {', '.join(missed)}." if missed else ""


def _price(judged: Judged) -> str:
    """What the fit asks of single numbers."""
    p = judged.judgement.price
    assert p is not None  # asked for with all the paper's actuators alone
    _, high = p.gear_interval
    return (
        '**The price of the fit:** "almost 15" needs a planetary gear with '
        f"{p.gear_friction:.1f} mN·m of constant friction (95 % of the posterior: "
        f"{span(p.gear_known)}), where gear data suggest {p.gear_prior:g}, at most {high:.0f} "
        f"mN·m; it alone turns {p.gear_heat:.0f} of the {p.leg_energy:.0f} J that a leg draws per "
        f"cycle into heat. In {percent(p.no_load_share, 1)} of the posterior the motor draws over "
        f"{percent(NOTABLE - 1)} more current without load than the "
        f"{1e3 * p.no_load_sheet:.0f} mA of its data sheet."
    )


def _energies(judged: Judged, tables: Mapping[str, Table]) -> str:
    """What a leg draws, and when the irreversible drive pays."""
    energy = tables["walking_energy"].columns
    legs = {
        name: joules
        for name, leg, joules in zip(
            energy["alternative"], energy["leg"], energy["electrical_J"], strict=True
        )
        if leg == PUBLISHED_LEG
    }
    rows = _rows(judged)
    if judged.judgement.missing:
        listed = _listed(f"**{joules:.1f} J** with `{name}`" for name, joules in legs.items())
        return (
            "**What it costs:** walking one 3 s cycle, the middle right leg draws " + listed + "."
        )
    power = {
        name: rows[f"{name}_leg_energy_3s"].computed / CYCLE
        for name in ("reversible", "irreversible")
    }
    text = (
        f"**What it costs:** walking one 3 s cycle, the middle right leg draws "
        f"**{legs['ideal']:.2f} J** with ideal drives, {legs['rotor']:.1f} J once the rotor has "
        f"inertia and friction, **{legs['reversible']:.1f} J** with belt and Harmonic Drive "
        f"(reversible) and **{legs['irreversible']:.1f} J** with planetary and hypoid gears "
        "(irreversible). Standing still, a loaded leg draws "
        f"{power['reversible']:.2f} W with reversible and {power['irreversible']:.2g} W with "
        "irreversible gears"
    )
    even = rows[EVEN]
    if math.isnan(even.computed):
        return text + "; there is no share of standing above which the irreversible ones pay."
    text += (
        "; of the two middle legs, which the paper adds up, one is loaded, so that irreversible "
        f"gears pay only above {percent(even.computed, 1)} of the time standing."
    )
    if judged.by.results is None:
        return text
    row = next(c for c in judged.judgement.conclusions if c.id == EVEN)
    more = next(c for c in judged.judgement.conclusions if c.id == EXTRA)
    return text + (
        " Data sheets and literature alone, before any fit, put the irreversible gears at "
        f"{span(rows['walking_ratio_irreversible'].prior)} times the ideal drive's energy; in "
        f"{percent(1 - more.prior_share)} of their draws walking takes less with irreversible than "
        "with reversible gears, and where it takes more, the irreversible ones pay above "
        f"{_percent(row.prior)} of the time standing. With everything fitted but their own two "
        "figures (almost 15 and the share of standing), irreversible gears take "
        f"{span(rows['walking_ratio_irreversible'].left_out)} times the ideal drive's energy."
    )


def percent(share: float, digits: int = 0) -> str:
    """A share in percent."""
    return f"{100 * share:.{digits}f} %"


def _percent(interval: Interval) -> str:
    return f"{100 * interval[0]:.0f} to {percent(interval[1])}"


def span(interval: Interval) -> str:
    """An interval with one decimal."""
    return f"{interval[0]:.1f} to {interval[1]:.1f}"


def _posterior(judged: Judged) -> str:
    """What is known of the numbers behind, and how well it was computed."""
    results = judged.by.results
    assert results is not None
    count = headline(judged.judgement.reproduction)
    unmet = judged.judgement.best.unmet
    known = results["posterior"]
    numbers = known["numbers"].values()
    paths = [
        f"{name} {percent(p['share'])} ± {percent(1.96 * p['standard_error'])}"
        for name, p in known["paths"].items()
    ]
    return (
        "**How sure it is:** the paper does not print friction, inertia, masses or gear angles, "
        f"and {count['target'][1]} figures cannot determine {len(results['nearest']['z'])} "
        "numbers. The values here are the set nearest to data sheets and literature that fits. "
        "Their intervals hold 95 % of the posterior: what data sheets and literature say of all "
        "numbers together, where every target lies within half its last printed digit and no motor "
        f"beyond its limits. It was sampled with {known['walkers']} walkers, which agree (R-hat at "
        f"most {max(n['r_hat'] for n in numbers):.2f}) and are worth at least "
        f"{min(n['effective'] for n in numbers):.0f} independent draws of each number. The foot's "
        f"path through the air is one of the unknowns: {_listed(paths)}. The motor's torque "
        "constant, resistance and rotor friction have no prior but are drawn from the narrow range "
        "in which Tables IV to VI come out, finer than any data sheet resolves, but for "
        f"{_listed(_named(_rows(judged)[name]) for name in unmet)}."
    )


def changed(judged: Judged) -> str:
    """What of the run is not the paper's."""
    return f"**Not the paper's:** {judged.by.word}."


def roles_text() -> str:
    """What the roles of printed numbers mean."""
    return " ".join(f"*{role}*: {meaning}." for role, meaning in ROLES.items())
