"""One candidate tried in earnest: estimated on *fit*, judged on *choose*, tested over blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.identification.regression.normal_equations import BlockSums
from pipeline.identification.regression.problem import Problem
from pipeline.identification.selection.screen import Score
from pipeline.logs.prepared.measurement import CHOOSE, FIT

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trial:
    """What trying a candidate gave.

    Attributes:
        score: What was tried.
        gain: Fall of the penalised misfit on *fit* and *choose* together.
        held_out: Fall of the misfit on *choose* at estimates from *fit*, penalties included.
        held_share: Fall of the plain misfit there, over what it is at the joints it touches.
        significance: Wald statistic of the coordinates with the scatter over blocks.
        freedom: Number of coordinates in use.
        scale: Misfit per independent sample that is left with the candidate.
        expected: Misfit of noise alone at the joints it touches, on *fit* and *choose*.
        touched: Those joints.
    """

    score: Score
    gain: float
    held_out: float
    held_share: float
    significance: float
    freedom: int
    scale: float
    expected: float
    touched: frozenset[int]

    @property
    def key(self) -> tuple[str, tuple[str, ...]]:
        """Effect and place."""
        return self.score.effect.name, self.score.place


def try_candidate(problem: Problem, score: Score) -> Trial:
    """Try a candidate.

    Args:
        problem: The present problem.
        score: From screening, with its best shape.
    """
    columns = [
        problem.columns(k, score.effect, score.place, score.shape)
        for k in range(len(problem.benches))
    ]
    absorbed = problem.absorbed(score.effect, score.place)
    sums = problem.extended(columns, absorbed)
    plain = problem.sums()
    n = problem.names
    used = [k for k, c in enumerate(score.effect.coordinates) if score.x[c.name] != 0.0]
    free = np.concatenate([np.arange(n), n + np.array(used, dtype=np.intp)])
    old = np.arange(n)
    fit, choose, both = sums.blocks(FIT), sums.blocks(CHOOSE), sums.blocks(FIT, CHOOSE)

    gain = _objective(plain, both, old) - _objective(sums, both, free)
    before, after = plain.solve(fit, old), sums.solve(fit, free)
    fall = float(plain.loss(before, choose).sum()) - float(sums.loss(after, choose).sum())
    held_out = fall + plain.penalty(before) - sums.penalty(after)
    theta = sums.solve(both, free)
    covariance = sums.covariance(theta, both, free)
    tail = slice(n, None)
    x = theta[free][tail]
    significance = float(x @ np.linalg.pinv(covariance[tail, tail]) @ x)
    count = float(sums.count[both].sum())
    touched = {j for per_log in columns for column in per_log for j in column}
    share = len(touched) / len(problem.model.joints)
    scale = float(sums.loss(theta, both).sum()) / max(count, 1.0)
    loss = _loss_of(problem, touched, before)
    touches = frozenset(touched)
    return Trial(
        score, gain, held_out, fall / loss, significance, len(used), scale, count * share, touches
    )


def _loss_of(problem: Problem, joints: set[int], theta: Array) -> float:
    """Misfit of some joints on *choose* at an estimate."""
    total = 1e-300
    for stack in problem.stacks():
        rows = stack.bench.parts[CHOOSE]
        for j in joints:
            rest = stack.r[j][rows] - np.tensordot(theta[stack.ids[j]], stack.X[j][:, rows], 1)
            total += float(np.sum(rest**2))
    return total


def _objective(sums: BlockSums, blocks: NDArray[np.intp], free: NDArray[np.intp]) -> float:
    return sums.objective(sums.solve(blocks, free), blocks)


def joint_gain(problem: Problem, scores: list[Score]) -> float:
    """Fall of the penalised misfit with several candidates at once."""
    columns = [
        [column for s in scores for column in problem.columns(k, s.effect, s.place, s.shape)]
        for k in range(len(problem.benches))
    ]
    absorbed = [k for s in scores for k in problem.absorbed(s.effect, s.place)]
    sums = problem.extended(columns, absorbed)
    plain = problem.sums()
    both = sums.blocks(FIT, CHOOSE)
    n = problem.names
    used, at = list(range(n)), n
    for s in scores:
        for c in s.effect.coordinates:
            if s.x[c.name] != 0.0:
                used.append(at)
            at += 1
    free = np.array(used, dtype=np.intp)
    return _objective(plain, both, np.arange(n)) - _objective(sums, both, free)
