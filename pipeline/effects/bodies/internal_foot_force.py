"""Feet that squeeze the ground: tangential forces above the least ones."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel


class InternalFootForce(Effect):
    """A lateral force pair between the standing feet of either side; positive spreads the feet."""

    name = "internal_foot_force"
    additive = True
    place_kind = "ground"
    parameters: ClassVar = (Parameter("lateral", "N", -1e5, 1e5),)
    coordinates: ClassVar = (Coordinate("lateral", 1.0, signed=True),)
    signature = "support"
    excitation = "stands on different sets of feet, with tangential forces measured"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """The ground under a walking robot whose tangential forces are not measured."""
        sensed = m.foot_force is not None and not np.isnan(m.foot_force).any()
        return [("ground",)] if model.floating and not sensed else []

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Squeeze further."""
        squeeze = model.bodies.squeeze + x["lateral"]
        return model.with_bodies(replace(model.bodies, squeeze=squeeze))
