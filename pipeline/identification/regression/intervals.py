"""Intervals of the accepted effects' parameters by a block bootstrap of the normal equations.

Blocks of training and validation rows are drawn with replacement and the linearised problem is
solved anew for each draw, all tolerances free within their priors. Nonlinear parameters (order of a
ripple, Stribeck speed) have a column of their own here. With few blocks a bootstrap is too narrow:
the spread is widened to what noise alone would give where that is more. Two things a log cannot
know are added: that a law holds to about one per cent (`LAW`), and how much of a delay is the skew
of sampling.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import pinocchio as pin
from scipy.stats import chi2

from actuators.arrays import Array
from pipeline.effects.bodies import NAMES, UNITS
from pipeline.effects.sensors import SKEW_TOLERANCE
from pipeline.identification.regression.design_matrix import Accepted
from pipeline.identification.regression.normal_equations import BlockSums, inverse_spd, solve_spd
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.tolerances import STRAINS
from pipeline.identification.results import Estimate
from pipeline.logs.prepared.measurement import TRAIN, VALIDATION
from pipeline.simulation.rigid_bodies import possible, strained

LAW: Final = 0.01  # share to which a law holds at best

SAMPLES: Final = 300
SEED: Final = 20240613
_COVERED: Final = (0.025, 0.975)


@dataclass(frozen=True)
class Sized:
    """One accepted effect's estimates."""

    parameters: tuple[Estimate, ...]  #: With intervals.
    certain: bool  #: Whether "nothing of it" lies outside their common 95 % region.


def estimates(problem: Problem, channel: str) -> list[Sized]:
    """Estimates of every accepted effect, in order.

    Args:
        problem: With all accepted effects at their estimates.
        channel: The compared channel, for units.
    """
    if not problem.accepted:
        return []
    draws = _draws(problem.sums)
    out = []
    for a, (coordinates, shapes) in zip(problem.accepted, problem.spans(), strict=True):
        names = [c.name for c in a.effect.coordinates]
        samples = []
        for draw in draws:
            x = {n: a.x[n] + float(d) for n, d in zip(names, draw[coordinates], strict=True)}
            for c in a.effect.coordinates:
                x[c.name] = x[c.name] if c.signed else max(x[c.name], 0.0)
            nonlinear = zip(a.nonlinear.items(), draw[shapes], strict=True)
            shape = {**a.shape, **{n: v + float(d) for (n, v), d in nonlinear}}
            samples.append(a.effect.physical(x, shape))
        best = a.effect.physical(a.x, a.shape)
        parameters = tuple(_estimate(a, n, best, samples, channel) for n in best)
        size = np.array([a.x[n] for n in names])
        own = draws[:, coordinates]
        # An effect is this effect only while what it requires is something, each by itself.
        needed = [k for k, c in enumerate(a.effect.coordinates) if c.required]
        certain = all(_certain(size[[k]], own[:, [k]]) for k in needed)
        out.append(Sized(parameters, certain and _certain(size, own)))
    return out


def _certain(size: Array, draws: Array) -> bool:
    """Whether coordinates (p,) differ from nothing, given deviations (n, p) of their estimate."""
    used = size != 0.0
    if not used.any():
        return False
    spread = np.atleast_2d(np.cov(draws[:, used].T))
    wald = float(size[used] @ np.linalg.pinv(spread, hermitian=True) @ size[used])
    return wald > float(chi2.isf(0.05, int(used.sum())))


def _estimate(
    a: Accepted,
    name: str,
    best: Mapping[str, float],
    samples: list[dict[str, float]],
    channel: str,
) -> Estimate:
    values = np.array([s[name] for s in samples])
    if name == "phase":
        # An angle: measured from the estimate, so that it does not wrap inside the interval.
        values = best[name] + (values - best[name] + np.pi) % (2 * np.pi) - np.pi
    low, high = np.quantile(values, _COVERED)
    value = float(best[name])
    bounds = next(p for p in a.effect.parameters if p.name == name)
    if name not in a.shape and name != "phase":
        skew = SKEW_TOLERANCE if a.effect.name == "time_delay" else 0.0
        extra = 1.96 * float(np.hypot(LAW * value, skew))
        low, high = value - np.hypot(value - low, extra), value + np.hypot(high - value, extra)
    if name != "phase":
        low, high = max(low, bounds.low), min(high, bounds.high)
    return Estimate(
        name, value, float(min(low, value)), float(max(high, value)), a.effect.unit(name, channel)
    )


def _draws(sums: BlockSums) -> Array:
    """Deviations of the estimate in bootstrap samples, shape (SAMPLES, n)."""
    blocks = sums.blocks(TRAIN, VALIDATION)
    prior = np.diag(sums.precision)
    H, h = sums.H[blocks], sums.h[blocks]
    pull = sums.precision * sums.mean
    A = H.sum(axis=0) + prior
    centre = solve_spd(A, h.sum(axis=0) + pull)
    inverse = inverse_spd(A)
    rng = np.random.default_rng(SEED)
    out = np.empty((SAMPLES, centre.size))
    # One step from the centre with the sample's gradient: the matrix hardly changes.
    gradient = h - H @ centre
    for k in range(SAMPLES):
        weight = np.bincount(rng.integers(blocks.size, size=blocks.size), minlength=blocks.size)
        out[k] = inverse @ ((weight - 1.0) @ gradient)
    count = float(sums.count[blocks].sum())
    scale = float(sums.loss(centre, blocks).sum()) / max(count, 1.0)
    # The noise is as large as what is left; what a prior alone holds is none the wider for it.
    noisy = inverse_spd(H.sum(axis=0) / max(scale, 1.0) + prior)
    least = np.sqrt(np.maximum(np.diag(noisy), 0.0))
    spread = out.std(axis=0)
    # As for a t-distribution: few blocks know their own scatter badly.
    grow = np.maximum(1.0, least / np.maximum(spread, 1e-300)) * (1.0 + 2.0 / blocks.size)
    small = spread < 1e-12 * np.maximum(least, 1e-300)
    if small.any():
        out[:, small] = least[small] * rng.standard_normal((SAMPLES, int(small.sum())))
        grow[small] = 1.0
    # The largest growth of an effect's directions would distort its shape; each on its own.
    result: Array = out * grow
    return result


def bodies_of(problem: Problem) -> dict[str, tuple[Estimate, ...]]:
    """Ten inertial parameters of every link whose body is open, with intervals."""
    sums = problem.sums
    draws = _draws(sums)
    out: dict[str, tuple[Estimate, ...]] = {}
    links = dict.fromkeys(n.place for n in problem.tolerances if n.kind in STRAINS)
    for link in links:
        at = [k for k, n in enumerate(problem.tolerances) if n.place == link and n.kind in STRAINS]
        sigma = np.array([problem.tolerances[k].sigma for k in at])
        held = problem.held[at]
        joint = problem.model.carrier(link)
        body = problem.model.rigid.inertias[problem.model.rigid.getJointId(joint)]

        def ten(strain: Array, body: pin.Inertia = body) -> Array:
            return possible(np.asarray(strained(body, strain.tolist()).toDynamicParameters()))

        best = ten(held * sigma)
        spread = np.array([ten((held + draw) * sigma) for draw in draws[:, at]])
        low, high = np.quantile(spread, _COVERED, axis=0)
        out[link] = tuple(
            Estimate(n, float(b), float(min(lo, b)), float(max(hi, b)), u)
            for n, u, b, lo, hi in zip(NAMES, UNITS, best, low, high, strict=True)
        )
    return out
