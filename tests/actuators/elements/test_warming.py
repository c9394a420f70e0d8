"""Friction that falls with temperature: first order of the exponential law, and energy."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.elements.heating import ZERO_CELSIUS, Warming


def test_it_is_the_first_order_of_an_exponential_law() -> None:
    """Friction (c s + d v) exp(-b (T - T_ref)) to first order in b (T - T_ref)."""
    b, c, d, reference = 1e-4, 2.0, 0.5, 300.0
    kelvin = np.linspace(290.0, 310.0, 21)
    v = np.linspace(-2.0, 2.0, 21)
    sense = np.sign(v)
    friction = c * sense + d * v
    exact = friction * np.exp(-b * (kelvin - reference)) - friction
    told = Warming(b * c, b * d, reference).torque(kelvin - ZERO_CELSIUS, sense, v)
    assert told == pytest.approx(exact, abs=1e-3 * np.abs(exact).max())
