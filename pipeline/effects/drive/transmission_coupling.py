"""A motor that also turns with another joint."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from actuators.elements.friction import Friction
from actuators.elements.inertia import Inertia
from pipeline.effects.base import Coordinate, Effect, Parameter, Place, Values
from pipeline.logs.errors import EffectError
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.joint import JointModel
from pipeline.machine.machine import MachineModel

_FULL = 1.0  # a joint carried along by a bevel or a cable turns one to one
_LEAST_RATIO = 0.1  # below it the shaft is the own joint's


class TransmissionCoupling(Effect):
    """Motor angle = own joint + ratio x other joint; its torque acts on both.

    Where the model has no actuator, the inertia and friction of the shared shaft come with the
    coupling; where it has one, the ratio alone is missing.
    """

    name = "transmission_coupling"
    place_kind = "joint pair"
    parameters: ClassVar = (
        Parameter("ratio", "1", -5.0, 5.0),
        Parameter("inertia", "kg*m^2", 0.0, 1e3),
        Parameter("viscous", "N*m*s/rad", 0.0, 1e3),
        Parameter("coulomb", "N*m", 0.0, 1e3),
        Parameter("rise", "rad/s", 0.0, 1e4, optional=True),
        Parameter("travel", "rad", 0.0, 1.0, optional=True),
    )
    coordinates: ClassVar[tuple[Coordinate, ...]] = (Coordinate("ratio", 1e-3, signed=True),)
    signature = "velocity of the other joint"
    excitation = "moves one joint of the pair while the other stands still, then the other way"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Motor of a joint with a neighbour on the same chain of links."""
        out: list[Place] = []
        for a in model.actuators:
            if a.coupled_to or not _carries(a):
                continue
            out += [(a.name, other) for other in free_neighbours(model, a.name)]
        return out

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Couple them."""
        _refuse_circle(model, place)
        actuator = replace(model.actuator(place[0]), coupled_to=place[1], coupling=x["ratio"])
        if any(shape.values()):  # a written ratio alone comes with a shaft of nothing
            actuator = with_shaft(actuator, shape)
        return model.with_actuator(actuator)

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Ratio, and nothing more at the shaft."""
        return {"inertia": 0.0, "viscous": 0.0, "coulomb": 0.0, **shape, **x}


class BareCoupling(TransmissionCoupling):
    """The coupling of a machine whose model has no actuator yet: the shaft comes with it."""

    coordinates: ClassVar[tuple[Coordinate, ...]] = (
        Coordinate("inertia", 1e-3, required=False),
        Coordinate("viscous", 1e-2, required=False),
        Coordinate("coulomb", 1e-2, required=False),
    )

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """Neighbours on the same chain of links."""
        return [
            (a.name, other)
            for a in model.actuators
            if a.motor is None and not a.coupled_to
            for other in free_neighbours(model, a.name)
        ]

    def shapes(self, model: MachineModel, m: Measurement, place: Place) -> list[dict[str, float]]:
        """One to one, in either sense."""
        return [{"ratio": _FULL}, {"ratio": -_FULL}]

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """With a ratio of next to nothing the shaft is the joint's own."""
        own = super().plausible(model, place, x, shape)
        return own and abs(shape["ratio"]) >= _LEAST_RATIO

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Couple them by a shaft with inertia and friction."""
        actuator = replace(model.actuator(place[0]), coupled_to=place[1], coupling=shape["ratio"])
        return model.with_actuator(with_shaft(actuator, x))


def _refuse_circle(model: MachineModel, place: Place) -> None:
    if len(place) != 2 or place[0] == place[1]:
        raise EffectError(f"transmission_coupling: place {place} must name two joints")
    joint, seen = place[1], {place[0]}
    while joint:
        if joint in seen:
            raise EffectError(
                f"transmission_coupling: {place[0]} and {place[1]} are coupled the other way"
            )
        seen.add(joint)
        joint = model.actuator(joint).coupled_to


def with_shaft(actuator: JointModel, values: Values) -> JointModel:
    """An actuator with inertia and friction at its shaft."""
    name = TransmissionCoupling.name
    dry = {key: values.get(key, 0.0) for key in ("coulomb", "viscous", "rise", "travel")}
    actuator = actuator.with_element(Friction(name=name, **dry))
    return actuator.with_element(Inertia(name=f"{name}_inertia", inertia=values["inertia"]))


def _carries(actuator: JointModel) -> bool:
    return actuator.motor is not None


def free_neighbours(model: MachineModel, joint: str) -> list[str]:
    """Neighbours whose own motors do not turn with other joints."""
    return [n for n in neighbours(model, joint) if not model.actuator(n).coupled_to]


def neighbours(model: MachineModel, joint: str) -> list[str]:
    """Joints before and behind a joint on the same chain of links."""
    rigid = model.rigid
    own = rigid.getJointId(joint)
    out = []
    for other in model.joints:
        k = rigid.getJointId(other)
        if rigid.parents[own] == k or rigid.parents[k] == own:
            out.append(other)
    return out
