"""Laws beside the URDF's bodies or beside fitted ones, and which of the two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from pipeline.regression.laws.design import folds_of
from pipeline.regression.laws.friction import LAW, LAWS
from pipeline.regression.searching import Searching
from pipeline.regression.statistics.gram import Columns, System, system
from pipeline.regression.statistics.noise import Colour
from pipeline.regression.statistics.selection import (
    UNNAMED,
    Choice,
    choose_laws,
    upgrade,
)
from pipeline.regression.statistics.solve import Fit, compare

Array = NDArray[np.float64]


class Choosing(Searching):
    """Laws and bodies."""

    def _laws(self) -> None:
        """Laws beside the URDF's bodies and beside fitted ones; a refit has to win beyond chance.

        Rotor inertia and a link's inertia, or a load and friction, stand in for each other: either
        way needs laws of its own before the two can be compared. A refit must carry over: from one
        half of the log to the other as well, and in torque itself, not only in what whitening sees.
        """
        columns = self._columns(self.couplings)
        normal = self._system(columns)
        # The same rows with every joint's noise taken as white: what is promised is an error of
        # torque, and whitening hardly looks at its slow part.
        white = [Colour(np.zeros(0), c.level, c.level, 1.0) for c in self.noise]
        plain = system(columns, self.rows.tau, self.blocks, white)
        kept, kept_loss = self._chosen(self._fit(normal, columns, 0.0))
        refit, loss = self._chosen(self._fit(normal, columns, self.sigma))
        before = self.sigma
        self._strength(normal, columns, self._keys(refit))
        if self.sigma != before:
            refit, loss = self._chosen(self._fit(normal, columns, self.sigma))
        wins = self._beyond_chance(kept_loss, loss)
        count = len(self.blocks)
        for folds in (self.folds, folds_of(count), folds_of(count, 2)):
            plainly = self._plain_losses(normal, plain, columns, 0.0, kept, folds)
            fitted = self._plain_losses(normal, plain, columns, self.sigma, refit, folds)
            # In torque itself, and from part to part of the motion, it must not lose beyond chance.
            gain, error = compare(plainly, fitted, self.weight)
            wins = wins and gain > -error
        self.refit_share = self._share_of_draws(kept_loss - loss)
        if not wins:
            refit, self.sigma = kept, 0.0
        self.choices = [self._worth(j, c) for j, c in enumerate(refit)]

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

    def _beyond_chance(self, first: Array, second: Array) -> bool:
        gain, error = compare(first, second, self.weight)
        chance = scipy.stats.t.ppf(1 - self.options.error_rate, len(self.blocks) - 1)
        return gain > float(chance) * error

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

    def _chosen(self, fit: Fit) -> tuple[list[Choice], Array]:
        """Laws of all joints and the predictive loss of every block with them."""
        rich = self._general()
        found = choose_laws(fit, self.folds, self.weight, rich, self._shared, 3, self.barred)
        found = upgrade(fit, self.folds, self.weight, found, self._shared, self.barred)
        at = fit.columns(self._keys(found))
        return found, fit.losses(self.folds, self.weight, at)
