"""Which names explain a log best: steps from set to set, to the one with most evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
import scipy.linalg

from actuators.arrays import Array, Index
from pipeline.effects.base import Effect
from pipeline.identification.results import EXCLUDED, UNCERTAINTIES
from pipeline.identification.selection.evidence import BODIES, COARSE, RIDGE, Evidence, State
from pipeline.identification.selection.pool import Key, Pool, Term

#: Evidence that a rival may lack and still be looked at.
CLOSE: Final = EXCLUDED + 5.0


class Search(Evidence):
    """Steps from set to set on one pool."""

    def __init__(
        self, pool: Pool, weights: Array | None = None, closed: frozenset[Key] = frozenset()
    ) -> None:
        super().__init__(pool, weights, closed)
        every = [t.key for t in pool.terms]
        names = list(dict.fromkeys(every))
        self._keys = np.array([names.index(key) for key in every], dtype=np.intp)
        self._open = np.ones(len(every), dtype=np.bool_)
        self._shut = np.array([key in closed for key in every], dtype=np.bool_)
        self._spare = np.array([bool(_spare(t.effect)) for t in pool.terms], dtype=np.bool_)
        self._offered = np.arange(pool.base, pool.size)
        # Terms by their number of coordinates.
        counts = np.array([t.columns.size for t in pool.terms], dtype=np.intp)
        self._by_count = {int(n): np.flatnonzero(counts == n) for n in np.unique(counts)}
        self._own = {
            n: np.array([pool.terms[t].columns for t in own]) for n, own in self._by_count.items()
        }
        self._signed = {
            n: np.array([[c.signed for c in pool.terms[t].effect.coordinates] for t in own])
            for n, own in self._by_count.items()
        }

    def gains(self, state: State) -> Array:
        """Rise of the evidence with each further term, (T,); minus infinity where it cannot be."""
        pool = self.pool
        columns, L, x, _ = self.solve(state)
        rest = np.setdiff1d(self._offered, columns)
        W = scipy.linalg.solve_triangular(L, self.H[np.ix_(columns, rest)], lower=True)
        where = np.full(pool.size, -1)
        where[rest] = np.arange(rest.size)
        g = self.h[rest] - self.H[np.ix_(rest, columns)] @ x
        prior = self.precision(rest, state.uncertainty)
        held = [pool.terms[t] for t in state.numbers]
        out = np.full(len(pool.terms), -np.inf)
        open_ = (
            self._open & ~self._shut & ~np.isin(self._keys, [self._keys[t] for t in state.numbers])
        )
        if state.uncertainty >= COARSE:
            open_ &= ~self._in_bodies
        for count, numbers in self._by_count.items():
            tried = np.array([n for n in numbers[open_[numbers]] if self._allowed(n, held)], int)
            if not tried.size:
                continue
            at = self._own[count][np.searchsorted(numbers, tried)]  # columns (T, p)
            w = where[at]
            V = W[:, w]  # (n, T, p)
            S = self.H[at[:, :, None], at[:, None, :]] - np.einsum("ntp,ntq->tpq", V, V)
            out[tried] = self._gains(tried, S, g[w], prior[w]) + self._prior[tried]
        return out

    def _allowed(self, number: int, held: Sequence[Term]) -> bool:
        """Whether a term can stand beside those held: couplings that share a joint cannot."""
        term = self.pool.terms[number]
        if term.effect.place_kind != "joint pair":
            return True
        pairs = [h for h in held if h.effect.place_kind == "joint pair"]
        return not any({*term.place} & {*h.place} for h in pairs)

    def _gains(self, numbers: Index, S: Array, g: Array, prior: Array) -> Array:
        """Rise of the evidence with terms of as many coordinates each, (T,)."""
        M = S + prior[:, None, :] * np.eye(g.shape[1])
        M = M + RIDGE * M * np.eye(g.shape[1])
        sound = np.linalg.eigvalsh(M)[:, 0] > 0.0
        M[~sound] = np.eye(g.shape[1])
        x = np.linalg.solve(M, g[:, :, None])[:, :, 0]
        out = 0.5 * np.sum(g * x, axis=1) - 0.5 * np.linalg.slogdet(M)[1]
        out += 0.5 * np.log(prior).sum(axis=1)
        out[~sound | (abs(x[:, 0]) < self._least[numbers])] = -np.inf
        own = np.searchsorted(self._by_count[g.shape[1]], numbers)
        wrong = ((x < 0.0) & ~self._signed[g.shape[1]][own]).any(axis=1)
        # A coordinate left out saves its ln(S / prior) / 2 at most.
        saved = 0.5 * np.log(np.maximum(np.einsum("tii->ti", M) / prior, 1.0)).sum(axis=1)
        close = out + self._prior[numbers] + saved > -CLOSE
        for k in np.flatnonzero(sound & close & (wrong | self._spare[numbers])):
            out[k] = self._gain(self.pool.terms[numbers[k]], S[k], g[k], prior[k])
        return out

    def _gain(self, term: Term, S: Array, g: Array, prior: Array) -> float:
        """The same of one term, without coordinates against their sign or not worth it."""
        coordinates = term.effect.coordinates

        def rise(free: Sequence[int]) -> tuple[float, Array]:
            M = S[np.ix_(free, free)] + np.diag(prior[free])
            x = np.linalg.solve(M, g[free])
            size = np.linalg.slogdet(M)[1] - np.log(prior[free]).sum()
            return float(0.5 * g[free] @ x - 0.5 * size), np.asarray(x)

        free = list(range(len(coordinates)))
        while free:
            most, x = rise(free)
            wrong = [k for k, v in zip(free, x, strict=True) if v < 0 and not coordinates[k].signed]
            if any(coordinates[k].required for k in wrong):
                return -np.inf
            if not wrong:
                spare = [k for k in free if k in _spare(term.effect)] if len(free) > 1 else []
                less = {k: rise([f for f in free if f != k])[0] for k in spare}
                worst = max(less, key=less.__getitem__, default=None)
                if worst is None or less[worst] <= most:
                    return most
                wrong = [worst]
            free = [k for k in free if k not in wrong]
        return -np.inf

    def with_term(self, state: State, number: int) -> State:
        """A state with one term more, in as few of its components as make the log likeliest."""
        effect = self.pool.terms[number].effect
        used = tuple(range(len(effect.coordinates)))
        state = self.valid(replace(state, terms=(*state.terms, (number, used))))
        while number in state.numbers:
            *before, (_, used) = state.terms
            forms = [
                (*before, (number, tuple(u for u in used if u != k)))
                for k in _spare(effect)
                if k in used and len(used) > 1
            ]
            less = (self.valid(replace(state, terms=form)) for form in forms)
            better = max(less, key=lambda s: s.evidence, default=state)
            if better.evidence <= state.evidence:
                break
            state = better
        return state

    def removals(self, state: State) -> Array:
        """Rise of the evidence without each term, (T,).

        With the posterior covariance C of the coordinates d of a term and S = C_dd^-1,

            ln E' - ln E = (ln det S - ln det Lambda_d - x_d^T S x_d) / 2 - ln prior of the name.
        """
        columns, L, x, _ = self.solve(state)
        half = scipy.linalg.solve_triangular(L, np.eye(columns.size), lower=True)
        prior = self.precision(columns, state.uncertainty)
        out, at = np.empty(len(state.terms)), self.pool.base
        for k, (t, used) in enumerate(state.terms):
            d = slice(at, at + len(used))
            at += len(used)
            S = np.linalg.inv(half[:, d].T @ half[:, d])
            size = np.linalg.slogdet(S)[1] - np.log(prior[d]).sum()
            out[k] = 0.5 * (size - x[d] @ S @ x[d]) - self._prior[t]
        return out

    def _freed(self, state: State, uncertainties: Sequence[float]) -> State:
        every = [self.at(state, u) for u in uncertainties if u != state.uncertainty]
        return max([state, *every], key=lambda s: s.evidence)

    @property
    def uncertainties(self) -> tuple[float, ...]:
        """Of the URDF's bodies that are open."""
        return UNCERTAINTIES[:1] if BODIES in self.closed else UNCERTAINTIES

    def left(self, state: State) -> State:
        """A state without what is closed."""
        kept = tuple((t, used) for t, used in state.terms if not self._shut[t])
        uncertainty = min(state.uncertainty, self.uncertainties[-1])
        return self.valid(State(kept, uncertainty))

    def climbed(
        self, state: State, uncertainties: Sequence[float], laws_first: bool = False
    ) -> State:
        """The best state that steps of one name reach.

        Couplings, which bring a shaft, come last.

        Args:
            state: To start from.
            uncertainties: Of the URDF's bodies, to try.
            laws_first: Whether curves, which hold several laws, come last, too.
        """
        terms = self.pool.terms
        simple = [t.effect.place_kind != "joint pair" for t in terms]
        laws = [t.effect.has_law or not laws_first for t in terms]
        self._open = np.array(simple, dtype=np.bool_) & np.array(laws, dtype=np.bool_)
        state = self._climbed(state, uncertainties)
        self._open[:] = True
        return self._climbed(state, uncertainties)

    def _climbed(self, state: State, uncertainties: Sequence[float]) -> State:
        state = self.valid(state)
        while True:
            better = self.pruned(self._freed(self._grown(state), uncertainties))
            better = self._swapped(better)
            better = self._freed(better, uncertainties)
            if better.evidence <= state.evidence + 1e-6:
                return state
            state = better

    def _grown(self, state: State) -> State:
        while True:
            gains = self.gains(state)
            for number in np.argsort(-gains)[:3]:
                if gains[number] <= 0.0:
                    return state
                more = self.pruned(self.with_term(state, int(number)))
                if more.evidence > state.evidence + 1e-6:
                    state = more
                    break
            else:
                return state

    def pruned(self, state: State) -> State:
        """A state without the terms that make it less likely."""
        while state.terms:
            changes = self.removals(state)
            best = int(np.argmax(changes))
            if changes[best] <= 0.0:
                return state
            less = self.without(state, state.numbers[best])
            if less.evidence <= state.evidence:
                return state
            state = less
        return state

    def _swapped(self, state: State) -> State:
        """Each term against what may stand in its place."""
        for t in state.numbers:
            rest = self.without(state, t)
            gains = self.gains(rest)
            best = int(np.argmax(gains))
            if best != t and rest.evidence + gains[best] > state.evidence + 1e-6:
                other = self.pruned(self.with_term(rest, best))
                if other.evidence > state.evidence + 1e-6:
                    return self._swapped(other)
        return state


def _spare(effect: Effect) -> list[int]:
    """Coordinates that a law may do without: components that may have either sign."""
    if not effect.has_law:
        return []
    return [k for k, c in enumerate(effect.coordinates) if c.signed and not c.required]
