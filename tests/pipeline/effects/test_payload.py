"""A payload is a point mass, at the link's centre of mass or where it is said to be."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from pipeline.effects.base import effect_named
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
    found = loaded.rigid.inertias[joint]
    np.testing.assert_allclose(
        found.toDynamicParameters(), (before + point).toDynamicParameters(), atol=1e-12
    )
