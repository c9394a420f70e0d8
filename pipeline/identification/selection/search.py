"""Which names explain a log best: sets of names compared by their evidence.

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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from pipeline.effects.base import REACH, Effect
from pipeline.identification.regression.normal_equations import solve_spd
from pipeline.identification.regression.tolerances import STRAINS, UNCERTAINTY
from pipeline.identification.results import EXCLUDED, UNCERTAINTIES
from pipeline.identification.selection.pool import Key, Pool, Term, saturated

Array = NDArray[np.float64]
Index = NDArray[np.intp]
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
_RIDGE: Final = 1e-10
#: Evidence that a rival may lack and still be looked at.
CLOSE: Final = EXCLUDED + 5.0


@dataclass(frozen=True)
class State:
    """A set of names.

    Attributes:
        terms: Numbers of the pool's terms with the coordinates in use.
        uncertainty: Of the URDF's bodies [1].
        evidence: Its logarithm, priors of the names in it; up to a constant of the pool.
    """

    terms: tuple[tuple[int, tuple[int, ...]], ...]
    uncertainty: float
    evidence: float = -np.inf

    @property
    def numbers(self) -> tuple[int, ...]:
        """Of the terms."""
        return tuple(t for t, _ in self.terms)


class Search:
    """Evidence of sets of names on one pool; names that are closed are not taken up."""

    def __init__(
        self, pool: Pool, weights: Array | None = None, closed: frozenset[Key] = frozenset()
    ) -> None:
        self.pool = pool
        self.closed = closed
        self.weights = noise_weights(pool) if weights is None else weights
        self.H, self.h = pool.total(self.weights)
        self.bodies = np.array(
            [k for k, n in enumerate(pool.problem.tolerances) if n.kind in STRAINS], dtype=np.intp
        )
        self._wide = self._widths()
        names = len({t.key for t in pool.terms}) + 1
        # A nonlinear parameter costs what a coordinate that many rows tell does.
        rows = 0.5 * np.log(max(np.mean([c.count.sum() for c in pool.channels]), 1.0))
        nonlinear = [
            len([n for n in t.shape if n not in (REACH, *t.effect.fixed)]) for t in pool.terms
        ]
        self._name = -np.log(names) - MARGIN
        # A law that has another in it has to be worth more than that one by a name.
        each = [self._name * (1 + bool(t.effect.contains)) for t in pool.terms]
        self._prior = np.array(each) - rows * np.array(nonlinear)
        sums = [w * c.s.sum() for c, w in zip(pool.channels, self.weights, strict=True)]
        counts = [
            np.log(w) * c.count.sum() for c, w in zip(pool.channels, self.weights, strict=True)
        ]
        self._open = np.ones(len(pool.terms), dtype=np.bool_)
        self._shut = np.array([t.key in closed for t in pool.terms], dtype=np.bool_)
        self._index(pool)
        self._misfit = float(np.sum(sums))
        self._none = 0.5 * (float(np.sum(counts)) - self._misfit)

    def _index(self, pool: Pool) -> None:
        """Terms by their number of coordinates."""
        names = list(dict.fromkeys(t.key for t in pool.terms))
        self._keys = np.array([names.index(t.key) for t in pool.terms], dtype=np.intp)
        self._in_bodies = np.array([self._of_bodies(t) for t in pool.terms], dtype=np.bool_)
        # What a column looks across is a chord: it tells nothing of what is far smaller.
        self._least = np.array([0.5 * _reached(t) for t in pool.terms])
        counts = np.array([t.columns.size for t in pool.terms], dtype=np.intp)
        self._spare = np.array([bool(_spare(t.effect)) for t in pool.terms], dtype=np.bool_)
        self._by_count = {int(n): np.flatnonzero(counts == n) for n in np.unique(counts)}
        self._own = {
            n: np.array([pool.terms[t].columns for t in own]) for n, own in self._by_count.items()
        }
        self._signed = {
            n: np.array([[c.signed for c in pool.terms[t].effect.coordinates] for t in own])
            for n, own in self._by_count.items()
        }
        every = [t.columns for t in pool.terms]
        self._offered = np.unique(np.concatenate([_none(), *every]))

    def _of_bodies(self, term: Term) -> bool:
        """Whether bodies that may be anything hold it."""
        one = len(self.pool.problem.model.joints) == 1
        scale = term.effect.name == "effort_gain" and (one or term.place[0].startswith("*"))
        return scale or term.effect.name == "center_of_mass_offset"

    def _widths(self) -> Array:
        """Prior precision of coordinates: a torque as large as the effort it touches, (P,)."""
        energy, square = np.zeros(self.pool.size), np.zeros(self.pool.size)
        for channel, w in zip(self.pool.channels, self.weights, strict=True):
            own = np.einsum("bii->i", channel.H)
            energy[channel.ids] += w * own
            square[channel.ids] += np.where(own > 0, channel.effort * channel.count.sum() * w, 0)
        return np.where(energy > 0.0, energy / np.maximum(square, 1e-300), 1.0)

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
        L = np.linalg.cholesky(A / np.outer(scale, scale) + _RIDGE * np.eye(columns.size))
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
        term = self.pool.terms[number]
        return term.effect.place_kind != "joint pair" or not any(_excludes(term, h) for h in held)

    def _gains(self, numbers: Index, S: Array, g: Array, prior: Array) -> Array:
        """Rise of the evidence with terms of as many coordinates each, (T,)."""
        M = S + prior[:, None, :] * np.eye(g.shape[1])
        M = M + _RIDGE * M * np.eye(g.shape[1])
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

    def without(self, state: State, number: int) -> State:
        """A state with one term less."""
        kept = tuple((t, used) for t, used in state.terms if t != number)
        return self.valid(replace(state, terms=kept))

    def at(self, state: State, uncertainty: float) -> State:
        """A state at another uncertainty of the URDF."""
        return self.valid(replace(state, uncertainty=uncertainty))

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


def _reached(term: Term) -> float:
    """What the column of a term's first coordinate reaches across, beyond a small step."""
    return abs(term.shape.get(REACH, 0.0)) * term.effect.coordinates[0].step


def _spare(effect: Effect) -> list[int]:
    """Coordinates that a law may do without: components that may have either sign."""
    if not effect.has_law:
        return []
    return [k for k, c in enumerate(effect.coordinates) if c.signed and not c.required]


def _none() -> Index:
    return np.zeros(0, dtype=np.intp)


def _excludes(a: Term, b: Term) -> bool:
    """Whether two terms cannot be in one set: forms of a name, or couplings that share a joint."""
    both = a.effect.place_kind == b.effect.place_kind == "joint pair"
    return a.key == b.key or (both and bool(set(a.place) & set(b.place)))


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
