"""Effects between joint and motor: friction, elasticity, backlash, inertia, coupled joints.

Laws of friction are rows of `effects.csv` over the one law, `elements.element.Friction`. Elasticity
is a spring between motor and joint, one of which turns ahead of the other by torque / stiffness
(Spong, J. Dyn. Sys. Meas. Control 109, 1987): with the encoder at the joint the motor's speed and
acceleration follow, with the encoder at the motor the joint's do.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from actuators.elements.element import Element, Friction, Inertia
from actuators.elements.heating import Warming
from actuators.errors import LegwattError
from pipeline.effects.base import EVERY, Effect, Measured, Place, Shapes, Values
from pipeline.machine.machine import MachineModel

_STRIBECK_SPEEDS: Final = (0.012, 0.025, 0.05, 0.1, 0.2, 0.4)  # [rad/s]
_LARGEST_STRIBECK_SPEED: Final = 0.5  # [rad/s]
#: A break-away that has gone below so many `rise` is the reversal's own shape, of which no more is
#: known than its width: at 2 dry friction has 95 % of its level.
_REVERSED: Final = 2.0
_LARGEST_EXCESS: Final = 3.0  # of break-away over Coulomb friction, in Coulomb friction
#: Terms of the law that are shares of the load.
_SHARES: Final = ("load", "when_driving", "when_driven")
#: How dry friction changes its sense at a reversal: of the joint, whatever the law.
REVERSAL: Final = ("rise", "travel")


class FrictionLaw(Effect):
    """Friction inserted at the joint's shaft: some terms of the law.

    Dry friction may come with how it changes its sense at a reversal, `REVERSAL`. `velocity` is a
    Stribeck speed.
    """

    name = "friction"
    fixed = REVERSAL  #: Known before the search: see `pipeline.identification.offered.reversals`.

    def shapes(self, model: MachineModel, m: Measured, place: Place) -> Shapes:
        """Stribeck speeds above where friction changes sign and below the fastest motion."""
        if "velocity" not in self.acts:
            return [{}]
        k = model.index(place[0])
        slowest, fastest = 1.5 * float(m.rest_speed[k]), 0.6 * float(m.fast[k])
        return [{"velocity": s} for s in _STRIBECK_SPEEDS if slowest <= s <= fastest]

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """A Stribeck speed beyond the reversal, break-away at most four times Coulomb's level."""
        least = _REVERSED * shape.get("rise", 0.0)
        slow = least <= shape.get("velocity", least) < _LARGEST_STRIBECK_SPEED
        small = x.get("excess", 0.0) <= _LARGEST_EXCESS * x.get("coulomb", np.inf)
        return slow and small and super().plausible(model, place, x, shape)

    def known(self, values: Values, spread: Values) -> float:
        """That of the force that is known worst."""
        forces = [c.name for c in self.coordinates if values[c.name] > 0.0]
        return max((spread[name] / values[name] for name in forces), default=0.0)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert it."""
        terms = {self.acts[name]: value for name, value in {**x, **shape}.items()}
        law = Friction(self.name, **terms)
        return model.with_actuator(model.actuator(place[0]).with_element(law))


class DirectionDependentFriction(Effect):
    """Dry friction with a level for each direction.

    Note:
        In motion it is Coulomb friction with a constant offset.
    """

    name = "direction_dependent_friction"
    fixed = REVERSAL

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert friction at the joint's shaft."""
        mean, half = 0.5 * (x["positive"] + x["negative"]), 0.5 * (x["positive"] - x["negative"])
        law = Friction(name=self.name, coulomb=mean, skew=half, **shape)
        return model.with_actuator(model.actuator(place[0]).with_element(law))


