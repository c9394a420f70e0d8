"""One test for each slip in `actuators/ERRATA.md`."""

import numpy as np

from actuators.elements.element import Friction, Inertia
from actuators.elements.hypoid import Hypoid
from actuators.energy.energy import balance_residual
from tests.actuators.motions import CHAINS, constant, harmonic, split


def test_eq_3_lacks_the_dot_on_the_second_omega():
    steady = constant(5.0, 1.0)
    inertia = Inertia("rotor", 2.0)
    assert (inertia.inverse(steady).torque == steady.torque).all()  # J w w would load it
    speeding = constant(5.0, 1.0, acceleration=3.0)
    assert (inertia.stored(speeding) == 2.0 * 5.0 * 3.0).all()


def test_eq_5_and_6_lack_the_magnitudes():
    friction = Friction("f", coulomb=1.0, load=0.5, viscous=0.1)
    for speed in (2.0, -2.0):
        for torque in (100.0, -100.0):
            s = constant(speed, torque)
            assert (friction.loss(s) > 0.0).all()
            printed = (1.0 + 0.5 * torque + 0.1 * speed) * np.sign(speed) * speed
            assert (printed < 0.0) == (torque < 0.0)  # as printed it gives power


def test_eq_11_is_the_frictionless_limit():
    s = constant([1.0, -1.0], 30.0)
    for mu, equal in ((0.0, True), (0.1, False)):
        gear = Hypoid("h", 30.0, np.radians(80.0), np.radians(25.0), 0.03, mu)
        assert np.allclose(gear.inverse(s).power, s.power, rtol=1e-12) is equal


def test_section_iv_a_4_describes_the_irreversible_actuator():
    result = CHAINS["irreversible"].inverse(constant(1.0, 10.0))
    assert result.stages == ("out", "2", "ph", "mp", "m", "el")


def test_alternative_3_counts_the_rotor_friction_once():
    chain = CHAINS["reversible"]
    assert [e.name for e in chain.elements if isinstance(e, Friction)] == [
        "harmonic_drive_friction",
        "timing_belt_friction",
    ]


def test_rotor_friction_stands_apart_from_the_planetary_gear():
    result = CHAINS["irreversible"].inverse(split(harmonic(100)))
    assert {"planetary_friction", "rotor_friction"} <= set(result.losses)
    assert np.abs(balance_residual(result)).max() < 1e-9
