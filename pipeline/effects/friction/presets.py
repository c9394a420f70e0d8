"""The named laws of friction: each a choice of terms of `actuators.elements.friction`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from actuators.elements.friction import Friction
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

_STRIBECK_SPEEDS = (0.012, 0.025, 0.05, 0.1, 0.2, 0.4)  # [rad/s]
_LARGEST_STRIBECK_SPEED = 0.5  # [rad/s]
_LARGEST_EXCESS = 3.0  # of break-away over Coulomb friction, in Coulomb friction


class FrictionPreset(Effect):
    """Friction inserted at the joint's shaft."""

    terms: ClassVar[Mapping[str, str]]  #: Each parameter's term of the law.

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert friction at the joint's shaft."""
        values = {self.terms[name]: value for name, value in {**x, **shape}.items()}
        return insert(model, place, Friction(name=self.name, **values))


def insert(model: MachineModel, place: Place, element: Friction) -> MachineModel:
    """The machine with friction more at a joint's shaft."""
    return model.with_actuator(model.actuator(place[0]).with_element(element))


class CoulombFriction(FrictionPreset):
    """Friction that has one level at every speed and load."""

    name = "coulomb_friction"
    additive = True
    parameters: ClassVar = (Parameter("torque", "N*m", 0.0, 1e3),)
    coordinates: ClassVar = (Coordinate("torque", 1e-2),)
    terms: ClassVar = {"torque": "coulomb"}
    excitation = "moves in both directions at several speeds"


class ViscousFriction(FrictionPreset):
    """Friction of grease and bearings that grows with the speed."""

    name = "viscous_friction"
    additive = True
    parameters: ClassVar = (Parameter("coefficient", "N*m*s/rad", 0.0, 1e3),)
    coordinates: ClassVar = (Coordinate("coefficient", 1e-2),)
    terms: ClassVar = {"coefficient": "viscous"}
    excitation = "moves at clearly different speeds, the fastest near the limit"


class QuadraticDrag(FrictionPreset):
    """Friction that grows with the square of the speed: churned oil, air."""

    name = "quadratic_drag"
    additive = True
    parameters: ClassVar = (Parameter("quadratic", "N*m*s^2/rad^2", 0.0, 1e3),)
    coordinates: ClassVar = (Coordinate("quadratic", 1e-2),)
    terms: ClassVar = {"quadratic": "quadratic"}
    excitation = "moves at clearly different speeds, the fastest near the limit"


class StribeckFriction(FrictionPreset):
    """Dry friction that falls from break-away to Coulomb level with speed."""

    name = "stribeck_friction"
    additive = True
    parameters: ClassVar = (
        Parameter("coulomb", "N*m", 0.0, 1e3),
        Parameter("excess", "N*m", 0.0, 1e3),
        Parameter("velocity", "rad/s", 1e-4, 1e2),
    )
    coordinates: ClassVar = (
        Coordinate("coulomb", 1e-2, required=False),
        Coordinate("excess", 1e-2),
    )
    terms: ClassVar = {"coulomb": "coulomb", "excess": "excess", "velocity": "stribeck_speed"}
    excitation = "slow passages through many speeds below the Stribeck speed"
    contains: ClassVar = ("coulomb_friction",)

    def shapes(self, model: MachineModel, m: Measurement, place: Place) -> list[dict[str, float]]:
        """Stribeck speeds above where friction changes sign and below the fastest motion."""
        k = model.index(place[0])
        fastest = float(np.quantile(np.abs(m.v[:, k]), 0.98))
        slowest = 1.5 * float(m.rest_speed[k])
        return [{"velocity": s} for s in _STRIBECK_SPEEDS if slowest <= s <= 0.6 * fastest]

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """Slow enough to be a Stribeck speed, break-away at most four times Coulomb's level."""
        slow = shape["velocity"] < _LARGEST_STRIBECK_SPEED
        small = x["excess"] <= _LARGEST_EXCESS * x["coulomb"]
        return slow and small and super().plausible(model, place, x, shape)


class LoadDependentFriction(FrictionPreset):
    """Friction of loaded teeth, alike where the motor drives and where it is driven."""

    name = "load_dependent_friction"
    parameters: ClassVar = (Parameter("share", "1", 0.0, 0.99),)
    coordinates: ClassVar = (Coordinate("share", 1e-3),)
    terms: ClassVar = {"share": "load"}
    signature = "load"
    excitation = "moves at one speed under clearly different loads, both ways"


class BackdriveLoss(FrictionPreset):
    """Load friction with a coefficient for each power quadrant."""

    name = "backdrive_loss"
    parameters: ClassVar = (
        Parameter("driving", "1", 0.0, 10.0),
        Parameter("driven", "1", 0.0, 0.99),
    )
    coordinates: ClassVar = (
        Coordinate("driving", 1e-3, required=False),
        Coordinate("driven", 1e-3, required=False),
    )
    terms: ClassVar = {"driving": "when_driving", "driven": "when_driven"}
    signature = "load"
    excitation = "raises and lowers clearly different loads"
    contains: ClassVar = ("load_dependent_friction",)


class DirectionDependentFriction(Effect):
    """Dry friction with a level for each direction.

    Note:
        In motion it is Coulomb friction with a constant offset.
    """

    name = "direction_dependent_friction"
    additive = True
    parameters: ClassVar = (
        Parameter("positive", "N*m", 0.0, 1e3),
        Parameter("negative", "N*m", 0.0, 1e3),
    )
    coordinates: ClassVar = (
        Coordinate("positive", 1e-2, required=False),
        Coordinate("negative", 1e-2, required=False),
    )
    excitation = "moves in both directions, with stops in between"
    contains: ClassVar = ("coulomb_friction",)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert friction at the joint's shaft."""
        mean, half = 0.5 * (x["positive"] + x["negative"]), 0.5 * (x["positive"] - x["negative"])
        return insert(model, place, Friction(name=self.name, coulomb=mean, skew=half))
