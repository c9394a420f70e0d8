"""All friction of a joint in one law, its terms fitted together."""

from __future__ import annotations

from typing import ClassVar, Final

from actuators.elements.friction import Friction
from pipeline.effects.base import Effect, Parameter, Place, Values
from pipeline.machine.machine import MachineModel

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
    """Friction of a joint whose law is a sum of named terms, at the joint's own side.

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
    coordinates: ClassVar = ()
    competes: ClassVar = False
    excitation = "moves both ways at many speeds and loads"

    def law(self, values: Values) -> str:
        """The terms there are, in words."""
        words = [word for names, word, _ in _TERMS if any(map(values.get, names))]
        return _listed(words) if words else "none"

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


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
