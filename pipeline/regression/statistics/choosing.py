"""Laws beside the URDF's bodies or beside fitted ones, and which of the two."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from pipeline.regression.laws.bodies import Bodies
from pipeline.regression.laws.design import folds_of
from pipeline.regression.laws.friction import LAW, LAWS
from pipeline.regression.laws.payload import Payload, nearest
from pipeline.regression.searching import ANY, Searching
from pipeline.regression.statistics.gram import Columns, Key, System, system
from pipeline.regression.statistics.jackknife import standard_error
from pipeline.regression.statistics.noise import Colour
from pipeline.regression.statistics.selection import (
    UNNAMED,
    Choice,
    choose_laws,
    upgrade,
)
from pipeline.regression.statistics.solve import Fit, beyond_chance, compare

Array = NDArray[np.float64]
#: Laws of all joints, and the predictive loss of every block with them.
Found = tuple[list[Choice], Array]
#: By how much nearer to their URDF all links are than with the one that carries something.
NEARER = 4.0
#: Uncertainties of a link that carries something, relative to what it is by its URDF.
ANY_LINK = (5.0, 20.0, 100.0)
#: What is left by a refit that closes most of what is left without: less than this share.
MOST = 0.5


class Choosing(Searching):
    """Laws and bodies."""

    def _laws(self) -> None:
        """Laws beside the URDF's bodies and beside fitted ones; a refit has to win beyond chance.

        Rotor inertia and a link's inertia, or a load and friction, stand in for each other: either
        way needs laws of its own before the two can be compared. An offset that bodies could be as
        well is no reason to keep the URDF's: bodies are looked at first.
        """
        columns = self._columns(self.couplings)
        normal = self._system(columns)
        self.bodies, self.loaded = Bodies.of(self.model), None
        kept, kept_loss = self._chosen(self._fit(normal, columns, 0.0))
        refit, loss = self._refit(normal, columns)
        wins = self._carries(normal, columns, (kept, kept_loss), (refit, loss))
        claims = [(str(j), "offset") for j, c in enumerate(kept) if "offset" in c.beside]
        stands = self._beside_any_bodies(claims, self._keys(kept))
        unsure = {c for c, good in zip(claims, stands, strict=True) if not good}
        if not wins and unsure:
            before, sigma = self.bodies_instead, self.sigma
            self.bodies_instead = before | unsure
            first = self._chosen(self._fit(normal, columns, 0.0), unsure)
            refit, loss = self._refit(normal, columns)
            worse, error = compare(loss, kept_loss, self.weight)
            wins = worse <= error and self._carries(normal, columns, first, (refit, loss))
            if not wins:
                self.bodies_instead, self.sigma = before, sigma
        if wins:
            refit, loss = self._one_link(normal, columns, (refit, loss))
        self.refit_share = self._share_of_draws(kept_loss - loss)
        if not wins:
            refit, self.sigma = kept, 0.0
        self.choices = [self._worth(j, c) for j, c in enumerate(refit)]

    def _refit(self, normal: System, columns: Columns) -> Found:
        """Laws beside fitted bodies, with the uncertainty of the URDF that has most evidence."""
        found = self._chosen(self._fit(normal, columns, self.sigma), self.bodies_instead)
        before = self.sigma
        self._strength(normal, columns, self._keys(found[0]))
        if self.sigma == before:
            return found
        return self._chosen(self._fit(normal, columns, self.sigma), self.bodies_instead)

    def _one_link(self, normal: System, columns: Columns, refit: Found) -> Found:
        """Bodies of which one alone is far from its URDF: it carries something.

        Where the URDF's uncertainty has to be large because of one link, evidence for a link of any
        size beside others that are nearly as stated is far greater.
        """
        if int(self.bodies.free.sum()) < 2:
            return refit
        keys, before, bodies = self._keys(refit[0]), self.sigma, self.bodies
        plain = max(self._evidence(normal, columns, keys, u) for u in self.options.uncertainties)
        small = [u for u in self.options.uncertainties if u <= before / NEARER]
        tried = []
        for k, u, wide in product(map(int, np.flatnonzero(bodies.free)), small, ANY_LINK):
            self.bodies = bodies.trusting(k, (u / wide) ** 2)
            tried.append((self._evidence(normal, columns, keys, u), k, u, wide))
        self.bodies = bodies
        least = plain + float(np.log(bodies.free.sum() / self.options.error_rate))
        if not tried or max(tried)[0] < least:
            return refit
        _, k, u, wide = max(tried)
        self.loaded = self._payload(normal, columns, keys, k, (u, wide))
        if self.loaded is not None:
            self.bodies, self.sigma = bodies.carrying(self.model, k, self.loaded.parameters), u
            found = self._chosen(self._fit(normal, columns, u), self.bodies_instead)
            worse, error = compare(found[1], refit[1], self.weight)
            if worse <= error:
                return found
        self.bodies, self.sigma, self.loaded = bodies, before, None
        return refit

    def _payload(
        self,
        normal: System,
        columns: Columns,
        keys: Sequence[Key],
        k: int,
        sigmas: tuple[float, float],
    ) -> Payload | None:
        """What a body carries, that alone is far from its URDF.

        Args:
            normal: Whitened normal equations.
            columns: That they are of.
            keys: Beside bodies.
            k: Which.
            sigmas: Uncertainty of the URDF, and of this body.
        """
        plain, (sigma, wide) = self.bodies, sigmas
        self.bodies = plain.trusting(k, (sigma / wide) ** 2)
        fit = self._fit(normal, columns, sigma)
        self.bodies = plain
        at = fit.columns(keys)
        gram, _ = fit.normal(self.weight, at)
        sizes = fit.solve(self.weight, at)
        mine = np.flatnonzero(fit.free_bodies // 10 == k)
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        inverse = np.linalg.pinv(gram / np.outer(scale, scale), rcond=1e-12, hermitian=True)
        spread = (inverse / np.outer(scale, scale))[np.ix_(mine, mine)]
        own = slice(10 * k, 10 * k + 10)
        spread = spread + np.linalg.inv(plain.metric[own, own]) * sigma**2
        return nearest(k, sizes[mine] - plain.nominal[own], spread)

    def _carries(self, normal: System, columns: Columns, kept: Found, refit: Found) -> bool:
        """Whether fitted bodies predict better beyond chance, and carry over.

        What closes next to nothing is no finding. In torque itself they must not lose, not only in
        what whitening sees; and where they do not close most of what is left, not from one part of
        the motion to the others either: a part that hardly moves a joint tells little of its
        bodies.
        """
        closes = 1.0 - float(refit[1].sum() / kept[1].sum())
        by_chance = not beyond_chance(kept[1], refit[1], self.options.error_rate)
        if by_chance or closes < self.options.closes:
            return False
        # The same rows with every joint's noise taken as white: what is promised is an error of
        # torque, and whitening hardly looks at its slow part.
        white = [Colour(np.zeros(0), c.level, c.level, 1.0) for c in self.noise]
        plain = system(columns, self.rows.tau, self.blocks, white)
        count = len(self.blocks)
        for folds in (self.folds, folds_of(count), folds_of(count, 2)):
            first = self._plain_losses(normal, plain, columns, 0.0, kept[0], folds)
            second = self._plain_losses(normal, plain, columns, self.sigma, refit[0], folds)
            gain, _ = compare(first, second, self.weight)
            if gain <= 0.0:
                return False
            if folds is self.folds and second.sum() < MOST * first.sum():
                return True
        return True

    def _worth(self, joint: int, choice: Choice) -> Choice:
        """A curve only where friction takes more than a model of the rest holds to, `LAW`."""
        torque = float(np.sqrt((self.rows.tau[:, joint] ** 2).mean()))
        small = self.friction is not None and float(self.friction[joint]) < LAW * torque
        return replace(choice, law=LAWS[0]) if choice.law is UNNAMED and small else choice

    def _share_of_draws(self, gain: Array) -> float:
        """Share of draws of the blocks in which their sum is a gain."""
        rng, n = np.random.default_rng(self.options.seed), len(gain)
        drawn = rng.integers(0, n, (max(self.options.draws, 1), n))
        return float((gain[drawn].sum(axis=1) > 0).mean())

    def _beside_any_bodies(self, claims: Sequence[Key], keys: Sequence[Key]) -> list[bool]:
        """Whether sizes hold no zero beside bodies that may be anything."""
        columns = self._columns(self.couplings)
        fit = self._fit(self._system(columns), columns, ANY)
        have = [k for k in claims if k in keys]
        at = fit.columns(keys)
        first = len(at) - len(keys)
        size = fit.solve(self.weight, at)[first:]
        error = standard_error(np.array([fit.solve(w, at)[first:] for w in self._leave_one_out()]))
        t = self._quantile(1.0 - self.options.error_rate / max(len(keys), 1))
        sure = {k: abs(x) > t * e for k, x, e in zip(keys, size, error, strict=True)}
        return [k not in have or bool(sure[k]) for k in claims]

    def _plain_losses(
        self,
        normal: System,
        plain: System,
        columns: Columns,
        sigma: float,
        found: list[Choice],
        folds: Sequence[NDArray[np.intp]],
    ) -> Array:
        """Loss of every block in torque itself, fitted with whitening on the other folds."""
        fit, bare = self._fit(normal, columns, sigma), self._fit(plain, columns, sigma)
        at = fit.columns(self._keys(found))
        out = np.zeros(len(self.blocks))
        for fold in folds:
            train = self.weight.copy()
            train[fold] = 0.0
            x = fit.solve(train, at)
            out[fold] = [bare.loss(int(b), at, x) for b in fold]
        return out

    def _chosen(self, fit: Fit, barred: Collection[Key] = ()) -> Found:
        """Laws of all joints and the predictive loss of every block with them.

        Args:
            fit: Beside the bodies of which.
            barred: Terms that are not allowed, with those that never are.
        """
        barred = self.barred.union(barred)
        rich = self._general()
        found = choose_laws(fit, self.folds, self.weight, rich, self._shared, 3, barred)
        found = upgrade(fit, self.folds, self.weight, found, self._shared, barred)
        at = fit.columns(self._keys(found))
        return found, fit.losses(self.folds, self.weight, at)
