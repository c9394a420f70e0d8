"""A centre of mass that lies elsewhere than the robot file says."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.effects.bodies.link_mass import observable
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel


class CenterOfMassOffset(Effect):
    """Displacement of a link's centre of mass in the frame of its joint."""

    name = "center_of_mass_offset"
    additive = True
    place_kind = "link"
    parameters: ClassVar = tuple(Parameter(axis, "m", -0.5, 0.5) for axis in "xyz")
    coordinates: ClassVar = tuple(
        Coordinate(axis, 1e-3, signed=True, required=False) for axis in "xyz"
    )
    signature = "position"
    excitation = "holds the link in postures all around its axis"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Every moving link whose body the torques can show."""
        return [(link,) for link, joint in model.links.items() if observable(model, m, joint)]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Displace it."""
        joint = model.carrier(place[0])
        body = model.bodies.body(joint)
        moved = tuple(s + x[axis] for s, axis in zip(body.shift, "xyz", strict=True))
        changed = replace(body, shift=(moved[0], moved[1], moved[2]))
        return model.with_bodies(model.bodies.with_body(joint, changed))
