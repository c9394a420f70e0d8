"""The least friction coefficient, in closed form: no foot's force leans further than their sum."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.dynamics.force_rules import internal_basis, least_friction

FEET = np.array([[0.4, 0.0, 0.0], [-0.2, 0.3, 0.0], [-0.2, -0.3, 0.0]])


@pytest.mark.parametrize("enough", [np.inf, 5.0])
@pytest.mark.parametrize("lean", [0.0, 0.3, 3.0])
def test_the_least_coefficient_is_that_of_the_forces_sum(lean: float, enough: float) -> None:
    """All feet alike, sum t_i <= mu sum n_i; internal forces on top must be seen through."""
    basis = internal_basis(FEET[None])[0]
    start = np.tile([lean, 0.0, 1.0], (3, 1)) + basis @ np.array([0.1, -0.2, 0.15])
    assert least_friction(start, basis, enough) == pytest.approx(lean, abs=1e-6)


def test_no_coefficient_holds_feet_that_bear_nothing() -> None:
    basis = internal_basis(FEET[None])[0]
    assert least_friction(np.tile([1.0, 0.0, 0.0], (3, 1)), basis, np.inf) == np.inf
