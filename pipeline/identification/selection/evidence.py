"""How likely a log is with a set of names: the evidence.

With columns X whitened by the noise, prior N(mu, Lambda^-1) and H = X^T X + Lambda, a set of
unknowns has the evidence

    ln E = b^T H^-1 b / 2 - ln det H / 2 + ln det Lambda / 2 + const,   b = X^T r + Lambda mu

(MacKay, "Bayesian interpolation", Neural Computation 4, 1992). A tolerance has the prior of its
stated size, the bodies that of the URDF's uncertainty u, which is one more unknown; an effect's
coordinate may be as large as makes its torque as large as what is measured, and every name is as
likely as any other before the log is seen. So ten parameters per link, or a name of two, cost what
they are worth, and nothing else decides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.linalg

from actuators.arrays import Array, Index
from pipeline.effects.base import REACH
from pipeline.identification.regression.normal_equations import solve_spd
from pipeline.identification.regression.tolerances import STRAINS, UNCERTAINTY
from pipeline.identification.results import UNCERTAINTIES
from pipeline.identification.selection.pool import Key, Pool, Term
from pipeline.identification.selection.residual import saturated

#: How much likelier a set has to be with a name than without it, beyond even odds of all names
#: (logarithm).
MARGIN: Final = 3.0
#: The bodies of all links as one name.
BODIES: Final[Key] = ("rigid_body_parameters", ())
#: From this uncertainty of the URDF on, one link's centre of mass and a scale of all joints are a
#: part of the bodies.
COARSE: Final = 0.1
#: Parts of a log's blocks, each judged by estimates from the others.
FOLDS: Final = 8
RIDGE: Final = 1e-10


@dataclass(frozen=True)
class State:
    """A set of names."""

    #: Numbers of the pool's terms with the coordinates in use.
    terms: tuple[tuple[int, tuple[int, ...]], ...]
    uncertainty: float  #: Of the URDF's bodies [1].
    #: Its logarithm, priors of the names in it; up to a constant of the pool.
    evidence: float = -np.inf

    @property
    def numbers(self) -> tuple[int, ...]:
        """Of the terms."""
        return tuple(t for t, _ in self.terms)


class Evidence:
    """Of sets of names on one pool; names that are closed are not taken up."""

    def __init__(
        self, pool: Pool, weights: Array | None = None, closed: frozenset[Key] = frozenset()
    ) -> None:
        self.pool = pool
        self.closed = closed
        self.weights = noise_weights(pool) if weights is None else weights
        self.H, self.h = pool.total(self.weights)
        kinds = [n.kind in STRAINS for n in pool.problem.tolerances]
        self.bodies = np.flatnonzero(np.array(kinds, dtype=np.bool_))
        # A torque as large as the effort it touches.
        energy, square = np.zeros(self.pool.size), np.zeros(self.pool.size)
        for channel, w in zip(self.pool.channels, self.weights, strict=True):
            own = np.einsum("bii->i", channel.H)
            energy[channel.ids] += w * own
            square[channel.ids] += np.where(own > 0, channel.effort * channel.count.sum() * w, 0)
        self._wide = np.where(energy > 0.0, energy / np.maximum(square, 1e-300), 1.0)
        # A nonlinear parameter costs what a coordinate that many rows tell does.
        rows = 0.5 * np.log(max(np.mean([c.count.sum() for c in pool.channels]), 1.0))
        self._name = -np.log(len({t.key for t in pool.terms}) + 1) - MARGIN
        # A law that has another in it has to be worth more than that one by a name.
        self._prior = np.array(
            [
                self._name * (1 + bool(t.effect.contains))
                - rows * len(set(t.shape) - {REACH, *t.effect.fixed})
                for t in pool.terms
            ]
        )
        self._in_bodies = np.array([self._of_bodies(t) for t in pool.terms], dtype=np.bool_)
        # What a column looks across is a chord: it tells nothing of what is far smaller.
        self._least = np.array([0.5 * _reached(t) for t in pool.terms])
        pairs = list(zip(pool.channels, self.weights, strict=True))
        self._misfit = float(sum(w * c.s.sum() for c, w in pairs))
        count = float(sum(np.log(w) * c.count.sum() for c, w in pairs))
        self._none = 0.5 * (count - self._misfit)

    def _of_bodies(self, term: Term) -> bool:
        """Whether bodies that may be anything hold it."""
        one = len(self.pool.problem.model.joints) == 1
        scale = term.effect.name == "effort_gain" and (one or term.place[0].startswith("*"))
        return scale or term.effect.name == "center_of_mass_offset"

    @property
    def noise(self) -> Array:
        """Weights of squared residuals by joint and channel, (J, C)."""
        out = np.ones_like(self.pool.problem.sigma)
        for channel, w in zip(self.pool.channels, self.weights, strict=True):
            out[channel.joint, channel.number] = w
        return out

    def columns(self, state: State) -> Index:
        """Tolerances and the coordinates of its terms."""
        own = [self.pool.terms[t].columns[list(used)] for t, used in state.terms]
        return np.concatenate([np.arange(self.pool.base), *own]).astype(np.intp)

    def precision(self, columns: Index, uncertainty: float) -> Array:
        """Prior precision of some columns, tolerances among them."""
        # A tolerance that is a name in small stays open beside it: what it holds needs no name.
        every = np.concatenate([np.ones(self.pool.base), self._wide[self.pool.base :]])
        every[self.bodies] = (UNCERTAINTY / uncertainty) ** 2
        return np.maximum(every[columns], 1e-12 * np.maximum(np.diag(self.H)[columns], 1e-300))

    def solve(self, state: State) -> tuple[Index, Array, Array, float]:
        """Columns in use, Cholesky factor of H, estimate, and the evidence."""
        columns = self.columns(state)
        prior = self.precision(columns, state.uncertainty)
        A = self.H[np.ix_(columns, columns)] + np.diag(prior)
        scale = np.sqrt(np.diag(A))
        L = np.linalg.cholesky(A / np.outer(scale, scale) + RIDGE * np.eye(columns.size))
        L = scale[:, None] * L
        y = scipy.linalg.solve_triangular(L, self.h[columns], lower=True)
        x = scipy.linalg.solve_triangular(L, y, lower=True, trans=1)
        evidence = self._none + 0.5 * y @ y - np.log(np.diag(L)).sum() + 0.5 * np.log(prior).sum()
        evidence += sum(self._prior[t] for t in state.numbers)
        if state.uncertainty > UNCERTAINTIES[0]:
            evidence += self._name
        return columns, L, x, float(evidence)

    def reached(self, state: State, cost: float) -> float:
        """A state's evidence where another cost than that of these columns is reached.

        Args:
            state: With its evidence.
            cost: Twice the negative logarithm of likelihood and prior, of `Problem.cost`.
        """
        columns, L, _, evidence = self.solve(state)
        y = scipy.linalg.solve_triangular(L, self.h[columns], lower=True)
        return evidence - 0.5 * float(y @ y) + 0.5 * self._misfit - 0.5 * cost

    def promised(self, state: State) -> float:
        """How much more evidence the columns promise than the present model's estimates have.

        Args:
            state: The set of the present model.
        """
        columns = self.columns(state)
        held = self.pool.held
        prior = self.precision(columns, state.uncertainty) @ held[columns] ** 2
        cost = self._misfit + held @ (self.H @ held - 2.0 * self.h) + prior
        return self.solve(state)[3] - self.reached(state, float(cost))

    def valid(self, state: State) -> State:
        """A state with its evidence, coordinates against their sign left out."""
        while True:
            _, _, x, evidence = self.solve(state)
            at, kept, changed = self.pool.base, [], False
            for t, used in state.terms:
                own = x[at : at + len(used)]
                at += len(used)
                effect = self.pool.terms[t].effect
                stays = tuple(
                    k
                    for k, value in zip(used, own, strict=True)
                    if effect.coordinates[k].signed or value > 0.0
                )
                changed |= stays != used
                needed = [k for k, c in enumerate(effect.coordinates) if c.required]
                possible = self._plausible(t, dict(zip(used, own, strict=True)))
                possible &= set(needed) <= set(used)
                possible &= state.uncertainty < COARSE or not self._in_bodies[t]
                changed |= not possible
                if stays and set(needed) <= set(stays) and possible:
                    kept.append((t, stays))
            if not changed:
                return replace(state, evidence=evidence)
            state = replace(state, terms=tuple(kept))

    def _plausible(self, number: int, x: Mapping[int, float]) -> bool:
        term = self.pool.terms[number]
        names = [c.name for c in term.effect.coordinates]
        if abs(x.get(0, 0.0)) < self._least[number]:
            return False
        full = {name: x.get(k, 0.0) for k, name in enumerate(names)}
        if any(full[c.name] < 0 and not c.signed for c in term.effect.coordinates):
            return True  # its sign is judged by itself
        return term.effect.plausible(self.pool.problem.model, term.place, full, term.shape)

    def block_losses(self, state: State) -> Array:
        """Squared error of every block by estimates from other blocks, in noise variances, (B,).

        With its share of what the prior has against these estimates.
        """
        columns = self.columns(state)
        fold = np.arange(len(self.pool.channels[0].s)) % FOLDS
        H, h = self.pool.parts(columns, self.weights, fold)
        prior = np.diag(self.precision(columns, state.uncertainty))
        full = np.zeros((len(H), self.pool.size))
        for k in range(len(H)):
            A = np.delete(H, k, axis=0).sum(axis=0) + prior
            full[k, columns] = solve_spd(A, np.delete(h, k, axis=0).sum(axis=0))
        against = np.sum(full[:, columns] ** 2 * np.diag(prior), axis=1)
        out = against[fold] / fold.size
        for channel, w in zip(self.pool.channels, self.weights, strict=True):
            x = full[fold][:, channel.ids]  # (B, n)
            Hx = np.matmul(channel.H, x[:, :, None])[:, :, 0]
            out += w * (channel.s + np.sum(x * (Hx - 2.0 * channel.h), axis=1))
        return out

    def without(self, state: State, number: int) -> State:
        """A state with one term less."""
        kept = tuple((t, used) for t, used in state.terms if t != number)
        return self.valid(replace(state, terms=kept))

    def at(self, state: State, uncertainty: float) -> State:
        """A state at another uncertainty of the URDF."""
        return self.valid(replace(state, uncertainty=uncertainty))


def _reached(term: Term) -> float:
    """What the column of a term's first coordinate reaches across, beyond a small step."""
    return abs(term.shape.get(REACH, 0.0)) * term.effect.coordinates[0].step


