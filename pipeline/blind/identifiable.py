"""Which effects a trial's log could tell apart, fixed before the workflow sees it.

The twin runs every trial's machine twice, with the hidden effect and without it, and reads both by
sensors without noise: the difference d of what either leaves unpredicted is what has to be found. A
rival at any place, with all tolerances (under their priors) and any other hidden effect free,
explains d up to a rest u; without a rival u is what is left of d when tolerances alone have tried.
The misfit of a rival is

    z = (u'u + p) / sqrt(sum over blocks of (u'e)^2 + p)

where e is what the nominal model leaves of the machine without anything hidden, with the trial's
own sensor noise (so all that the simulated machine does otherwise than the workflow's laws), p is
the prior's penalty, and blocks of the log, not samples, are what counts as independent. z is the
number of standard deviations by which the truth beats the rival on average, on the parts of the log
that have a say in naming. Everything is in units of the sensors' noise.

Note:
    The truth's law is the twin's. An effect whose law the workflow has wrong counts as
    identifiable all the same, and is then a trial lost.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.truth import HiddenTruth
from pipeline.effects.base import Effect, Place
from pipeline.effects.drive.torque_ripple import TorqueRipple
from pipeline.effects.registry import EFFECTS, catalogue
from pipeline.identification.regression.design_matrix import Bench, effect_columns, residual
from pipeline.identification.regression.normal_equations import (
    BlockSums,
    block_sums,
    make_stack,
    solve_spd,
)
from pipeline.identification.regression.tolerances import nuisance_column, nuisances
from pipeline.identification.selection.screen import bounded_gain
from pipeline.logs.prepared.measurement import CHOOSE, FIT, Measurement
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction, Simulator

Array = NDArray[np.float64]
Column = Mapping[int, Array]
#: An effect is identifiable where nothing and no rival comes nearer than this many standard
#: deviations: 4.2 keep chance from passing for any of some 400 candidates in 99 of 100 logs, and
#: 1.7 more let the truth be seen in 95 of 100.
THRESHOLD: Final = 6.0
#: A name is excused only where it leaves less than this share of nothing's misfit.
EXPLAINS: Final = 0.5
#: Joints that feel less than this share of d are left out.
_LEAST_SHARE: Final = 0.02
_ORDERS = 3  # ripples of the rivals, the strongest ones


@dataclass(frozen=True)
class Rival:
    """Another effect and how far it stays behind the truth.

    Attributes:
        effect: Name; empty for nothing but tolerances.
        place: Where.
        misfit: z, in standard deviations.
    """

    effect: str
    place: Place
    misfit: float


@dataclass(frozen=True)
class Identifiability:
    """What a log could tell of one hidden effect.

    Attributes:
        nothing: Misfit of tolerances alone.
        rivals: All others, the nearest first.
    """

    nothing: float
    rivals: tuple[Rival, ...]

    @property
    def visible(self) -> bool:
        """Whether the log could show that something is there."""
        return self.nothing >= THRESHOLD

    @property
    def like(self) -> tuple[Rival, ...]:
        """Rivals of the same class: to name one of them is right."""
        return tuple(r for r in self.rivals if r.misfit < THRESHOLD)

    @property
    def stand_ins(self) -> tuple[Rival, ...]:
        """Rivals of the class that also explain most of the effect.

        Where hardly anything can be seen every rival is of the class, and not every name is right.
        """
        return tuple(r for r in self.like if r.misfit < EXPLAINS * self.nothing)

    @property
    def alone(self) -> bool:
        """Whether the log could tell the effect from all others."""
        return self.visible and not self.like

    @property
    def nearest(self) -> Rival:
        """The best-fitting rival, nothing included."""
        nothing = Rival("", (), self.nothing)
        return min((nothing, *self.rivals[:1]), key=lambda r: r.misfit)


def identifiability(
    model: MachineModel,
    bench: Bench,
    exact: Measurement,
    without: Sequence[Measurement],
    empty: Measurement,
    hidden: Sequence[HiddenTruth],
) -> list[Identifiability]:
    """Judge every hidden effect.

    Args:
        model: The nominal machine.
        bench: The trial's log, made ready.
        exact: The same log without noise.
        without: The same without one of the hidden effects, in their order.
        empty: The same with nothing hidden.
        hidden: What is in it.
    """
    base = bench.simulator.predict(model)
    whole = _rest(model, bench, exact)
    noise = _less(_rest(model, bench, bench.measurement), whole)
    rest = _less(_rest(model, bench, empty), noise, sign=-1.0)
    out = []
    for k, one in enumerate(hidden):
        d = _less(whole, _rest(model, bench, without[k]))
        others = [other for i, other in enumerate(hidden) if i != k]
        out.append(_judge(bench, base, d, rest, one, others))
    return out


def _rest(model: MachineModel, bench: Bench, m: Measurement) -> dict[int, Array]:
    """What a log leaves unpredicted, in the rows and units of the bench."""
    own = replace(bench, simulator=Simulator(m))
    return residual(own, own.simulator.predict(model), bench.measurement.noise)


def _less(a: Column, b: Column, sign: float = 1.0) -> dict[int, Array]:
    return {j: a[j] - sign * b[j] for j in a}


def _judge(
    bench: Bench,
    base: Prediction,
    d: Column,
    rest: Column,
    truth: HiddenTruth,
    others: Sequence[HiddenTruth],
) -> Identifiability:
    m, sigma, model = bench.measurement, bench.measurement.noise, base.model
    power = {j: float(np.sum(column**2)) for j, column in d.items()}
    total = sum(power.values())
    felt = {j for j, value in power.items() if value > _LEAST_SHARE * total}
    free: list[Column] = []
    for nuisance in nuisances(model, [m]):
        if _near(model, nuisance.place, felt):
            free.append(nuisance_column(bench, base, nuisance, sigma))
    priors = len(free)
    for other in others:
        if not other.in_catalogue:
            continue
        effect = EFFECTS[other.effect]
        for known in _shapes(effect, model, m, other):
            free += effect_columns(bench, base, effect, other.place, known, sigma)
    columns: list[Column] = [*free, d]
    tried: list[tuple[Effect, Place, slice]] = []
    hidden = {(one.effect, one.place) for one in (truth, *others)}
    for effect, place, shape in _candidates(bench, model, d, felt):
        contains = truth.effect in effect.contains and place == truth.place
        if (effect.name, place) in hidden or contains:
            continue
        own = effect_columns(bench, base, effect, place, shape, sigma)
        if any(own):
            tried.append((effect, place, slice(len(columns), len(columns) + len(own))))
            columns += own
    precision = np.zeros(len(columns))
    precision[:priors] = 1.0
    only = {j: r for j, r in rest.items() if j in felt}
    sums = block_sums([make_stack(bench, columns, only)], precision, np.zeros(len(columns)))
    return _compare(sums, len(free), tried)


def _shapes(
    effect: Effect, model: MachineModel, m: Measurement, truth: HiddenTruth
) -> list[dict[str, float]]:
    """Nonlinear parameters of a hidden effect; those to try where the twin's law has no such."""
    if all(p.name in truth.values for p in effect.parameters if not p.optional):
        return [effect.internal(truth.values)[1]]
    return effect.shapes(model, m, truth.place)


