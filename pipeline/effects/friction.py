"""Friction at a joint: effects that are choices of terms of `actuators.elements.element`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Final

import numpy as np

from actuators.elements.element import Friction
from actuators.elements.heating import ZERO_CELSIUS, Warming
from pipeline.effects.base import Effect, Parameter, Place, Values, at_joint
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

_STRIBECK_SPEEDS: Final = (0.012, 0.025, 0.05, 0.1, 0.2, 0.4)  # [rad/s]
_LARGEST_STRIBECK_SPEED: Final = 0.5  # [rad/s]
_LARGEST_EXCESS: Final = 3.0  # of break-away over Coulomb friction, in Coulomb friction
#: Change of a temperature from which friction can follow it: above a sensor's steps [K].
_LEAST_WARMING: Final = 3.0


class FrictionPreset(Effect):
    """Friction inserted at the joint's shaft."""

    terms: ClassVar[Mapping[str, str]]  #: Each parameter's term of the law.

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert it."""
        values = {self.terms[name]: value for name, value in {**x, **shape}.items()}
        return _inserted(model, place, Friction(name=self.name, **values))


def _inserted(model: MachineModel, place: Place, element: Friction) -> MachineModel:
    return model.with_actuator(model.actuator(place[0]).with_element(element))


class CoulombFriction(FrictionPreset):
    """Friction that has one level at every speed and load."""

    name = "coulomb_friction"
    additive = True
    parameters: ClassVar = (Parameter("torque", "N*m", 0.0, 1e3, step=1e-2),)
    terms: ClassVar = {"torque": "coulomb"}
    excitation = "moves in both directions at several speeds"


class ViscousFriction(FrictionPreset):
    """Friction of grease and bearings that grows with the speed."""

    name = "viscous_friction"
    additive = True
    parameters: ClassVar = (Parameter("coefficient", "N*m*s/rad", 0.0, 1e3, step=1e-2),)
    terms: ClassVar = {"coefficient": "viscous"}
    excitation = "moves at clearly different speeds, the fastest near the limit"


class QuadraticDrag(FrictionPreset):
    """Friction that grows with the square of the speed: churned oil, air."""

    name = "quadratic_drag"
    additive = True
    parameters: ClassVar = (Parameter("quadratic", "N*m*s^2/rad^2", 0.0, 1e3, step=1e-2),)
    terms: ClassVar = {"quadratic": "quadratic"}
    excitation = "moves at clearly different speeds, the fastest near the limit"


class StribeckFriction(FrictionPreset):
    """Dry friction that falls from break-away to Coulomb level with speed."""

    name = "stribeck_friction"
    additive = True
    parameters: ClassVar = (
        Parameter("coulomb", "N*m", 0.0, 1e3, step=1e-2, required=False),
        Parameter("excess", "N*m", 0.0, 1e3, step=1e-2),
        Parameter("velocity", "rad/s", 1e-4, 1e2),
    )
    terms: ClassVar = {"coulomb": "coulomb", "excess": "excess", "velocity": "stribeck_speed"}
    excitation = "passes slowly through many speeds below the Stribeck speed"
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
    parameters: ClassVar = (Parameter("share", "1", 0.0, 0.99, step=1e-3),)
    terms: ClassVar = {"share": "load"}
    signature = "load"
    excitation = "moves at one speed under clearly different loads, both ways"


class BackdriveLoss(FrictionPreset):
    """Load friction with a coefficient for each power quadrant."""

    name = "backdrive_loss"
    parameters: ClassVar = (
        Parameter("driving", "1", 0.0, 10.0, step=1e-3, required=False),
        Parameter("driven", "1", 0.0, 0.99, step=1e-3, required=False),
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
        Parameter("positive", "N*m", 0.0, 1e3, step=1e-2, required=False),
        Parameter("negative", "N*m", 0.0, 1e3, step=1e-2, required=False),
    )
    excitation = "moves in both directions, with stops in between"
    contains: ClassVar = ("coulomb_friction",)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert friction at the joint's shaft."""
        mean, half = 0.5 * (x["positive"] + x["negative"]), 0.5 * (x["positive"] - x["negative"])
        return _inserted(model, place, Friction(name=self.name, coulomb=mean, skew=half))


