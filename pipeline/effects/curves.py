"""Curves for what has no law in the catalogue: friction of a joint, torque over its position."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from actuators.elements.friction_curve import FrictionCurve
from actuators.elements.position_torque import PositionTorque
from actuators.elements.torque_table import TorqueTable
from pipeline.effects.base import Effect, Parameter, Place, Values, with_position_torque
from pipeline.effects.friction import DRY
from pipeline.machine.machine import MachineModel

_SPEEDS: Final = range(1, 6)
_SPOTS: Final = range(1, 8)
_LEVELS: Final = range(1, 10)


def _knots(name: str, unit: str, numbers: range, low: float = 0.0) -> list[Parameter]:
    return [Parameter(f"{name}_{k}", unit, low, 1e4) for k in numbers]


def _levels(name: str, numbers: range, low: float = 0.0) -> list[Parameter]:
    of = [f"{name}_{k}" for k in numbers]
    return [Parameter(n, "N*m", low, 1e4, DRY, step=1e-2, required=False) for n in of]


class FrictionCurveEffect(Effect):
    """Friction over speed, direction, load and position: it is there, its law is not known.

    It is fitted in dry friction forward and backward at knots of the speed, as no friction gives
    energy in either direction.
    """

    name = "friction_curve"
    additive = True
    parameters = (
        *_knots("speed", "rad/s", _SPEEDS),
        *_levels("forward", _SPEEDS),
        *_levels("backward", _SPEEDS),
        *(Parameter(f"share_{k}", "1", 0.0, 0.9, step=1e-3, required=False) for k in _SPEEDS),
        *_knots("place", "rad", _SPOTS, low=-1e4),
        *_levels("spot", _SPOTS),
        Parameter("travel", "rad", 0.0, 1.0, optional=True),
    )
    competes = False
    excitation = "moves both ways at many speeds and loads"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert the curves at the joint's side."""
        values = {**x, **shape}

        def curve(name: str, knots: range = _SPEEDS) -> tuple[float, ...]:
            return tuple(values[f"{name}_{k}"] for k in knots)

        both = tuple(zip(curve("forward"), curve("backward"), strict=True))
        element = FrictionCurve(
            name=self.name,
            travel=values.get("travel", 0.0),
            speeds=curve("speed"),
            levels=tuple(0.5 * (f + b) for f, b in both),
            asymmetries=tuple(0.5 * (f - b) for f, b in both),
            shares=curve("share"),
            places=curve("place", _SPOTS),
            spots=curve("spot", _SPOTS),
        )
        return model.with_actuator(model.actuator(place[0]).with_output(element))


class UnnamedTorque(Effect):
    """What has no name: a table over angle, direction, speed and the way a joint came.

    Its numbers are lists, under ``table`` in a model file (`TorqueTable`).
    """

    name = "unnamed_torque"
    parameters = ()
    tables = ("angle", "level", "friction", "speed", "drag", "radius", "memory")
    competes = False
    excitation = "moves both ways at many speeds and angles"

    def apply(self, model: MachineModel, place: Place, values: Mapping[str, Any]) -> MachineModel:
        """The machine with the table at the joint's own side.

        Raises:
            LegwattError: No such list. Knots do not ascend, or there is not one number at each.
        """
        self.refuse_other_names(values)
        lists = {name: tuple(own) for name, own in values.items()}
        element = TorqueTable(name=self.name, **lists)
        return model.with_actuator(model.actuator(place[0]).with_output(element))


class PositionCurveEffect(Effect):
    """Torque over position that the actuator has to supply in addition: cable, spring, cogging."""

    name = "position_curve"
    additive = True
    parameters = (*_knots("place", "rad", _LEVELS, low=-1e4), *_levels("level", _LEVELS, low=-1e4))
    competes = False
    excitation = "turns slowly through the whole travel, in both directions"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add it at the joint."""
        places = tuple(shape[f"place_{k}"] for k in _LEVELS)
        levels = tuple(x[f"level_{k}"] for k in _LEVELS)
        law = PositionTorque(self.name, places=places, levels=levels)
        return with_position_torque(model, place, law)
