"""A payload anywhere on the last link, found against the machine without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pipeline.effects.bodies import point_mass
from pipeline.effects.registry import effect_named
from pipeline.identification.selection.identify import identify
from pipeline.identification.selection.places import _point
from pipeline.simulation.rigid_bodies import changed_model
from tests.pipeline.identification import bench_leg as leg

LAST = ("rm_tibia_link",)
FAR = {"mass": 1.5, "x": 0.1, "y": 0.25, "z": -0.4}  # outside of the link's own size


def test_it_is_a_point_mass_where_it_is_said_to_be() -> None:
    model = leg.leg_model()
    loaded = effect_named("link_mass").apply(model, LAST, FAR)
    joint = model.rigid.getJointId(model.carrier(LAST[0]))
    place = np.array([FAR[axis] for axis in "xyz"])
    expected = model.rigid.inertias[joint] + pin.Inertia(FAR["mass"], place, np.zeros((3, 3)))
    found = changed_model(loaded.rigid, loaded.bodies).inertias[joint]
    np.testing.assert_allclose(
        found.toDynamicParameters(), expected.toDynamicParameters(), atol=1e-12
    )


def test_without_a_place_it_is_at_the_centre_of_mass_and_leaves_it_where_it_is() -> None:
    model = leg.leg_model()
    loaded = effect_named("link_mass").apply(model, LAST, {"mass": 0.7})
    joint = model.rigid.getJointId(model.carrier(LAST[0]))
    before, after = (changed_model(m.rigid, m.bodies).inertias[joint] for m in (model, loaded))
    assert after.mass == pytest.approx(before.mass + 0.7)
    np.testing.assert_allclose(after.lever, before.lever)


@pytest.mark.slow
def test_against_a_machine_whose_bodies_are_known_mass_and_place_are_found() -> None:
    bare = leg.leg_model()
    model = replace(bare, identified=tuple(bare.links))
    truth = effect_named("link_mass").apply(model, LAST, FAR)
    (first,) = identify(model, [leg.measured(truth, leg.leg_motion())]).naming.found
    assert (first.effect, first.place) == ("link_mass", LAST)
    for p in first.parameters:
        assert p.low <= FAR[p.name] <= p.high, p
        assert p.value == pytest.approx(FAR[p.name], rel=0.02)


@pytest.mark.parametrize("seed", range(10))
def test_its_place_is_found_beside_ten_free_parameters(seed: int) -> None:
    """Where gravity tells the first moment and little else tells the rest."""
    rng = np.random.default_rng(seed)
    scale = np.array([1e-3, 9.81, 9.81, 9.81, *[0.3] * 6, 1.0])
    X = rng.standard_normal((400, 11)) * scale
    place = rng.uniform(-0.6, 0.6, 3)
    y = X[:, :10] @ point_mass(0.8, place) + 1.5 * X[:, 10] + 1e-3 * rng.standard_normal(400)
    X = X[:, [10, *range(10)]]
    mass, *found = _point(X.T @ X, X.T @ y, np.zeros(1))
    assert mass == pytest.approx(0.8, rel=0.05)
    np.testing.assert_allclose(found, place, atol=0.03)