#: Terms of a law, any of which makes it so in words, and the effect of the catalogue that this is
#: by itself.
_TERMS: Final = (
    (("coulomb",), "Coulomb", "coulomb_friction"),
    (("viscous",), "viscous", "viscous_friction"),
    (("excess",), "Stribeck", "stribeck_friction"),
    (("quadratic",), "quadratic", "quadratic_drag"),
    (("saturating",), "saturating", ""),
    (("load",), "load-dependent", "load_dependent_friction"),
    (("driving", "driven"), "load-dependent by quadrant", "backdrive_loss"),
    (("asymmetry",), "by direction", ""),
)


class JointFrictionLaw(Effect):
    """All friction of a joint as a sum of named terms, fitted together, at the joint's own side.

    Where the joint's motor turns with another joint, too, this friction does not: it is that of the
    joint's bearings and seals.
    """

    name = "joint_friction"
    parameters: ClassVar = (
        Parameter("coulomb", "N*m", 0.0, 1e3, optional=True),
        Parameter("viscous", "N*m*s/rad", 0.0, 1e3, optional=True),
        Parameter("asymmetry", "N*m*s/rad", -1e3, 1e3, optional=True),
        Parameter("excess", "N*m", 0.0, 1e3, optional=True),
        Parameter("stribeck_speed", "rad/s", 1e-6, 1e4, optional=True),
        Parameter("quadratic", "N*m*s^2/rad^2", 0.0, 1e3, optional=True),
        Parameter("saturating", "N*m", 0.0, 1e3, optional=True),
        Parameter("saturation_speed", "rad/s", 1e-6, 1e4, optional=True),
        Parameter("load", "1", 0.0, 0.99, optional=True),
        Parameter("driving", "1", 0.0, 10.0, optional=True),
        Parameter("driven", "1", 0.0, 0.99, optional=True),
        Parameter("rise", "rad/s", 0.0, 1e4, optional=True),
        Parameter("travel", "rad", 0.0, 1.0, optional=True),
    )
    competes: ClassVar = False
    excitation = "moves both ways at many speeds and loads"

    def law(self, values: Values) -> str:
        """The terms there are, in words."""
        *words, last = [word for names, word, _ in _TERMS if any(map(values.get, names))] or [
            "none"
        ]
        return f"{', '.join(words)} and {last}" if words else last

    def amounts_to(self, values: Values) -> tuple[str, ...]:
        """Effects of one term each that it is the sum of."""
        return tuple(
            effect for names, _, effect in _TERMS if effect and any(map(values.get, names))
        )

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert the law at the joint's side."""
        terms = {f"when_{n}" if n in ("driving", "driven") else n: v for n, v in shape.items()}
        element = Friction(name=self.name, **terms)
        return model.with_actuator(model.actuator(place[0]).with_output(element))


class WarmingFriction(Effect):
    """Dry and viscous friction that a joint loses per kelvin; a log with temperatures shows it."""

    name = "warming_friction"
    parameters: ClassVar = (
        Parameter("coulomb", "N*m/K", 0.0, 1e2, step=1e-3, required=False),
        Parameter("viscous", "N*m*s/(rad*K)", 0.0, 1e2, step=1e-3, required=False),
        Parameter("reference", "K", 100.0, 1000.0),
    )
    signature = "time"
    excitation = "repeats its first motion, both ways at several speeds, once the gears are warm"
    additive = True
    fixed: ClassVar = ("reference",)

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Joints whose temperature is measured."""
        return [] if m.temperature is None else super().places(model, m)

    def shapes(self, model: MachineModel, m: Measurement, place: Place) -> list[dict[str, float]]:
        """The mean temperature of the first log: what falls is counted from there."""
        return [{"reference": float(np.mean(_kelvin(m, place)))}]

    def shown(self, m: Measurement, place: Place, shape: Values) -> bool:
        """Whether the temperature leaves the reference by more than a sensor's steps."""
        if m.temperature is None or place[0] not in m.joints:
            return False
        return bool(np.max(np.abs(_kelvin(m, place) - shape["reference"])) >= _LEAST_WARMING)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Let the joint's friction fall."""
        return at_joint(model, place, warming=Warming(**x, **shape))


def _kelvin(m: Measurement, place: Place) -> np.ndarray:
    assert m.temperature is not None
    return m.temperature[:, m.joints.index(place[0])] + ZERO_CELSIUS