def _compare(
    sums: BlockSums, count: int, tried: Sequence[tuple[Effect, Place, slice]]
) -> Identifiability:
    """Misfit of every rival; unknowns are tolerances and others (`count`), d, then rivals."""
    blocks = sums.blocks(FIT, CHOOSE)
    H, free = sums.H[blocks], np.arange(count)
    N = H.sum(axis=0)
    A = N[:count, :count] + np.diag(sums.precision[:count])
    # What is left of the log itself once tolerances have been fitted to it.
    start = solve_spd(A, sums.h[blocks][:, free].sum(axis=0))
    gradient = sums.h[blocks] - np.einsum("bij,j->bi", H[:, :, :count], start)
    explained = solve_spd(A, N[:count])  # of every column by the free ones
    S = N - N[:, :count] @ explained
    g = S[:, count]

    def misfit(x: Array, at: slice) -> float:
        theta = np.zeros(N.shape[0])
        theta[count] = 1.0
        theta[at] = -x
        theta[:count] = -(explained @ theta)
        penalty = float(np.sum(sums.precision * theta**2))
        size = float(theta @ N @ theta) + penalty
        scatter = float(np.sum((gradient @ theta) ** 2)) * blocks.size / max(blocks.size - 1, 1)
        # No estimate is better than white noise of the sensors would allow.
        return size / np.sqrt(max(scatter + penalty, size, 1e-300))

    nothing = misfit(np.empty(0), slice(0, 0))
    best: dict[tuple[str, Place], float] = {}
    for effect, place, at in tried:
        index = np.arange(at.start, at.stop)
        _, x = bounded_gain(
            S[np.ix_(index, index)],
            g[index],
            N[np.ix_(index, index)],
            [c.signed for c in effect.coordinates],
        )
        key = (effect.name, place)
        best[key] = min(best.get(key, np.inf), misfit(x, at))
    rivals = [Rival(name, place, value) for (name, place), value in best.items()]
    return Identifiability(nothing, tuple(sorted(rivals, key=lambda r: r.misfit)))


def _candidates(
    bench: Bench, model: MachineModel, d: Column, felt: set[int]
) -> Iterator[tuple[Effect, Place, Mapping[str, float]]]:
    m = bench.measurement
    for effect in catalogue(model):
        for place in effect.places(model, m):
            if not any(_near(model, part, felt) for part in place):
                continue
            if isinstance(effect, TorqueRipple):
                shapes = _orders(bench, effect, model.index(place[0]), d)
            else:
                shapes = effect.shapes(model, m, place)
            for shape in shapes:
                yield effect, place, shape


def _orders(bench: Bench, effect: TorqueRipple, joint: int, d: Column) -> list[dict[str, float]]:
    """Orders of the joint's angle that d holds most of."""
    if joint not in d:
        return []
    series = d[joint][::4, 0]
    return effect.strongest(bench.measurement, joint, bench.rows[::4], series, _ORDERS)


def _near(model: MachineModel, part: str, felt: set[int]) -> bool:
    """Whether a joint or link shares a leg with a joint that feels d; the ground does always."""
    links = model.links
    joint = part if part in model.joints else links.get(part, "")
    if joint not in model.joints:
        return True
    return bool(felt & set(_leg(model, joint)))


def _leg(model: MachineModel, joint: str) -> list[int]:
    """Columns of all joints of the limb that a joint belongs to."""
    rigid = model.rigid
    root = rigid.getJointId(joint)
    while rigid.parents[root] != 0 and str(rigid.names[rigid.parents[root]]) in model.joints:
        root = rigid.parents[root]
    limb = {str(rigid.names[i]) for i in rigid.subtrees[root].tolist()}
    return [k for k, name in enumerate(model.joints) if name in limb]
