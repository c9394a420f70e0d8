"""What the paper says against what is computed: every row, and what is claimed of it."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from actuators.units import to_si
from pipeline.paper.calibration import EXACT
from pipeline.paper.judgement.judge import Judgement
from pipeline.paper.judgement.rows import Row, break_evens, judged
from pipeline.paper.motor_constants import UNMET
from pipeline.paper.published import EVEN, EXTRA, ROLES, Published
from pipeline.paper.quantities import steps
from pipeline.simulation.cycle_energy import break_even


@pytest.fixture(scope="module")
def rows(judgement: Judgement) -> dict[str, Row]:
    return {row.id: row for row in judgement.reproduction}


def test_every_printed_value_is_reproduced_or_contradicted(
    judgement: Judgement, rows: dict[str, Row], published: dict[str, Published]
) -> None:
    assert rows.keys() == published.keys()
    for name, row in rows.items():
        inside = abs(row.computed - row.published) <= row.half_width * (1 + 1e-9) + 1e-12
        assert inside == (name not in UNMET), f"{row.computed} for {row.published}"
        assert row.verdict == ("contradicted" if name in UNMET else "reproduced"), name
        assert row.remark or row.role != "contradicted"
    reproduced = Counter(row.role for row in rows.values() if row.holds)
    assert [reproduced[role] for role in ROLES] == [11, 11, 19, 1, 1, 1]
    assert Counter(row.role for row in rows.values())["contradicted"] == 3


@pytest.mark.parametrize(
    ("name", "value", "verdict"),
    [
        ("walking_ratio_rotor", 3.5, "reproduced"),
        ("walking_ratio_rotor", 4.5, "reproduced"),
        ("walking_ratio_rotor", 3.4, "not reproduced"),
        ("walking_ratio_rotor", 4.6, "not reproduced"),
        ("walking_ratio_rotor", math.nan, "not reproduced"),
        (UNMET[0], 4.6, "contradicted"),
        (UNMET[0], 3.5, "reproduced"),
    ],
)
def test_verdicts_of_a_row(name: str, value: float, verdict: str) -> None:
    row = Row(name, "", "", "1", "target", at_least=3.5, at_most=4.5)
    (found,) = judged("reproduction", [row], {name: value}, False)
    assert found.verdict == verdict
    assert np.isnan([*found.prior, *found.left_out, found.posterior_share]).all()
    assert judged("reproduction", [row], {"other": 4.0}, True) == ()
    (found,) = judged("reproduction", [row], {name: value}, True)
    assert math.isnan(found.prior[0]) == (name in UNMET)  # what Table V fixes, no data sheet knows


def test_what_is_fitted_shows_no_interval_of_the_fit(
    rows: dict[str, Row], judgement: Judgement
) -> None:
    """What is shown of a target is the prior and what the rest says."""
    # The price of "almost 15".
    assert rows["walking_ratio_irreversible"].prior[1] < rows["walking_ratio_irreversible"].computed
    # Put in exactly, or fixed by Tables IV and V: nothing else knows them.
    for name in (*EXACT, "ideal_leg_energy_3s", "rotor_leg_energy_3s"):
        assert np.isnan(rows[name].prior).all()
    line = judgement.per_minute[-1]
    assert line.alternative == "irreversible"
    assert line.prior is not None
    assert line.energy[0] > line.prior[1][0]  # fitted beyond what data sheets say
    assert judgement.per_minute[0].left_out is None  # of the ideal drive nothing is fitted


def test_no_break_even_is_reported(judgement: Judgement) -> None:
    for row in judgement.break_even:
        assert row.holds != row.remark.startswith("no break-even")

    def remark(cycle: float, stand: float) -> str:
        costs = {"reversible cycle_J": 2.0, "reversible stand_W": 1.0}
        costs |= {"irreversible cycle_J": cycle, "irreversible stand_W": stand}
        even = break_even(cycle - 2.0, 3.0 * (1.0 - stand))
        return break_evens({**costs, "middle_legs": even}, False)[0].remark

    assert remark(3.0, 0.5).startswith("above this share")
    assert remark(2.0, 0.5).startswith("no break-even: walking")
    assert remark(3.0, 1.0).startswith("no break-even: standing")
    assert break_evens({}, False) == ()


def test_sentences_of_section_iv_a_hold_but_two(judgement: Judgement) -> None:
    """Much higher is at least twice as high, which 1.6 to 1.7 times is not."""
    said = [row for row in judgement.conclusions if row.where != "Section V"]
    assert len(said) == 28
    found: dict[str, list[float]] = {}
    for row in said:
        found.setdefault(row.quantity, []).append(row.computed)
    for quantity, ratios, tolerance in (
        ("E_m(+), actuator with ideal transmission over ideal actuator", [69, 3.8, 13], 0.02),
        ("reversible actuator, E_wg(+) over E_out(+)", [137, 5.9, 20], 0.02),
        ("reversible actuator, E_m(+) over E_wg(+)", [1.6, 1.65, 1.74], 0.02),
        ("E_m(+), irreversible over reversible", [1.24, 1.45, 1.37], 0.01),
    ):
        assert found[quantity] == pytest.approx(ratios, rel=tolerance)
    assert {row.sentence for row in said if not row.holds} == {
        "so does the timing belt",
        "the fluctuation of the rotor's kinetic energy increases the dissipation in it",
    }
    assert all(math.isnan(row.prior_share) for row in said)  # evaluated on ours alone


def test_every_sentence_of_section_v_can_fail(judgement: Judgement, rows: dict[str, Row]) -> None:
    """Holds for ours, and does not where one number is turned the other way."""
    ours = {name: to_si(r.computed, r.unit) for name, r in rows.items()} | {EXTRA: 20.0}
    turned = {
        "walking_ratio_rotor": ("walking_ratio_rotor", 5.0),
        "walking_ratio_reversible": ("walking_ratio_reversible", 10.0),
        "walking_ratio_irreversible": ("walking_ratio_irreversible", 15.1),
        EXTRA: (EXTRA, 0.0),
        EVEN: (EVEN, 0.8),
        "ideal_most": ("ideal_leg_energy_3s", 5.0),
        "irreversible_leg_energy_3s": ("irreversible_leg_energy_3s", 0.1),
        "ordered": ("reversible_leg_energy_3s", 5.9),
    }
    said = {row.id: row for row in judgement.conclusions if not row.joint}
    assert said.keys() == turned.keys()
    for name, (number, value) in turned.items():
        assert said[name].holds
        changed = ours | {number: value}
        assert said[name].true_of((ours | steps(ours))[name])
        assert not said[name].true_of((changed | steps(changed))[name]), name
