"""The catalogue of effects, by name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from actuators.errors import LegwattError, closest
from pipeline.effects import bodies, curves, friction, motor, sensors, transmission
from pipeline.effects.base import Effect
from pipeline.machine.machine import MachineModel

EFFECTS: Final[Mapping[str, Effect]] = MappingProxyType(
    {
        effect.name: effect
        for effect in (
            friction.CoulombFriction(),
            friction.ViscousFriction(),
            friction.QuadraticDrag(),
            friction.StribeckFriction(),
            friction.LoadDependentFriction(),
            friction.DirectionDependentFriction(),
            friction.BackdriveLoss(),
            friction.JointFrictionLaw(),
            friction.WarmingFriction(),
            curves.FrictionCurveEffect(),
            curves.PositionCurveEffect(),
            transmission.RotorInertia(),
            bodies.RigidBodyParameters(),
            bodies.LinkMass(),
            bodies.CenterOfMassOffset(),
            bodies.BaseTilt(),
            transmission.JointElasticity(),
            transmission.Backlash(),
            motor.TorqueRipple(),
            transmission.TransmissionCoupling(),
            motor.ParallelSpring(),
            motor.TorqueConstantError(),
            motor.WindingHeating(),
            sensors.EffortOffset(),
            sensors.EffortGain(),
            sensors.PositionOffset(),
            sensors.TimeDelay(),
            bodies.InternalFootForce(),
        )
    }
)
_BARE_COUPLING: Final = transmission.BareCoupling()
_SENSED_HEATING: Final = motor.SensedHeating()


def effect_named(name: str) -> Effect:
    """An effect of the catalogue.

    Raises:
        LegwattError: Unknown name; the message offers the closest one.
    """
    if name not in EFFECTS:
        raise LegwattError(f"no effect '{name}'; {closest(name, list(EFFECTS))}")
    return EFFECTS[name]


def told_apart(*names: str) -> str:
    """Which motion shows each of some effects that a log cannot tell apart, in words."""
    each = dict.fromkeys(names)  # one effect at two places has one motion
    shown = [f"that {effect_named(name).excitation} shows {name}" for name in each]
    return f"a motion {', one '.join(shown)}"


def catalogue(model: MachineModel) -> tuple[Effect, ...]:
    """Every effect in the form in which it competes for this machine."""
    bare = any(a.motor is None for a in model.actuators)
    effects = [
        _BARE_COUPLING if bare and e.name == _BARE_COUPLING.name else e
        for e in EFFECTS.values()
        if e.competes
    ]
    # A log with the motors' temperature has places for this one, any other for the plain one.
    return (*effects, _SENSED_HEATING)
