"""Rigid bodies: regressor, distance, consistency, base parameters."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from pipeline.regression.errors import RegressionError
from pipeline.regression.laws.base_parameters import base_set
from pipeline.regression.laws.bodies import (
    Bodies,
    consistent,
    parameters,
    pseudo_inertia,
    regressor,
    with_parameters,
)
from tests.pipeline.regression.arms import arm, heavier


@pytest.fixture
def motion() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    return tuple(rng.standard_normal((300, 3)) for _ in range(3))


def test_torque_is_regressor_times_parameters(motion) -> None:
    model = heavier(arm(), {1: 1.3})
    data = model.createData()
    expected = [pin.rnea(model, data, *row) for row in zip(*motion, strict=True)]
    np.testing.assert_allclose(regressor(model, *motion) @ parameters(model), expected, atol=1e-12)


def test_pseudo_inertia_is_pinocchios() -> None:
    model = arm()
    for inertia in list(model.inertias)[1:]:
        np.testing.assert_allclose(
            pseudo_inertia(np.asarray(inertia.toDynamicParameters())),
            pin.PseudoInertia.FromInertia(inertia).toMatrix(),
            atol=1e-14,
        )


def test_distance_does_not_depend_on_the_frame() -> None:
    model, turned = arm(1), arm(1)
    place = pin.SE3(pin.exp3(np.array([0.3, -0.2, 0.5])), np.array([0.04, 0.01, -0.03]))
    turned.inertias[1] = place.act(model.inertias[1])
    one, two = Bodies.of(model), Bodies.of(turned)
    off = pin.Inertia(2.2, np.array([0.16, 0.01, -0.02]), np.diag([0.005, 0.021, 0.025]))
    here, there = (np.asarray(i.toDynamicParameters()) for i in (off, place.act(off)))
    assert one.divergence(here)[0] == pytest.approx(two.divergence(there)[0], rel=1e-9)


def test_gradient_and_hessian_are_those_of_the_divergence() -> None:
    bodies = Bodies.of(arm(2))
    rng = np.random.default_rng(0)
    x = bodies.centre * (1 + 0.002 * rng.standard_normal(20))
    _, gradient, hessian = bodies.divergence(x)
    for _ in range(3):
        d = 1e-5 * rng.standard_normal(20) * (np.abs(x) + 1e-4)
        up, down = bodies.divergence(x + d), bodies.divergence(x - d)
        assert up[0] - down[0] == pytest.approx(2 * gradient @ d, rel=1e-4)
        np.testing.assert_allclose(up[1] - down[1], 2 * hessian @ d, rtol=2e-2, atol=1e-6)


def test_least_squares_that_ask_for_a_negative_mass_end_at_a_body() -> None:
    bodies = Bodies.of(arm(1))
    wish = bodies.centre.copy()
    wish[0], wish[9] = -1.0, -0.1
    gram = np.diag(1.0 / (0.1 * np.abs(bodies.centre) + 1e-3) ** 2)
    x = consistent(gram, gram @ wish, bodies, 10.0)
    assert np.linalg.eigvalsh(pseudo_inertia(x))[0] > 0


def test_consistent_bodies_that_fit_are_found_exactly(motion) -> None:
    model = arm()
    true = parameters(heavier(model, {0: 1.2, 1: 0.8, 2: 1.5}))
    y = regressor(model, *motion).reshape(-1, 30) * 1e4
    x = consistent(y.T @ y, y.T @ (y @ true), Bodies.of(model), 1.0)
    np.testing.assert_allclose(y @ x, y @ true, rtol=1e-3, atol=1e-3 * np.abs(y @ true).max())


def test_base_parameters_hold_all_that_torque_tells(motion) -> None:
    model = arm()
    y = regressor(model, *motion)
    found = base_set(y, Bodies.of(model), tuple(model.names[1:]))
    flat = y.reshape(-1, 30)
    assert len(found.names) == np.linalg.matrix_rank(flat)
    # Parameters with equal base parameters have equal torques.
    null = np.linalg.svd(found.combine)[2][len(found.names) :]
    assert np.abs(flat @ null.T).max() < 1e-6 * np.abs(flat).max()
    assert "m(joint_1)" in found.lost
    assert found.condition > 1


def test_a_body_without_mass_is_left_alone() -> None:
    model = arm(2)
    model.inertias[1] = pin.Inertia.Zero()
    bodies = Bodies.of(model)
    assert list(bodies.free) == [False, True]
    assert not bodies.metric[:10].any()


def test_a_free_base_is_refused_by_name() -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "base")
    with pytest.raises(RegressionError, match='joint "base" has 6 degrees of freedom'):
        Bodies.of(model)


def test_parameters_written_are_parameters_read() -> None:
    model = arm()
    values = parameters(model) * 1.1
    np.testing.assert_allclose(parameters(with_parameters(model, values)), values, atol=1e-12)
