"""A whole machine fitted to what may be learnt from: bodies, friction, couplings at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.effects.base import CHANNEL_UNITS
from pipeline.effects.registry import effect_named
from pipeline.identification.results import Found
from pipeline.identification.whole.beside import kinds_of, names_of, unnamed
from pipeline.identification.whole.errors import NotWholeError
from pipeline.identification.whole.findings import COVER, suspected, told
from pipeline.identification.whole.rigid import held, rigid_model, still_joints
from pipeline.identification.whole.sides import sides
from pipeline.identification.whole.training import training_runs, without_known
from pipeline.identification.workflow.locate import Whereabouts
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel
from pipeline.regression import Options, Result, identify, prepare
from pipeline.regression.errors import RegressionError
from pipeline.regression.laws.bodies import regressor

Array = NDArray[np.float64]
#: Effects that the regression decides about: they are not offered again.
FAMILIES = frozenset(
    {
        "coulomb_friction",
        "viscous_friction",
        "stribeck_friction",
        "load_dependent_friction",
        "direction_dependent_friction",
        "backdrive_loss",
        "rotor_inertia",
        "transmission_coupling",
    }
)
#: ... and of bodies, where they were fitted.
OF_BODIES = frozenset({"link_mass", "center_of_mass_offset", "base_tilt"})
#: ... and of torque columns, whose zero is a term of every joint's friction.
OF_COLUMNS = frozenset({"effort_offset"})
#: What only bodies that are known can tell: the scale of a torque is that of the masses it moves.
SCALES = frozenset({"effort_gain", "torque_constant_error"})


#: Rows over which a doubt is averaged.
ROWS = 300
#: What an encoder at the joint does not feel: it is read off two positions, or not at all.
BEFORE_THE_JOINT = frozenset({"joint_elasticity", "backlash"})


@dataclass(frozen=True, eq=False)
class Whole:
    """What a regression of the whole machine found.

    Attributes:
        found: In the order in which a model file applies it.
        model: The machine with it.
        result: Of the regression.
        decided: Names of effects that need not be offered again.
        notes: What else a reader should know.
        floor: Noise of the joints' torques by what the richest model leaves, at the bandwidth of
            the comparison, (J,) [N*m]; NaN of joints that were held.
        rigid: Bodies before, of the joints that were fitted.
        order: Columns of these joints.
    """

    found: tuple[Found, ...]
    model: MachineModel
    result: Result
    decided: frozenset[str]
    notes: tuple[str, ...]
    floor: Array
    rigid: pin.Model
    order: NDArray[np.intp]

    def doubt(self, m: Measurement) -> Array:
        """What is left open of bodies and friction, as torque along another motion, (J,) [N*m] RMS.

        NaN of joints that were held.
        """
        out = np.full(len(m.joints), np.nan)
        rows = np.flatnonzero(m.mask.any(axis=1))
        rows = rows[:: max(1, rows.size // ROWS)]
        out[self.order] = 0.0
        if not rows.size:
            return out
        q, v, a = (x[np.ix_(rows, self.order)] for x in (m.q, m.v, m.a))
        variance = self._friction_open(q, v, a)
        if self.result.refit:
            y = regressor(self.rigid, q, v, a)
            open_ = self.result.bodies_spread + self.result.bodies_scatter
            variance += np.einsum("njp,pq,njq->nj", y, open_, y).mean(axis=0)
        out[self.order] = np.sqrt(variance)
        return out

    def _friction_open(self, q: Array, v: Array, a: Array) -> Array:
        """Variance of the torque of friction by the intervals of its sizes, (K,) [N^2*m^2]."""
        felt, out = self.result.passed(q, v, a), np.zeros(q.shape[1])
        for j, friction in enumerate(self.result.friction):
            columns, _ = friction.shape.columns(v[:, j], a[:, j], felt[:, j])
            for term in friction.terms:
                error = self.result.halves.get((str(j), term), 0.0) / COVER
                out[j] += error**2 * float((columns[term] ** 2).mean())
        return out


def with_found(model: MachineModel, found: Found) -> MachineModel:
    """A machine with a finding, all its members."""
    effect = effect_named(found.effect)
    return reduce(lambda m, one: effect.apply(m, one.place, one.values), found.each, model)


def noise_floor(result: Result, bandwidth: float) -> Array:
    """Noise below a bandwidth [Hz], by the richest model's colour, (K,) [N*m].

    Read above the cut-off and taken for white, noise with a memory is several times too small. NaN
    where the model leaves more than noise.
    """
    rate, gain = result.rate, result.gain
    band = min(bandwidth, result.cutoff)
    level = np.array([c.below(band, rate) for c in result.noise]) * gain
    level[list(result.structured)] = np.nan
    return level


def fit_whole(model: MachineModel, where: Whereabouts) -> Whole:
    """Fit a machine on a fixed base as a whole.

    Args:
        model: As its files say.
        where: Logs and their parts; what proves is not looked at.

    Raises:
        NotWholeError: The machine or its log does not allow it.
    """
    prepared = where.intake.prepared
    rigid, carried = held(rigid_model(model), still_joints(model, [p.log for p in prepared]))
    order = np.array([model.index(str(n)) for n in list(rigid.names)[1:]], dtype=np.intp)
    runs = training_runs(prepared, where.parts, model, order)
    channel = where.measurements[0].channels[0]
    kinds = kinds_of(channel, at_motor=where.measurements[0].at_motor)
    try:
        rows = prepare(runs, rigid, most=where.measurements[0].bandwidth)
        rows = replace(rows, tau=without_known(rows, model, rigid))
        result = identify(rows, rigid, options=Options(extras=kinds))
    except (RegressionError, np.linalg.LinAlgError) as error:
        raise NotWholeError(str(error)) from None
    unit = CHANNEL_UNITS[channel]
    findings = [*told(result, model, carried, channel), *sides(where, result, order)]
    found = tuple(t.found(k, unit) for k, t in enumerate(findings, start=1))
    kept = [f for f in found if f.kept]
    decided = FAMILIES | names_of(kinds) | BEFORE_THE_JOINT
    if channel == "torque":
        decided |= OF_COLUMNS
    if result.refit:
        decided |= OF_BODIES | SCALES
    floor = np.full(len(model.joints), np.nan)
    floor[order] = noise_floor(result, where.measurements[0].bandwidth)
    notes = (*unnamed(result), *suspected(result))
    return Whole(
        found, reduce(with_found, kept, model), result, decided, notes, floor, rigid, order
    )
