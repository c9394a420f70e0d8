"""Common laws first: what blocks find at all joints is a point that the search starts from.

The search takes up one name at one joint after another, and where every joint has friction of its
own the first names stand in for the laws that are still missing. Blocks estimate them together
(`pipeline.identification.blocks`); what is not common is the search's.
"""

from __future__ import annotations

import numpy as np

from actuators.arrays import Array
from pipeline.effects.base import Effect
from pipeline.effects.registry import catalogue
from pipeline.identification.block_columns import block_data
from pipeline.identification.blocks import BlockFit, fit_blocks
from pipeline.identification.regression.design_matrix import Accepted
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.refit import refit
from pipeline.identification.results import UNCERTAINTIES
from pipeline.machine.machine import MachineModel


def with_common_laws(problem: Problem, weights: Array) -> Problem | None:
    """The problem with the common laws that blocks find, estimated anew; None without any.

    Blocks need torque at the joints of a fixed base: behind a motor the search's own columns hold
    what its chain makes of a law, and on legs the residual of unknown ground forces is not the one
    that the search estimates by.

    Args:
        problem: Without effects.
        weights: Of the squared residuals, shape (J, C).
    """
    model, m = problem.model, problem.data_sets[0].measurement
    motors = any(a.motor is not None for a in model.actuators)
    if model.floating or motors or m.channels != ("torque",):
        return None
    fit = fit_blocks(block_data(model, problem.data_sets))
    accepted = _laws(fit, model)
    if not accepted:
        return None
    return refit(problem.judged(_uncertainty(fit), weights).with_accepted(accepted))


def _uncertainty(fit: BlockFit) -> float:
    """Of the URDF's bodies, on the search's grid: the nearest to the bodies' scales."""
    scales = [fit.scales[b] for b in fit.active if fit.data.blocks[b].kind == "body"]
    size = float(np.sqrt(np.mean(np.square(scales)))) if scales else 0.0
    nearest = np.argmin(np.abs(np.log(np.array(UNCERTAINTIES) / max(size, 1e-9))))
    return UNCERTAINTIES[int(nearest)]


def _laws(fit: BlockFit, model: MachineModel) -> list[Accepted]:
    """Effects of the numbers that a log tells from nothing."""
    effects: dict[str, Effect] = {e.name: e for e in catalogue(model)}
    out, told = [], fit.told()
    for b in fit.active:
        block = fit.data.blocks[b]
        effect = effects.get(block.law.effect)
        if block.kind == "coupling" and effect is not None:
            other, sense, joint = block.places[0].split(" ")[::-1]
            numbers = fit.values[block.columns].tolist()
            x = dict(zip(("viscous", "coulomb", "inertia"), numbers, strict=True))
            shape = {"ratio": 1.0 if sense == "+" else -1.0}
            out.append(Accepted(effect, (joint, other), x, shape))
        elif block.law.common and effect is not None and block.kind != "body":
            for joint, k in zip(block.places, block.columns, strict=True):
                if told[k]:
                    x = {block.law.parameter: float(fit.values[k])}
                    if effect.plausible(model, (joint,), x, {}):
                        out.append(Accepted(effect, (joint,), x, {}))
    return out
