"""Blocks and names on small regressions whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.effects.base import EFFECTS, effect_named
from pipeline.effects.model_file import Edit
from pipeline.identification.answer import Told, answered
from pipeline.identification.design import make_data_sets
from pipeline.identification.fit import independent
from pipeline.identification.floor import floor_of
from pipeline.identification.results import Found
from pipeline.identification.search import searched
from pipeline.identification.workflow.written import may_be_nothing
from pipeline.logs.log import TEST
from tests.pipeline.identification import bench_leg as leg

J1 = ("rm_joint_1",)


def test_samples_with_memory_count_for_less() -> None:
    rng = np.random.default_rng(1)
    white = rng.standard_normal(20_000)
    assert independent(white) == pytest.approx(1.0, abs=0.1)
    slow = np.empty_like(white)
    slow[0] = white[0]
    for k in range(1, white.size):
        slow[k] = 0.9 * slow[k - 1] + white[k]
    # (1 - rho) / (1 + rho) of an autoregressive process of first order.
    assert independent(slow) == pytest.approx(0.1 / 1.9, rel=0.25)


def test_a_law_that_only_one_chunk_shows_is_not_told() -> None:
    nominal = leg.leg_model()
    log = leg.only(leg.measured(nominal, leg.leg_motion(duration=8.0)), ("current",))
    rubbing = effect_named("coulomb_friction").apply(nominal, J1, {"torque": 0.2})
    other = leg.only(leg.measured(rubbing, leg.leg_motion(duration=8.0)), ("current",))
    once = (log.time > 3.0) & (log.time < 3.4)
    effort = np.where(once[:, None, None], other.effort, log.effort)
    mixed = replace(log, effort=effort)
    found = searched(nominal, make_data_sets([mixed]), floor_of([mixed]))
    assert not [t for t in answered(found).told if t.key[0] == "coulomb_friction"]
    held = (log.part == TEST)[:, None, None]
    always = replace(log, effort=np.where(held, log.effort, other.effort))
    found = searched(nominal, make_data_sets([always]), floor_of([always]))
    assert [t.key for t in answered(found).told] == [("coulomb_friction", J1)]


@pytest.mark.parametrize(
    "lacks", [{"against_nothing": -1.0}, {"sure": 1.0}, {"share": 0.0}, {"certain": False}]
)
def test_a_name_is_told_where_evidence_and_chunks_and_rest_and_interval_all_want_it(
    lacks: dict[str, float],
) -> None:
    whole = Told(("coulomb_friction", J1), (0,), 50.0, 5.0, 0.5, certain=True, priced=True)
    assert whole.stands
    assert not replace(whole, **lacks).stands  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("effect", "parameter", "ends", "nothing"),
    [
        ("effort_offset", "offset", (-0.005, 0.12), True),
        ("effort_offset", "offset", (0.005, 0.12), False),
        ("effort_gain", "gain", (0.97, 1.2), True),
        ("effort_gain", "gain", (0.01, 0.2), False),
    ],
)
def test_a_name_whose_interval_holds_no_effect_is_not_written(
    effect: str, parameter: str, ends: tuple[float, float], nothing: bool
) -> None:
    number = {"value": 0.5 * sum(ends), "unit": EFFECTS[effect].unit(parameter, "torque")}
    parameters = {parameter: {**number, "interval": ends}}
    made = {"effect": effect, "place": ("joint",), "parameters": parameters}
    found = Found(1, (Edit.model_validate(made),))
    assert may_be_nothing(found) == nothing
