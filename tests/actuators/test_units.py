import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actuators.errors import UnitError
from actuators.units import dimension, from_si, known_dimensions, known_units, si_unit, to_si


@pytest.mark.parametrize(
    ("value", "unit", "si", "dim"),
    [
        (30.2, "mN*m/A", 0.0302, "torque constant"),
        (138.0, "g*cm^2", 1.38e-5, "inertia"),
        (7580.0, "rpm", 793.776, "angular velocity"),
        (9.6, "m/min", 0.16, "velocity"),
        (1.0, "mN*m/krpm", 1e-3 / 104.7198, "viscous friction"),
        (317.0, "rpm", 33.1962, "angular velocity"),
        (20.0, "degC", 293.15, "temperature"),
        (5.0, "%", 0.05, "ratio"),
        (180.0, "deg", math.pi, "angle"),
        (0.0823, "mH", 8.23e-5, "inductance"),
        (3.155, "V/krpm", 0.030128, "torque constant"),
    ],
)
def test_known_conversions(value, unit, si, dim):
    assert to_si(value, unit) == pytest.approx(si, rel=1e-5)
    assert dimension(unit) == dim


@given(st.sampled_from(known_units()), st.floats(-1e6, 1e6))
def test_from_si_inverts_to_si(unit, value):
    assert from_si(to_si(value, unit), unit) == pytest.approx(value, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", known_dimensions())
def test_first_unit_of_a_dimension_is_si(name):
    assert to_si(1.0, si_unit(name)) == 1.0


def test_unknown_unit_offers_the_closest():
    with pytest.raises(UnitError, match=r"'mN\*m/a'.*did you mean 'mN\*m/A'"):
        to_si(1.0, "mN*m/a")
    with pytest.raises(UnitError, match="unknown dimension"):
        si_unit("torqe")
