"""A weight on one link: told from bodies that are wrong all over, with mass and place."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from pipeline.regression.identify import Options, identify
from pipeline.regression.laws.payload import nearest
from pipeline.regression.statistics.bandwidth import prepare
from pipeline.simulation.rigid_bodies import point_mass
from tests.pipeline.regression.arms import arm, heavier, log

MASS, PLACE = 0.8, np.array([0.05, -0.02, 0.3])


def with_weight(model: pin.Model, body: int) -> pin.Model:
    out = model.copy()
    ten = np.asarray(out.inertias[body + 1].toDynamicParameters())
    ten = ten + point_mass([MASS, *(MASS * PLACE)])
    out.inertias[body + 1] = pin.Inertia.FromDynamicParameters(ten)
    return out


@pytest.mark.parametrize("known", [np.ones(10), np.array([1e6, *np.ones(9)])])
def test_the_nearest_point_mass_is_the_one_that_is_there(known: np.ndarray) -> None:
    more = point_mass([MASS, *(MASS * PLACE)])
    more[0] = more[0] if known[0] == 1 else 0.0  # a mass that nothing tells
    found = nearest(2, more, np.diag(1e-8 * known))
    assert found is not None
    assert found.mass == pytest.approx(MASS, rel=0.02)
    assert found.place == pytest.approx(PLACE, abs=0.01)
    np.testing.assert_allclose(found.parameters[1:4], more[1:4], rtol=0.02)


def test_what_is_less_than_its_urdf_carries_nothing() -> None:
    assert nearest(0, -point_mass([MASS, *(MASS * PLACE)]), np.diag(np.full(10, 1e-8))) is None


def test_a_weight_on_one_link_is_told_from_bodies_that_are_wrong_all_over() -> None:
    model = arm(5)
    model.gravity.linear = np.array([4.0, 5.0, -7.4])
    train, _ = log(with_weight(model, 4), {}, seconds=60, seed=4)
    one = identify(prepare([train], model), model, options=Options(draws=5)).loaded
    assert one is not None
    assert one.body == 4
    assert abs(one.mass - MASS) < 3 * one.mass_error < 0.3 * MASS
    np.testing.assert_allclose(one.place, PLACE, atol=0.05)
    wrong = heavier(model, {0: 1.2, 1: 0.8, 2: 1.25})
    train, _ = log(wrong, {}, seconds=60, seed=4)
    result = identify(prepare([train], model), model, options=Options(draws=5))
    assert result.refit
    assert result.loaded is None
