"""Curves without a law: friction takes energy out, a torque over the position gives it back."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuators.elements.friction_curve import FrictionCurve
from pipeline.effects.base import Effect
from pipeline.effects.registry import effect_named
from pipeline.identification.regression.design_matrix import effect_columns, make_data_set
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator
from tests.pipeline.identification import bench_leg as leg

J2 = ("rm_joint_2",)
LOG = leg.leg_motion(duration=3.0)
FRICTION, POSITION = effect_named("friction_curve"), effect_named("position_curve")


def shape_of(effect: Effect, number: int = 0) -> dict[str, float]:
    return effect.shapes(leg.leg_model(), LOG, J2)[number]


def friction_of(model: MachineModel) -> np.ndarray:
    """What the curve takes at the joint over the whole motion, (N,) [N*m]."""
    side = SimpleNamespace(position=LOG.q[:, [1]], velocity=LOG.v[:, [1]])
    (curve,) = model.actuator(J2[0]).output
    return np.asarray(curve.free(side, np.sign(side.velocity))[:, 0])  # type: ignore[attr-defined]


def test_knots_stand_where_the_joint_was() -> None:
    shape = shape_of(FRICTION)
    speeds = [shape[f"speed_{k}"] for k in range(1, 6)]
    assert speeds[0] == 0.0
    assert speeds == sorted(speeds)
    assert speeds[-1] == pytest.approx(np.abs(LOG.v[:, 1]).max())
    for places in (
        [shape[f"place_{k}"] for k in range(1, 8)],
        [shape_of(POSITION)[f"place_{k}"] for k in range(1, 10)],
    ):
        assert (places[0], places[-1]) == (LOG.q[:, 1].min(), LOG.q[:, 1].max())
        np.testing.assert_allclose(np.diff(places, 2), 0.0, atol=1e-12)


def test_a_joint_that_stands_has_no_curve() -> None:
    still = replace(LOG, q=np.zeros_like(LOG.q), v=np.zeros_like(LOG.v))
    assert FRICTION.shapes(leg.leg_model(), still, J2) == []


@given(st.lists(st.floats(0.0, 2.0), min_size=17, max_size=17))
@settings(max_examples=40, deadline=None)
def test_friction_takes_energy_out_whatever_its_coordinates(values: list[float]) -> None:
    names = [c.name for c in FRICTION.coordinates if not c.name.startswith("share")]
    x = dict.fromkeys((c.name for c in FRICTION.coordinates), 0.0)
    x |= dict(zip(names, values, strict=True))
    model = FRICTION.edit(leg.leg_model(), J2, x, shape_of(FRICTION))
    power = friction_of(model) * LOG.v[:, 1]
    assert power.min() >= -1e-9 * (1.0 + np.abs(power).max())


def test_dry_friction_more_at_a_place_is_a_line_between_spots() -> None:
    curve = FrictionCurve("c", places=(0.0, 1.0), spots=(0.2, 0.6))
    position, velocity = np.array([[-1.0], [0.25], [2.0]]), np.array([[1.0], [-1.0], [1.0]])
    side = SimpleNamespace(position=position, velocity=velocity)
    found = curve.free(side, np.sign(velocity))  # type: ignore[arg-type]
    np.testing.assert_allclose(found[:, 0], [0.2, -0.3, 0.6])
    assert curve.static()[:2] == (0.6, 0.6)  # what holds where it rubs most


@pytest.mark.parametrize("seed", range(3))
def test_a_torque_over_the_position_gives_back_what_it_took(seed: int) -> None:
    """Work over a way there and back is none."""
    rng = np.random.default_rng(seed)
    x = {c.name: float(rng.normal()) for c in POSITION.coordinates}
    model = POSITION.edit(leg.leg_model(), J2, x, shape_of(POSITION))
    way = 0.4 * np.sin(np.linspace(0.0, 2.0 * np.pi, 20001))
    torque = model.actuator(J2[0]).position_torques[-1].torque(way)
    work = np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(way))
    assert abs(work) < 1e-6 * np.sum(np.abs(torque[1:] * np.diff(way)))


@pytest.mark.parametrize("name", ["friction_curve", "position_curve"])
def test_columns_are_what_a_large_change_does(name: str) -> None:
    """A curve is linear in its levels: a step a hundred times as large moves as much per size."""
    effect, model = effect_named(name), leg.leg_model()
    shape = shape_of(effect)
    data_set = make_data_set(LOG)
    base = data_set.simulator.predict(model)
    columns = effect_columns(data_set, base, effect, J2, shape, LOG.noise)
    zero = dict.fromkeys((c.name for c in effect.coordinates), 0.0)
    for c, column in zip(effect.coordinates, columns, strict=True):
        if c.name.startswith("share"):  # the load through a share is bent in it
            continue
        moved = effect.edit(model, J2, zero | {c.name: 100.0 * c.step}, shape)
        change = Simulator(LOG).predict(moved).effort - base.effort
        expected = data_set.whitened(change / (100.0 * c.step), range(3), LOG.noise)[1]
        np.testing.assert_allclose(column[1], expected, atol=1e-6 * np.abs(expected).max() + 1e-9)
