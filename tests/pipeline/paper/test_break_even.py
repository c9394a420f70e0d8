"""The break-even is where two straight lines of energy against time standing cross."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pipeline.paper.calibration.quantities import STANDING_SECONDS, pair_break_even
from pipeline.paper.judgement.fig_21 import crossing

PERIOD = 3.0  # of the gait [s]
CASES = [(120.0, 9.0, 200.0, 1.0), (10.0, 2.0, 10.5, 0.0), (50.0, 1.0, 400.0, 0.9)]


@pytest.mark.parametrize(("cycle", "held", "more", "less"), CASES)
def test_at_the_crossing_both_actuators_draw_the_same_power(
    cycle: float, held: float, more: float, less: float
) -> None:
    whole = {
        "reversible": {"cycle": cycle, "stand": held},
        "irreversible": {"cycle": more, "stand": less},
    }
    f = crossing(whole, "cycle", "stand")
    assert 0.0 < f < 1.0
    drawn = [(1 - f) * w["cycle"] / PERIOD + f * w["stand"] for w in whole.values()]
    assert drawn[0] == pytest.approx(drawn[1], rel=1e-12)
    # Beyond it, and only there, the irreversible one draws less.
    for at, sign in ((f - 0.01, 1.0), (f + 0.01, -1.0)):
        reversible, irreversible = (
            (1 - at) * w["cycle"] / PERIOD + at * w["stand"] for w in whole.values()
        )
        assert np.sign(irreversible - reversible) == sign


@pytest.mark.parametrize("legs", [1, 2])
def test_the_papers_break_even_adds_up_both_middle_legs(legs: int) -> None:
    """Fig. 21: walking both draw, standing `legs` of them, the irreversible actuator nothing."""
    energy = {
        "reversible": {"lm": 100.0, "rm": 110.0},
        "irreversible": {"lm": 140.0, "rm": 145.0},
    }
    power = 0.9  # of one loaded leg [W]
    f = pair_break_even(energy, power, legs)
    walking = {name: (1 - f) * sum(e.values()) for name, e in energy.items()}  # [J] per period
    standing = f * legs * power * STANDING_SECONDS
    assert walking["irreversible"] == pytest.approx(walking["reversible"] + standing, rel=1e-12)


def test_no_crossing_where_one_actuator_is_better_at_both() -> None:
    better = {"cycle": 100.0, "stand": 1.0}
    worse = {"cycle": 200.0, "stand": 2.0}
    assert math.isnan(crossing({"reversible": better, "irreversible": worse}, "cycle", "stand"))
    assert math.isnan(crossing({"reversible": worse, "irreversible": better}, "cycle", "stand"))
    equal = {"reversible": better, "irreversible": better}
    assert math.isnan(crossing(equal, "cycle", "stand"))