class FrictionFactor(Effect):
    """Friction that the files state, some of its terms times a factor: at all joints, or at one.

    What a data sheet assumed of a gear, or what an earlier log showed, where it has changed since;
    by the load alone, a gear of another efficiency.
    """

    name = "factor"

    @property
    def terms(self) -> list[str]:
        """Of the law that are multiplied."""
        return self.acts["more"].split()

    def places(self, model: MachineModel, m: Measured) -> list[Place]:
        """All joints together, then each, as far as files state friction there."""
        rubbing: list[Place] = [
            (a.name,)
            for a in model.actuators
            for rows in [(*a.output, *a.elements)]
            if any(np.any(getattr(e, t, 0.0)) for e in rows for t in self.terms)
        ]
        return [(EVERY,), *rubbing] if len(rubbing) > 1 else rubbing

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Multiply the terms."""
        factor, terms = max(1.0 + x["more"], 0.0), self.terms
        for joint in model.joints if place == (EVERY,) else place[:1]:
            chain = model.actuator(joint)
            parts = ("elements", "output")
            rows = {n: [_times(e, factor, terms) for e in getattr(chain, n)] for n in parts}
            model = self.at_joint(model, (joint,), **{n: tuple(row) for n, row in rows.items()})
        return model


def _times(element: Element, factor: float, of: Sequence[str]) -> Element:
    """Terms of friction times a factor; those of a load at most to where none could drive it."""
    if not isinstance(element, Friction):
        return element
    terms = {n: np.multiply(getattr(element, n), factor) for n in of}
    most = 0.99 / np.maximum(np.add(element.load, element.when_driven), 1e-9)
    share = min(factor, float(np.min(most)))
    terms |= {n: np.multiply(getattr(element, n), share) for n in _SHARES}
    return replace(element, **terms)


class WarmingFriction(Effect):
    """Dry and viscous friction that a joint loses per kelvin; a log with temperatures shows it."""

    name = "warming_friction"

    def places(self, model: MachineModel, m: Measured) -> list[Place]:
        """Joints whose temperature is measured."""
        return [] if m.kelvin is None else super().places(model, m)

    def shapes(self, model: MachineModel, m: Measured, place: Place) -> Shapes:
        """The mean temperature of the first log: what falls is counted from there."""
        assert m.kelvin is not None
        return [{"reference": float(m.kelvin[model.index(place[0])])}]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Let the joint's friction fall."""
        return self.at_joint(model, place, warming=Warming(**x, **shape))


#: Wind-up of what a robot file calls rigid, one standard deviation [rad/(N*m)].
COMPLIANCE_TOLERANCE: Final = 1.2e-5
_SEATED: Final = (0.02, 0.1, 0.3, 1.0)  # of the joint's torque, at which a flank may be seated
_FULL: Final = 1.0  # a joint carried along by a bevel or a cable turns one to one
_LEAST_RATIO: Final = 0.1  # below it the shaft is the own joint's


class Backlash(Effect):
    """Motor and joint lie half the width apart, on the side of the flank that carries.

    The motor leads by width / 2 tanh(torque / crossing) + torque / stiffness: a describing
    function of backlash with seated flanks (Nordin and Gutman, Automatica 38, 2002, treat backlash
    with elastic flanks). Below the crossing torque the joint floats between the flanks, where its
    place does not follow from the torque alone; the flanks give, and their stiffness comes with the
    width.
    """

    name = "backlash"

    def shapes(self, model: MachineModel, m: Measured, place: Place) -> Shapes:
        """Crossing torques, as shares of what the joint's actuator gives on the whole."""
        actuator, channel = model.actuator(place[0]), m.channels[0]
        size = float(m.effort[model.index(place[0])])
        if channel != "torque" and actuator.motor is not None:  # transmission without loss
            resistance = float(np.asarray(actuator.motor.resistance))
            currents = {"current": size, "voltage": size / resistance}
            current = currents.get(channel, float(np.sqrt(size / resistance)))
            size = abs(actuator.ratio) * float(np.asarray(actuator.motor.torque_constant)) * current
        return [{"crossing": share * max(size, 1e-9)} for share in _SEATED]


class RotorInertia(Effect):
    """Inertia beyond the data sheet at the motor's shaft, which without a gear is the joint's."""

    name = "rotor_inertia"

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
    fits: tuple[str, ...] = ("ratio",)
    driven = True  #: Whether it is that of joints with a motor in the model.

    def places(self, model: MachineModel, m: Measured) -> list[Place]:
        """Motor of a joint with a neighbour on the same chain of links, neither coupled yet.

        Both move: the shaft of a joint at rest that is coupled is its neighbour's.
        """
        moves = m.fast > m.rest_speed
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

    fits = ("inertia", "viscous", "coulomb")
    driven = False

    def shapes(self, model: MachineModel, m: Measured, place: Place) -> Shapes:
        """One to one, in either sense."""
        return [{"ratio": _FULL}, {"ratio": -_FULL}]

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """With a ratio of next to nothing the shaft is the joint's own."""
        own = super().plausible(model, place, x, shape)
        return own and abs(shape["ratio"]) >= _LEAST_RATIO
