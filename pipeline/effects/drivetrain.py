"""Effects between joint and motor: friction, elasticity, backlash, inertia, coupled joints.

Laws of friction are rows of one table over the one law, `elements.element.Friction`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from actuators.elements.element import Element, Friction, Inertia
from actuators.elements.heating import Warming
from actuators.errors import LegwattError
from pipeline.effects.base import (
    EVERY,
    MORE,
    Coordinate,
    Effect,
    Form,
    Measured,
    Parameter,
    Place,
    Shapes,
    Size,
    Values,
)
from pipeline.machine.machine import MachineModel

_STRIBECK_SPEEDS: Final = (0.012, 0.025, 0.05, 0.1, 0.2, 0.4)  # [rad/s]
_LARGEST_STRIBECK_SPEED: Final = 0.5  # [rad/s]
#: A break-away that has gone below so many `rise` is the reversal's own shape, of which no more is
#: known than its width: at 2 dry friction has 95 % of its level.
_REVERSED: Final = 2.0
_LARGEST_EXCESS: Final = 3.0  # of break-away over Coulomb friction, in Coulomb friction
_ALL: Final = "friction takes 5 to 100 % of a geared joint's torque (arms and servos measured)"
DRY: Final = Size(1.0, "torque", _ALL)
VISCOUS: Final = Size(1.0, "torque/speed", _ALL)
_BREAK: Final = "break-away is up to half above (Armstrong et al., Automatica 30, 1994)"
_GEAR: Final = Size(0.1, "", "gears lose 5 to 30 % of the load (efficiencies in data sheets)")
_WARM: Final = "1 to 2 % per kelvin (Bittencourt, J. Dyn. Sys. Meas. Control 134, 2012)"
_THINNER: Final = Size(0.02, "torque/speed", _WARM)
#: Terms of the law that are forces, and those that are shares of the load.
_SHARES: Final = ("load", "when_driving", "when_driven")
_LEVELS: Final = (
    *("coulomb", "viscous", "skew", "excess", "asymmetry", "quadratic", "saturating"),
    *_SHARES,
)
#: The terms of the law, in the order in which model files have them.
_BY_TERM: Final = (
    Parameter("coulomb", "N*m", 0.0, 1e3, DRY, step=1e-2),
    Parameter("viscous", "N*m*s/rad", 0.0, 1e3, VISCOUS, step=1e-2),
    Parameter("excess", "N*m", 0.0, 1e3, Size(0.5, "torque", _BREAK), step=1e-2),
    Parameter("stribeck_speed", "rad/s", 1e-6, 1e4),
    Parameter("quadratic", "N*m*s^2/rad^2", 0.0, 1e3, Size(1.0, "torque/speed^2", _ALL), step=1e-2),
    Parameter("load", "1", 0.0, 0.99, _GEAR, step=1e-3),
    Parameter("driving", "1", 0.0, 10.0, _GEAR, step=1e-3),
    Parameter("driven", "1", 0.0, 0.99, _GEAR, step=1e-3),
    Parameter("rise", "rad/s", 0.0, 1e4, optional=True),
    Parameter("travel", "rad", 0.0, 1.0, optional=True),
)
TERMS: Final = {p.name: p for p in _BY_TERM}
_CALLED: Final = {"driving": "when_driving", "driven": "when_driven"}
#: How dry friction changes its sense at a reversal: of the joint, whatever the law.
REVERSAL: Final = ("rise", "travel")


class FrictionPreset(Effect):
    """Friction inserted at the joint's shaft: some terms of the law.

    Dry friction may come with how it changes its sense at a reversal, `REVERSAL`.

    Each parameter has a term, of `TERMS`; `velocity` is a Stribeck speed, and without the optional
    ones it is the effect still.
    """

    fixed = REVERSAL  #: Known before the search: see `pipeline.identification.offered.reversals`.
    of_drivetrain = True

    def __init__(
        self,
        name: str,
        terms: Mapping[str, str],
        excitation: str,
        optional: Sequence[str] = (),
        **about: Any,
    ) -> None:
        dry = {} if set(terms.values()) <= {"viscous", "quadratic"} else {t: t for t in REVERSAL}
        self.name, self.excitation, self.terms = name, excitation, {**terms, **dry}
        self.parameters = tuple(
            replace(TERMS[term], name=own, required=own not in optional)
            for own, term in self.terms.items()
        )
        self.coordinates = tuple(p.coordinate for p in self.parameters if p.step)
        self.replaces = any(_CALLED.get(t, t) in _SHARES for t in terms.values())
        vars(self).update(about)

    def shapes(self, model: MachineModel, m: Measured, place: Place) -> Shapes:
        """Stribeck speeds above where friction changes sign and below the fastest motion."""
        if "velocity" not in self.terms:
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
        terms = {self.terms[name]: value for name, value in {**x, **shape}.items()}
        law = Friction(self.name, **{_CALLED.get(t, t): value for t, value in terms.items()})
        return model.with_actuator(model.actuator(place[0]).with_element(law))


_BOTH: Final = "moves in both directions at several speeds"
_FAST: Final = "moves at clearly different speeds, the fastest near the limit"
for _row in (
    FrictionPreset("coulomb_friction", {"torque": "coulomb"}, _BOTH, additive=True),
    FrictionPreset("viscous_friction", {"coefficient": "viscous"}, _FAST, additive=True),
    FrictionPreset("quadratic_drag", {"quadratic": "quadratic"}, _FAST, additive=True),
    FrictionPreset(
        "stribeck_friction",
        {"coulomb": "coulomb", "excess": "excess", "velocity": "stribeck_speed"},
        "passes slowly through many speeds below the Stribeck speed",
        optional=["coulomb"],
        additive=True,
    ),
    FrictionPreset(
        "load_dependent_friction",
        {"share": "load"},
        "moves at one speed under clearly different loads, both ways",
    ),
    FrictionPreset(  # with a coefficient for each power quadrant
        "backdrive_loss",
        {"driving": "driving", "driven": "driven"},
        "raises and lowers clearly different loads",
        optional=["driving", "driven"],
    ),
):
    _row.enter()


class DirectionDependentFriction(Effect):
    """Dry friction with a level for each direction.

    Note:
        In motion it is Coulomb friction with a constant offset.
    """

    name = "direction_dependent_friction"
    additive = True
    parameters = (
        Parameter("positive", "N*m", 0.0, 1e3, DRY, step=1e-2),
        Parameter("negative", "N*m", 0.0, 1e3, DRY, step=1e-2),
        TERMS["rise"],
        TERMS["travel"],
    )
    excitation = "moves in both directions, with stops in between"
    fixed = REVERSAL
    of_drivetrain = True

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Insert friction at the joint's shaft."""
        mean, half = 0.5 * (x["positive"] + x["negative"]), 0.5 * (x["positive"] - x["negative"])
        law = Friction(name=self.name, coulomb=mean, skew=half, **shape)
        return model.with_actuator(model.actuator(place[0]).with_element(law))


