"""Units by the definitions of their prefixes, however they are spelt; numbers written with them."""

import math
import re

import pytest

from actuators.errors import LegwattError
from actuators.units import dimension, from_si, known_units, quantity, si_unit, to_si

RPM, DEGREE = 2.0 * math.pi / 60.0, math.pi / 180.0  # [rad/s], [rad]
MILLI = ("mm", "g", "ms", "mm/s", "mN*m", "mN*m*s/rad", "mW", "mJ", "mA", "mV", "mohm", "mH")
#: Every unit that is not its dimension's SI unit.
SI = {
    **dict.fromkeys((*MILLI, "mN*m/A", "mN*m/sqrt(W)"), 1 / 1000),
    **dict.fromkeys(("%", "cm", "cN*m", "N*cm", "%/K"), 1 / 100),
    **dict.fromkeys(("kN", "kN/m", "N/mm"), 1000.0),
    **{"us": 1 / 1000**2, "ns": 1 / 1000**3, "min": 60.0, "h": 3600.0, "m/min": 1 / 60},
    **{"deg": DEGREE, "deg/s": DEGREE, "rpm": RPM, "rpm/V": RPM, "N*m/deg": 1 / DEGREE},
    **{"g*cm^2": 1 / 1000 / 100**2, "kg*cm^2": 1 / 100**2, "g/cm^3": 100**3 / 1000},
    **{"mN*m/krpm": 1 / 1000 / (1000 * RPM), "mN*m/rpm": 1 / 1000 / RPM},
    **dict.fromkeys(("kg*cm", "kgf*cm"), 9.80665 / 100),
    **{"Wh": 3600.0, "Wh/kg": 3600.0, "V*s/rad": 1.0, "V/krpm": 1 / (1000 * RPM), "degC": 1.0},
}


def test_every_unit_has_the_factor_of_its_prefixes():
    for unit in known_units():
        factor = to_si(1.0, unit) - to_si(0.0, unit)
        assert factor == pytest.approx(SI.get(unit, 1.0), rel=1e-12), unit
        assert (unit in SI) == (unit != si_unit(dimension(unit))), unit
        assert to_si(0.0, unit) == (273.15 if unit == "degC" else 0.0)
        assert from_si(to_si(3.0, unit), unit) == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("written", "kind", "si"),
    [
        (0, "velocity", 0.0),
        ("35 mNm", "torque", 0.035),
        ("579 g cm²", "inertia", 579e-7),
        ("2.5 mΩ", "resistance", 2.5e-3),
        ("25 °C", "temperature", 298.15),
        ("9:1", "ratio", 9.0),
        (240, "length", "240 has no unit; expected such as '1 m'"),
        ("5 kg", "length", "'5 kg': expected a length such as '1 m'"),
        ("5 mN*", "length", "unknown unit 'mN*': did you mean 'mN*m'"),
        ("long", "length", "'long' is no finite number with a unit"),
        (True, "ratio", "True is no finite number"),
    ],
)
def test_a_number_written_with_its_unit_is_si_or_refused(written, kind, si):
    if isinstance(si, float):
        assert quantity(written, kind) == pytest.approx(si)
    else:
        with pytest.raises(LegwattError, match=re.escape(si)):
            quantity(written, kind)
