"""A payload: mass at a link's centre of mass."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

MASS_TOLERANCE = 0.03  # of the link's mass, one standard deviation [1]


class LinkMass(Effect):
    """A point mass more at the link's centre of mass."""

    name = "link_mass"
    place_kind = "link"
    parameters: ClassVar = (Parameter("mass", "kg", -1e4, 1e4),)
    coordinates: ClassVar = (Coordinate("mass", 1e-2, signed=True),)
    signature = "position"
    is_tolerance = True
    excitation = "holds and moves the link in clearly different postures"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Every moving link; the base's own mass rests on measured feet unseen."""
        return [(link,) for link, joint in model.links.items() if felt(model, m, joint)]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add the mass."""
        joint = model.carrier(place[0])
        body = model.bodies.body(joint)
        changed = replace(body, payload=body.payload + x["mass"])
        return model.with_bodies(model.bodies.with_body(joint, changed))

    def absorbs(self, place: Place) -> tuple[tuple[str, str], ...]:
        """The link's own mass."""
        return (("mass", place[0]),)

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """Something of the link is left, and the payload is no multiple of the robot."""
        total = sum(i.mass for i in model.rigid.inertias)
        return bool(-0.9 * own_mass(model, place[0]) < x["mass"] < 2.0 * total)

    def tolerance(self, model: MachineModel, place: Place) -> dict[str, float]:
        """Three per cent of the link's mass."""
        return {"mass": MASS_TOLERANCE * own_mass(model, place[0])}


def own_mass(model: MachineModel, link: str) -> float:
    """Mass of a link in the robot file [kg]."""
    joint = model.rigid.getJointId(model.carrier(link))
    return float(model.rigid.inertias[joint].mass)


def felt(model: MachineModel, m: Measurement, joint: str) -> bool:
    """Whether joint torques feel the body at a joint at all."""
    floating = model.floating and model.rigid.getJointId(joint) == 1
    return not (floating and m.foot_force is not None and not np.isnan(m.foot_force).any())
