"""What an identification works on: rows, blocks, noise, and the regressions they allow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
import scipy.stats
from numpy.typing import NDArray

from pipeline.regression.errors import RegressionError
from pipeline.regression.laws.bodies import Bodies
from pipeline.regression.laws.coupling import Coupling
from pipeline.regression.laws.design import Design, even_blocks, folds_of
from pipeline.regression.laws.friction import (
    bends,
)
from pipeline.regression.options import Options
from pipeline.regression.preprocess import Rows
from pipeline.regression.statistics.gram import Columns, Key, System, system
from pipeline.regression.statistics.noise import Colour, Span
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
        self.bodies = Bodies.of(model)
        self.design = Design.of(model, rows)
        self.names = tuple(model.names[1:])
        self.couplings: list[Coupling] = []
        self.coupled: dict[str, float] = {}
        self.noise = [Colour(np.zeros(0), s, s, 1.0) for s in rows.tau.std(axis=0) + 1e-12]
        self.load = self.design.load(self.bodies.nominal)
        self.friction: Array | None = None
        self.sigma = 1.0
        self.bend = 0.1
        self.refit_share = 0.0
        self.bends = frozenset(bends())
        self.choices = [general(j) for j in range(model.nv)]
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

    def _curve(self, key: Key) -> bool:
        """Whether a column is a part of a curve without a name, and none of its parts is judged."""
        place, term = key
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
