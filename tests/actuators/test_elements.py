import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actuators.elements.friction import Friction
from actuators.elements.hypoid import Hypoid
from actuators.elements.inertia import Inertia
from actuators.elements.motor import DCMotor
from actuators.elements.ratio import Ratio
from actuators.errors import SelfLockingError, UnphysicalElementError
from tests.actuators.motions import constant, harmonic, series, split

positive = st.floats(0.0, 10.0)
fraction = st.floats(0.0, 0.95)
torques = st.floats(-1e3, 1e3)
speeds = st.floats(-1e3, 1e3).filter(lambda v: abs(v) > 1e-6)


@st.composite
def frictions(draw):
    return Friction("f", coulomb=draw(positive), load=draw(fraction), viscous=draw(positive))


@st.composite
def hypoids(draw, self_locking=None):
    b2 = draw(st.floats(0.0, 0.8))
    b1 = draw(st.floats(b2 + 0.05, 1.5))
    limit = 0.95 / max(np.tan(b2), 1e-9)
    low, high = 0.0, min(limit, 1.0)
    if self_locking is False:
        high = min(high, 0.95 / np.tan(b1))
    return Hypoid(
        "h",
        ratio=draw(st.floats(1.0, 100.0)),
        pinion_angle=b1,
        wheel_angle=b2,
        wheel_radius=draw(st.floats(0.01, 0.1)),
        friction=draw(st.floats(low, high)),
    )


ELEMENTS = (
    frictions()
    | hypoids(self_locking=False)
    | st.builds(lambda r: Ratio("r", r), st.floats(0.1, 500.0))
    | st.builds(lambda i: Inertia("i", i), positive)
)


@given(frictions() | hypoids(), torques, speeds)
def test_dissipated_power_is_never_negative(element, torque, speed):
    s = constant(speed, torque)
    m = element.moving(s)
    loss = element.loss(s, m)
    assert (loss >= 0.0).all()
    np.testing.assert_allclose(
        loss, m.power - s.power, rtol=1e-9, atol=1e-9 * (1 + abs(torque * speed))
    )


@given(ELEMENTS, torques, speeds, st.floats(-100, 100))
def test_driving_inverts_moving(element, torque, speed, acceleration):
    s = constant(speed, torque, acceleration)
    back = element.driving(element.moving(s))
    for name in ("torque", "velocity", "acceleration", "position", "direction"):
        np.testing.assert_allclose(
            getattr(back, name), getattr(s, name), rtol=1e-7, atol=1e-7 * (1 + abs(torque))
        )


@given(frictions() | hypoids(), torques)
def test_holding_contains_the_limits_of_moving(element, torque):
    low, high = element.holding(np.array([torque]), np.array([torque]))
    for sign in (1.0, -1.0):
        limit = element.moving(constant(sign * 2e-9, torque)).torque[0, 0]
        slack = 1e-7 * (1 + abs(torque))
        assert low[0] - slack <= limit <= high[0] + slack
    ends = sorted(element.moving(constant([2e-9, -2e-9], torque)).torque[0])
    np.testing.assert_allclose([low[0], high[0]], ends, rtol=1e-6, atol=1e-6 * (1 + abs(torque)))


@given(frictions() | hypoids(), torques, st.floats(0, 1e3), st.floats(0, 1))
def test_holding_an_interval_contains_holding_each_of_its_points(element, low, width, share):
    a, b = element.holding(np.array([low]), np.array([low + width]))
    p, q = element.holding(np.array([low + share * width]), np.array([low + share * width]))
    slack = 1e-9 * (1 + abs(low) + width)
    assert a[0] <= p[0] + slack
    assert q[0] <= b[0] + slack


def test_friction_is_absent_at_rest_and_widens_the_hold():
    f = Friction("f", coulomb=2.0, load=0.1, viscous=1.0)
    s = constant(0.0, 10.0)
    assert f.moving(s).torque.tolist() == s.torque.tolist()
    assert not f.loss(s, s).any()
    assert [x.tolist() for x in f.holding(np.array([10.0]), np.array([10.0]))] == [[7.0], [13.0]]


def test_parameters_may_differ_by_joint():
    f = Friction("f", coulomb=np.array([1.0, 2.0]))
    assert f.moving(constant([1.0, -1.0], 0.0)).torque[0].tolist() == [1.0, -2.0]


@pytest.mark.parametrize(
    "build",
    [
        lambda: Friction("f", coulomb=-1.0),
        lambda: Friction("f", load=1.0),
        lambda: Friction("f", viscous=np.nan),
        lambda: Inertia("i", -1.0),
        lambda: Ratio("r", 0.0),
        lambda: Ratio("r", np.inf),
        lambda: Hypoid("h", 10.0, 0.5, 0.6, 0.03, 0.1),
        lambda: Hypoid("h", 10.0, 1.5, 1.4, 0.03, 0.5),
        lambda: Hypoid("h", 10.0, 1.6, 0.4, 0.03, 0.1),
        lambda: Hypoid("h", ratio=2.0),
        lambda: Hypoid("h", 0.0, 1.4, 0.4, 0.03, 0.1),
        lambda: Hypoid("h", 10.0, 1.4, 0.4, 0.0, 0.1),
        lambda: Hypoid("h", 10.0, 1.4, -0.1, 0.03, 0.1),
        lambda: DCMotor("m", 0.0, 0.3),
        lambda: DCMotor("m", 0.03, -0.3),
        lambda: DCMotor("m", 0.03, 0.3, max_speed=0.0),
    ],
)
def test_unphysical_parameters_are_refused(build):
    with pytest.raises(UnphysicalElementError, match=r"^element '[a-z]':"):
        build()


