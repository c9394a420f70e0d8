"""Accepted effects estimated anew together, and those that the others have made superfluous."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.identification import results as limits
from pipeline.identification.regression.normal_equations import solve_spd
from pipeline.identification.regression.problem import Accepted, Problem
from pipeline.logs.prepared.measurement import CHOOSE, FIT

Array = NDArray[np.float64]
_NEWTON = 6  # refits after an acceptance, at most
_HELD = 3.0  # sigmas
_CONTRIBUTION = 3.0  # largest part of an effort one effect may have, in its RMS
_BEND = 0.3  # largest relative change of a nonlinear parameter in one step
#: Tolerances in which the prediction bends enough to be taken up into the model.
_RELINEARISED = ("torque_constant", "resistance", "encoder", "mass", "inertia", "skew")


def refit(problem: Problem) -> Problem:
    """Re-estimate all accepted effects together with the tolerances on *fit* and *choose*."""
    for _ in range(_NEWTON):
        sums, spans = problem.with_shapes()
        theta = sums.solve(sums.blocks(FIT, CHOOSE))
        moved, largest = [], 0.0
        for number, a in enumerate(problem.accepted):
            after = _stepped(problem, a, theta[problem.span(number)], theta[spans[number]])
            for c in a.effect.coordinates:
                change = abs(after.x[c.name] - a.x[c.name])
                largest = max(largest, change / (abs(after.x[c.name]) + c.step))
            moved.append(after)
        count = len(problem.tolerances)
        # Beyond a few sigmas a tolerance only stands in for an effect not yet found.
        reach = np.array([_HELD if n.kind in _RELINEARISED else 0.0 for n in problem.tolerances])
        lowest = np.array([n.lowest / n.sigma for n in problem.tolerances])
        held = np.clip(problem.held + theta[:count], np.maximum(-reach, lowest), reach)
        largest = max(largest, 0.02 * float(np.abs(held - problem.held).max(initial=0.0)))
        problem = problem.with_accepted(moved, held)
        if largest < 2e-3:
            break
    return problem


def tolerances_of(problem: Problem) -> dict[tuple[str, str], tuple[float, float]]:
    """Tolerances as *fit* and *choose* show them: (kind, place) to estimate and prior sigma."""
    sums = problem.sums()
    theta = sums.solve(sums.blocks(FIT, CHOOSE))
    held = problem.held + theta[: len(problem.tolerances)]
    return {
        (n.kind, n.place): (float(v) * n.sigma, n.sigma)
        for n, v in zip(problem.tolerances, held, strict=True)
    }


def _stepped(problem: Problem, a: Accepted, step: Array, bend: Array) -> Accepted:
    """An effect moved by a Newton step, shortened until it stays inside what can be."""
    for share in (1.0, 0.5, 0.25, 0.1, 0.02):
        x = {}
        for c, d in zip(a.effect.coordinates, step, strict=True):
            value = a.x[c.name] + share * float(d)
            x[c.name] = value if c.signed else max(value, 0.0)
        shape = {}
        for (name, value), d in zip(a.shape.items(), bend, strict=True):
            most = _BEND * abs(value)
            shape[name] = value + share * float(np.clip(d, -most, most))
        seen = any(a.effect.shown(b.measurement, a.place, shape) for b in problem.benches)
        if seen and a.effect.plausible(problem.model, a.place, x, shape):
            return replace(a, x=x, shape=shape)
    return a


def pruned(problem: Problem) -> Problem:
    """Without effects that the others have made superfluous, one after another."""
    while len(problem.accepted) > 1:
        losses = [_needed(problem, number) for number in range(len(problem.accepted))]
        weakest = int(np.argmin([loss / least for loss, least in losses]))
        if losses[weakest][0] > losses[weakest][1]:
            break
        kept = [a for k, a in enumerate(problem.accepted) if k != weakest]
        problem = refit(problem.with_accepted(kept))
    return problem


def _needed(problem: Problem, number: int) -> tuple[float, float]:
    """Rise of the penalised misfit without one effect, and the least that keeps it."""
    own = problem.accepted[number]
    if all(own.x[c.name] == 0.0 for c in own.effect.coordinates):
        return 0.0, 1.0
    sums = problem.sums()
    both = sums.blocks(FIT, CHOOSE)
    a, span = problem.accepted[number], problem.span(number)
    x0 = np.array([a.x[c.name] for c in a.effect.coordinates])
    theta = sums.solve(both)
    # At the estimate the residual contains the effect: without it, its step is minus its size.
    rest = np.setdiff1d(np.arange(problem.names), np.arange(span.start, span.stop))
    A = sums.H[both].sum(axis=0) + np.diag(sums.precision)
    b = sums.h[both].sum(axis=0) + sums.precision * sums.mean
    fixed = np.zeros(problem.names)
    fixed[span] = -x0
    fixed[rest] = solve_spd(
        A[np.ix_(rest, rest)], b[rest] - A[np.ix_(rest, np.arange(problem.names))] @ fixed
    )
    rise = sums.objective(fixed, both) - sums.objective(theta, both)
    if a.effect.is_tolerance:
        return rise, limits.TOLERANCE_SIGMAS**2
    scale = float(sums.loss(theta, both).sum()) / max(float(sums.count[both].sum()), 1.0)
    return rise, limits.LEAST_GAIN * scale


def runs_away(problem: Problem) -> bool:
    """Whether some effect takes what another gives: a direction that the log does not hold."""
    for bench, prediction in zip(problem.benches, problem.predictions(), strict=True):
        m = bench.measurement
        said = np.isin(m.part, (FIT, CHOOSE))
        if not said.any():
            continue
        size = np.sqrt(np.mean(m.effort[said] ** 2, axis=0))  # (J, C)
        for k in range(len(problem.accepted)):
            change = bench.simulator.difference(prediction, problem.without(k))
            for column, j in enumerate(change.joints):
                part = np.sqrt(np.mean(change.effort[said, column] ** 2, axis=0))
                if (part > _CONTRIBUTION * size[j]).any():
                    return True
    return False
