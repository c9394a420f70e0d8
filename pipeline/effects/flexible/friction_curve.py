"""Friction of a joint whose law has no name in the catalogue, as curves."""

from __future__ import annotations

from typing import ClassVar, Final

import numpy as np

from actuators.elements.friction_curve import FrictionCurve
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.effects.flexible.knots import place_knots
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

#: Knots on the speed above zero, at these quantiles of what occurs.
_QUANTILES: Final = (0.2, 0.45, 0.75, 1.0)
_SPEEDS: Final = range(1, len(_QUANTILES) + 2)
_PLACES: Final = range(1, 8)
#: Travel over which friction builds up after a reversal, at first [rad].
_TRAVELS: Final = (0.0,)


class FrictionCurveEffect(Effect):
    """Friction over speed, direction, load and position: it is there, its law is not known.

    It is fitted in dry friction forward and backward at knots of the speed, as no friction gives
    energy in either direction.
    """

    name = "friction_curve"
    additive = True
    parameters: ClassVar = (
        *(Parameter(f"speed_{k}", "rad/s", 0.0, 1e4) for k in _SPEEDS),
        *(Parameter(f"forward_{k}", "N*m", 0.0, 1e4) for k in _SPEEDS),
        *(Parameter(f"backward_{k}", "N*m", 0.0, 1e4) for k in _SPEEDS),
        *(Parameter(f"share_{k}", "1", 0.0, 0.9) for k in _SPEEDS),
        *(Parameter(f"place_{k}", "rad", -1e4, 1e4) for k in _PLACES),
        *(Parameter(f"spot_{k}", "N*m", 0.0, 1e4) for k in _PLACES),
        Parameter("travel", "rad", 0.0, 1.0, optional=True),
    )
    coordinates: ClassVar = (
        *(Coordinate(f"forward_{k}", 1e-2, required=False) for k in _SPEEDS),
        *(Coordinate(f"backward_{k}", 1e-2, required=False) for k in _SPEEDS),
        *(Coordinate(f"share_{k}", 1e-3, required=False) for k in _SPEEDS),
        *(Coordinate(f"spot_{k}", 1e-2, required=False) for k in _PLACES),
    )
    has_law: ClassVar = False
    fixed: ClassVar = (
        *(f"speed_{k}" for k in _SPEEDS),
        *(f"place_{k}" for k in _PLACES),
    )
    excitation = "moves both ways at many speeds and loads"

    def shapes(self, model: MachineModel, m: Measurement, place: Place) -> list[dict[str, float]]:
        """Knots where the joint was; with and without a rise over the travel."""
        j = m.joints.index(place[0])
        speed = np.abs(m.v[:, j])
        speed = speed[speed > m.rest_speed[j]]
        places = place_knots(m, j, len(_PLACES))
        if speed.size == 0 or not places:
            return []
        knots = np.unique([0.0, *np.quantile(speed, _QUANTILES)])
        if knots.size < len(_SPEEDS):
            return []
        shape = {f"speed_{k}": float(x) for k, x in zip(_SPEEDS, knots, strict=True)}
        shape |= {f"place_{k}": x for k, x in zip(_PLACES, places, strict=True)}
        return [shape | ({"travel": travel} if travel else {}) for travel in _TRAVELS]

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
            places=curve("place", _PLACES),
            spots=curve("spot", _PLACES),
        )
        return model.with_actuator(model.actuator(place[0]).with_output(element))
