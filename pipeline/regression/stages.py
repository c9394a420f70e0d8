"""The richest model: its noise, its couplings, how far it bends, where friction rises."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.regression.laws.coupling import Coupling, every_pair
from pipeline.regression.laws.friction import (
    BESIDE,
    TRANSITIONS,
    TRAVELS,
    Shape,
    general_terms,
)
from pipeline.regression.state import State
from pipeline.regression.statistics.gram import Columns, Key, System
from pipeline.regression.statistics.noise import Colour, colour
from pipeline.regression.statistics.selection import find_coupling
from pipeline.regression.statistics.solve import RIDGE, Eliminated, beyond_chance


class Stages(State):
    """Stages that need no law."""

    def _rich(self, colours: bool | None = None) -> None:
        """Fit everything; its residual is the noise, its bodies give the load.

        Args:
            colours: Whether the noise has a colour; by default it stays as it was.
        """
        columns = self._columns(self.couplings)
        fit = self._fit(self._system(columns), columns, self.sigma)
        keys = self._keys(self._general())
        at = fit.columns(keys)
        x = fit.known.copy()
        x[at] = fit.solve(self.weight, at)
        self.load = self.design.load(x[: fit.n_bodies])
        residual = self._residual(columns, keys, x[fit.system.index(keys)])
        self.sizes, self.fitted = dict(zip(fit.system.keys, x, strict=True)), x[: fit.n_bodies]
        self.left, self.told = residual, self._torque(residual)
        size = np.empty(self.model.nv)
        for j in range(self.model.nv):
            parts = [
                x[fit.system.where[(str(j), t)]] * columns.local[j][t] for t in general_terms()
            ]
            size[j] = float(np.sqrt((np.sum(parts, axis=0) ** 2).mean()))
        self.friction = size
        if colours:
            seen = [residual[:, j] * self._sure(columns, j) for j in range(self.model.nv)]
            self.noise = [colour(x, self.blocks) for x in seen]
        elif colours is not None:
            self.noise = [Colour(np.zeros(0), s, s, 1.0) for s in residual.std(axis=0) + 1e-12]

    def _couple(self) -> None:
        pairs = every_pair(self.model.nv)
        while pairs:
            rest = [c for c in pairs if c not in self.couplings]
            columns = self.design.columns(self.load, self.couplings, rest)
            columns = replace(columns, shared={**columns.shared, **self.actions})
            fit = self._fit(self._system(columns), columns, self.sigma)
            found = find_coupling(
                fit,
                self.folds,
                self.weight,
                self._general(),
                self._shared,
                rest,
                self.options.error_rate,
            )
            if found is None:
                break
            self.couplings.append(found)
            self._rich(colours=True)

    def _strengths(self) -> None:
        """How far the general member bends and the URDF may be off, by validation blocks."""
        columns = self._columns(self.couplings)
        s = self._system(columns)
        keys = self._keys(self._general())
        total = []
        for bend in self.options.bends:
            self.bend = bend
            fit = self._fit(s, columns, self.sigma)
            total.append(fit.losses(self.folds, self.weight, fit.columns(keys)).sum())
        self.bend = self.options.bends[int(np.argmin(total))]
        self._strength(s, columns, keys)

    def _strength(self, s: System, columns: Columns, keys: Sequence[Key]) -> None:
        """Uncertainty of the URDF of most evidence beside some columns.

        With P the prior's precision, which grows with 1 / sigma^2, and H = G + P,

            ln E = m^T H^-1 m / 2 - ln det H / 2 + ln det P / 2

        (MacKay, "Bayesian interpolation", Neural Computation 4, 1992).
        """
        evidence = [self._evidence(s, columns, keys, u) for u in self.options.uncertainties]
        self.sigma = self.options.uncertainties[int(np.argmax(evidence))]

    def _evidence(self, s: System, columns: Columns, keys: Sequence[Key], sigma: float) -> float:
        """Logarithm of the evidence for an uncertainty of the URDF, up to a constant."""
        fit = self._fit(s, columns, sigma)
        at = fit.columns(keys)
        gram, moment = fit.normal(self.weight, at)
        # About the URDF, so that the prior pulls nowhere.
        off = np.zeros(len(at))
        off[: len(fit.free_bodies)] = self.bodies.centre[fit.free_bodies]
        prior = fit.prior_moment[at] - fit.prior_gram[np.ix_(at, at)] @ off
        moment = moment - gram @ off - prior
        scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        scaled = gram / np.outer(scale, scale)
        scaled[np.diag_indices_from(scaled)] += RIDGE
        fall = (moment / scale) @ np.linalg.solve(scaled, moment / scale)
        size = np.linalg.slogdet(scaled)[1] + 2.0 * np.log(scale).sum()
        trust = 5.0 * float(np.log(self.bodies.trust[self.bodies.free]).sum())
        return float(0.5 * fall - 0.5 * size + trust - len(fit.free_bodies) * np.log(sigma))

    def _rise(self) -> None:
        """Speed or travel over which friction rises after a reversal: what predicts best.

        That of coupled motors first, beside friction of any shape at the joints; the joint of such
        a motor has the same, since the two could take each other's part.
        """
        for number, c in enumerate(self.couplings):
            speed = Shape.of(c.speed(self.rows.v), 0.0).speed
            tried = [replace(c, rise=share * speed, travel=0.0) for share in TRANSITIONS]
            tried += [replace(c, rise=0.0, travel=travel) for travel in TRAVELS]
            others = [o for k, o in enumerate(self.couplings) if k != number]
            losses = [self._loss_with([*others, one]) for one in tried]
            self.couplings[number] = tried[int(np.argmin(losses))]
        columns = self._columns(self.couplings)
        fit = self._fit(self._system(columns), columns, self.sigma)
        rich = [c.keys(j) for j, c in enumerate(self._general())]
        shared = self._shared
        shapes = list(self.design.shapes)
        coupled = {c.motor: c for c in self.couplings}
        for j in range(self.model.nv):
            if j in coupled:
                c = coupled[j]
                shapes[j] = replace(shapes[j], rise=c.rise, travel=c.travel)
                continue
            common = [k for i, ks in enumerate(rich) if i != j for k in ks] + shared
            names = ["viscous", *BESIDE]
            for k in range(len(TRANSITIONS)):
                names += [f"rising@{k}", f"rising_load@{k}"]
            for k in range(len(TRAVELS)):
                names += [f"sliding@{k}", f"sliding_load@{k}"]
            own = fit.system.index([(str(j), t) for t in names])
            e = Eliminated(fit, self.folds, self.weight, fit.columns(common), own)
            best = self._likeliest(e, len(names))
            if best < len(TRANSITIONS):
                rise = TRANSITIONS[best] * shapes[j].speed
                shapes[j] = replace(shapes[j], rise=rise, travel=0.0)
            else:
                travel = TRAVELS[best - len(TRANSITIONS)]
                shapes[j] = replace(shapes[j], rise=0.0, travel=travel)
        self.design = replace(self.design, shapes=tuple(shapes))

    def _likeliest(self, e: Eliminated, count: int) -> int:
        """Which rise predicts best, without an offset where one predicts no better beyond chance.

        Of a joint that rests between moves in one direction an offset is dry friction that is held
        at rest; beside it any rise would do.

        Args:
            e: Of viscous friction, what is beside friction, and pairs of columns by rise.
            count: Of these columns.
        """
        first, offset = 1 + len(BESIDE), 1 + BESIDE.index("offset")
        both = [
            [
                e.losses([*(n for n in range(first) if n not in out), k, k + 1])
                for out in ((), (offset,))
            ]
            for k in range(first, count, 2)
        ]
        best, bare = (min((x[w] for x in both), key=lambda x: float(x.sum())) for w in (0, 1))
        needed = beyond_chance(bare, best, self.options.error_rate)
        sums = [float(x[int(not needed)].sum()) for x in both]
        return int(np.argmin(sums))

    def _loss_with(self, couplings: Sequence[Coupling]) -> float:
        """Predictive loss beside friction of any shape with some couplings."""
        columns = self._columns(couplings)
        fit = self._fit(self._system(columns), columns, self.sigma)
        keys = self._keys(self._general())
        return float(fit.losses(self.folds, self.weight, fit.columns(keys)).sum())
