"""Rigid bodies, friction of every joint and couplings of a machine with a fixed base, together.

The order of a good engineer: the richest model first, whose residual is the noise; couplings and
the refit of bodies beside friction of any shape; then for every joint the simplest law that
predicts blocks it did not see as well as any; what does not stand is dropped and the rest fitted
anew; sizes with intervals from leaving out blocks; shares from drawing blocks anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import scipy.stats
from numpy.typing import NDArray

from pipeline.regression.base_parameters import base_set
from pipeline.regression.bodies import Bodies, consistent, with_parameters
from pipeline.regression.coupling import Coupling, every_pair
from pipeline.regression.design import Design, even_blocks, folds_of
from pipeline.regression.errors import RegressionError
from pipeline.regression.friction import (
    BESIDE,
    SIGNED,
    TRANSITIONS,
    Law,
    bends,
    general_terms,
    kind,
    name_of,
    unit,
)
from pipeline.regression.gram import Columns, Key, System, system
from pipeline.regression.noise import Colour, Span, colour
from pipeline.regression.preprocess import Rows
from pipeline.regression.result import BaseParameter, Friction, Level, Result, Term
from pipeline.regression.selection import (
    UNNAMED,
    Choice,
    choose_laws,
    find_coupling,
    general,
    upgrade,
)
from pipeline.regression.solve import Eliminated, Fit, Prior, compare

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Options:
    """Error rates and sizes of the search.

    Attributes:
        error_rate: Chance of one wrong coupling, of a refit of true bodies, and of one confirmed
            size whose interval should have held zero, per log.
        coverage: Of the intervals.
        sure: Share of draws from which a name is confirmed: so often it should be right.
        draws: Of the log's blocks.
        uncertainties: Of the URDF that validation chooses from, beside no refit.
        closes: Share of what stays unexplained below which a size closes next to nothing.
        bends: Of the general member: how far it may depart from Coulomb, viscous and
            load-dependent friction, as a share of the joint's torque; validation chooses.
        seed: Of the draws.
    """

    error_rate: float = 0.05
    coverage: float = 0.95
    sure: float = 0.95
    draws: int = 50
    uncertainties: tuple[float, ...] = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
    closes: float = 0.01
    bends: tuple[float, ...] = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0)
    seed: int = 0


def identify(
    rows: Rows,
    model: pin.Model,
    *,
    blocks: Sequence[Span] | None = None,
    options: Options | None = None,
) -> Result:
    """Identify a machine from its training rows.

    Args:
        rows: Training rows; nothing else is looked at.
        model: By the URDF; its joints in the order of the rows' columns.
        blocks: Stretches that are drawn and left out together, such as whole cycles; found from the
            correlation of the noise by default.
        options: Error rates.

    Raises:
        RegressionError: Joints do not match, or there are too few blocks.
    """
    return _Identification(rows, model, blocks, options or Options()).run()


class _Identification:
    """State of one identification: what stands so far."""

    def __init__(
        self, rows: Rows, model: pin.Model, blocks: Sequence[Span] | None, options: Options
    ) -> None:
        if model.nv != rows.v.shape[1]:
            raise RegressionError(
                f"the model has {model.nv} joints, the rows {rows.v.shape[1]}; expected the same"
            )
        self.rows, self.model, self.options, self.given = rows, model, options, blocks
        self.bodies = Bodies.of(model)
        self.design = Design.of(model, rows)
        self.names = tuple(model.names[1:])
        self.couplings: list[Coupling] = []
        self.noise = [Colour(np.zeros(0), s, s, 1.0) for s in rows.tau.std(axis=0) + 1e-12]
        self.load = self.design.load(self.bodies.nominal)
        self.friction: Array | None = None
        self.sigma = 1.0
        self.bend = 0.1
        self.bends = frozenset(bends())
        self.choices = [general(j) for j in range(model.nv)]
        self._block(5.0)

    # -- columns and regressions ---------------------------------------------------------------

    def _block(self, correlation: float) -> None:
        if self.given is not None:
            self.blocks = list(self.given)
        else:
            self.blocks = even_blocks(len(self.rows.time), self.rows.start, correlation)
        if len(self.blocks) < 4:
            raise RegressionError(
                f"{len(self.rows.time)} rows at {self.rows.rate:g} Hz are {len(self.blocks)} "
                "blocks that are longer than the noise is correlated; expected 4 or more"
            )
        self.folds = folds_of(len(self.blocks))
        self.weight = np.ones(len(self.blocks))

    def _columns(self, couplings: Sequence[Coupling]) -> Columns:
        return self.design.columns(self.load, couplings)

    def _system(self, columns: Columns) -> System:
        return system(columns, self.rows.tau, self.blocks, self.noise, self.friction)

    def _fit(self, s: System, columns: Columns, sigma: float) -> Fit:
        precision = np.zeros(len(s.keys))
        torque = self.rows.tau.std(axis=0) + 1e-12
        for k, (place, term) in enumerate(s.keys):
            if place == "body":
                continue
            if place == "shared":
                parts = columns.shared[term]
                ratio = [float(np.sqrt((x**2).mean())) / torque[j] for j, x in parts.items()]
                precision[k] = (max(ratio) / 3.0) ** 2
            elif term.startswith("loaded@"):
                precision[k] = 1.0 / self.bend**2
            elif term in self.bends:
                precision[k] = 1.0 / (self.bend * torque[int(place)]) ** 2
            else:
                x = columns.local[int(place)][term]
                precision[k] = (float(np.sqrt((x**2).mean())) / torque[int(place)] / 3.0) ** 2
        return Fit(s, Prior(self.bodies, sigma, precision))

    def _keys(self, choices: Sequence[Choice] | None = None) -> list[Key]:
        keys = [k for j, c in enumerate(choices or self.choices) for k in c.keys(j)]
        return keys + [("shared", n) for c in self.couplings for n in c.names]

    def _residual(self, columns: Columns, keys: Sequence[Key], sizes: Array) -> Array:
        out = self.rows.tau.copy()
        for (place, term), size in zip(keys, sizes, strict=True):
            if place == "body":
                continue
            if place == "shared":
                for j, x in columns.shared[term].items():
                    out[:, j] -= size * x
            else:
                out[:, int(place)] -= size * columns.local[int(place)][term]
        return out - self.rows.thin(self.load)

    # -- stages --------------------------------------------------------------------------------

    def run(self) -> Result:
        """All stages in order."""
        self._rich(colours=False)
        self._rich(colours=True)
        self._couple()
        self._rich(colours=True)
        self._block(max(c.correlation for c in self.noise))
        self._rich(colours=True)
        self._strengths()
        self._rise()
        self._rich(colours=True)
        self._laws()
        return self._finish()

    def _rich(self, colours: bool) -> None:
        """Fit everything; its residual is the noise, its bodies give the load."""
        columns = self._columns(self.couplings)
        fit = self._fit(self._system(columns), columns, self.sigma)
        keys = self._keys([general(j) for j in range(self.model.nv)])
        at = fit.columns(keys)
        x = fit.known.copy()
        x[at] = fit.solve(self.weight, at)
        self.load = self.design.load(x[: fit.n_bodies])
        residual = self._residual(columns, keys, x[fit.system.index(keys)])
        size = np.empty(self.model.nv)
        for j in range(self.model.nv):
            parts = [
                x[fit.system.where[(str(j), t)]] * columns.local[j][t] for t in general_terms()
            ]
            size[j] = float(np.sqrt((np.sum(parts, axis=0) ** 2).mean()))
        self.friction = size
        if colours:
            self.noise = [colour(residual[:, j], self.blocks) for j in range(self.model.nv)]
        else:
            self.noise = [Colour(np.zeros(0), s, s, 1.0) for s in residual.std(axis=0) + 1e-12]

    def _couple(self) -> None:
        pairs = every_pair(self.model.nv)
        while pairs:
            rest = [c for c in pairs if c not in self.couplings]
            columns = self.design.columns(self.load, self.couplings, rest)
            fit = self._fit(self._system(columns), columns, self.sigma)
            found = find_coupling(
                fit,
                self.folds,
                self.weight,
                [general(j) for j in range(self.model.nv)],
                self.couplings,
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
        keys = self._keys([general(j) for j in range(self.model.nv)])
        total = []
        for bend in self.options.bends:
            self.bend = bend
            fit = self._fit(s, columns, self.sigma)
            total.append(fit.losses(self.folds, self.weight, fit.columns(keys)).sum())
        self.bend = self.options.bends[int(np.argmin(total))]
        self._strength(s, columns, keys)

    def _strength(self, s: System, columns: Columns, keys: Sequence[Key]) -> None:
        """Uncertainty of the URDF that predicts best beside some columns."""
        losses = []
        for sigma in self.options.uncertainties:
            fit = self._fit(s, columns, sigma)
            losses.append(float(fit.losses(self.folds, self.weight, fit.columns(keys)).sum()))
        self.sigma = self.options.uncertainties[int(np.argmin(losses))]

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
        for folds in (self.folds, folds_of(len(self.blocks), 2)):
            wins = wins and self._beyond_chance(
                self._plain_losses(normal, plain, columns, 0.0, kept, folds),
                self._plain_losses(normal, plain, columns, self.sigma, refit, folds),
            )
        if wins:
            self.choices = refit
        else:
            self.choices, self.sigma = kept, 0.0

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
        rich = [general(j) for j in range(self.model.nv)]
        found = choose_laws(fit, self.folds, self.weight, rich, self.couplings, passes=3)
        found = upgrade(fit, self.folds, self.weight, found, self.couplings)
        at = fit.columns(self._keys(found))
        return found, fit.losses(self.folds, self.weight, at)

    def _rise(self) -> None:
        """Speed over which friction rises after a reversal, per joint: what predicts best."""
        columns = self._columns(self.couplings)
        fit = self._fit(self._system(columns), columns, self.sigma)
        rich = [general(j).keys(j) for j in range(self.model.nv)]
        shared: list[Key] = [("shared", n) for c in self.couplings for n in c.names]
        coupled = {c.motor for c in self.couplings}
        shapes = list(self.design.shapes)
        for j in range(self.model.nv):
            if j in coupled:
                losses = [self._with_rise(j, share) for share in TRANSITIONS]
            else:
                common = [k for i, ks in enumerate(rich) if i != j for k in ks] + shared
                names = ["viscous", *BESIDE]
                for k in range(len(TRANSITIONS)):
                    names += [f"rising@{k}", f"rising_load@{k}"]
                own = fit.system.index([(str(j), t) for t in names])
                e = Eliminated(fit, self.folds, self.weight, fit.columns(common), own)
                losses = [
                    float(e.losses([0, 1, 2, 3 + 2 * k, 4 + 2 * k]).sum())
                    for k in range(len(TRANSITIONS))
                ]
            share = TRANSITIONS[int(np.argmin(losses))]
            shapes[j] = replace(shapes[j], rise=share * shapes[j].speed)
        self.design = replace(self.design, shapes=tuple(shapes))

    def _with_rise(self, joint: int, share: float) -> float:
        """Predictive loss with the friction of one joint and of its coupled motor rising so."""
        shapes = list(self.design.shapes)
        shapes[joint] = replace(shapes[joint], rise=share * shapes[joint].speed)
        columns = replace(self.design, shapes=tuple(shapes)).columns(self.load, self.couplings)
        fit = self._fit(self._system(columns), columns, self.sigma)
        simple = Choice(Law("", ("coulomb", "viscous", "load")), BESIDE, 0.0)
        choices = [simple if j == joint else general(j) for j in range(self.model.nv)]
        return float(fit.losses(self.folds, self.weight, fit.columns(self._keys(choices))).sum())

    # -- the end: drop what does not stand, sizes, intervals, shares ---------------------------

    def _finish(self) -> Result:
        suspected: list[Term] = []
        for last in (False, True):  # the load is of the bodies as they come out
            columns = self._columns(self.couplings)
            fit = self._fit(self._system(columns), columns, self.sigma)
            keys, x, replicas = self._stand(fit, self._keys())
            if last:
                while small := self._small(fit, keys, x, replicas):
                    suspected += [t for _, t in small]
                    gone = [k for k, _ in small]
                    keys, x, replicas = self._stand(fit, [k for k in keys if k not in gone])
            self.load = self.design.load(x[: fit.n_bodies])
        shares, laws = self._shares(fit)
        return self._result(fit, keys, x, replicas, shares, laws, suspected)

    def _small(
        self, fit: Fit, keys: Sequence[Key], x: Array, replicas: Array
    ) -> list[tuple[Key, Term]]:
        """The least of every joint's columns that closes next to nothing on validation blocks."""
        error, t = _jackknife(replicas), self._quantile(self.options.coverage)
        least: dict[str, tuple[float, Key]] = {}
        for key, (closes, gain) in self._closing(fit, keys).items():
            if gain > 0 and closes > self.options.closes:
                continue
            if key[0] not in least or closes < least[key[0]][0]:
                least[key[0]] = (closes, key)
        out = []
        for closes, key in least.values():
            value, e = float(x[fit.system.where[key]]), float(error[fit.system.where[key]])
            term = Term(
                self._place(key),
                kind(key[1]),
                key[1],
                value,
                value - t * e,
                value + t * e,
                unit(key[1]),
                0.0,
                closes,
                Level.SUSPECTED,
            )
            out.append((key, term))
        return out

    def _closing(self, fit: Fit, keys: Sequence[Key]) -> dict[Key, tuple[float, float]]:
        """What every named column closes, and by how many standard errors."""
        with_all = fit.losses(self.folds, self.weight, fit.columns(keys))
        out = {}
        for key in keys:
            if self._curve(key):
                continue
            rest = [other for other in keys if other != key]
            without = fit.losses(self.folds, self.weight, fit.columns(rest))
            mean, error = compare(without, with_all, self.weight)
            part = self._part(fit, key)
            out[key] = (mean * len(self.blocks) / part, mean / max(error, 1e-300))
        return out

    def _part(self, fit: Fit, key: Key) -> float:
        """Whitened power of the noise of the joints that a column acts on."""
        if key[0] == "shared":
            c = next(c for c in self.couplings if key[1] in c.names)
            joints = 2 if c.motor != c.other else 1
        else:
            joints = 1
        return 0.5 * float(fit.system.rows.sum()) / self.model.nv * joints

    def _place(self, key: Key) -> str:
        if key[0] != "shared":
            return self.names[int(key[0])]
        c = next(c for c in self.couplings if key[1] in c.names)
        return f"{self.names[c.motor]} {c.ratio:+g} {self.names[c.other]}"

    def _drop(self, fit: Fit, keys: list[Key]) -> list[Key]:
        """Backward: leave out what has the wrong sign, holds zero or predicts nothing."""
        keys = list(keys)
        while True:
            at = fit.columns(keys)
            n = len(at) - len(keys)
            full = fit.solve(self.weight, at)[n:]
            error = _jackknife(np.array([fit.solve(w, at)[n:] for w in self._leave_one_out()]))
            t = self._quantile(self.options.coverage)
            weakest: tuple[float, Key] | None = None
            for key, size, e in zip(keys, full, error, strict=True):
                if self._curve(key):
                    continue
                ratio = abs(size) / max(e, 1e-300)
                if size < 0 and key[1] not in SIGNED:
                    ratio = -ratio
                if ratio <= t and (weakest is None or ratio < weakest[0]):
                    weakest = (ratio, key)
            if weakest is None:
                return keys
            keys.remove(weakest[1])

    def _stand(self, fit: Fit, keys: list[Key]) -> tuple[list[Key], Array, Array]:
        """Drop, fit with bodies that are bodies, and drop what has the wrong sign then."""
        keys = self._drop(fit, keys)
        while True:
            x, replicas = self._final(fit, keys)
            where = fit.system.where
            wrong = [
                k for k in keys if not self._curve(k) and k[1] not in SIGNED and x[where[k]] <= 0
            ]
            if not wrong:
                return keys, x, replicas
            keys = [k for k in keys if k not in wrong]

    def _curve(self, key: Key) -> bool:
        """Whether a column is a part of a curve without a name, and none of its parts is judged."""
        place, term = key
        if not place.isdigit() or term not in UNNAMED.terms:
            return False
        return self.choices[int(place)].law is UNNAMED

    def _leave_one_out(self) -> list[Array]:
        return [
            np.where(np.arange(len(self.blocks)) == b, 0.0, 1.0) for b in range(len(self.blocks))
        ]

    def _quantile(self, coverage: float) -> float:
        return float(scipy.stats.t.ppf(0.5 + 0.5 * coverage, len(self.blocks) - 1))

    def _final(self, fit: Fit, keys: Sequence[Key]) -> tuple[Array, Array]:
        """Sizes of all columns with bodies that are bodies, and the same without each block."""
        at = fit.columns(keys)

        def solved(weight: Array, start: Array | None) -> Array:
            x = fit.known.copy()
            if not fit.prior.refit:
                x[at] = fit.solve(weight, at)
                return x
            used = np.concatenate([np.arange(fit.n_bodies), fit.system.index(keys)])
            gram, moment = fit.normal(weight, used.astype(np.intp))
            nb = fit.n_bodies
            gram[:nb, :nb] -= fit.prior_gram[:nb, :nb]
            moment[:nb] -= fit.prior_moment[:nb]
            free = np.isin(used, at)
            gram[~free], gram[:, ~free], moment[~free] = 0.0, 0.0, 0.0
            first = None if start is None else np.where(free, start[used], 0.0)
            y = consistent(gram, moment, self.bodies, self.sigma, first)
            x[used] = np.where(free, y, 0.0) + fit.known[used]
            return x

        x = solved(self.weight, None)
        return x, np.array([solved(w, x) for w in self._leave_one_out()])

    def _shares(self, fit: Fit) -> tuple[list[dict[str, float]], list[float]]:
        """How often every kind and every law is chosen when blocks are drawn anew."""
        rng = np.random.default_rng(self.options.seed)
        n = len(self.blocks)
        kinds: list[dict[str, float]] = [{} for _ in range(self.model.nv)]
        laws = [0.0] * self.model.nv
        done = 0
        for _ in range(self.options.draws):
            weight = np.bincount(rng.integers(0, n, n), minlength=n).astype(float)
            drawn = choose_laws(fit, self.folds, weight, self.choices, self.couplings, passes=1)
            done += 1
            for j, c in enumerate(drawn):
                laws[j] += c.law.name == self.choices[j].law.name
                for k in {kind(t) for t in c.terms}:
                    kinds[j][k] = kinds[j].get(k, 0.0) + 1.0
        done = max(done, 1)
        return [{k: x / done for k, x in d.items()} for d in kinds], [x / done for x in laws]

    def _result(
        self,
        fit: Fit,
        keys: Sequence[Key],
        x: Array,
        replicas: Array,
        shares: Sequence[dict[str, float]],
        laws: Sequence[float],
        suspected: Sequence[Term],
    ) -> Result:
        o, t = self.options, self._quantile(self.options.coverage)
        error = _jackknife(replicas)
        strict = self._quantile(1 - o.error_rate / max(len(keys), 1))
        terms = []
        for key, (closes, gain) in self._closing(fit, keys).items():
            place, term = key
            k = fit.system.where[key]
            share, short = 1.0, 0.0
            if place != "shared":
                share = shares[int(place)].get(kind(term), 0.0)
                short = self.choices[int(place)].short
            stands = (
                abs(x[k]) > strict * error[k]
                and share >= o.sure
                and short <= 1.0
                and gain > 1.0
                and closes > o.closes
                and (x[k] > 0 or term in SIGNED)
            )
            level = Level.CONFIRMED if stands else Level.APPROXIMATE
            terms.append(
                Term(
                    self._place(key),
                    kind(term),
                    term,
                    float(x[k]),
                    float(x[k] - t * error[k]),
                    float(x[k] + t * error[k]),
                    unit(term),
                    share,
                    closes,
                    level,
                )
            )
        frictions = []
        for j, choice in enumerate(self.choices):
            have = tuple(key[1] for key in keys if key[0] == str(j) and key[1] not in BESIDE)
            mine = [u for u in terms if u.place == self.names[j] and u.term not in BESIDE]
            unnamed = choice.law is UNNAMED
            sure = laws[j] >= o.sure and not unnamed
            sure = sure and all(u.level is Level.CONFIRMED for u in mine)
            frictions.append(
                Friction(
                    self.names[j],
                    UNNAMED.name if unnamed else name_of(have),
                    {u: float(x[fit.system.where[(str(j), u)]]) for u in have},
                    self.design.shapes[j],
                    laws[j],
                    Level.CONFIRMED if sure else Level.APPROXIMATE,
                    choice.short,
                )
            )
        base, condition, lost = self._base(x, replicas, t)
        nb = fit.n_bodies
        return Result(
            with_parameters(self.model, x[:nb]) if self.sigma > 0 else self.model.copy(),
            self.sigma > 0,
            self.sigma,
            base,
            condition,
            lost,
            (*terms, *suspected),
            tuple(frictions),
            tuple(self.couplings),
            {key: float(x[fit.system.where[key]]) for key in keys},
            tuple(self.noise),
            self.rows.cutoff,
            len(self.blocks),
            self.rows.sigma_v,
        )

    def _base(
        self, x: Array, replicas: Array, t: float
    ) -> tuple[tuple[BaseParameter, ...], float, tuple[str, ...]]:
        if self.sigma == 0:
            return (), float("nan"), ()
        found = base_set(self.design.bodies, self.bodies, self.names)
        nb = self.bodies.nominal.size
        value, urdf = found.combine @ x[:nb], found.combine @ self.bodies.nominal
        error = _jackknife(replicas[:, :nb] @ found.combine.T)
        free = np.flatnonzero(self.bodies.columns)
        spread = np.linalg.inv(self.bodies.metric[np.ix_(free, free)]) * self.sigma**2
        stated = np.sqrt(
            np.einsum("ki,ij,kj->k", found.combine[:, free], spread, found.combine[:, free])
        )
        table = tuple(
            BaseParameter(
                name,
                float(u),
                float(v),
                float(v - t * e),
                float(v + t * e),
                one,
                float((v - u) / s),
            )
            for name, one, u, v, e, s in zip(
                found.names, found.units, urdf, value, error, stated, strict=True
            )
        )
        return table, found.condition, found.lost


def _jackknife(replicas: Array) -> Array:
    """Standard error from leaving out one block at a time (B, ...) (Efron and Tibshirani, 11)."""
    b = len(replicas)
    d = replicas - replicas.mean(axis=0)
    out: Array = np.sqrt((b - 1) / b * (d**2).sum(axis=0))
    return out
