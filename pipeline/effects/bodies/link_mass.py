"""A payload: a point mass at a link's centre of mass, or anywhere else on it."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Final

import numpy as np

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

MASS_TOLERANCE = 0.03  # of the link's mass, one standard deviation [1]
#: Where a payload is in the frame of its link's joint.
AXES: Final = ("x", "y", "z")
FARTHEST: Final = 10.0  # [m]


class LinkMass(Effect):
    """A point mass more, at the link's centre of mass or where it is said to be."""

    name = "link_mass"
    place_kind = "link"
    parameters: ClassVar = (
        Parameter("mass", "kg", -1e4, 1e4),
        *(Parameter(axis, "m", -FARTHEST, FARTHEST, optional=True) for axis in AXES),
    )
    coordinates: ClassVar[tuple[Coordinate, ...]] = (Coordinate("mass", 1e-2, signed=True),)
    signature = "position"
    is_tolerance = True
    kinds_absorbed: ClassVar[tuple[str, ...]] = ("mass",)
    excitation = "holds and moves the link in clearly different postures"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Every moving link; the base's own mass rests on measured feet unseen."""
        return [(link,) for link, joint in model.links.items() if felt(model, m, joint)]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add the mass."""
        joint = model.carrier(place[0])
        body = model.bodies.body(joint)
        if any(axis in shape for axis in AXES):
            mass = x["mass"]
            far = [mass * shape.get(axis, 0.0) for axis in AXES]
            return carrying(model, joint, (mass, far[0], far[1], far[2]))
        changed = replace(body, payload=body.payload + x["mass"])
        return model.with_bodies(model.bodies.with_body(joint, changed))

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """Something of the link is left, and the payload is no multiple of the robot."""
        total = sum(i.mass for i in model.rigid.inertias)
        return bool(-0.9 * own_mass(model, place[0]) < x["mass"] < 2.0 * total)

    def tolerance(self, model: MachineModel, place: Place) -> dict[str, float]:
        """Three per cent of the link's mass; nothing where a log has shown it."""
        if place[0] in model.identified:
            return {}
        return {"mass": MASS_TOLERANCE * own_mass(model, place[0])}


class PlacedPayload(LinkMass):
    """A payload at the end of a chain of links, its place not known: linear in m and m c."""

    coordinates: ClassVar[tuple[Coordinate, ...]] = (
        Coordinate("mass", 1e-2),
        *(Coordinate(f"m{axis}", 1e-3, signed=True, required=False) for axis in AXES),
    )
    kinds_absorbed: ClassVar[tuple[str, ...]] = ("mass", "com_x", "com_y", "com_z")

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Last links."""
        carriers = {model.rigid.getJointId(joint) for joint in model.links.values()}
        inner = {int(p) for k, p in enumerate(model.rigid.parents) if k in carriers}
        ids = {link: model.rigid.getJointId(joint) for link, joint in model.links.items()}
        return [p for p in super().places(model, m) if ids[p[0]] not in inner]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add the mass and its moments."""
        moments = (x["mass"], x["mx"], x["my"], x["mz"])
        return carrying(model, model.carrier(place[0]), moments)

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Mass and place."""
        mass = x["mass"]
        far = {axis: x[f"m{axis}"] / mass if mass else 0.0 for axis in AXES}
        return {"mass": mass, **{axis: min(max(v, -1e6), 1e6) for axis, v in far.items()}}

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """No multiple of the robot, and within reach."""
        far = max(abs(self.physical(x, shape)[axis]) for axis in AXES)
        return super().plausible(model, place, x, shape) and far <= FARTHEST


def carrying(
    model: MachineModel, joint: str, more: tuple[float, float, float, float]
) -> MachineModel:
    """A machine whose body at a joint carries a point mass more, by mass and first moments."""
    body = model.bodies.body(joint)
    first, x, y, z = (a + b for a, b in zip(body.carried, more, strict=True))
    return model.with_bodies(model.bodies.with_body(joint, replace(body, carried=(first, x, y, z))))


def own_mass(model: MachineModel, link: str) -> float:
    """Mass of a link in the robot file [kg]."""
    joint = model.rigid.getJointId(model.carrier(link))
    return float(model.rigid.inertias[joint].mass)


def felt(model: MachineModel, m: Measurement, joint: str) -> bool:
    """Whether joint torques feel the body at a joint at all."""
    floating = model.floating and model.rigid.getJointId(joint) == 1
    return not (floating and m.foot_force is not None and not np.isnan(m.foot_force).any())
