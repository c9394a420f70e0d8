"""What the motor's data sheet says, to hold the calibration against it."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from actuators.parameters import ParameterSet, parameters_from_table, read_toml

DATA_SHEET_FILE = Path(__file__).parent / "data_sheet.toml"
_SCHEMA = {
    "torque_constant": "torque constant",
    "resistance": "resistance",
    "no_load_current": "current",
    "no_load_speed": "angular velocity",
}


@cache
def data_sheet() -> ParameterSet:
    """The motor's data sheet.

    Raises:
        ParameterError: The file cannot be read, or a number is wrong.
    """
    return parameters_from_table(read_toml(DATA_SHEET_FILE), _SCHEMA, DATA_SHEET_FILE.name)


def no_load_current(torque_constant: float, coulomb: float, viscous: float) -> float:
    """Current at the data sheet's no-load speed with a rotor of given friction [A].

    Args:
        torque_constant: [N*m/A].
        coulomb: Coulomb friction [N*m].
        viscous: Viscous friction [N*m*s/rad].
    """
    return (coulomb + viscous * data_sheet()["no_load_speed"]) / torque_constant
