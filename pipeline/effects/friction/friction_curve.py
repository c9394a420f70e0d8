"""Friction of a joint whose law has no name in the catalogue, as curves over speed and load."""

from __future__ import annotations

from typing import ClassVar, Final

from actuators.elements.friction_curve import FrictionCurve
from pipeline.effects.base import Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel

#: Knots on the speed.
KNOTS: Final = 8
_NUMBERS: Final = range(1, KNOTS + 1)


class FrictionCurveEffect(Effect):
    """Friction over speed and load, at the joint's own side: it is there, its law is not known."""

    name = "friction_curve"
    parameters: ClassVar = (
        *(Parameter(f"speed_{k}", "rad/s", 0.0, 1e4) for k in _NUMBERS),
        *(Parameter(f"level_{k}", "N*m", -1e3, 1e3) for k in _NUMBERS),
        *(Parameter(f"asymmetry_{k}", "N*m", -1e3, 1e3) for k in _NUMBERS),
        *(Parameter(f"share_{k}", "1", 0.0, 0.99) for k in _NUMBERS),
        Parameter("viscous", "N*m*s/rad", 0.0, 1e3),
        Parameter("rise", "rad/s", 0.0, 1e4),
        Parameter("travel", "rad", 0.0, 1.0, optional=True),
    )
    coordinates: ClassVar = ()
    competes: ClassVar = False
    excitation = "moves both ways at many speeds and loads"

    def law(self, values: Values) -> str:
        """There is none."""
        return "not in the catalogue"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert the curves at the joint's side."""
        values = {**x, **shape}

        def curve(name: str) -> tuple[float, ...]:
            return tuple(values[f"{name}_{k}"] for k in _NUMBERS)

        element = FrictionCurve(
            name=self.name,
            rise=values["rise"],
            travel=values.get("travel", 0.0),
            speeds=curve("speed"),
            levels=curve("level"),
            asymmetries=curve("asymmetry"),
            shares=curve("share"),
            viscous=values["viscous"],
        )
        return model.with_actuator(model.actuator(place[0]).with_output(element))