def noise_weights(pool: Pool, estimated: bool = False) -> Array:
    """Weight of every channel: noise is what everything together leaves, with its memory.

    The residual of all columns over the samples it has left, at least the sensor's noise; where
    its gradient scatters more over blocks than independent samples would, samples count for less.

    Args:
        pool: The columns.
        estimated: Whether the present model holds estimates. What it leaves, over this noise and in
            the mean of all samples, is then the dispersion by which all of them count for less
            (McCullagh and Nelder, Generalized Linear Models, 1989, section 4.5), so that in a log
            that nothing explains to its noise no name is had for next to nothing.
    """
    out = np.empty(len(pool.channels))
    left, count = 0.0, 0.0
    for k, channel in enumerate(pool.channels):
        H, h, s = channel.H.sum(axis=0), channel.h.sum(axis=0), channel.s.sum()
        x, rank = saturated(H, h)
        n = channel.count.sum()
        variance = max((s - x @ h) / max(n - rank, 0.1 * n), 1.0)
        g = channel.h - channel.H @ x
        own = np.einsum("bii->bi", channel.H)
        live = own.sum(axis=0) > 0
        scatter = (g[:, live] ** 2).sum(axis=0) / (variance * own[:, live].sum(axis=0))
        out[k] = 1.0 / (variance * max(1.0, float(np.median(scatter)) if live.any() else 1.0))
        now = pool.held[channel.ids]
        left += float(s + now @ (H @ now - 2.0 * h)) / variance
        count += float(n)
    return out / max(1.0, left / count) if estimated else out
