"""What every machine differs in from its files: tolerances that are always estimated.

Each is free within its stated standard deviation, a Gaussian prior; an effect of the same kind is
named where that costs more than the name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from actuators.elements.element import Friction
from pipeline.effects.base import observable
from pipeline.effects.motor import CONSTANT_TOLERANCE
from pipeline.effects.sensors import ENCODER_TOLERANCE, SKEW_TOLERANCE
from pipeline.effects.transmission import COMPLIANCE_TOLERANCE
from pipeline.identification.regression.design_matrix import DataSet, of_own_leg
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction
from pipeline.simulation.rigid_bodies import legs_are_separate

#: Entries of a body's strain (`rigid_bodies.strained`) and their standard deviation at an
#: uncertainty of 1 of the URDF: a rotation of the axes in which a body is measured leaves this as
#: it is. A radius of gyration has half the uncertainty of the moment of inertia.
STRAINS: Final = {
    **dict.fromkeys(("xx", "yy", "zz"), 0.5),
    "mass": 1.0,
    **dict.fromkeys(("xy", "xz", "yz"), 0.5 * 0.5**0.5),
    **dict.fromkeys(("x", "y", "z"), 0.5**0.5),
}
#: Uncertainty of the URDF in which strains are counted [1].
UNCERTAINTY: Final = 0.01
#: Of a winding, where its file states no wider interval [1].
RESISTANCE_TOLERANCE: Final = 0.02
#: Friction that the actuator's files state already [1].
FRICTION_TOLERANCE: Final = 0.005
#: Zero of an effort sensor, in standard deviations of its noise inside the bandwidth.
OFFSET_SIGMAS: Final = 0.75


@dataclass(frozen=True)
class Nuisance:
    """One tolerance of one part of the machine."""

    #: One of `STRAINS` (of a link's body), ``"torque_constant"``, ``"resistance"``, ``"friction"``
    #: (of the files), ``"encoder"``, ``"effort_zero"``, ``"compliance"`` or ``"skew"`` (of all
    #: effort channels).
    kind: str
    place: str  #: Link or joint.
    sigma: float  #: Standard deviation before the log was seen.
    unit: str  #: Of it.

    @property
    def lowest(self) -> float:
        """Least value that makes sense: what scales a mass or a constant leaves a tenth of it."""
        return -0.9 if self.unit == "1" else -np.inf

    def edit(self, model: MachineModel, value: float) -> MachineModel:
        """The machine with this tolerance at a value."""
        if self.kind in STRAINS:
            joint = model.carrier(self.place)
            body = model.bodies.body(joint)
            strain = list(body.strain or (0.0,) * len(STRAINS))
            strain[list(STRAINS).index(self.kind)] += value
            body = replace(body, strain=tuple(strain))
            return model.with_bodies(model.bodies.with_body(joint, body))
        if self.kind == "skew":
            late = tuple(replace(a, delay=a.delay + value) for a in model.actuators)
            return replace(model, actuators=late)
        actuator = model.actuator(self.place)
        if self.kind == "encoder":
            changed = replace(actuator, encoder_offset=actuator.encoder_offset + value)
        elif self.kind == "compliance":
            changed = replace(actuator, compliance=actuator.compliance + value)
        elif self.kind == "friction":
            elements = tuple(
                replace(e, coulomb=e.coulomb * (1.0 + value), viscous=e.viscous * (1.0 + value))
                if isinstance(e, Friction)
                else e
                for e in actuator.elements
            )
            changed = replace(actuator, elements=elements)
        elif self.kind == "effort_zero":
            changed = replace(actuator, effort_offset=actuator.effort_offset + value)
        else:
            assert actuator.motor is not None
            motor = actuator.motor
            if self.kind == "torque_constant":
                constant = float(np.asarray(motor.torque_constant)) * (1.0 + value)
                motor = replace(motor, torque_constant=constant)
            else:
                resistance = float(np.asarray(motor.resistance)) * (1.0 + value)
                motor = replace(motor, resistance=resistance)
            changed = replace(actuator, motor=motor)
        return model.with_actuator(changed)


def nuisances(model: MachineModel, measurements: Sequence[Measurement]) -> tuple[Nuisance, ...]:
    """All tolerances of a machine that its log could show.

    Args:
        model: The machine.
        measurements: Logs with the same channels.
    """
    m = measurements[0]
    out = []
    for link, joint in model.links.items():
        if observable(model, m, joint):
            out += [Nuisance(k, link, UNCERTAINTY * s, "1") for k, s in STRAINS.items()]
    electrical = "torque" not in m.channels
    for k, actuator in enumerate(model.actuators):
        out.append(Nuisance("encoder", actuator.name, ENCODER_TOLERANCE, "rad"))
        zero = OFFSET_SIGMAS * float(m.noise[k, 0])
        out.append(Nuisance("effort_zero", actuator.name, zero, "channel"))
        if any(isinstance(e, Friction) for e in actuator.elements):
            out.append(Nuisance("friction", actuator.name, FRICTION_TOLERANCE, "1"))
        if actuator.motor is not None and electrical:
            out.append(Nuisance("compliance", actuator.name, COMPLIANCE_TOLERANCE, "rad/(N*m)"))
        if actuator.motor is not None and electrical:
            motor = actuator.motor
            constant = max(CONSTANT_TOLERANCE, motor.torque_constant_spread)
            out.append(Nuisance("torque_constant", actuator.name, constant, "1"))
            if "voltage" in m.channels or "power" in m.channels:
                resistance = max(RESISTANCE_TOLERANCE, motor.resistance_spread)
                out.append(Nuisance("resistance", actuator.name, resistance, "1"))
    out.append(Nuisance("skew", "", SKEW_TOLERANCE, "s"))
    return tuple(out)


def nuisance_columns(
    data_set: DataSet, base: Prediction, group: Sequence[Nuisance], sigma: Array
) -> list[dict[int, Array]]:
    """Columns of tolerances that touch different joints, from one prediction.

    Args:
        data_set: The log.
        base: The present prediction.
        group: One tolerance, or the like ones of all legs where legs are separate.
        sigma: Shape (J, C).
    """
    if len(group) == 1:
        return [nuisance_column(data_set, base, group[0], sigma)]
    step, model = 0.1, base.model
    for nuisance in group:
        model = nuisance.edit(model, step * nuisance.sigma)
    change = data_set.simulator.difference(base, model)
    whole = data_set.whitened(change.effort / step, change.joints, sigma)
    return [of_own_leg(base.model, nuisance.place, whole) for nuisance in group]


def grouped(model: MachineModel, m: Measurement, every: Sequence[Nuisance]) -> list[list[Nuisance]]:
    """Tolerances in groups that one prediction serves."""
    if not legs_are_separate(model, m):
        return [[n] for n in every]
    groups: dict[tuple[str, int | str], list[Nuisance]] = {}
    for n in every:
        leg, number = model.in_leg(n.place) if n.place else (-1, -1)
        groups.setdefault((n.kind, n.place if leg < 0 else number), []).append(n)
    return list(groups.values())


def nuisance_column(
    data_set: DataSet, base: Prediction, nuisance: Nuisance, sigma: Array
) -> dict[int, Array]:
    """Its column, per standard deviation of the prior, so that its prior precision is one."""
    step = 0.1
    model = nuisance.edit(base.model, step * nuisance.sigma)
    change = data_set.simulator.difference(base, model)
    return data_set.whitened(change.effort / step, change.joints, sigma)
