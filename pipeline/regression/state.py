"""What an identification works on: rows, blocks, noise, and the regressions they allow."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
import scipy.stats
from numpy.typing import NDArray

from pipeline.regression.errors import RegressionError
from pipeline.regression.laws.bodies import Bodies
from pipeline.regression.laws.coupling import Coupling
from pipeline.regression.laws.design import Design, even_blocks, turns_of
from pipeline.regression.laws.extras import SENSORS, Extra, Kind
from pipeline.regression.laws.friction import (
    bends,
)
from pipeline.regression.laws.payload import Payload
from pipeline.regression.options import Options
from pipeline.regression.preprocess import Rows
from pipeline.regression.statistics.gram import Columns, Key, System, system
from pipeline.regression.statistics.noise import Colour, Span, weights
from pipeline.regression.statistics.selection import (
    UNNAMED,
    Choice,
    general,
)
from pipeline.regression.statistics.solve import Fit, Prior

Array = NDArray[np.float64]


class State:
    """Rows, bodies, blocks, noise and what stands so far."""

    def __init__(
        self, rows: Rows, model: pin.Model, blocks: Sequence[Span] | None, options: Options
    ) -> None:
        if model.nv != rows.v.shape[1]:
            raise RegressionError(
                f"the model has {model.nv} joints, the rows {rows.v.shape[1]}; expected the same"
            )
        self.rows, self.model, self.options, self.given = rows, model, options, blocks
        self.logged = rows
        self.bodies = Bodies.of(model)
        #: What the one body carries that is far from its URDF.
        self.loaded: Payload | None = None
        self.design = Design.of(model, rows)
        self.names = tuple(model.names[1:])
        self.couplings: list[Coupling] = []
        self.coupled: dict[str, float] = {}
        self.extras: list[Extra] = []
        self.barred: set[Key] = set()
        #: Beside fitted bodies only, which could be the same.
        self.bodies_instead: set[Key] = set()
        self.actions: dict[str, dict[int, Array]] = {}
        self.points: dict[Extra, float] = {}
        self.zero, self.gain = np.zeros(model.nv), np.zeros(model.nv)
        self.sizes: dict[Key, float] = {}
        self.fitted = self.bodies.nominal
        self.left = self.told = rows.tau
        self.noise = [Colour(np.zeros(0), s, s, 1.0) for s in rows.tau.std(axis=0) + 1e-12]
        self.load = self.design.load(self.bodies.nominal)
        self.friction: Array | None = None
        self.sigma = 1.0
        self.bend = 0.1
        self.refit_share = 0.0
        self.bends = frozenset(bends())
        self.choices = [general() for _ in range(model.nv)]
        self._block(5.0)

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
        self.folds = turns_of(len(self.blocks))
        self.weight = np.ones(len(self.blocks))

    def _columns(self, couplings: Sequence[Coupling]) -> Columns:
        columns = self.design.columns(self.load + self._over_angle(), couplings)
        return replace(columns, shared={**columns.shared, **self.actions})

    def _over_angle(self) -> Array:
        """Torque of springs and ripple before rows are thinned: friction is felt under it, too."""
        out = np.zeros_like(self.load)
        for e in self.extras:
            x = [self.sizes.get(("shared", n), 0.0) for n in e.names]
            out[:, e.joint] += e.torque(self.rows.fine[0][:, e.joint], x)
            if e.kind is Kind.SPRING:
                out[:, e.joint] += self.sizes.get((str(e.joint), "offset"), 0.0)
        return out

    def _general(self, but: Collection[int] = (), *, scaled: bool = False) -> list[Choice]:
        """Friction of any shape at every joint.

        Where a torque reads a multiple, friction is the same in all quadrants at every joint: by
        quadrant it has the torque's own shape, and beside bodies of any size a scale at each of
        them would leave none to be told.

        Args:
            but: Joints whose friction is the same in all quadrants.
            scaled: Whether it may differ at joints besides those that read a multiple.
        """
        found = {e.joint for e in self.extras if e.kind is Kind.GAIN}
        joints = range(self.model.nv)
        same = {*but, *(found if scaled or not found else joints)}
        return [general(j not in same) for j in joints]

    @property
    def _shared(self) -> list[Key]:
        """Columns of couplings and extras."""
        names = [n for c in self.couplings for n in c.names]
        return [("shared", n) for n in (*names, *(n for e in self.extras for n in e.names))]

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
        return keys + self._shared

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

    @property
    def _structured(self) -> set[int]:
        """Joints whose remainder stays alike for longer than a block: that is no noise."""
        length = len(self.rows.time) / len(self.blocks)
        return {j for j, c in enumerate(self.noise) if c.correlation > length}

    def _confirms(self, joints: Collection[int]) -> bool:
        """Whether anything at these joints can be confirmed."""
        return len(self.blocks) >= self.options.fewest and not self._structured & set(joints)

    def _sure(self, columns: Columns, joint: int) -> Array:
        """Weight of rows by how sure a joint's dry friction is, (N,)."""
        if self.friction is None:
            return np.ones(len(self.rows.time))
        level = self.noise[joint].level
        return weights(columns.doubt[:, joint], float(self.friction[joint]), level)

    def _torque(self, residual: Array) -> Array:
        """Torque as predicted, without what sensors get wrong, (N, J)."""
        out = self.rows.tau - residual
        for e in self.extras:
            if e.kind in SENSORS:
                size = self.sizes[("shared", e.names[0])]
                for j, x in self.actions[e.names[0]].items():
                    out[:, j] -= size * x
        return out

    def _curve(self, key: Key) -> bool:
        """Whether a column is no term that is judged by itself: a curve's, or an extra's."""
        place, term = key
        if place == "shared":
            return term in self.actions
        if not place.isdigit() or term not in UNNAMED.terms:
            return False
        return self.choices[int(place)].law is UNNAMED

    def _place(self, key: Key) -> str:
        if key[0] != "shared":
            return self.names[int(key[0])]
        c = next(c for c in self.couplings if key[1] in c.names)
        return f"{self.names[c.motor]} {c.ratio:+g} {self.names[c.other]}"

    def _leave_one_out(self) -> list[Array]:
        return [
            np.where(np.arange(len(self.blocks)) == b, 0.0, 1.0) for b in range(len(self.blocks))
        ]

    def _quantile(self, coverage: float) -> float:
        return float(scipy.stats.t.ppf(0.5 + 0.5 * coverage, len(self.blocks) - 1))
