"""The law of play by itself: which flank carries, and how far motor and joint lie apart."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.effects.base import effect_named
from tests.pipeline.identification import bench_leg as leg

J3 = ("rm_joint_3",)
VALUES = {"width": 0.01, "stiffness": 1e3, "crossing": 0.2}


def lead(torque: np.ndarray) -> np.ndarray:
    """How far the motor leads its joint."""
    model = effect_named("backlash").apply(leg.leg_model(), J3, VALUES)
    return model.actuator(J3[0]).deflection(torque)


def test_play_is_odd_nothing_without_load_and_ends_at_its_flanks() -> None:
    torque = np.array([-5.0, -0.05, 0.0, 0.05, 5.0])
    lag = lead(torque)
    assert lag == pytest.approx(-lag[::-1], abs=1e-12)
    assert lag[2] == pytest.approx(0.0, abs=1e-12)
    # On a flank: half the width and what the flank gives.
    assert lag[-1] == pytest.approx(0.5 * VALUES["width"] + 5.0 / VALUES["stiffness"], rel=1e-6)
    # Between the flanks the slope is that of width / (2 crossing) beside the stiffness.
    slope = 0.5 * VALUES["width"] / VALUES["crossing"] + 1.0 / VALUES["stiffness"]
    assert lag[3] == pytest.approx(0.05 * slope, rel=0.03)
