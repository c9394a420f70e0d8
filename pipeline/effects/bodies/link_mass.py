"""A payload: a point mass at a link's centre of mass, or anywhere else on it."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Final

import numpy as np

from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.effects.bodies.rigid_body_parameters import NAMES
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

#: Where a payload is in the frame of its link's joint.
AXES: Final = ("x", "y", "z")
FARTHEST: Final = 10.0  # [m]


class LinkMass(Effect):
    """A point mass more, at the link's centre of mass or where it is said to be."""

    name = "link_mass"
    additive = True
    place_kind = "link"
    parameters: ClassVar = (
        Parameter("mass", "kg", -1e4, 1e4),
        *(Parameter(axis, "m", -FARTHEST, FARTHEST, optional=True) for axis in AXES),
    )
    coordinates: ClassVar[tuple[Coordinate, ...]] = (Coordinate("mass", 1e-2, signed=True),)
    signature = "position"
    excitation = "holds and moves the link in clearly different postures"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Every moving link; the base's own mass rests on measured feet unseen."""
        return [(link,) for link, joint in model.links.items() if observable(model, m, joint)]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add the mass."""
        joint = model.carrier(place[0])
        body = model.bodies.body(joint)
        if any(axis in shape for axis in AXES):
            centre = np.array([shape.get(axis, 0.0) for axis in AXES])
            return carrying(model, joint, point_mass(x["mass"], centre))
        changed = replace(body, payload=body.payload + x["mass"])
        return model.with_bodies(model.bodies.with_body(joint, changed))

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """Something of the link is left, and the payload is within reach and no second robot."""
        if max((abs(shape.get(axis, 0.0)) for axis in AXES), default=0.0) > FARTHEST:
            return False
        total = sum(i.mass for i in model.rigid.inertias)
        return bool(-0.9 * own_mass(model, place[0]) < x["mass"] < 2.0 * total)


class AddedBody:
    """Ten inertial parameters more at a link, in which joint torques are linear."""

    coordinates: ClassVar = tuple(Coordinate(name, 1e-2, signed=True) for name in NAMES)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add them."""
        return carrying(model, model.carrier(place[0]), np.array([x[n] for n in NAMES]))


def last_links(model: MachineModel) -> list[str]:
    """Links that carry no other."""
    carriers = {link: model.rigid.getJointId(joint) for link, joint in model.links.items()}
    inner = {int(p) for k, p in enumerate(model.rigid.parents) if k in carriers.values()}
    return [link for link, k in carriers.items() if k not in inner]


def point_mass(mass: float, place: np.ndarray) -> np.ndarray:
    """Ten inertial parameters of a point mass [kg] at a place (3,) [m]."""
    turning = mass * (place @ place * np.eye(3) - np.outer(place, place))
    return np.array([mass, *(mass * place), *turning[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]])


def carrying(model: MachineModel, joint: str, more: np.ndarray) -> MachineModel:
    """A machine whose body at a joint carries ten inertial parameters more."""
    body = model.bodies.body(joint)
    carried = tuple((np.array(body.carried or (0.0,) * len(more)) + more).tolist())
    return model.with_bodies(model.bodies.with_body(joint, replace(body, carried=carried)))


def own_mass(model: MachineModel, link: str) -> float:
    """Mass of a link in the robot file [kg]."""
    joint = model.rigid.getJointId(model.carrier(link))
    return float(model.rigid.inertias[joint].mass)


def observable(model: MachineModel, m: Measurement, joint: str) -> bool:
    """Whether joint torques depend on the body at a joint at all."""
    floating = model.floating and model.rigid.getJointId(joint) == 1
    return not (floating and m.foot_force is not None and not np.isnan(m.foot_force).any())
