"""Curves without a law: friction takes energy out, a torque over the position gives it back."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from actuators.elements.friction_curve import FrictionCurve
from pipeline.effects.registry import effect_named
from tests.pipeline.identification import bench_leg as leg

J2 = ("rm_joint_2",)
MODEL, LOG = leg.leg_model(), leg.leg_motion(duration=1.5)
FRICTION, POSITION = effect_named("friction_curve"), effect_named("position_curve")


SHAPES = {
    FRICTION: {f"speed_{k}": 0.5 * (k - 1) for k in range(1, 6)}
    | {f"place_{k}": 0.1 * (k - 4) for k in range(1, 8)},
    POSITION: {f"place_{k}": 0.1 * (k - 5) for k in range(1, 10)},
}


@given(st.lists(st.floats(0.0, 2.0), min_size=17, max_size=17))
@settings(max_examples=15, deadline=None)
def test_friction_takes_energy_out_whatever_its_coordinates(values: list[float]) -> None:
    names = [c.name for c in FRICTION.coordinates if not c.name.startswith("share")]
    x = dict.fromkeys((c.name for c in FRICTION.coordinates), 0.0)
    x |= dict(zip(names, values, strict=True))
    model = FRICTION.edit(MODEL, J2, x, SHAPES[FRICTION])
    (curve,) = model.actuator(J2[0]).output
    side = SimpleNamespace(position=LOG.q[:, [1]], velocity=LOG.v[:, [1]])
    power = curve.free(side, np.sign(side.velocity)) * side.velocity  # type: ignore[attr-defined]
    assert power.min() >= -1e-9 * (1.0 + np.abs(power).max())


def test_dry_friction_more_at_a_place_is_a_line_between_spots() -> None:
    curve = FrictionCurve("c", places=(0.0, 1.0), spots=(0.2, 0.6))
    position, velocity = np.array([[-1.0], [0.25], [2.0]]), np.array([[1.0], [-1.0], [1.0]])
    side = SimpleNamespace(position=position, velocity=velocity)
    found = curve.free(side, np.sign(velocity))  # type: ignore[arg-type]
    np.testing.assert_allclose(found[:, 0], [0.2, -0.3, 0.6])
    assert curve.static()[:2] == (0.6, 0.6)  # what holds where it rubs most


def test_a_torque_over_the_position_gives_back_what_it_took() -> None:
    """Work over a way there and back is none."""
    rng = np.random.default_rng(0)
    x = {c.name: float(rng.normal()) for c in POSITION.coordinates}
    model = POSITION.edit(MODEL, J2, x, SHAPES[POSITION])
    way = 0.4 * np.sin(np.linspace(0.0, 2.0 * np.pi, 20001))
    torque = model.actuator(J2[0]).position_torques[-1].torque(way)
    work = np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(way))
    assert abs(work) < 1e-6 * np.sum(np.abs(torque[1:] * np.diff(way)))
