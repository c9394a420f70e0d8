"""The summary's first paragraphs: what was fitted, predicted, contradicted, and what it costs.

Every number and every count in them is computed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from pipeline.app.judgement import Judged
from pipeline.calibration.conclusions import Conclusion
from pipeline.calibration.evidence import Interval
from pipeline.calibration.price import NOTABLE
from pipeline.calibration.problem import EVEN
from pipeline.calibration.published import ROLES
from pipeline.calibration.reproduction import REPRODUCED, ReproducedRow, headline
from reports.table import Table

_STANDING_SECONDS = 3.0


def answer(judged: Judged, tables: Mapping[str, Table]) -> tuple[str, ...]:
    """The paragraphs a reader in a hurry reads."""
    if judged.by.results is None:
        return (_changed(judged), _energies(judged, tables), _counts(judged))
    return (_first(judged), _energies(judged, tables), _ensemble(judged))


def _first(judged: Judged) -> str:
    """What is fitted, predicted and contradicted, and what the fit costs."""
    judgement = judged.judgement
    rows = {row.published.id: row for row in judgement.reproduction}
    text = (
        "A paper compares four drives for the joints of a walking robot and prints how much more "
        "energy walking takes with each, but not the friction it used. Here that friction was "
        "**fitted** until the paper's walking figures came out (reversible gears "
        f"{_ratio(rows, 'reversible')} times the ideal drive's energy, irreversible ones "
        f"{_ratio(rows, 'irreversible')} times), so that they come out proves nothing. "
    )
    text += _counts(judged)
    text += _price(judged)
    before = {c.sentence.text: c for c in judgement.conclusions}
    prior = rows["walking_ratio_irreversible"].prior
    costs_more = next(
        c for c in before.values() if c.sentence.text.startswith("walking, the irreversible")
    )
    return text + (
        " Data sheets and literature alone, without the fit, would put the irreversible drive at "
        f"{_span(prior)} times the ideal one's energy, and in {_less(costs_more)} of their draws "
        "below the reversible one even walking."
    )


def _less(row: Conclusion) -> str:
    return f"{1 - row.prior_share:.0%}"


def _ratio(rows: Mapping[str, ReproducedRow], alternative: str) -> str:
    return f"{rows[f'walking_ratio_{alternative}'].computed:.1f}"


def _counts(judged: Judged) -> str:
    """How many printed numbers are what, and what contradicts."""
    judgement = judged.judgement
    count = headline(judgement.reproduction)
    total = sum(of for _, of in count.values())
    fitted = "fitted" if judged.by.results is not None else "targets of the fit"
    met, of = count["prediction"]
    text = (
        f"Of {total} printed numbers {count['input'][1]} were put in, {count['target'][1]} "
        f"{fitted}, {count['consequence'][1]} follow from those (by Ohm's law and the like), "
        f"{count['symmetry'][1]} is zero by symmetry and {of} are **predicted**: that friction "
        "alone holds the lightly loaded knee with reversible gears, and the whole leg with "
        f"irreversible ones. {'Both' if met == of == 2 else f'{met} of {of}'} come out"
    )
    shares = [
        row.met
        for row in judgement.reproduction
        if row.published.role == "prediction" and not math.isnan(row.met)
    ]
    text += f" (in {min(shares):.0%} of the fitted sets at least). " if shares else ". "
    return text + _against(judged) + _missed(judgement.reproduction)


def _against(judged: Judged) -> str:
    """The rows that the paper contradicts, with the two numbers."""
    judgement = judged.judgement
    first, second = judgement.contradiction.asked
    met, of = headline(judgement.reproduction)["contradicted"]
    if of == 0:
        return ""
    unmet = [
        f"{row.published.quantity} {row.computed:.4g} instead of {row.published.value:g} "
        f"{row.published.unit}"
        for row in judgement.reproduction
        if row.published.role == "contradicted" and row.verdict != REPRODUCED
    ]
    return (
        f"The other {of} **contradict** each other: the two motor torques of Table V ask for a "
        f"rotor friction of {first:.3f} and of {second:.3f} mN·m, and its energy is that of a "
        f"rounded power. {met} of the {of} {'is' if met == 1 else 'are'} met"
        + (f", {len(unmet)} cannot be ({'; '.join(unmet)}). " if unmet else ". ")
    )


def _missed(rows: tuple[ReproducedRow, ...]) -> str:
    """Rows not reproduced that nothing contradicts."""
    missed = [
        row.published.id
        for row in rows
        if row.verdict != REPRODUCED and row.published.role != "contradicted"
    ]
    return f"Not reproduced: {', '.join(missed)}. " if missed else ""


def _price(judged: Judged) -> str:
    """What the fit asks of single numbers."""
    p = judged.judgement.price
    low, high = p.gear_interval
    return (
        f'The fit has its price. "Almost 15" takes a planetary gear with {p.gear_friction:.1f} '
        f"mN·m of Coulomb friction, {p.gear_friction / p.gear_prior:.1f} times the "
        f"{p.gear_prior:g} mN·m that gear data suggest (they believe {low:g} to {high:g}); "
        f"it alone turns {p.gear_heat:.0f} of the leg's {p.leg_energy:.0f} J per step cycle into "
        f"heat. And {p.no_load_share:.0%} of the fitted sets ask for a motor that draws over "
        f"{NOTABLE - 1:.0%} more current without load than its data sheet's "
        f"{1e3 * p.no_load_sheet:.0f} mA."
    )


def _energies(judged: Judged, tables: Mapping[str, Table]) -> str:
    """What a leg draws, and when the irreversible drive pays."""
    energy = tables["walking_energy"].columns
    legs = {
        name: joules
        for name, leg, joules in zip(
            energy["alternative"], energy["leg"], energy["electrical_J"], strict=True
        )
        if leg == "rm"
    }
    rows = {row.published.id: row for row in judged.judgement.reproduction}
    power = {
        name: rows[f"{name}_leg_energy_3s"].computed / _STANDING_SECONDS
        for name in ("reversible", "irreversible")
    }
    text = (
        f"Walking one 3 s cycle, the middle right leg draws **{legs['ideal']:.1f} J** with "
        f"ideal actuators, {legs['rotor']:.1f} J once the rotor has inertia and friction, "
        f"**{legs['reversible']:.1f} J** with belt and Harmonic Drive and "
        f"**{legs['irreversible']:.1f} J** with planetary and hypoid gears. Standing still, the "
        f"loaded leg draws {power['reversible']:.2f} W with the reversible actuator and "
        f"{power['irreversible']:.2g} W with the irreversible one"
    )
    even = rows[EVEN]
    if math.isnan(even.computed):
        return text + "; there is no share of standing above which the irreversible one pays."
    text += f", which pays only above {even.computed:.1%} of the time standing"
    if judged.by.results is None:
        return text + "."
    before = next(c for c in judged.judgement.conclusions if c.sentence.left_out and _is_even(c))
    return text + (
        f". That share too is fitted: left out of the fit together with the irreversible ratio it "
        f"would be {_percent(even.left_out)}, before any fit {_percent(before.prior)} where there "
        "is one at all."
    )


def _is_even(row: Conclusion) -> bool:
    return row.sentence.quantity.startswith("break-even")


def _percent(interval: Interval) -> str:
    return f"{interval[0]:.0%} to {interval[1]:.0%}"


def _span(interval: Interval) -> str:
    return f"{interval[0]:.1f} to {interval[1]:.1f}"


def _ensemble(judged: Judged) -> str:
    """What the ensemble is."""
    results = judged.by.results
    assert results is not None
    count = headline(judged.judgement.reproduction)
    members, draws = len(results["ensemble"]), results["draws"]
    unmet = judged.judgement.contradiction.best.unmet
    return (
        "The paper does not print friction, inertia, masses or gear angles. "
        f"{count['target'][1]} fitted figures cannot determine "
        f"{len(results['nearest']['z'])} numbers: the values here are the set nearest to data "
        f"sheets and literature. Beside it stand {members} sets (of {draws} draws from prior "
        f"knowledge, moved as little as needed) that give every printed number at printed "
        f"precision but {' and '.join(f'`{name}`' for name in unmet)} and the predictions, of "
        "which none was asked. The motor's torque constant, resistance and rotor friction have no "
        "prior: these rows leave so narrow a sliver of them that no data sheet resolves it, and "
        "all sets are drawn from inside it."
    )


def _changed(judged: Judged) -> str:
    return f"**Changed numbers.** {judged.by.word[0].upper()}{judged.by.word[1:]}."


def roles_text() -> str:
    """What the roles of printed numbers mean."""
    return " ".join(f"*{role}*: {meaning}." for role, meaning in ROLES.items())
