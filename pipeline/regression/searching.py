"""Extras looked for beside bodies, friction of any shape and couplings; one at a time, each proven.

What is offered competes for what the richest model leaves. The winner is what predicts blocks that
did not fit it best, by more than chance among all that were tried would; of several as good the
one with fewest columns, and one with a name before one without. After every acceptance all are
fitted together about their new values, and what the others have made superfluous goes.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.stats
from numpy.typing import NDArray
from qpsolvers import solve_qp

from pipeline.regression.laws.bodies import with_parameters
from pipeline.regression.laws.extras import (
    EVERY,
    SENSORS,
    UNNAMED,
    UNSIGNED,
    Extra,
    Kind,
    Seen,
    orders,
    strongest,
    tuned,
)
from pipeline.regression.laws.friction import QUADRANT
from pipeline.regression.stages import Stages
from pipeline.regression.statistics.gram import Columns, Key
from pipeline.regression.statistics.jackknife import standard_error
from pipeline.regression.statistics.noise import colour
from pipeline.regression.statistics.solve import Eliminated, Fit, beyond_chance, compare

Array = NDArray[np.float64]
#: Rounds of fitting about new values, and the relative change that ends them.
ROUNDS = 5
SETTLED = 1e-3
#: Uncertainty of a URDF that says nothing about its bodies.
ANY = 1e3
#: By which a sensor's scale may be off before it is one that is wrong.
GAIN = 0.02
#: Extras per joint at most.
MOST = 4


@dataclass(frozen=True)
class Won:
    """How an extra won its round.

    Attributes:
        share: Of draws of the log's blocks in which it predicts best.
        rivals: What predicts as well, within one standard error.
    """

    share: float
    rivals: tuple[Extra, ...]


class Searching(Stages):
    """Extras."""

    def _search(self, kinds: Collection[Kind]) -> None:
        """Accept extras until none is needed any more.

        Args:
            kinds: That are offered.
        """
        self.won: dict[Extra, Won] = {}
        refused: set[frozenset[tuple[Kind, int, int]]] = set()
        if kinds:
            self._colour(self._offered(kinds))
            self._block(max(c.correlation for c in self.noise))
        while kinds and len(self.extras) < MOST * self.model.nv:
            found = self._best(self._offered(kinds))
            if found is None:
                break
            extra, won = found
            before = list(self.extras)
            self.extras.append(extra)
            self.won[extra] = won
            self._settle()
            if extra.kind in SENSORS:
                self._rise_again()
            self._prune()
            now = frozenset((*e.same, round(e.order)) for e in self.extras)
            if now in refused:
                # It takes turns with others: they stay.
                self.extras = before
                self._settle()
                break
            refused.add(now)
        self._swap()

    def _swap(self) -> None:
        """A rival in the place of an extra, where with it fewer explain as much.

        Of two torques that disagree by a factor either may be wrong: which one shows in how many
        others have to follow.
        """
        for e in list(self.extras):
            for rival in self.won[e].rivals if e in self.extras else ():
                before, points = list(self.extras), dict(self.points)
                if rival.same in {x.same for x in before}:
                    continue
                old = self._predicted()
                self.extras = [*(x for x in before if x is not e), rival]
                self.won[rival] = replace(self.won[e], rivals=(e,))
                self._settle()
                self._prune()
                worse, error = compare(self._predicted(), old, self.weight)
                if worse <= error and _columns(self.extras) < _columns(before):
                    break
                self.extras, self.points = before, points
                self._settle()

    def _predicted(self) -> Array:
        """Predictive loss of every block beside friction of any shape and bodies of any size."""
        columns = self._columns(self.couplings)
        fit = self._fit(self._system(columns), columns, ANY)
        keys = self._keys(self._general())
        return fit.losses(self.folds, self.weight, fit.columns(keys))

    def _impossible(self) -> list[int]:
        """Joints whose friction by quadrant would give energy: the torque there reads a multiple.

        Friction that differs by quadrant has the shape of the torque itself, as a wrong scale has;
        but half of the difference is no larger than the mean of both, or the load would drive for
        nothing. Where that costs the fit, a joint is named without which it costs much less. Bodies
        of any size take a scale that all joints have in common.
        """
        columns = self._columns(self.couplings)
        fit = self._fit(self._system(columns), columns, ANY)
        keys = self._keys(self._general(scaled=True))
        at = fit.columns(keys)
        first = len(at) - len(keys)
        passive: dict[int, Array] = {}
        for j in range(self.model.nv):
            mine = {k[1]: first + n for n, k in enumerate(keys) if k[0] == str(j)}
            if QUADRANT not in mine:
                continue
            curve = [n for t, n in mine.items() if t.startswith("loaded@")]
            row = np.zeros(len(at))
            row[mine["load"]], row[curve] = -1.0, -1.0 / len(curve)
            rows = np.stack([row, row])
            # Its column is half of what driving takes more: so much scales the torque.
            rows[:, mine[QUADRANT]] = 0.5, -0.5
            passive[j] = rows
        if len(passive) < 2:
            return []
        normal = fit.normal(self.weight, at)
        every, _ = least_cost(*normal, list(passive.values()))
        least = float(np.log(self.model.nv / self.options.error_rate))
        limit = self._chance(self.options.error_rate / self.model.nv)
        out = []
        for j, rows in passive.items():
            others = [x for i, x in passive.items() if i != j]
            cost, x = least_cost(*normal, others)
            if every - cost <= least:
                continue
            drawn = [least_cost(*fit.normal(w, at), others)[1] for w in self._leave_one_out()]
            side = rows[int(np.argmax(rows @ x))]
            beyond, error = side @ x - GAIN, standard_error(np.array(drawn) @ side)
            if beyond > limit * error:
                out.append(j)
        return out

    def _offered(self, kinds: Collection[Kind]) -> list[tuple[Extra, int]]:
        """What competes, with the number of looks that were taken to find it."""
        out: list[tuple[Extra, int]] = []
        have = {e.same for e in self.extras}
        joints = range(self.model.nv)
        for kind in Kind:
            if kind not in kinds:
                continue
            if kind is Kind.RIPPLE:
                for j in joints:
                    grid = orders(self.rows, j)
                    near = [e.order for e in self.extras if e.same == (kind, j)]
                    found = strongest(self.left[:, j], self.rows.q[:, j], grid, near)
                    out += [(Extra(kind, j, n), max(grid.size, 1)) for n in found]
                continue
            if kind is Kind.GAIN:
                out += [(Extra(kind, j), self.model.nv) for j in self._impossible()]
                continue
            places = [*joints, EVERY] if kind is Kind.LATE and len(joints) > 1 else [*joints]
            out += [(Extra(kind, j), 1) for j in places if (kind, j) not in have]
        return out

    def _best(self, offered: Sequence[tuple[Extra, int]]) -> tuple[Extra, Won] | None:
        """What predicts best beside everything else, if chance would not."""
        # Beside bodies of any size: what freeing them would explain is no extra's.
        free = ANY
        offered, actions = self._acting(offered)
        if not offered:
            return None
        columns = self._columns(self.couplings)
        columns = replace(columns, shared={**columns.shared, **actions})
        self._colour(offered)
        fit = self._fit(self._system(columns), columns, free)
        names = [n for e, _ in offered for n in e.names]
        own = fit.system.index([("shared", n) for n in names])
        but = [extra.joint for extra, _ in offered if extra.kind is Kind.GAIN]
        common = self._keys(self._general(but))
        e = Eliminated(fit, self.folds, self.weight, fit.columns(common), own)
        at = {name: k for k, name in enumerate(names)}
        without = e.losses([])
        looks = sum(n for _, n in offered)
        # On blocks that did not fit it a useless size gains g with a chance of exp(-g); what the
        # richest model leaves beyond its noise counts as noise, too.
        noise = max(float(without.sum()) / (0.5 * float(fit.system.rows.sum())), 1.0)
        least = noise * float(np.log(looks / self.options.error_rate))
        tried: list[tuple[float, Extra, Array]] = []
        for extra, _ in offered:
            use = [at[n] for n in extra.names]
            if extra.kind in UNSIGNED and e.sizes(use)[0] <= 0:
                continue
            loss = e.losses(use)
            mean, _ = compare(without, loss, self.weight)
            part = self._noise_power(fit, [j for n in extra.names for j in actions[n]])
            closes = mean * len(self.blocks) / part
            sure = beyond_chance(without, loss, 1.0 - self.options.sure)
            if sure and mean * len(self.blocks) > least and closes > self.options.worth:
                tried.append((mean, extra, loss))
        return _chosen(tried, self.weight, self.options.draws, self.options.seed)

    def _acting(
        self, offered: Sequence[tuple[Extra, int]]
    ) -> tuple[list[tuple[Extra, int]], dict[str, dict[int, Array]]]:
        """What is offered and felt at some joint, and its columns: not all of it is.

        The zero of an encoder whose axis is upright changes no torque.
        """
        actions = self._seen().columns([e for e, _ in offered]) if offered else {}
        felt = [(e, n) for e, n in offered if all(actions[name] for name in e.names)]
        return felt, {name: actions[name] for e, _ in felt for name in e.names}

    def _colour(self, offered: Sequence[tuple[Extra, int]]) -> None:
        """Noise as what everything that is offered would leave together.

        Of what is not in the model yet a part would pass for noise in colour, and be whitened away.
        """
        _, actions = self._acting(offered)
        columns = self._columns(self.couplings)
        columns = replace(columns, shared={**columns.shared, **actions})
        system = self._system(columns)
        fit = self._fit(system, columns, ANY)
        keys = self._keys(self._general())
        keys += [("shared", n) for n in actions]
        sizes = fit.solve(self.weight, fit.columns(keys))
        x = fit.known.copy()
        x[fit.columns(keys)] = sizes
        load = self.rows.thin(self.design.load(x[: fit.n_bodies] - self.fitted))
        residual = self._residual(columns, keys, x[fit.system.index(keys)]) - load
        own = np.array([sum(self._acts(k, j, columns) for k in keys) for j in range(self.model.nv)])
        spent = (own + len(fit.free_bodies) / self.model.nv) / len(self.rows.time)
        left = np.sqrt(1.0 - np.minimum(spent, 0.5))
        self.noise = [
            colour(residual[:, j] * self._sure(columns, j) / left[j], self.blocks)
            for j in range(self.model.nv)
        ]

    @staticmethod
    def _acts(key: Key, joint: int, columns: Columns) -> bool:
        """Whether a column acts on a joint."""
        place, term = key
        return joint in columns.shared[term] if place == "shared" else place == str(joint)

    def _bent(self, keys: Sequence[Key]) -> set[int]:
        """Joints at which a curve over the angle says more than what is in the model.

        There a spring, an offset or a ripple is at best a part of what is.
        """
        joints = range(self.model.nv)
        curves = [Extra(kind, j) for j in joints for kind in UNNAMED]
        curves = [e for e in curves if e not in self.extras]
        actions = self._seen().columns(curves)
        columns = self._columns(self.couplings)
        columns = replace(columns, shared={**columns.shared, **actions})
        fit = self._fit(self._system(columns), columns, self.sigma)
        own = fit.system.index([("shared", n) for n in actions])
        e = Eliminated(fit, self.folds, self.weight, fit.columns(keys), own)
        at = {name: k for k, name in enumerate(actions)}
        without = e.losses([])
        least = float(np.log(1.0 / self.options.error_rate))
        out = {x.joint for x in self.extras if not x.named}
        for curve in curves:
            loss = e.losses([at[n] for n in curve.names])
            mean, error = compare(without, loss, self.weight)
            if mean > error and mean * len(self.blocks) > least:
                out.add(curve.joint)
        return out

    def _harmonic(self, e: Extra) -> bool:
        """Whether a ripple is one of several whose orders are multiples: no sine, but its parts."""
        others = [x.order for x in self.extras if x.same == e.same and x is not e]
        for order in others if e.kind is Kind.RIPPLE else ():
            low, high = sorted((order, e.order))
            step = float(np.diff(orders(self.rows, e.joint)[:2])[0])
            whole = round(high / low)
            if whole > 1 and abs(high - whole * low) < step * whole:
                return True
        return False

    def _chance(self, rate: float) -> float:
        """Quantile of t that chance passes so rarely."""
        return float(scipy.stats.t.isf(rate, max(len(self.blocks) - 1, 1)))

    def _noise_power(self, fit: Fit, joints: Collection[int]) -> float:
        """Whitened power of the noise of some joints."""
        return 0.5 * float(fit.system.rows.sum()) / self.model.nv * len(set(joints))

    def _seen(self) -> Seen:
        """What extras are linear about."""
        model = with_parameters(self.model, self.fitted)
        passed = self.rows.thin(self.load + self._over_angle())
        return Seen(self.rows, self.told, model, 1.0 + self._point(Kind.GAIN), passed)

    def _point(self, kind: Kind) -> Array:
        """What is taken out of the rows already, (J,)."""
        out = np.zeros(self.model.nv)
        for e, value in self.points.items():
            if e.kind is kind:
                out += value if e.joint == EVERY else value * (np.arange(out.size) == e.joint)
        return out

    def _settle(self) -> None:
        """Fit everything together about the values it has then."""
        self.points = {e: x for e, x in self.points.items() if e in self.extras}
        self._linearise()
        for number in range(ROUNDS):
            self._rich()
            moved = self._tune() if number < ROUNDS - 1 else 0.0
            for e in self.extras:
                if e.kind in SENSORS:
                    new = float(self.sizes[("shared", e.names[0])])
                    old = self.points.get(e, 0.0)
                    moved = max(moved, abs(new - old) / max(abs(new), abs(old), 1e-12))
                    self.points[e] = float(np.clip(new, *_sensible(e.kind)))
            self._linearise()
            if moved < SETTLED:
                break
        self._rich()

    def _rise_again(self) -> None:
        """How friction rises and what sensors get wrong in turn, until neither changes.

        A torque that comes late looks like friction that rises over a travel: a part of it was
        taken for that as long as nothing else was known.
        """
        tried = [[(s.rise, s.travel) for s in self.design.shapes]]
        for _ in range(ROUNDS):
            self._rise()
            now = [(s.rise, s.travel) for s in self.design.shapes]
            done = now in tried
            if now != tried[-1]:
                self._settle()
            if done:
                return
            tried.append(now)

    def _tune(self) -> float:
        """Orders of ripples where they fit best; the largest relative change."""
        moved = 0.0
        for number, e in enumerate(self.extras):
            grid = orders(self.rows, e.joint) if e.kind is Kind.RIPPLE else np.empty(0)
            if grid.size < 2:
                continue
            own = [self.sizes[k] * self.actions[k[1]][e.joint] for k in self._of(e)]
            series = self.left[:, e.joint] + np.sum(own, axis=0)
            step = float(grid[1] - grid[0])
            better = replace(e, order=tuned(series, self.rows, e.joint, e.order, step))
            if abs(better.order - e.order) > 1e-3 * step:
                moved = max(moved, abs(better.order - e.order) / step)
                self.extras[number] = better
                self.won[better] = self.won[e]
        return moved

    def _linearise(self) -> None:
        """Rows and columns about the present values; a column's size is the whole value."""
        zero, gain, late = (self._point(k) for k in (Kind.ZERO, Kind.GAIN, Kind.LATE))
        turned = not np.array_equal(zero, self.zero)
        # The noise is that of the torque as logged.
        scale = (1.0 + self.gain) / (1.0 + gain)
        self.noise = [
            replace(c, sigma=c.sigma * s, level=c.level * s)
            for c, s in zip(self.noise, scale, strict=True)
        ]
        self.zero, self.gain = zero, gain
        self.rows = self.logged.corrected(zero, 1.0 + gain, late)
        if turned:
            self.design = self.design.turned(self.model, self.rows)
            self.load = self.design.load(self.fitted)
        else:
            self.design = replace(self.design, rows=self.rows)
        self.actions = self._seen().columns(self.extras) if self.extras else {}
        tau = self.rows.tau.copy()
        for e, value in self.points.items():
            for j, x in self.actions[e.names[0]].items():
                tau[:, j] += value * x
        self.rows = replace(self.rows, tau=tau)
        self.design = replace(self.design, rows=self.rows)

    def _without(self, fallen: Collection[Extra]) -> None:
        """Leave extras out."""
        self.extras = [e for e in self.extras if e not in fallen]
        self._settle()

    def _prune(self) -> None:
        """Leave out what the latest extra has made superfluous."""
        while True:
            columns = self._columns(self.couplings)
            fit = self._fit(self._system(columns), columns, ANY)
            keys = self._keys(self._general())
            have = fit.losses(self.folds, self.weight, fit.columns(keys))
            gone = None
            for e in self.extras[:-1]:
                rest = [k for k in keys if k not in self._of(e)]
                without = fit.losses(self.folds, self.weight, fit.columns(rest))
                mean, error = compare(without, have, self.weight)
                if mean <= error:
                    gone = e
            if gone is None:
                return
            self.extras.remove(gone)
            self._settle()

    @staticmethod
    def _of(e: Extra) -> list[Key]:
        return [("shared", n) for n in e.names]


