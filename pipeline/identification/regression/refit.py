"""Accepted effects estimated anew together, and those that the others have made superfluous."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from actuators.arrays import Array
from pipeline.identification.regression.design_matrix import Accepted, residual
from pipeline.identification.regression.normal_equations import DesignMatrix, solve_spd
from pipeline.identification.regression.problem import Problem
from pipeline.logs.prepared.measurement import TRAIN, VALIDATION

#: Times the columns are computed, at most, and steps that are made with the same.
_COLUMNS, _STEPS = 3, 8
#: Rise of twice the logarithm of the likelihood that is none.
_NOTHING = 0.1
#: Damping, relative to the matrix's diagonal: where a step fails; above it columns are renewed.
_DAMPED, _MOST_DAMPED = 0.01, 10.0
_LARGEST_CHANGE = 0.3  # largest relative change of a nonlinear parameter in one step


def refit(problem: Problem) -> Problem:
    """Estimate all accepted effects together with the tolerances on training and validation rows.

    Levenberg's damped Gauss-Newton steps (Marquardt 1963) with columns that are kept over several
    of them: a prediction costs little, the columns much. No step makes the log less likely.
    """
    cost = problem.cost()
    for _ in range(_COLUMNS):
        before = cost
        matrices, sums = problem.matrices, problem.sums
        A = sums.H[sums.blocks(TRAIN, VALIDATION)].sum(axis=0) + np.diag(sums.precision)
        damping = 0.0
        for _ in range(_STEPS):
            D = np.diag(damping * np.diag(A))
            # What has one sign stops at nothing, a tolerance where it would stand in for something
            # else.
            low, high = np.full(problem.names, -np.inf), np.full(problem.names, np.inf)
            count = problem.held.size
            for bound, far in ((low, -np.inf), (high, np.inf)):
                bound[:count] = problem.inside(np.full(count, far)) - problem.held
            for a, (coordinates, _) in zip(problem.accepted, problem.spans(), strict=True):
                every = a.effect.coordinates
                low[coordinates] = [-np.inf if c.signed else -a.x[c.name] for c in every]
            theta = _bounded(A + D, gradient(problem, matrices), low, high)
            moved = [
                _effect_stepped(problem, a, theta[coordinates], theta[shape])
                for a, (coordinates, shape) in zip(problem.accepted, problem.spans(), strict=True)
            ]
            held = problem.held + theta[: len(problem.tolerances)]
            after = problem.with_accepted(moved, problem.inside(held))
            reached = after.cost()
            if reached >= cost:
                damping = max(_DAMPED, 10.0 * damping)
                if damping > _MOST_DAMPED:
                    break
                continue
            gain, problem, cost = cost - reached, after, reached
            if gain < _NOTHING and not damping:
                break
            # Damping holds back what the log shows least of: the last step is without.
            damping = 0.0 if gain < _NOTHING else 0.1 * damping
        if before - cost < 10.0 * _NOTHING:
            break
    return problem


def _bounded(A: Array, h: Array, low: Array, high: Array) -> Array:
    """Least squares step; unknowns that would pass a bound stay there and the rest follows."""
    theta = np.zeros_like(h)
    free = np.ones(h.size, dtype=np.bool_)
    while True:
        theta[free] = solve_spd(
            A[np.ix_(free, free)], h[free] - A[np.ix_(free, ~free)] @ theta[~free]
        )
        beyond = free & ((theta < low) | (theta > high))
        if not beyond.any():
            return theta
        theta[beyond] = np.clip(theta[beyond], low[beyond], high[beyond])
        free &= ~beyond


def tolerances_of(problem: Problem) -> dict[tuple[str, str], tuple[float, float]]:
    """Tolerances as estimated without test rows: (kind, place) to estimate and prior sigma."""
    sums = problem.sums
    theta = sums.solve(sums.blocks(TRAIN, VALIDATION))
    held = problem.held + theta[: len(problem.tolerances)]
    return {
        (n.kind, n.place): (float(v) * n.sigma, n.sigma)
        for n, v in zip(problem.tolerances, held, strict=True)
    }


def _effect_stepped(problem: Problem, a: Accepted, step: Array, change: Array) -> Accepted:
    """An effect moved by a Newton step, shortened until it stays inside what can be."""
    for share in (1.0, 0.5, 0.25, 0.1, 0.02):
        x = {}
        for c, d in zip(a.effect.coordinates, step, strict=True):
            value = a.x[c.name] + share * float(d)
            x[c.name] = value if c.signed else max(value, 0.0)
        shape = dict(a.shape)
        for (name, value), d in zip(a.nonlinear.items(), change, strict=True):
            most = _LARGEST_CHANGE * abs(value)
            shape[name] = value + share * float(np.clip(d, -most, most))
        seen = any(a.effect.shown(b.measurement, a.place, shape) for b in problem.data_sets)
        if seen and a.effect.plausible(problem.model, a.place, x, shape):
            return replace(a, x=x, shape=shape)
    return a


def gradient(problem: Problem, matrices: Sequence[DesignMatrix]) -> Array:
    """X^T W r (n,) without test rows, of this residual with columns of another estimate."""
    h = problem.precision * problem.mean
    for k, matrix in enumerate(matrices):
        rest, rows = (
            residual(matrix.data_set, problem.predictions[k], problem.sigma),
            problem.head(k),
        )
        for j, r in rest.items():
            weighted = r[rows] * problem.weights[j]
            h[matrix.ids[j]] += np.tensordot(matrix.X[j][:, rows], weighted, axes=2)
    return h
