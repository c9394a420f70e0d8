"""Effects between motor and joint: elasticity, backlash, inertia, coupling of two joints."""

from dataclasses import replace
from typing import Final

import numpy as np

from actuators.elements.element import Friction, Inertia
from actuators.errors import LegwattError
from pipeline.effects.base import Coordinate, Effect, Form, Parameter, Place, Shapes, Size, Values
from pipeline.effects.friction import DRY, VISCOUS
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel

#: Wind-up of what a robot file calls rigid, one standard deviation [rad/(N*m)].
COMPLIANCE_TOLERANCE: Final = 1.2e-5
_SHARES: Final = (0.02, 0.1, 0.3, 1.0)  # of the joint's torque, at which a flank may be seated
_FULL: Final = 1.0  # a joint carried along by a bevel or a cable turns one to one
_LEAST_RATIO: Final = 0.1  # below it the shaft is the own joint's
_SOFT: Final = Size(1e-4, "", "harmonic drives have 1e4 N·m/rad (data sheets), belts less")
_PLAY: Final = Size(5e-3, "", "precision gears: an arc minute; hobby servos: half a degree")
_BENDING: Final = Form("compliance", lambda c: 1.0 / max(c, 1e-12), lambda k: 1.0 / k, False)
_STIFFNESS: Final = Parameter("stiffness", "N*m/rad", 1.0, 1e12, _SOFT, 1e-6, form=_BENDING)
_ROTOR: Final = Size(
    1.0, "torque/acceleration", "behind a high ratio a rotor takes all of a torque"
)
_CARRIED: Final = Size(1.0, "", "a joint carried along by a bevel or a cable turns one to one")


class JointElasticity(Effect):
    """A spring between motor and joint: one turns ahead of the other by torque / stiffness.

    Spong, J. Dyn. Sys. Meas. Control 109, 1987. With the encoder at the joint the motor's speed
    and acceleration follow; with the encoder at the motor the joint's do.
    """

    name = "joint_elasticity"
    parameters = (_STIFFNESS,)
    excitation = "changes its torque fast: accelerates, brakes and steps hard"
    adds = (("compliance", "compliance"),)
    unseen = "the motor's own motion differs by the wind-up only"


class Backlash(Effect):
    """Motor and joint lie half the width apart, on the side of the flank that carries.

    The motor leads by width / 2 tanh(torque / crossing) + torque / stiffness: a describing
    function of backlash with seated flanks (Nordin and Gutman, Automatica 38, 2002, treat backlash
    with elastic flanks). Below the crossing torque the joint floats between the flanks, where its
    place does not follow from the torque alone; the flanks give, and their stiffness comes with the
    width.
    """

    name = "backlash"
    parameters = (
        Parameter("width", "rad", 0.0, 1.0, _PLAY, step=1e-5),
        replace(_STIFFNESS, required=False),
        Parameter("crossing", "N*m", 0.0, 1e4),
    )
    excitation = "lets the torque change its sign often, slowly and fast"
    adds = (("width", "backlash"), ("compliance", "compliance"))
    unseen = "the motor's own motion differs by the gap only"

    def shapes(self, model: MachineModel, m: Log, place: Place) -> Shapes:
        """Crossing torques, as shares of what the joint's actuator gives on the whole."""
        actuator, channel = model.actuator(place[0]), m.channels[0]
        rows = m.effort[m.has_say, model.index(place[0]), 0]
        size = float(np.sqrt(np.nanmean(rows**2)))
        if channel != "torque" and actuator.motor is not None:  # transmission without loss
            resistance = float(np.asarray(actuator.motor.resistance))
            currents = {"current": size, "voltage": size / resistance}
            current = currents.get(channel, float(np.sqrt(size / resistance)))
            size = abs(actuator.ratio) * float(np.asarray(actuator.motor.torque_constant)) * current
        return [{"crossing": share * max(size, 1e-9)} for share in _SHARES]


