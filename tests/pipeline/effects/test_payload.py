"""A payload is a point mass, at the link's centre of mass or where it is said to be."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from pipeline.effects.base import effect_named
from pipeline.effects.bodies import point_mass
from pipeline.identification.offered import _point
from pipeline.simulation.rigid_bodies import changed_model
from tests.pipeline.identification import bench_leg as leg

LAST = ("rm_tibia_link",)
FAR = {"x": 0.1, "y": 0.25, "z": -0.4}  # outside of the link's own size


@pytest.mark.parametrize("place", [FAR, {}], ids=["far", "centre of mass"])
def test_it_is_a_point_mass_where_it_is_said_to_be(place: dict[str, float]) -> None:
    model = leg.leg_model()
    loaded = effect_named("link_mass").apply(model, LAST, {"mass": 1.5, **place})
    joint = model.rigid.getJointId(model.carrier(LAST[0]))
    before = model.rigid.inertias[joint]
    point = pin.Inertia(1.5, np.array([*place.values()] or before.lever), np.zeros((3, 3)))
    found = changed_model(loaded.rigid, loaded.bodies).inertias[joint]
    np.testing.assert_allclose(
        found.toDynamicParameters(), (before + point).toDynamicParameters(), atol=1e-12
    )


@pytest.mark.parametrize("seed", range(3))
def test_its_place_is_found_beside_ten_free_parameters(seed: int) -> None:
    """Where gravity tells the first moment and little else tells the rest."""
    rng = np.random.default_rng(seed)
    scale = np.array([1e-3, 9.81, 9.81, 9.81, *[0.3] * 6, 1.0])
    X = rng.standard_normal((400, 11)) * scale
    place = rng.uniform(-0.6, 0.6, 3)
    y = X[:, :10] @ point_mass(0.8, place) + 1.5 * X[:, 10] + 1e-3 * rng.standard_normal(400)
    beside = X[:, 10] / np.linalg.norm(X[:, 10])
    X, y = X[:, :10] - np.outer(beside, beside @ X[:, :10]), y - beside * (beside @ y)
    mass, *found = _point(X.T @ X, X.T @ y)
    assert mass == pytest.approx(0.8, rel=0.05)
    np.testing.assert_allclose(found, place, atol=0.03)
