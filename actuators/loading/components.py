"""The kinds of catalogue components: which parameters, of which dimension, each one has."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

from pydantic import AfterValidator

from actuators.checked import Table, checked
from actuators.errors import CatalogError, closest, one_line
from actuators.parameters import ParameterSet, parameters_from_table, read_toml

MOTOR_KIND: Final = "dc_motor"

#: Terms of the law of friction, with the dimension of each.
FRICTION: Final[Mapping[str, str]] = {
    "coulomb": "torque",
    "load": "ratio",
    "viscous": "viscous friction",
    "skew": "torque",
    "excess": "torque",
    "stribeck_speed": "angular velocity",
    "when_driving": "ratio",
    "when_driven": "ratio",
}
_GEAR: Final = {"ratio": "ratio", **FRICTION, "inertia": "inertia"}

KINDS: Final[Mapping[str, Mapping[str, str]]] = {
    "requirement": {"ratio": "ratio"},
    MOTOR_KIND: {
        "torque_constant": "torque constant",
        "resistance": "resistance",
        "max_speed": "angular velocity",
        "supply_voltage": "voltage",
        "continuous_current": "current",
        "peak_current": "current",
        "mass": "mass",
    },
    "rotating_friction": {**FRICTION, "inertia": "inertia"},
    "gear": _GEAR,
    "harmonic_drive": _GEAR,
    "timing_belt": _GEAR,
    "planetary": _GEAR,
    "hypoid": {
        **_GEAR,
        "pinion_angle": "angle",
        "wheel_angle": "angle",
        "wheel_radius": "length",
        "friction": "ratio",
    },
    "bearing": FRICTION,
    "spring": {"stiffness": "rotational stiffness", "rest": "angle"},
    "brake": {"static_torque": "torque", "released_power": "power", "engaged_power": "power"},
    "second_motor": {
        "torque_constant": "torque constant",
        "resistance": "resistance",
        "share": "ratio",
    },
}


def _known_kind(kind: str) -> str:
    if kind not in KINDS:
        raise ValueError(f"unknown kind '{one_line(kind)}': {closest(kind, list(KINDS))}")
    return kind


class _Written(Table):
    """A component file; which parameters it has, its kind says."""

    kind: Annotated[str, AfterValidator(_known_kind)]
    title: str
    note: str = ""
    parameters: dict[str, object]


@dataclass(frozen=True)
class Component:
    """One component file of the catalogue."""

    name: str  #: The file's stem.
    kind: str  #: One of `KINDS`.
    title: str  #: What it is, in words.
    note: str  #: What its values claim and what they do not; may be empty.
    parameters: ParameterSet  #: Its values.


def load_component(path: Path) -> Component:
    """Load one component file.

    Raises:
        ParameterError: The file cannot be read, or a parameter is wrong.
        CatalogError: A key or the kind is unknown or missing.
    """
    file = one_line(path.name)
    written = checked(_Written, read_toml(path), file, CatalogError)
    kinds = KINDS[written.kind]
    # What is needed, alternatives say: they name each number, and one that none names is refused.
    optional = frozenset({"mass"}) if written.kind == MOTOR_KIND else frozenset(kinds)
    parameters = parameters_from_table(written.parameters, kinds, file, optional)
    return Component(path.stem, written.kind, written.title, written.note, parameters)
