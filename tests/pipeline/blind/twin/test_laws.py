from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.blind.twin.laws.bristle import BristleFriction, BristleLaw
from pipeline.blind.twin.laws.extra import CableDrag, QuadraticDrag, Ripple, Spring, StickingSpot
from pipeline.blind.twin.laws.ground import Footing, Ground
from pipeline.blind.twin.laws.transmission import transmitted_torque

DT = 5e-4
ONE = np.ones(1)


def law(**values: float) -> BristleLaw:
    return replace(BristleLaw.none(1), **{k: np.array([v]) for k, v in values.items()})


def slid(friction: BristleFriction, velocity: float, load: float, time: float = 0.5) -> float:
    torque = np.zeros(1)
    for _ in range(round(time / DT)):
        torque = friction.torque(velocity * ONE, load * ONE)
    return float(torque[0])


@pytest.mark.parametrize("velocity", [-1.5, -0.2, -0.01, 0.01, 0.05, 0.2, 1.5])
def test_steady_sliding_is_the_stribeck_curve(velocity: float) -> None:
    friction = BristleFriction(law(coulomb=1.2, excess=0.7, viscous=0.4), DT)
    expected = np.sign(velocity) * (1.2 + 0.7 * np.exp(-((velocity / 0.1) ** 2))) + 0.4 * velocity
    assert slid(friction, velocity, 0.0) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("velocity", "load", "expected"),
    [(1, 10, 3.0), (-1, 10, -1.5), (1, -10, 1.5), (-1, -10, -3.0), (1, 0, 1.0)],
)
def test_load_friction_knows_its_quadrant(velocity: int, load: int, expected: float) -> None:
    friction = BristleFriction(law(coulomb=1.0, load_driving=0.2, load_driven=0.05), DT)
    assert slid(friction, velocity, load) == pytest.approx(expected, rel=1e-9)


def test_asymmetry_adds_forwards_and_takes_off_backwards() -> None:
    given = law(coulomb=1.0, asymmetry=0.3)
    assert slid(BristleFriction(given, DT), 1.0, 0.0) == pytest.approx(1.3)
    assert slid(BristleFriction(given, DT), -1.0, 0.0) == pytest.approx(-0.7)


def test_small_motion_is_a_spring_and_standstill_holds() -> None:
    friction = BristleFriction(law(coulomb=2.0), DT)
    step = 1e-8  # [rad]
    for _ in range(100):
        friction.torque(step / DT * ONE, 0 * ONE)
    held = friction.torque(0 * ONE, 0 * ONE)[0]
    assert held == pytest.approx(2e4 * 100 * step, rel=0.01)
    assert friction.torque(0 * ONE, 0 * ONE)[0] == held


@pytest.mark.parametrize("velocity", [0.0, 1e-12, 1e3])
def test_no_friction_is_no_torque(velocity: float) -> None:
    assert abs(slid(BristleFriction(law(), DT), velocity, 5.0, 0.01)) < 1e-9


def test_bristles_never_give_energy_over_a_closed_motion() -> None:
    friction = BristleFriction(law(coulomb=1.0, excess=0.5, viscous=0.1), DT)
    t = np.arange(0, 4, DT)
    velocity = 0.5 * np.cos(2 * np.pi * 0.5 * t) + 0.1 * np.cos(2 * np.pi * 3 * t)
    work = [float(friction.torque(w * ONE, 0 * ONE)[0]) * w * DT for w in velocity]
    assert np.sum(work) > 0
    assert np.min(np.cumsum(work)) > -0.5 * 2e4 * (1.5 / 2e4) ** 2


def test_transmission_winds_up_by_torque_over_stiffness() -> None:
    twist = np.array([2e-3, -2e-3, 0.0])
    torque = transmitted_torque(twist, np.zeros(3), np.full(3, 5e3), np.full(3, 2.0), np.zeros(3))
    np.testing.assert_allclose(torque, [10.0, -10.0, 0.0])


def test_backlash_passes_nothing_over_its_width_and_never_pulls() -> None:
    twist = np.array([-3e-3, -1e-3, 0.0, 1e-3, 3e-3, 1.1e-3])
    rate = np.array([0.0, 5.0, 5.0, -5.0, 0.0, -5.0])
    args = np.full(6, 1e4), np.full(6, 5.0), np.full(6, 2e-3)
    np.testing.assert_allclose(transmitted_torque(twist, rate, *args), [-20, 0, 0, 0, 20, 0])


def test_extra_torques_by_their_formulas() -> None:
    assert Spring(0, 0.1, 3.0, 10.0).start(DT).torque(0.6, 9.0) == pytest.approx(-1.5 - 1.25)
    assert Ripple(0, 0.5, 100.0, 0.2).start(DT).torque(0.03, 0.0) == pytest.approx(
        0.5 * np.sin(3.2)
    )
    drag = QuadraticDrag(0, 2.0).start(DT)
    assert (drag.torque(0, 3.0), drag.torque(0, -3.0)) == (-18.0, 18.0)
    assert StickingSpot(0, 0.2, 0.05, 1.5).level(0.25) == pytest.approx(1.5 * np.exp(-0.5))


def test_cable_drag_ends_at_its_hysteresis_either_way() -> None:
    cable = CableDrag(0, 0.0, 0.0, 0.4, 0.1).start(DT)
    for sign in (1.0, -1.0):
        torque = [cable.torque(0.0, sign * 1.0) for _ in range(4000)][-1]
        assert torque == pytest.approx(-0.4 * sign, rel=1e-6)


def test_ground_pushes_by_depth_and_drags_inside_the_cone() -> None:
    ground = Ground()
    footing = Footing(ground, 2, DT)
    feet = np.array([[0.0, 0.0, -0.002], [0.0, 0.0, 0.001]])
    still = footing.forces(feet, np.zeros((2, 3)))
    np.testing.assert_allclose(still, [[0, 0, 0.002 * ground.stiffness], [0, 0, 0]])
    sliding = np.array([[0.3, 0.4, 0.0], [0.0, 0.0, 0.0]])
    for _ in range(400):
        force = footing.forces(feet, sliding)
    np.testing.assert_allclose(force[0, :2], -ground.friction * 80.0 * np.array([0.6, 0.8]))


def test_drag_is_released_when_a_foot_leaves_the_ground() -> None:
    footing = Footing(Ground(), 1, DT)
    down, up = np.array([[0.0, 0.0, -0.002]]), np.array([[0.0, 0.0, 0.002]])
    footing.forces(down, np.array([[0.1, 0.0, 0.0]]))
    footing.forces(up, np.zeros((1, 3)))
    assert footing.forces(down, np.zeros((1, 3)))[0, 0] == 0.0
