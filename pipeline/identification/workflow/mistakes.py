"""Usual mistakes of URDFs: the model as it would be without one, against the model as stated.

Inertias about the joint where the format wants them about the centre of mass, in another unit, of
the neighbouring link, or placeholders, are further off than any body is made, so that a search from
the stated bodies finds other names for them. Each is a model of its own; common laws and bodies at
their widest bound stand beside each. From the likeliest, if it is likelier than the bodies as
stated, the search is made once more, and has to end in an answer that is clearly likelier.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
import pinocchio as pin

from pipeline.effects.bodies import NAMES, UNITS, physical, point_mass
from pipeline.identification.design import make_data_sets, make_design
from pipeline.identification.fit import Fit, settled, start_fit
from pipeline.identification.floor import floor_of
from pipeline.identification.offered import block_terms
from pipeline.identification.results import APPROXIMATE, Estimate, Found, Member
from pipeline.identification.search import about, is_far
from pipeline.identification.settings import EXCLUDED, SURE
from pipeline.identification.tolerances import BodyStrain
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.rigid_bodies import possible

logger = logging.getLogger("legwatt")

#: Radius of gyration over a link's reach that bodies have: a rod of even mass has 0.29 about its
#: middle, a weight at its end 0.1 and less.
_USUAL: Final = (0.03, 1.5)
#: Units of inertia in kg*m^2: kg*cm^2, kg*mm^2, g*cm^2, g*mm^2; and each taken for the other.
_UNITS: Final = (1e-4, 1e-6, 1e-7, 1e-9, 1e4, 1e6, 1e7, 1e9, 1e3, 1e-3)
#: Radius of gyration that takes a placeholder's place, in the link's reach.
_ROD: Final = 0.29
_TURNS: Final = 2
#: Independent samples of a joint's residual that are believed at most: some a second.
_SAMPLES: Final = 200.0


@dataclass(frozen=True, eq=False)
class Mistake:
    """A model without a mistake."""

    words: str  #: What the URDF states.
    model: MachineModel
    gain: float = 0.0  #: Logarithm of how much likelier the log is (evidence).

    def found(self, before: MachineModel, unit: str) -> Found:
        """Its bodies as something found, an interval of 2 % about every number."""
        members = []
        for link, joint in before.links.items():
            k = before.rigid.getJointId(joint)
            old, new = (m.rigid.inertias[k].toDynamicParameters() for m in (before, self.model))
            if np.allclose(old, new, rtol=1e-9, atol=0.0):
                continue
            ten = tuple(
                Estimate(n, float(x), float(x - 0.02 * abs(x)), float(x + 0.02 * abs(x)), u)
                for n, x, u in zip(NAMES, new, UNITS, strict=True)
            )
            members.append(Member((link,), ten, APPROXIMATE))
        nan = float("nan")
        return Found(
            order=1,
            effect="rigid_body_parameters",
            place=tuple(m.place[0] for m in members),
            parameters=(),
            rivals=(),
            valid_before=nan,
            valid_after=nan,
            unit=unit,
            noise_floor=nan,
            level=APPROXIMATE,
            reason=f"the log is e^{self.gain:.0f} times as likely as by the bodies as stated",
            law=self.words,
            members=tuple(members),
        )


def mistaken(model: MachineModel, logs: Sequence[Log]) -> Mistake | None:
    """The likeliest usual mistake, where it is clearly likelier than none.

    Args:
        model: As stated; one whose bodies a log has shown has none, nor has one that walks.
        logs: Of it.
    """
    if model.floating or any(link in model.known for link in model.links):
        return None
    others = list(_without(model))
    if not others:
        return None
    logger.info("trying usual mistakes of URDFs")
    data_sets, floor = make_data_sets(logs), floor_of(logs)

    def evidence(one: MachineModel) -> float:
        terms = block_terms(one, logs[0])
        design = make_design(one, data_sets, terms)
        loose = frozenset(t.block for t in terms if isinstance(t.effect, BodyStrain))
        noise = np.array([floor[e.joint, e.channel] for e in design.equations])
        # Independent samples are counted alike for all: what a mistake leaves has a long memory.
        rows = np.array([e.total[3] for e in design.equations])
        kappa = np.minimum(1.0, _SAMPLES / np.maximum(rows, 1.0))
        fit = settled(replace(start_fit(design, noise), loose=loose, kappa=kappa))
        for _ in range(_TURNS):
            if is_far(fit):
                fit = settled(about(fit))
        return fit.evidence

    stated = evidence(model)
    tried = [replace(one, gain=evidence(one.model) - stated) for one in others]
    most = max(one.gain for one in tried)
    if most <= EXCLUDED:
        return None
    like = [one for one in tried if one.gain > most - EXCLUDED]
    return replace(like[0], words=", or ".join(one.words for one in like))


def clearly_likelier(one: Fit, other: Fit) -> float:
    """By how much the log is likelier with an answer than with another, of two models.

    Returns:
        The rise of the evidence, both judged by the least independent samples of either, less what
        a name costs; 0 where that is less than what excludes, or chunks of the log that stay out
        are clearly predicted worse: bodies let loose one by one may predict as well.
    """
    assert one.kappa is not None
    assert other.kappa is not None
    kappa = np.minimum(one.kappa, other.kappa)
    first, second = (settled(replace(fit, kappa=kappa)) for fit in (one, other))
    gain = first.evidence - second.evidence + one.design.name_cost
    sure, _ = first.sure(second, range(len(first.design.equations)))
    return gain if gain > EXCLUDED and sure > -SURE else 0.0


def _without(model: MachineModel) -> Iterator[Mistake]:
    """Models without each mistake that a URDF may have by its numbers alone."""
    joints = [model.rigid.getJointId(joint) for joint in model.links.values()]
    bodies = {k: model.rigid.inertias[k] for k in joints}
    reach = {k: _reach(model.rigid, k) for k in joints}

    def usual(body: pin.Inertia, k: int) -> bool:
        radius = np.sqrt(max(np.linalg.eigvalsh(body.inertia)[-1], 0.0) / body.mass)
        return bool(_USUAL[0] < radius / reach[k] < _USUAL[1])

    def other(changed: dict[int, pin.Inertia]) -> MachineModel | None:
        if not changed or not all(physical(b.toDynamicParameters()) for b in changed.values()):
            return None
        rigid = model.rigid.copy()
        for k, body in changed.items():
            rigid.inertias[k] = body
        return replace(model, rigid=rigid)

    about_joint = {}
    for k, b in bodies.items():
        # About the joint's frame the ten parameters hold m (c^2 1 - c c^T) once more.
        ten = (
            np.asarray(b.toDynamicParameters())
            - np.r_[np.zeros(4), point_mass(b.mass, b.lever)[4:]]
        )
        if np.linalg.norm(b.lever) > 1e-6 and np.trace(b.inertia) > 2.0 * b.mass * float(
            b.lever @ b.lever
        ):
            about_joint[k] = pin.Inertia.FromDynamicParameters(possible(ten))
    if made := other(about_joint):
        yield Mistake("inertias about the joint in place of the centre of mass", made)
    odd = {k: b for k, b in bodies.items() if not usual(b, k)}
    for factor in _UNITS:
        scaled = {k: pin.Inertia(b.mass, b.lever, factor * b.inertia) for k, b in odd.items()}
        fits = [usual(b, k) for k, b in scaled.items()]
        if len(odd) * 2 > len(bodies) and sum(fits) * 2 > len(odd) and (made := other(scaled)):
            yield Mistake(f"inertias in another unit ({factor:g} kg*m^2)", made)
    round_ = {
        k: pin.Inertia(b.mass, b.lever, b.mass * (_ROD * reach[k]) ** 2 * np.eye(3))
        for k, b in bodies.items()
        if np.allclose(b.inertia, b.inertia[0, 0] * np.eye(3), rtol=1e-9, atol=1e-15)
    }
    if made := other(round_):
        yield Mistake("placeholders of inertia", made)
    for k, behind in pairwise(joints):
        a, b = bodies[k], bodies[behind]
        swapped = {
            k: pin.Inertia(a.mass, a.lever, b.inertia),
            behind: pin.Inertia(b.mass, b.lever, a.inertia),
        }
        ratio = np.trace(a.inertia) / max(float(np.trace(b.inertia)), 1e-300)
        if not 0.5 < ratio < 2.0 and (made := other(swapped)):
            names = " and ".join(str(model.rigid.names[j]) for j in (k, behind))
            yield Mistake(f"the inertias of the links of {names} exchanged", made)


def _reach(rigid: pin.Model, k: int) -> float:
    """Of a link: to the next joint, or twice to its centre of mass [m]."""
    ends = [
        float(np.linalg.norm(rigid.jointPlacements[child].translation))
        for child in range(1, rigid.njoints)
        if rigid.parents[child] == k
    ]
    return max([*ends, 2.0 * float(np.linalg.norm(rigid.inertias[k].lever)), 0.02])
