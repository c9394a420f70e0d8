"""What every machine differs in from its files without being an effect of the catalogue.

They have an effect's name, coordinates and edit, stay in every estimate and are never a name by
themselves; bodies are told together, as ten parameters a link.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import Coordinate, Place
from pipeline.machine.machine import Bodies, MachineModel, changed_model, strained_parameters

#: Coordinates of a body (`bodies.strained`) and their standard deviation at a scale of one: a
#: rotation of the axes in which a body is measured leaves this as it is. A radius of gyration has
#: half the uncertainty of the moment of inertia.
STRAINS: Final = {
    **dict.fromkeys(("xx", "yy", "zz"), 0.5),
    "mass": 1.0,
    **dict.fromkeys(("xy", "xz", "yz"), 0.5 * 0.5**0.5),
    **dict.fromkeys(("x", "y", "z"), 0.5**0.5),
}


class Tolerance:
    """A coordinate of the machine itself."""

    name: str
    coordinates: tuple[Coordinate, ...] = (Coordinate("relative", 1e-3, signed=True),)

    def edit(
        self, model: MachineModel, place: Place, x: Mapping[str, float], shape: Mapping[str, float]
    ) -> MachineModel:
        """The machine with more of it."""
        raise NotImplementedError


class BodyStrain(Tolerance):
    """A link's body stretched, moved and made heavier, so that it stays one that can be."""

    name = "rigid_body_parameters"
    coordinates = tuple(Coordinate(name, 1e-3, signed=True) for name in STRAINS)

    def edit(
        self, model: MachineModel, place: Place, x: Mapping[str, float], shape: Mapping[str, float]
    ) -> MachineModel:
        """Strain it further."""
        joint = model.carrier(place[0])
        body = model.bodies.body(joint)
        now = body.strain or (0.0,) * len(STRAINS)
        more = tuple(a + x[name] for a, name in zip(now, STRAINS, strict=True))
        return model.with_bodies(model.bodies.with_body(joint, replace(body, strain=more)))


def inertial(model: MachineModel, link: str) -> Callable[[Array], Array]:
    """The ten inertial parameters of a link's body in a model by its strains, each (..., 10)."""
    joint = model.carrier(link)
    bare = replace(model.bodies.body(joint), strain=())
    rigid = changed_model(model.robot.model, Bodies(((joint, bare),)))
    ten = np.asarray(rigid.inertias[rigid.getJointId(joint)].toDynamicParameters())
    return lambda x: strained_parameters(ten, x)


def slope(law: Callable[[Array], Array], x: Array) -> Array:
    """Change of what follows from some numbers by each of them, central differences, (m, n)."""
    steps = 1e-4 * np.eye(x.size)
    return np.asarray((law(x + steps) - law(x - steps)).T / 2e-4)


class Resistance(Tolerance):
    """Of a winding."""

    name = "resistance"
    replaces = True

    def edit(
        self, model: MachineModel, place: Place, x: Mapping[str, float], shape: Mapping[str, float]
    ) -> MachineModel:
        """Scale it."""
        actuator = model.actuator(place[0])
        assert actuator.motor is not None
        value = float(np.asarray(actuator.motor.resistance)) * max(1.0 + x["relative"], 0.1)
        motor = replace(actuator.motor, resistance=value)
        return model.with_actuator(replace(actuator, motor=motor))


class Slope(Tolerance):
    """One nonlinear parameter of a name that stands: what moves with it, at its value."""

    name = "slope"

    def __init__(self, effect: str, parameter: str, step: float) -> None:
        self.effect, self.parameter = effect, parameter
        self.coordinates = (Coordinate(parameter, step, signed=True),)
