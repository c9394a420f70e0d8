"""The catalogue of effects, by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from actuators.errors import LegwattError, closest
from pipeline.effects import bodies, curves, friction, motor, sensors, transmission
from pipeline.effects.base import Effect
from pipeline.machine.machine import MachineModel

#: In the order in which they compete, and in which tables list them.
EFFECTS: Final[Mapping[str, Effect]] = {
    effect.name: effect
    for effect in (
        *friction.FRICTION,
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
#: Of machines without a motor; of logs with the motors' temperature.
_BARE_COUPLING, _SENSED_HEATING = transmission.BareCoupling(), motor.SensedHeating()


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
    return "a motion " + ", one ".join(f"that {EFFECTS[n].excitation} shows {n}" for n in each)


def catalogue(model: MachineModel) -> tuple[Effect, ...]:
    """Every effect in the form in which it competes for this machine."""
    forms = dict(EFFECTS)
    if any(a.motor is None for a in model.actuators):
        forms[_BARE_COUPLING.name] = _BARE_COUPLING
    # A log with the motors' temperature has places for the last one, any other for the plain one.
    return (*(effect for effect in forms.values() if effect.competes), _SENSED_HEATING)