class RotorInertia(Effect):
    """Inertia beyond the data sheet at the motor's shaft, which without a gear is the joint's."""

    name = "rotor_inertia"
    additive = True
    parameters = (Parameter("added", "kg*m^2", 0.0, 1e3, _ROTOR, step=1e-7),)
    excitation = "accelerates hard on an axis whose load does not change"
    of_drivetrain = True

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert it at the motor."""
        element = Inertia(self.name, x["added"])
        return model.with_actuator(model.actuator(place[0]).with_element(element, at_motor=True))


class TransmissionCoupling(Effect):
    """Motor angle = own joint + ratio x other joint; its torque acts on both.

    Where the model has no actuator, the inertia and friction of the shared shaft come with the
    coupling; where it has one, the ratio alone is missing.
    """

    name = "transmission_coupling"
    replaces = True
    place_kind = "joint pair"
    parameters = (
        Parameter("ratio", "1", -5.0, 5.0, _CARRIED, step=1e-3),
        Parameter("inertia", "kg*m^2", 0.0, 1e3, optional=True),
        Parameter("viscous", "N*m*s/rad", 0.0, 1e3, optional=True),
        Parameter("coulomb", "N*m", 0.0, 1e3, optional=True),
        Parameter("rise", "rad/s", 0.0, 1e4, optional=True),
        Parameter("travel", "rad", 0.0, 1.0, optional=True),
    )
    excitation = "moves one joint of the pair while the other stands still, then the other way"
    of_drivetrain = True
    driven = True  #: Whether it is that of joints with a motor in the model.

    def places(self, model: MachineModel, m: Log) -> list[Place]:
        """Motor of a joint with a neighbour on the same chain of links, neither coupled yet.

        Both move: the shaft of a joint at rest that is coupled is its neighbour's.
        """
        moves = np.quantile(np.abs(m.v), 0.98, axis=0) > m.rest_speed
        free = [
            a for a, own in zip(model.actuators, moves, strict=True) if own and not a.coupled_to
        ]
        at = {a.name: model.rigid.getJointId(a.name) for a in free}
        parent = {name: model.rigid.parents[k] for name, k in at.items()}
        return [
            (a.name, other)
            for a in free
            if (a.motor is not None) == self.driven
            for other in at
            if parent[a.name] == at[other] or parent[other] == at[a.name]
        ]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Couple them, by a shaft with inertia and friction where it has any."""
        if len(place) != 2 or place[0] == place[1]:
            raise LegwattError(f"transmission_coupling: place {place} must name two joints")
        joint = place[1]
        while joint:
            joint = model.actuator(joint).coupled_to
            if joint == place[0]:
                raise LegwattError(
                    f"transmission_coupling: {place[0]} and {place[1]} are coupled the other way"
                )
        values = {**x, **shape}
        actuator = replace(
            model.actuator(place[0]), coupled_to=place[1], coupling=values.pop("ratio")
        )
        shaft = [values.get(name, 0.0) for name in ("inertia", "viscous", "coulomb")]
        if not self.driven or any(shaft):  # a ratio alone comes with a shaft of nothing
            inertia = Inertia(name=f"{self.name}_inertia", inertia=values.pop("inertia", 0.0))
            friction = Friction(name=self.name, **values)
            actuator = actuator.with_element(friction).with_element(inertia)
        return model.with_actuator(actuator)


class BareCoupling(TransmissionCoupling):
    """The coupling of a machine whose model has no actuator yet: the shaft comes with it."""

    coordinates = (
        Coordinate("inertia", 1e-3, _ROTOR, required=False),
        Coordinate("viscous", 1e-2, VISCOUS, required=False),
        Coordinate("coulomb", 1e-2, DRY, required=False),
    )
    driven = False

    def shapes(self, model: MachineModel, m: Log, place: Place) -> Shapes:
        """One to one, in either sense."""
        return [{"ratio": _FULL}, {"ratio": -_FULL}]

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """With a ratio of next to nothing the shaft is the joint's own."""
        own = super().plausible(model, place, x, shape)
        return own and abs(shape["ratio"]) >= _LEAST_RATIO
