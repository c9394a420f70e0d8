"""Accepted effects estimated anew together, and those that the others have made superfluous."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.identification.regression.normal_equations import solve_spd
from pipeline.identification.regression.problem import Accepted, Problem
from pipeline.identification.regression.tolerances import STRAINS
from pipeline.logs.prepared.measurement import CHOOSE, FIT

Array = NDArray[np.float64]
#: Times the columns are computed, at most, and steps that are made with the same.
_COLUMNS, _STEPS = 3, 6
#: Largest change that is none: of a coordinate relative to it, of a tolerance in fifty sigmas.
_SMALL, _NEAR = 2e-3, 2e-2
#: Share of the last step beyond which columns are computed anew.
_SLOW = 0.7
_HELD = 3.0  # sigmas
_BEND = 0.3  # largest relative change of a nonlinear parameter in one step
#: Tolerances in which the prediction bends enough to be taken up into the model.
_RELINEARISED = ("torque_constant", "resistance", "encoder", "skew", *STRAINS)


def refit(problem: Problem) -> Problem:
    """Estimate all accepted effects together with the tolerances on *fit* and *choose*.

    Gauss-Newton with columns that are kept over several steps, of which only the residual is
    computed anew: the predictions cost little, the columns much.
    """
    for _ in range(_COLUMNS):
        problem, first = _with_one_jacobian(problem)
        if first < _NEAR:
            break
    return problem


def _with_one_jacobian(problem: Problem) -> tuple[Problem, float]:
    """Steps with the columns of where they start, and how large the first of them was."""
    stacks, sums = problem.stacks(), problem.sums()
    A = sums.H[sums.blocks(FIT, CHOOSE)].sum(axis=0) + np.diag(sums.precision)
    sizes: list[float] = []
    while len(sizes) < _STEPS:
        theta = solve_spd(A, problem.gradient(stacks) + problem.precision * problem.mean)
        after, size = _stepped(problem, theta)
        if sizes and size > _SLOW * sizes[-1]:
            break
        problem = after
        sizes.append(size)
        if size < _SMALL:
            break
    return problem, sizes[0]


def _stepped(problem: Problem, theta: Array) -> tuple[Problem, float]:
    """The problem after a step (n,), and the largest relative change in it."""
    moved, largest = [], 0.0
    for a, (coordinates, shape) in zip(problem.accepted, problem.spans(), strict=True):
        after = _effect_stepped(problem, a, theta[coordinates], theta[shape])
        for c in a.effect.coordinates:
            change = abs(after.x[c.name] - a.x[c.name])
            largest = max(largest, change / (abs(after.x[c.name]) + c.step))
        moved.append(after)
    count = len(problem.tolerances)
    # Beyond a few sigmas a tolerance only stands in for an effect not yet found.
    reach = np.array([_HELD if n.kind in _RELINEARISED else 0.0 for n in problem.tolerances])
    reach /= np.sqrt(problem.precision[:count])
    lowest = np.array([n.lowest / n.sigma for n in problem.tolerances])
    held = np.clip(problem.held + theta[:count], np.maximum(-reach, lowest), reach)
    largest = max(largest, 0.02 * float(np.abs(held - problem.held).max(initial=0.0)))
    return problem.with_accepted(moved, held), largest


def tolerances_of(problem: Problem) -> dict[tuple[str, str], tuple[float, float]]:
    """Tolerances as *fit* and *choose* show them: (kind, place) to estimate and prior sigma."""
    sums = problem.sums()
    theta = sums.solve(sums.blocks(FIT, CHOOSE))
    held = problem.held + theta[: len(problem.tolerances)]
    return {
        (n.kind, n.place): (float(v) * n.sigma, n.sigma)
        for n, v in zip(problem.tolerances, held, strict=True)
    }


def _effect_stepped(problem: Problem, a: Accepted, step: Array, bend: Array) -> Accepted:
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