def _factor(size: float, reason: str) -> Parameter:
    return Parameter("factor", "1", 0.0, 100.0, Size(size, "", reason), step=1e-3, form=MORE)


class FrictionFactor(Effect):
    """Friction that the files state, all of it times a factor: at all joints alike, or at one.

    What a data sheet assumed of a gear, or what an earlier log showed, where it has changed since.
    """

    name = "friction_factor"
    replaces = True
    parameters = (
        _factor(0.1, "temperature and load change friction by tenths (Bittencourt, 2012)"),
    )
    on_stated = True
    of_drivetrain = True
    excitation = "moves both ways at clearly different speeds and loads"
    terms: tuple[str, ...] = _LEVELS  #: Of the law that are multiplied.

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
        """Multiply every term."""
        factor = max(1.0 + x["more"], 0.0)
        for joint in model.joints if place == (EVERY,) else place[:1]:
            chain = model.actuator(joint)
            parts = ("elements", "output")
            rows = {n: [_times(e, factor, self.terms) for e in getattr(chain, n)] for n in parts}
            model = self.at_joint(model, (joint,), **{n: tuple(row) for n, row in rows.items()})
        return model


class GearLossFactor(FrictionFactor):
    """Friction by the load that the files state, times a factor: a gear of another efficiency."""

    name = "gear_loss_factor"
    parameters = (_factor(0.5, "efficiencies that sheets leave out are assumed by class"),)
    excitation = "moves at one speed under clearly different loads, both ways"
    terms = _SHARES


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
    replaces = True
    parameters = (
        Parameter("coulomb", "N*m/K", 0.0, 1e2, Size(0.02, "torque", _WARM), 1e-3, required=False),
        Parameter("viscous", "N*m*s/(rad*K)", 0.0, 1e2, _THINNER, 1e-3, required=False),
        Parameter("reference", "K", 100.0, 1000.0),
    )
    excitation = "repeats its first motion, both ways at several speeds, once the gears are warm"
    unseen = "friction is that of the temperature which its file states"
    additive = True

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

    coordinates = (
        Coordinate("inertia", 1e-3, _ROTOR, required=False),
        Coordinate("viscous", 1e-2, VISCOUS, required=False),
        Coordinate("coulomb", 1e-2, DRY, required=False),
    )
    driven = False

    def shapes(self, model: MachineModel, m: Measured, place: Place) -> Shapes:
        """One to one, in either sense."""
        return [{"ratio": _FULL}, {"ratio": -_FULL}]

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """With a ratio of next to nothing the shaft is the joint's own."""
        own = super().plausible(model, place, x, shape)
        return own and abs(shape["ratio"]) >= _LEAST_RATIO
