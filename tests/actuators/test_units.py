import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actuators.errors import UnitError
from actuators.units import UNITS, dimension, from_si, known_units, quantity, si_unit, to_si


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


RPM, DEGREE = 2.0 * math.pi / 60.0, math.pi / 180.0  # [rad/s], [rad]
#: Every unit that is not its dimension's SI unit, from the definitions of the prefixes.
SI = {
    **{"%": 1 / 100, "cm": 1 / 100, "mm": 1 / 1000, "g": 1 / 1000, "min": 60.0},
    **{"ms": 1 / 1000, "us": 1 / 1000**2, "ns": 1 / 1000**3},
    **{"deg": DEGREE, "deg/s": DEGREE, "rpm": RPM, "mm/s": 1 / 1000, "m/min": 1 / 60},
    **{"kN": 1000.0, "mN*m": 1 / 1000, "cN*m": 1 / 100, "N*cm": 1 / 100},
    **{"g*cm^2": 1 / 1000 / 100**2, "kg*cm^2": 1 / 100**2, "N*m/deg": 1 / DEGREE},
    **{"mN*m*s/rad": 1 / 1000, "mN*m/krpm": 1 / 1000 / (1000 * RPM), "mN*m/rpm": 1 / 1000 / RPM},
    **{"kN/m": 1000.0, "N/mm": 1000.0, "g/cm^3": 100**3 / 1000},
    **{"mW": 1 / 1000, "mJ": 1 / 1000, "Wh": 3600.0, "mA": 1 / 1000, "mV": 1 / 1000},
    **{"mohm": 1 / 1000, "mH": 1 / 1000, "mN*m/A": 1 / 1000, "V*s/rad": 1.0},
    **{"V/krpm": 1 / (1000 * RPM), "%/K": 1 / 100, "degC": 1.0},
    **{"rpm/V": RPM, "Wh/kg": 3600.0, "mN*m/sqrt(W)": 1 / 1000},
}


@pytest.mark.parametrize("unit", known_units())
def test_every_unit_has_the_factor_of_its_prefixes(unit):
    factor = to_si(1.0, unit) - to_si(0.0, unit)
    assert factor == pytest.approx(SI.get(unit, 1.0), rel=1e-12)
    assert (unit in SI) == (unit != si_unit(dimension(unit)))
    assert to_si(0.0, unit) == (273.15 if unit == "degC" else 0.0)


@given(st.sampled_from(known_units()), st.floats(-1e6, 1e6))
def test_from_si_inverts_to_si(unit, value):
    assert from_si(to_si(value, unit), unit) == pytest.approx(value, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", UNITS)
def test_first_unit_of_a_dimension_is_si(name):
    assert to_si(1.0, si_unit(name)) == 1.0


def test_unknown_unit_offers_the_closest():
    with pytest.raises(UnitError, match=r"'mN\*m/a'.*did you mean 'mN\*m/A'"):
        to_si(1.0, "mN*m/a")
    with pytest.raises(UnitError, match="unknown dimension"):
        si_unit("torqe")


@pytest.mark.parametrize(
    ("written", "dim", "si"),
    [
        ("240 mm", "length", 0.24),
        ("-5deg", "angle", -math.pi / 36),
        (" 1.5e-3 s ", "time", 1.5e-3),
        (0, "velocity", 0.0),
        (0.75, "ratio", 0.75),
        ("75 %", "ratio", 0.75),
        ("0.75", "ratio", 0.75),
    ],
)
def test_a_number_written_with_its_unit(written, dim, si):
    assert quantity(written, dim) == pytest.approx(si)


@pytest.mark.parametrize(
    ("written", "dim", "message"),
    [
        (240, "length", "240 has no unit; expected text such as '1 m'"),
        ("240", "length", "'240' has no unit; expected such as '1 m'"),
        ("5 kg", "length", "'5 kg': expected a length in one of m, cm, mm"),
        ("5 parsec", "length", "unknown unit 'parsec'"),
        ("long", "length", "'long' is no number with a unit"),
        ("1e999 m", "length", "'1e999 m' is not finite"),
        (float("nan"), "ratio", "is no number with a unit"),
        (True, "ratio", "True has no unit"),
    ],
)
def test_what_is_no_number_with_a_unit_is_told(written, dim, message):
    with pytest.raises(UnitError) as refused:
        quantity(written, dim)
    assert message in str(refused.value)