# --- hypoid ---------------------------------------------------------------------------------------
B1, B2, MU, N, R2 = np.radians(80.0), np.radians(25.0), 0.1, 30.0, 0.0315


def hypoid(mu=MU):
    return Hypoid("h", N, B1, B2, R2, mu)


def test_hypoid_driving_efficiency_in_closed_form():
    s = constant(1.0, 30.0)
    efficiency = s.power / hypoid().moving(s).power
    expected = (1 + MU * np.tan(B2)) / (1 + MU * np.tan(B1))
    np.testing.assert_allclose(efficiency, expected, rtol=1e-13)


def test_hypoid_driven_efficiency_in_closed_form():
    s = constant(-1.0, 30.0)
    efficiency = hypoid().moving(s).power / s.power
    expected = (1 - MU * np.tan(B1)) / (1 - MU * np.tan(B2))
    np.testing.assert_allclose(efficiency, expected, rtol=1e-13)


def test_hypoid_without_friction_is_its_ratio():
    s = constant([1.0, -1.0], 30.0)
    np.testing.assert_allclose(hypoid(0.0).moving(s).torque, 1.0, rtol=1e-13)


def test_hypoid_of_ratio_and_pinion_angle_alone_is_a_spiral_without_friction():
    h = Hypoid("h", ratio=4.0, pinion_angle=0.7)
    s = constant([1.0, -1.0], 30.0)
    np.testing.assert_allclose(h.moving(s).torque, 7.5, rtol=1e-13)
    np.testing.assert_allclose(h.normal_force(s), 30.0)  # at a wheel of 1 m, teeth along its axis
    assert not h.loss(s, h.moving(s)).any()


@pytest.mark.parametrize("mu", [0.1, 0.2], ids=["reversible", "self-locking"])
def test_hypoid_without_a_load_needs_no_torque(mu):
    s = constant([1.0, -1.0], 0.0)
    assert not hypoid(mu).moving(s).torque.any()
    assert not hypoid(mu).driving(s).torque.any()


def test_self_locking_hypoid_names_the_sample_in_which_it_jams():
    s = series([0.0, 1.0, 2.0], [[0, 0]] * 3, [[1, 1]] * 3, [[0, 0]] * 3, [[1, 1], [1, 1], [1, -1]])
    with pytest.raises(SelfLockingError, match="joint 'j1' cannot keep moving in sample 2"):
        hypoid(0.2).driving(s)


def test_self_locking_hypoid_holds_any_load_without_torque():
    h = hypoid(0.2)
    assert h.driven_factor < 0.0
    low, high = h.holding(np.array([-30.0, 30.0]), np.array([-30.0, 30.0]))
    assert (low < 0).all()
    assert (high > 0).all()


def test_self_locking_hypoid_jams_when_its_pinion_pushes_back():
    with pytest.raises(SelfLockingError, match="joint 'j0' cannot keep moving in sample 0"):
        hypoid(0.2).driving(constant(1.0, -1.0))
    s = constant([1.0, -1.0], [30.0, -30.0])  # driven along its motion there is no trouble
    h = hypoid(0.2)
    np.testing.assert_allclose(h.driving(h.moving(s)).torque, s.torque)


def test_hypoid_sliding_speed_is_the_difference_along_the_teeth():
    # Independent of the loss law: pitch-point velocities of both gears as vectors in the common
    # tangent plane, each at its spiral angle to the tooth trace.
    h = hypoid()
    v2 = R2 * 1.0
    v1 = h.pinion_radius * N * 1.0
    assert v1 * np.cos(B1) == pytest.approx(v2 * np.cos(B2))  # normal to the teeth: equal
    slip = v1 * np.sin(B1) - v2 * np.sin(B2)
    s = constant(1.0, 30.0)
    force = h.normal_force(s)[0, 0]
    assert h.loss(s, h.moving(s))[0, 0] == pytest.approx(MU * force * slip)


# --- motor ----------------------------------------------------------------------------------------
@given(torques, speeds)
def test_motor_power_is_mechanical_power_and_copper_loss(torque, speed):
    m = DCMotor("m", 0.03, 0.3)
    i = m.current(np.array(torque))
    u = m.voltage(i, np.array(speed))
    assert u * i == pytest.approx(torque * speed + m.copper_loss(i), rel=1e-9, abs=1e-6)
    assert m.torque(u, np.array(speed)) == pytest.approx(torque, rel=1e-9, abs=1e-6)


def test_a_motor_may_be_small():
    limits = ("max_speed", "supply_voltage", "continuous_current", "peak_current")
    small = DCMotor("m", 0.003, 0.3, **dict.fromkeys(limits, 0.5))
    assert [getattr(small, name) for name in limits] == [0.5] * 4
    with pytest.raises(UnphysicalElementError, match="torque_constant must be > 0"):
        DCMotor("m", np.array([0.03, 0.0]), 0.3)


def test_a_motor_has_no_limits_and_no_spread_unless_given():
    m = DCMotor("m", 0.03, 0.3)
    assert {m.max_speed, m.supply_voltage, m.continuous_current, m.peak_current} == {math.inf}
    assert m.torque_constant_spread == m.resistance_spread == 0.0


def test_inertia_stores_the_change_of_kinetic_energy():
    s = split(harmonic(4001, joints=2, seed=1))
    i = Inertia("i", 0.3)
    rate = i.stored(s, s)
    kinetic = 0.5 * 0.3 * s.velocity**2
    integral = np.diff(s.time)[:, None] * 0.5 * (rate[1:] + rate[:-1])
    np.testing.assert_allclose(np.cumsum(integral, axis=0), kinetic[1:] - kinetic[0], atol=1e-5)
