"""Laws that naming adds to a chain: at rest, without load, with power reversed."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuators.elements.directional import DirectionalFriction
from actuators.elements.element import Element
from actuators.elements.friction import Friction
from actuators.elements.friction_curve import FrictionCurve
from actuators.elements.heating import Heating, warm_resistance, warm_torque_constant
from actuators.elements.inertia import Inertia
from actuators.elements.joint_friction import JointFriction
from actuators.elements.loaded_friction import LoadedFriction, erf
from actuators.elements.position_torque import ParallelSpring, Ripple
from actuators.elements.quadrant import QuadrantFriction
from actuators.elements.ratio import Ratio
from actuators.elements.stribeck import Stribeck
from actuators.errors import UnphysicalElementError
from actuators.shaft import ShaftSeries

LAWS = [
    Stribeck("s", excess=2.0, speed=0.1),
    DirectionalFriction("d", positive=2.0, negative=0.5),
    QuadrantFriction("q", when_driving=0.2, when_driven=0.05),
    JointFriction(
        "f",
        coulomb=0.5,
        viscous=0.3,
        asymmetry=-0.2,
        excess=0.4,
        stribeck_speed=0.2,
        quadratic=0.1,
        saturating=0.3,
        saturation_speed=0.5,
        when_driving=0.4,
        when_driven=0.1,
        rise=0.02,
    ),
    FrictionCurve(
        "c",
        speeds=(0.0, 0.5, 2.0),
        levels=(0.5, 0.8, -0.2),
        asymmetries=(0.0, 0.3, -0.2),
        shares=(0.1, 0.3, 0.2),
        viscous=0.4,
        rise=0.05,
    ),
]


def series(velocity: list[float], torque: list[float]) -> ShaftSeries:
    n = len(velocity)
    v, t = np.array(velocity)[:, None], np.array(torque)[:, None]
    zero = np.zeros((n, 1))
    return ShaftSeries(("j",), np.arange(n) * 0.1, zero, v, zero, t, np.sign(v))


@pytest.mark.parametrize("law", LAWS, ids=lambda e: e.name)
def test_rest_takes_nothing_in_motion_and_holds_an_interval(law: Element) -> None:
    still = series([0.0, 0.0], [3.0, -3.0])
    assert np.array_equal(law.moving(still).torque, still.torque)
    low, high = law.holding(still.torque, still.torque)
    assert (low < still.torque).all()
    assert (high > still.torque).all()


@pytest.mark.parametrize("law", LAWS, ids=lambda e: e.name)
def test_friction_never_gives_power(law: Element) -> None:
    rng = np.random.default_rng(3)
    side = series(list(rng.normal(size=400)), list(rng.normal(size=400) * 5))
    power = (law.moving(side).torque - side.torque) * side.velocity
    assert (power >= 0).all()
    loss = law.loss(side, law.moving(side))
    assert loss is not None
    assert np.allclose(loss, power)


@pytest.mark.parametrize("law", LAWS, ids=lambda e: e.name)
def test_driving_inverts_moving(law: Element) -> None:
    rng = np.random.default_rng(4)
    side = series(list(rng.normal(size=400)), list(rng.normal(size=400) * 5))
    assert np.allclose(law.driving(law.moving(side)).torque, side.torque)


@pytest.mark.parametrize("law", LAWS, ids=lambda e: e.name)
def test_holding_ends_where_motion_sets_in(law: Element) -> None:
    """Friction at standstill is the limit of friction in either sense, for every load.

    What rises over some speed stands for presliding, and holds with its whole level.
    """
    if isinstance(law, LoadedFriction):
        law = replace(law, rise=0.0)
    load = np.array([[5.0, -5.0, 0.3, -0.3, 0.0]])
    slow = 1e-12
    limits = []
    for sign in (1.0, -1.0):
        v = np.full_like(load, sign * slow)
        names = tuple("abcde")
        side = ShaftSeries(names, np.zeros(1), 0 * load, v, 0 * load, load, np.sign(v))
        limits.append(law.moving(side).torque)
    low, high = law.holding(load, load)
    np.testing.assert_allclose(low, np.minimum(*limits), rtol=1e-9)
    np.testing.assert_allclose(high, np.maximum(*limits), rtol=1e-9)


@pytest.mark.parametrize(
    "law",
    [
        *(Stribeck("s"), DirectionalFriction("d"), QuadrantFriction("q")),
        *(Friction("f"), Inertia("i"), Ratio("r")),
    ],
    ids=lambda e: e.name,
)
def test_a_law_without_parameters_is_absent(law: Element) -> None:
    side = series([1.0, -1.0, 2.0], [3.0, 5.0, -7.0])
    side = replace(side, acceleration=side.velocity + 1.0)
    assert np.array_equal(law.moving(side).torque, side.torque)
    assert np.array_equal(law.driving(side).torque, side.torque)
    low, high = law.holding(side.torque, side.torque)
    assert np.array_equal(low, side.torque)
    assert np.array_equal(high, side.torque)


def test_a_position_torque_without_parameters_is_absent() -> None:
    q = np.array([0.3, -0.2])
    assert not ParallelSpring("k").torque(q).any()
    assert not Ripple("r").torque(q).any()
    assert np.allclose(ParallelSpring("k", stiffness=2.0).torque(q), [0.6, -0.4])
    assert np.allclose(Ripple("r", amplitude=2.0).torque(q), 2.0 * np.sin(q))


@pytest.mark.parametrize(
    ("law", "full"),
    [
        (DirectionalFriction("d", positive=2.0, negative=0.5), [2.0, -0.5]),
        (Stribeck("s", excess=2.0, speed=1e9), [2.0, -2.0]),
        (QuadrantFriction("q", when_driving=0.2, when_driven=0.05), [0.8, -0.2]),
    ],
    ids=lambda e: getattr(e, "name", ""),
)
def test_a_softened_sense_near_rest_takes_that_share_of_its_own_level(
    law: Element, full: list[float]
) -> None:
    """Identification has directions between -1 and 1 where a joint turns back."""
    side = series([1.0, -1.0], [4.0, 4.0])
    for share in (1.0, 0.5, 0.01):
        soft = replace(side, direction=share * side.direction)
        friction = (law.moving(soft).torque - side.torque)[:, 0]
        np.testing.assert_allclose(friction, share * np.array(full), rtol=1e-12)


def test_no_load_is_driven_without_load() -> None:
    law = QuadrantFriction("q", when_driving=0.2, when_driven=0.05)
    assert not law.driving(series([1.0, -1.0], [0.0, 0.0])).torque.any()


def test_stribeck_falls_to_a_share_1_over_e_at_its_speed() -> None:
    law = Stribeck("s", excess=2.0, speed=0.1)
    friction = law.moving(series([0.1, -0.1, 10.0], [0.0, 0.0, 0.0])).torque[:, 0]
    assert np.allclose(friction, [2 / np.e, -2 / np.e, 0.0])


def test_quadrants_are_those_of_power_at_the_joint() -> None:
    law = QuadrantFriction("q", when_driving=0.2, when_driven=0.05)
    friction = law.moving(series([1, 1, -1, -1], [10, -10, 10, -10])).torque[:, 0]
    assert np.allclose(friction - [10, -10, 10, -10], [2.0, 0.5, -0.5, -2.0])
    # No load, no friction.
    assert np.allclose(law.moving(series([1, -1], [0, 0])).torque, 0.0)


def test_directional_is_coulomb_and_offset_in_motion() -> None:
    law = DirectionalFriction("d", positive=2.0, negative=0.5)
    friction = law.moving(series([1, -1], [0, 0])).torque[:, 0]
    assert np.allclose(friction, [1.25 + 0.75, -1.25 + 0.75])


def test_spring_and_ripple() -> None:
    q = np.array([0.3, 0.1, -0.2])
    assert np.allclose(ParallelSpring("k", 2.0, 0.1).torque(q), [0.4, 0.0, -0.6])
    ripple = Ripple("r", 0.5, 4.0, 0.2)
    assert np.allclose(ripple.torque(q), 0.5 * np.sin(4 * q + 0.2))
    assert np.allclose(ripple.torque(q + np.pi / 2), ripple.torque(q))


def test_heating_follows_its_exponential() -> None:
    time = np.linspace(0, 20, 400)
    node = Heating(thermal_resistance=2.0, time_constant=5.0, rise=10.0)
    rise = node.temperature_rise(time, np.full(400, 3.0))
    # The winding's own resistance grows with it: a shorter way to a higher end.
    share = 1.0 - 0.00393 * 2.0 * 3.0
    assert np.allclose(rise, 16.0 / share * (1 - np.exp(-time * share / 5.0)))
    assert np.isclose(warm_resistance(0.3, rise)[-1], 0.3 * (1 + 0.00393 * rise[-1]))
    assert warm_torque_constant(0.03, rise)[-1] < 0.03


def test_heating_solves_its_equation_for_a_current_that_changes() -> None:
    """Against a general integrator, the current held over each interval."""
    rng = np.random.default_rng(6)
    time = np.cumsum(rng.uniform(0.05, 1.5, 30))
    loss = rng.uniform(0.0, 40.0, 30)
    node = Heating(thermal_resistance=3.0, time_constant=7.0, rise=5.0, initial=12.0)
    level, expected = 12.0, [12.0]
    for k in range(29):
        solved = solve_ivp(
            lambda t, x, p=loss[k]: (5.0 + 3.0 * p * (1.0 + 0.00393 * x) - x) / 7.0,
            (time[k], time[k + 1]),
            [level],
            rtol=1e-10,
            atol=1e-10,
        )
        level = float(solved.y[0, -1])
        expected.append(level)
    np.testing.assert_allclose(node.temperature_rise(time, loss), expected, rtol=1e-7)


def test_a_cold_motor_without_resistance_to_warmth_keeps_its_temperature() -> None:
    time = np.linspace(0.0, 5.0, 20)
    assert not Heating().temperature_rise(time, np.full(20, 9.0)).any()
    # Warm at the start it cools with its time constant, 10 s where none is given.
    cooling = Heating(initial=30.0).temperature_rise(time, np.zeros(20))
    assert np.allclose(cooling, 30.0 * np.exp(-time / 10.0))
    # Where the warm winding's own loss just balances cooling, the warming is a straight line.
    even = Heating(thermal_resistance=1.0, time_constant=5.0)
    line = even.temperature_rise(time, np.full(20, 1.0 / 0.00393))
    assert np.allclose(line, time / 5.0 / 0.00393, atol=1e-9)


def test_copper_and_magnets_follow_their_coefficients() -> None:
    assert np.allclose(warm_resistance(0.5, np.array([0.0, 100.0])), [0.5, 0.5 * 1.393])
    assert np.allclose(warm_torque_constant(0.03, np.array([0.0, 100.0])), [0.03, 0.03 * 0.89])


def test_a_sensor_tells_warming_above_the_data_sheets_temperature() -> None:
    node = Heating(sensor_gain=4.0)
    assert np.allclose(node.sensed(np.array([25.0, 30.0, 20.0])), [0.0, 20.0, -20.0])


@pytest.mark.parametrize(
    "make",
    [
        lambda: Stribeck("s", excess=-1.0),
        lambda: Stribeck("s", excess=1.0, speed=0.0),
        lambda: DirectionalFriction("d", positive=-1.0),
        lambda: QuadrantFriction("q", when_driven=1.0),
        lambda: Heating(time_constant=0.0),
    ],
)
def test_unphysical_values_are_refused(make) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(UnphysicalElementError):
        make()


def test_a_motor_that_would_melt_is_warmed_to_an_end() -> None:
    rise = Heating(thermal_resistance=10.0).temperature_rise(np.arange(100.0), np.full(100, 400.0))
    assert rise.max() == 500.0
    cold = Heating(rise=-9000.0).temperature_rise(np.arange(100.0), np.zeros(100))
    assert cold.min() == -500.0
    assert warm_torque_constant(0.03, rise).min() > 0.0


def test_the_error_function_is_that_of_the_standard_library() -> None:
    x = np.linspace(-6.0, 6.0, 241)
    assert np.allclose(erf(x), [math.erf(value) for value in x], atol=2e-7, rtol=0.0)
    assert erf(np.zeros(1))[0] == 0.0


def test_dry_friction_rises_over_the_stated_speed_and_is_whole_beyond() -> None:
    law = JointFriction("f", coulomb=2.0, rise=0.1)
    side = series([0.0, 0.1, -0.1, 1.0], [0.0] * 4)
    one_sigma = 2.0 * math.erf(1.0 / math.sqrt(2.0))
    assert np.allclose(law.moving(side).torque[:, 0], [0.0, one_sigma, -one_sigma, 2.0], atol=1e-6)


def test_a_joint_law_of_one_term_is_that_of_the_catalogue() -> None:
    rng = np.random.default_rng(5)
    side = series(list(rng.normal(size=50)), list(rng.normal(size=50)))
    pairs = [
        (JointFriction("f", coulomb=0.3, viscous=0.2), Friction("g", coulomb=0.3, viscous=0.2)),
        (
            JointFriction("f", when_driving=0.2, when_driven=0.1),
            QuadrantFriction("g", when_driving=0.2, when_driven=0.1),
        ),
        (
            JointFriction("f", excess=0.3, stribeck_speed=0.4),
            Stribeck("g", excess=0.3, speed=0.4),
        ),
    ]
    for one, other in pairs:
        assert np.allclose(one.moving(side).torque, other.moving(side).torque)
        assert np.allclose(one.driving(side).torque, other.driving(side).torque)
        held = (law.holding(side.torque, side.torque) for law in (one, other))
        assert np.allclose(*held)


def test_a_friction_curve_goes_through_its_knots_and_on() -> None:
    curve = FrictionCurve(
        "c",
        speeds=(0.0, 1.0, 2.0),
        levels=(0.5, 1.0, 2.0),
        asymmetries=(0.0, 0.2, 0.2),
        shares=(0.1, 0.1, 0.1),
    )
    side = series([1.0, -1.0, 3.0, 1.5], [0.0, 0.0, 10.0, -10.0])
    expected = [1.2, 0.2 - 1.0, 13.0 + 0.2 + 1.0, -10.0 + 1.5 + 0.2 + 1.0]
    assert np.allclose(curve.moving(side).torque[:, 0], expected)


@pytest.mark.parametrize(
    "wrong",
    [
        {"speeds": (0.1, 1.0)},
        {"speeds": (0.0, 0.0)},
        {"levels": (0.1, -0.1)},
        {"asymmetries": (0.0, 0.3)},
        {"shares": (0.0, 1.0)},
        {"levels": (0.1,)},
    ],
)
def test_a_curve_that_would_give_energy_or_has_no_shape_is_refused(wrong: dict[str, Any]) -> None:
    right = {"speeds": (0.0, 1.0), "levels": (0.1, 0.1), "asymmetries": (0.0, 0.0)}
    FrictionCurve("c", **{**right, "shares": (0.0, 0.0)})
    with pytest.raises(UnphysicalElementError):
        FrictionCurve("c", **{**right, "shares": (0.0, 0.0), **wrong})


def test_viscous_friction_by_direction_may_not_give_energy() -> None:
    with pytest.raises(UnphysicalElementError, match="asymmetry"):
        JointFriction("f", viscous=0.1, asymmetry=0.2)
