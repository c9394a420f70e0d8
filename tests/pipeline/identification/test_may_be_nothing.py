"""A name whose interval holds nothing is not written."""

from __future__ import annotations

import pytest

from pipeline.identification.results import CONFIRMED, Estimate, Found
from pipeline.identification.workflow.written import may_be_nothing


@pytest.mark.parametrize(
    ("effect", "parameter", "ends", "nothing"),
    [
        ("effort_offset", "offset", (-0.005, 0.12), True),
        ("effort_offset", "offset", (0.005, 0.12), False),
        ("coulomb_friction", "torque", (0.0, 0.4), True),
        ("effort_gain", "gain", (0.97, 1.2), True),
        ("effort_gain", "gain", (0.01, 0.2), False),
        ("friction_factor", "factor", (0.9, 1.1), True),
        ("friction_factor", "factor", (0.0, 0.1), False),
    ],
)
def test_an_interval_that_holds_no_effect_is_told_by_what_the_effect_makes_of_it(
    effect: str, parameter: str, ends: tuple[float, float], nothing: bool
) -> None:
    low, high = ends
    estimate = Estimate(parameter, 0.5 * (low + high), low, high, "1")
    nan = float("nan")
    found = Found(1, effect, ("joint",), (estimate,), (), nan, nan, "N*m", nan, level=CONFIRMED)
    assert may_be_nothing(found) == nothing
