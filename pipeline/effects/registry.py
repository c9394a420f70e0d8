"""The catalogue of effects, by name: every module of effects is imported here."""

from __future__ import annotations

from typing import Final

from pipeline.effects import bodies, friction, motor, sensors, transmission, unnamed
from pipeline.effects.base import EFFECTS, Effect, effect_named
from pipeline.machine.machine import MachineModel

__all__ = ["EFFECTS", "catalogue", "effect_named", "told_apart"]

#: Classes enter the catalogue as they are declared; whatever is imported first, it has this order.
_MODULES: Final = (friction, transmission, bodies, motor, sensors, unnamed)
_ORDER: Final = [module.__name__ for module in _MODULES]
for _name in sorted(EFFECTS, key=lambda name: _ORDER.index(type(EFFECTS[name]).__module__)):
    EFFECTS[_name] = EFFECTS.pop(_name)


def told_apart(*names: str) -> str:
    """Which motion shows each of some effects that a log cannot tell apart, in words."""
    each = dict.fromkeys(names)  # one effect at two places has one motion
    return "a motion " + ", one ".join(f"that {EFFECTS[n].excitation} shows {n}" for n in each)


def catalogue(model: MachineModel) -> tuple[Effect, ...]:
    """Every effect in the form in which it competes for this machine."""
    forms = dict(EFFECTS)
    if any(a.motor is None for a in model.actuators):
        bare = transmission.BareCoupling()
        forms[bare.name] = bare
    # A log with the motors' temperature has places for the last one, any other for the plain one.
    competing = (effect for effect in forms.values() if effect.competes)
    return (*competing, motor.SensedHeating())