def _columns(extras: Sequence[Extra]) -> int:
    """Number of columns of some extras."""
    return sum(len(e.names) for e in extras)


def least_cost(gram: Array, moment: Array, passive: Sequence[Array]) -> tuple[float, Array]:
    """Least x^T G x / 2 - m^T x under rows R x <= `GAIN`, (K, P) each, and where it is, (P,)."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    scaled = gram * np.outer(scale, scale)
    scaled[np.diag_indices_from(scaled)] += 1e-9
    rows = np.concatenate(passive) * scale
    x = solve_qp(scaled, -moment * scale, rows, np.full(len(rows), GAIN), solver="quadprog")
    if x is None:
        return np.inf, np.zeros(len(moment))
    return float(0.5 * x @ scaled @ x - (moment * scale) @ x), np.asarray(x * scale)


def _sensible(kind: Kind) -> tuple[float, float]:
    """Bounds of what a sensor may get wrong while it is fitted."""
    return {Kind.GAIN: (-0.9, 9.0), Kind.LATE: (-0.2, 0.2)}.get(kind, (-1.6, 1.6))


def _chosen(
    tried: Sequence[tuple[float, Extra, Array]], weight: Array, draws: int, seed: int
) -> tuple[Extra, Won] | None:
    """The simplest that predicts as well as the best, and how surely it is that one."""
    if not tried:
        return None
    _, _, best = max(tried, key=lambda t: t[0])
    near = []
    for mean, extra, loss in tried:
        more, error = compare(loss, best, weight)
        if more <= error:
            near.append((not extra.named, len(extra.names), -mean, extra, loss))
    _, _, _, winner, own = min(near, key=lambda t: t[:3])
    rivals = tuple(t[3] for t in near if t[3].same != winner.same and t[3].named)
    others = [loss for _, e, loss in tried if e.same != winner.same and e.kind not in UNNAMED]
    rng, n = np.random.default_rng(seed), len(own)
    drawn = rng.integers(0, n, (max(draws, 1), n))
    wins = np.ones(len(drawn), dtype=bool)
    for loss in others:
        wins &= (loss - own)[drawn].sum(axis=1) > 0
    return winner, Won(float(wins.mean()), rivals)
