"""Numbers of the actuator that the twin's machines are built around, from the catalogue's files.

The twin simulates the alternative "rotor": motor RE 40, its rotor's friction and inertia, and an
ideal transmission of 400. Only numbers are read; no law of `actuators` is used.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from actuators.parameters import load_parameters

CATALOG = Path(__file__).parents[3] / "actuators" / "catalog"
#: Name of the alternative in `alternatives.toml` that the twin's nominal machine follows.
ALTERNATIVE = "rotor"
_MOTOR = {
    "torque_constant": "torque constant",
    "resistance": "resistance",
    "max_speed": "angular velocity",
    "supply_voltage": "voltage",
    "continuous_current": "current",
    "peak_current": "current",
    "mass": "mass",
}
_ROTOR = {"coulomb": "torque", "viscous": "viscous friction", "inertia": "inertia"}


@dataclass(frozen=True)
class Machine:
    """One actuator by its data sheet, at the motor.

    Attributes:
        ratio: Motor turns per joint turn [1].
        torque_constant: [N*m/A].
        resistance: [ohm].
        supply: Largest voltage either way [V].
        peak_current: [A].
        rotor_inertia: [kg*m^2].
        rotor_coulomb: [N*m].
        rotor_viscous: [N*m*s/rad].
    """

    ratio: float
    torque_constant: float
    resistance: float
    supply: float
    peak_current: float
    rotor_inertia: float
    rotor_coulomb: float
    rotor_viscous: float

    @property
    def reflected_inertia(self) -> float:
        """Rotor inertia referred to the joint [kg*m^2]."""
        return self.ratio**2 * self.rotor_inertia


def load_machine(catalog: Path = CATALOG) -> Machine:
    """Read the nominal actuator from the catalogue.

    Raises:
        actuators.errors.ParameterError: A file or parameter is missing or malformed.
    """
    motor = load_parameters(catalog / "motor_re40_24v.toml", _MOTOR)
    rotor = load_parameters(catalog / "rotor_re40.toml", _ROTOR)
    ratio = load_parameters(catalog / "requirement.toml", {"ratio": "ratio"})
    return Machine(
        ratio=ratio["ratio"],
        torque_constant=motor["torque_constant"],
        resistance=motor["resistance"],
        supply=motor["supply_voltage"],
        peak_current=motor["peak_current"],
        rotor_inertia=rotor["inertia"],
        rotor_coulomb=rotor["coulomb"],
        rotor_viscous=rotor["viscous"],
    )
