"""What every element promises: energy balances, holding is the limit of motion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuators.elements.element import Friction, Inertia, Ratio
from actuators.elements.heating import Warming
from actuators.elements.hypoid import Hypoid
from actuators.elements.position_torque import PositionTorque
from actuators.errors import LegwattError
from tests.actuators.motions import constant

torques = st.floats(-1e3, 1e3)
speeds = st.floats(-1e3, 1e3).filter(lambda v: abs(v) > 1e-6)
positive, fraction = st.floats(0.0, 10.0), st.floats(0.0, 0.47)
FRICTION = {name: positive for name in ("coulomb", "excess", "quadratic", "saturating", "viscous")}
FRICTION |= dict.fromkeys(("load", "when_driving", "when_driven"), fraction)


@st.composite
def hypoids(draw):
    b2 = draw(st.floats(0.0, 0.8))
    b1 = draw(st.floats(b2 + 0.05, 1.5))
    most = min(0.95 / max(np.tan(b2), 1e-9), 0.95 / np.tan(b1))
    return Hypoid("h", draw(st.floats(1, 100)), b1, b2, 0.03, draw(st.floats(0, most)))


SIDED = Friction("f", coulomb=2.0, skew=-1.5, viscous=0.3, asymmetry=0.2, stribeck_speed=0.2)
FRICTIONS = st.builds(Friction, st.just("f"), **FRICTION) | st.just(SIDED)
ELEMENTS = (
    FRICTIONS
    | hypoids()
    | st.builds(Ratio, st.just("r"), st.floats(0.1, 500.0))
    | st.builds(Inertia, st.just("i"), positive)
    | st.builds(PositionTorque, st.just("s"), *[st.floats(-9, 9)] * 5)
)


@settings(max_examples=60)
@given(ELEMENTS, torques, speeds, st.floats(-100, 100))
def test_what_goes_in_is_passed_on_lost_or_stored(element, torque, speed, acceleration):
    s = constant(speed, torque, acceleration)
    m, loss, stored = element.inverse(s), element.loss(s), element.stored(s)
    taken = (0.0 if loss is None else loss) + (0.0 if stored is None else stored)
    assert loss is None or (loss >= 0.0).all()
    scale = np.abs(s.power).max() + np.abs(m.power).max()
    np.testing.assert_allclose(m.power - s.power, taken, rtol=1e-9, atol=1e-9 * (1 + scale))


@given(FRICTIONS | hypoids(), torques)
def test_holding_ends_where_motion_sets_in(element, torque):
    low, high = element.holding(np.array([torque]), np.array([torque]))
    ends = sorted(element.inverse(constant([2e-9, -2e-9], torque)).torque[0])
    np.testing.assert_allclose([low[0], high[0]], ends, rtol=1e-6, atol=1e-6 * (1 + abs(torque)))


NOTHING = (Friction("f"), Inertia("i"), Ratio("r"), PositionTorque("s"))


@pytest.mark.parametrize("law", NOTHING, ids=lambda e: type(e).__name__)
def test_a_law_without_parameters_is_absent(law):
    s = constant([1.0, -1.0, 2.0, 0.0], [3.0, 5.0, -7.0, 2.0], acceleration=4.0)
    assert np.array_equal(law.inverse(s).torque, s.torque)
    for end in law.holding(s.torque, s.torque, s.position):
        assert np.array_equal(end, s.torque)


@pytest.mark.parametrize(
    "build",
    [
        *(lambda n=n: Friction("f", **{n: -1.0}) for n in FRICTION),
        lambda: Friction("f", load=1.0),
        lambda: Warming(-0.1),
        lambda: Friction("f", load=0.5, when_driven=0.5),
        lambda: Friction("f", coulomb=0.1, skew=0.2),
        lambda: Friction("f", viscous=0.1, asymmetry=-0.2),
        lambda: Friction("f", excess=1.0, stribeck_speed=0.0),
        lambda: Inertia("i", -1.0),
        lambda: Ratio("r", 0.0),
        lambda: Hypoid("h", 10.0, 0.5, 0.6, 0.03, 0.1),
        lambda: Hypoid("h", 10.0, 1.5, 1.4, 0.03, 0.5),
        lambda: Hypoid("h", ratio=2.0),
        lambda: Hypoid("h", 10.0, 1.4, -0.1, 0.03, 0.1),
        lambda: PositionTorque("s", stiffness=np.inf),
        lambda: PositionTorque("w", phase=np.nan),
    ],
)
def test_unphysical_parameters_are_refused(build):
    with pytest.raises(LegwattError, match=r"^element '[A-Za-z]+':"):
        build()
