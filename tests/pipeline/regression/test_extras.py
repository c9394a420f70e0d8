"""Columns of what torque depends on beside bodies and friction, against inverse dynamics itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pipeline.regression.laws.extras import (
    ANGLES,
    EVERY,
    Extra,
    Kind,
    Seen,
    angle_knots,
    orders,
    refined,
    strongest,
    tuned,
)
from pipeline.regression.preprocess import Rows, Run, rows
from tests.pipeline.regression.arms import arm

STEP = 1e-5


def dynamics(model: pin.Model, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    data = model.createData()
    return np.array([pin.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])


def arms_motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    w = 2 * np.pi * np.array([0.3, 0.5, 0.4])
    size, at = np.array([0.6, 0.5, 0.8]), np.outer(t, w) + np.array([0.0, 1.0, 2.0])
    return size * np.sin(at), size * w * np.cos(at), -size * w**2 * np.sin(at)


@pytest.fixture(scope="module")
def seen() -> Seen:
    """An arm along a smooth motion; torque is what its bodies need, told without error."""
    model = arm(3)
    t = np.arange(0, 8, 0.005)
    q, v, a = arms_motion(t)
    r = rows([Run(t, q, dynamics(model, q, v, a), v)], cutoff=20.0, rate=50.0)
    torque = dynamics(model, r.q, r.v, r.a)
    return Seen(r, torque, model, np.ones(3), torque)


def column(seen: Seen, kind: Kind, joint: int) -> dict[int, np.ndarray]:
    e = Extra(kind, joint)
    return seen.columns([e])[e.names[0]]


def all_joints(seen: Seen, actions: dict[int, np.ndarray]) -> np.ndarray:
    out = np.zeros_like(seen.torque)
    for j, x in actions.items():
        out[:, j] = x
    return out


def turned(seen: Seen, change: np.ndarray, rate: np.ndarray, bend: np.ndarray) -> np.ndarray:
    """Change of torque with the motion, by central differences of inverse dynamics."""
    r = seen.rows
    ends = [
        dynamics(seen.model, r.q + s * change, r.v + s * rate, r.a + s * bend)
        for s in (STEP, -STEP)
    ]
    return (ends[0] - ends[1]) / (2 * STEP)


@pytest.mark.parametrize("joint", [1, 2])
def test_a_zero_shifts_the_posture_and_neither_speed_nor_acceleration(seen, joint: int) -> None:
    shift = np.zeros(seen.rows.q.shape)
    shift[:, joint] = -1.0
    expected = turned(seen, shift, 0 * shift, 0 * shift)
    assert np.abs(expected).max() > 1.0
    np.testing.assert_allclose(
        all_joints(seen, column(seen, Kind.ZERO, joint)), expected, atol=1e-5
    )


def test_a_zero_about_an_upright_axis_is_not_felt(seen) -> None:
    assert column(seen, Kind.ZERO, 0) == {}


@pytest.mark.parametrize("joint", [0, 1, 2])
def test_a_wound_link_lags_by_its_torque_with_speed_and_acceleration(seen, joint: int) -> None:
    """q = q_seen - c t, and so on for its rates: by differences on the motion as it then is."""
    change, rate, bend = (np.zeros(seen.rows.q.shape) for _ in range(3))
    torque = seen.torque[:, joint]
    fast = np.gradient(torque, seen.rows.time)
    change[:, joint], rate[:, joint] = -torque, -fast
    bend[:, joint] = -np.gradient(fast, seen.rows.time)
    expected = turned(seen, change, rate, bend)
    inner = slice(8, -8)
    scale = np.abs(expected).max()
    found = all_joints(seen, column(seen, Kind.WIND, joint))
    np.testing.assert_allclose(found[inner], expected[inner], atol=0.03 * scale)


@pytest.mark.parametrize("joint", [1, 2])
def test_play_is_half_its_width_to_the_side_that_the_torque_pushes(seen, joint: int) -> None:
    change = np.zeros(seen.rows.q.shape)
    change[:, joint] = -0.5 * np.sign(seen.torque[:, joint])
    expected = turned(seen, change, 0 * change, 0 * change)
    np.testing.assert_allclose(
        all_joints(seen, column(seen, Kind.PLAY, joint)), expected, atol=1e-5
    )


def test_a_torque_that_comes_late_is_its_rate_with_the_other_sign(seen) -> None:
    """Against the torque of the motion a little earlier."""
    d, model = 1e-3, seen.model
    motion = [arms_motion(seen.rows.time + s) for s in (d / 2, -d / 2)]
    late = (dynamics(model, *motion[1]) - dynamics(model, *motion[0])) / d
    inner = slice(8, -8)
    scale = np.abs(late).max()
    own = column(seen, Kind.LATE, 1)
    assert list(own) == [1]
    np.testing.assert_allclose(own[1][inner], late[inner, 1], atol=0.02 * scale)
    every = column(seen, Kind.LATE, EVERY)
    assert list(every) == [0, 1, 2]
    np.testing.assert_array_equal(every[1], own[1])


def test_a_scale_is_the_torque_itself_in_the_unit_of_what_was_corrected(seen) -> None:
    actions = column(seen, Kind.GAIN, 2)
    assert list(actions) == [2]
    np.testing.assert_array_equal(actions[2], seen.torque[:, 2])
    again = replace(seen, gain=np.array([1.0, 1.0, 0.5]))
    np.testing.assert_allclose(column(again, Kind.GAIN, 2)[2], 2.0 * seen.torque[:, 2])


def test_a_spring_is_the_angle_of_its_joint(seen) -> None:
    np.testing.assert_allclose(column(seen, Kind.SPRING, 2)[2], seen.rows.q[:, 2], atol=1e-12)


def test_a_ripple_is_a_sine_and_a_cosine_through_the_filter_of_the_torque(seen) -> None:
    e = Extra(Kind.RIPPLE, 1, 60.0)
    sine, cosine = (seen.columns([e])[n][1] for n in e.names)
    q = seen.rows.fine[0][:, 1]
    np.testing.assert_allclose(sine, seen.rows.filtered(np.sin(60.0 * q)[:, None])[:, 0])
    np.testing.assert_allclose(cosine, seen.rows.filtered(np.cos(60.0 * q)[:, None])[:, 0])
    assert not np.allclose(sine, np.sin(60.0 * seen.rows.q[:, 1]), atol=0.02)


def curves(seen: Seen, kind: Kind) -> np.ndarray:
    e = Extra(kind, 1)
    assert not e.named
    return np.array([actions[1] for actions in seen.columns([e]).values()])


def test_a_curve_has_a_knot_per_quantile_and_holds_no_constant(seen) -> None:
    parts = curves(seen, Kind.CURVE)
    assert len(parts) == len(ANGLES)
    # Hats add up to one: less their means, to nothing.
    np.testing.assert_allclose(parts.sum(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(parts.mean(axis=1), 0.0, atol=0.02)


def test_friction_over_the_angle_is_such_a_curve_with_the_sense_of_motion(seen) -> None:
    fast = np.abs(seen.rows.v[:, 1]) > 0.8
    expected = curves(seen, Kind.CURVE) * np.sign(seen.rows.v[:, 1])
    drag = curves(seen, Kind.DRAG)
    np.testing.assert_allclose(drag[:, fast], expected[:, fast], atol=0.05)


def test_knots_ascend_where_a_joint_rests_for_long() -> None:
    q = np.concatenate([np.zeros(900), np.linspace(0.0, 0.1, 100)])
    assert (np.diff(angle_knots(q)) > 0).all()


def turning(order: float, noise: float = 0.3) -> tuple[Rows, np.ndarray]:
    """Rows of a joint that turns to and fro, and what is left of its torque at them."""
    rng = np.random.default_rng(4)
    t = np.arange(0, 30, 0.005)
    q = np.column_stack([np.zeros_like(t), 1.5 * np.sin(2 * np.pi * 0.1 * t)])
    tau = 0.2 * np.sin(order * q + 0.5) + noise * rng.standard_normal(q.shape)
    r = rows([Run(t, q, tau)], cutoff=15.0)
    return r, r.tau


@pytest.mark.parametrize("order", [9.3, 31.7])
def test_the_order_of_a_ripple_is_found_and_refined(order: float) -> None:
    r, left = turning(order)
    grid = orders(r, 1)
    step = grid[1] - grid[0]
    assert grid[0] <= order <= grid[-1]
    first = strongest(left[:, 1], r.q[:, 1], grid, [])[0]
    assert first == pytest.approx(order, abs=step)
    assert tuned(left[:, 1], r, 1, first, step) == pytest.approx(order, abs=0.15 * step)


def test_no_order_is_looked_for_next_to_one_that_is_known() -> None:
    r, left = turning(31.7)
    grid = orders(r, 1)
    others = strongest(left[:, 1], r.q[:, 1], grid, [31.7])
    step = grid[1] - grid[0]
    assert all(abs(n - 31.7) > 2 * step for n in others)


def test_refining_ends_at_the_summit() -> None:
    q = np.linspace(-20.0, 20.0, 4000)
    assert refined(np.sin(20.0 * q), q, 20.02, 0.05) == pytest.approx(20.0, abs=1e-3)


def test_a_joint_that_stands_has_no_orders() -> None:
    r, _ = turning(9.3)
    assert orders(r, 0).size == 0
    assert strongest(r.tau[:, 0], r.q[:, 0], np.empty(0), []) == []


def test_no_order_has_less_than_a_period_and_a_half_in_the_travel() -> None:
    r, _ = turning(9.3)
    assert orders(r, 1)[0] * np.ptp(r.fine[0][:, 1]) >= 1.5 * 2 * np.pi - 1e-9
