"""From rows to columns: what torque is linear in, given the load on every joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.regression.laws.bodies import regressor
from pipeline.regression.laws.coupling import Coupling
from pipeline.regression.laws.friction import BY_LOAD, SMOOTH, TRAVELS, Shape
from pipeline.regression.preprocess import Rows
from pipeline.regression.statistics.gram import Columns
from pipeline.regression.statistics.noise import Span

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ways:
    """Senses that one joint's dry friction may have at the rows.

    Attributes:
        slid: By the travel over which it rises, (N,) each.
        turned: The same less what it were, had it begun the other way, (N,) each.
    """

    slid: dict[float, Array]
    turned: dict[float, Array]

    @classmethod
    def of(cls, rows: Rows, joint: int, slid: dict[float, Array]) -> Ways:
        """Filter them as the torque was."""
        both = np.column_stack(
            [*slid.values(), *(rows.slid(joint, d, begun=-1.0) for d in slid)],
        )
        out, n = rows.filtered(both), len(slid)
        travels = list(slid)
        return cls(
            {d: out[:, k] for k, d in enumerate(travels)},
            {d: out[:, k] - out[:, n + k] for k, d in enumerate(travels)},
        )

    def doubt(self, sense: Array, shape: Shape) -> Array:
        """Variance of a sense (N,) from not knowing the travel, nor how a run begins, (N,).

        A travel is known to the next one tried; where friction jumps, any of the small ones may be.
        """
        travels = list(self.slid)
        at = travels.index(shape.travel) if shape.travel else 0
        near = travels[max(at - 1, 0) : at + 2] if shape.travel else travels[:3]
        off = [self.slid[d] - sense for d in near]
        off.append(self.turned[travels[max(at, 1)]])
        return np.asarray(np.max(np.square(off), axis=0))


@dataclass(frozen=True)
class Design:
    """Rows with the regressor of their bodies and the shape of every joint's friction.

    Attributes:
        rows: The rows.
        bodies: Torque per body parameter of the rows, (N, J, P).
        fine: The same before rows are thinned, (M, J, P).
        shapes: Of every joint.
        slid: Of every joint, travel to sense of friction that rises over it, (M,).
        ways: The same at the rows, to tell how unsure it is there.
        filtered_once: Columns that no load changes, by joint and what friction rises over.
    """

    rows: Rows
    bodies: Array
    fine: Array
    shapes: tuple[Shape, ...]
    slid: tuple[dict[float, Array], ...]
    ways: tuple[Ways, ...]
    filtered_once: dict[tuple[int, float, float], dict[str, Array]] = field(default_factory=dict)

    @classmethod
    def of(cls, model: pin.Model, rows: Rows) -> Design:
        """Compute the regressor once; nothing later changes it."""
        shapes = tuple(
            Shape.of(rows.v[:, j], float(rows.sigma_v[j])) for j in range(rows.v.shape[1])
        )
        fine = regressor(model, *rows.fine)
        joints = range(rows.v.shape[1])
        slid = tuple({d: rows.slid(j, d) for d in TRAVELS} for j in joints)
        ways = tuple(Ways.of(rows, j, slid[j]) for j in joints)
        return cls(rows, rows.thin(fine), fine, shapes, slid, ways)

    def turned(self, model: pin.Model, rows: Rows) -> Design:
        """The same about other zeros of the encoders: only bodies feel them."""
        fine = regressor(model, *rows.fine)
        return replace(self, rows=rows, bodies=rows.thin(fine), fine=fine)

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.shapes)

    def load(self, bodies: Array) -> Array:
        """Torque of bodies with these parameters before rows are thinned, (M, J) [N*m]."""
        out: Array = self.fine @ bodies
        return out

    def columns(
        self, load: Array, couplings: Sequence[Coupling], halves: Sequence[Coupling] = ()
    ) -> Columns:
        """All columns, with couplings as asked, and some with their two actions apart."""
        r = self.rows
        _, v, a = r.fine
        local, doubt = [], []
        for j, shape in enumerate(self.shapes):
            terms, unsure = shape.columns(v[:, j], a[:, j], load[:, j], self.slid[j])
            own = self._rows(j, terms)
            local.append(own)
            doubt.append(np.maximum(r.thin(unsure), self.ways[j].doubt(own["coulomb"], shape)))
        shared: dict[str, dict[int, Array]] = {}
        for c in couplings:
            whole = c.columns(v, a, r.sigma_v, c.slid(r))
            shared.update({n: self._actions(n, parts) for n, parts in whole.items()})
        for c in halves:
            apart = c.halves(v, a, r.sigma_v, c.slid(r))
            shared.update({n: self._actions(n, parts) for n, parts in apart.items()})
        return Columns(self.bodies, local, shared, np.column_stack(doubt))

    def _rows(self, joint: int, terms: dict[str, Array]) -> dict[str, Array]:
        """Filter what jumps or bends, thin the rest; what no load changes is filtered once."""
        shape = self.shapes[joint]
        key = (joint, shape.rise, shape.travel)
        known = self.filtered_once.setdefault(key, {})
        sharp = [n for n in terms if n not in SMOOTH and n not in known]
        filtered = self.rows.filtered(np.column_stack([terms[n] for n in sharp]))
        out = {n: filtered[:, k] for k, n in enumerate(sharp)}
        known.update({n: x for n, x in out.items() if not n.startswith(BY_LOAD)})
        out |= known
        return {n: out[n] if n in out else self.rows.thin(x) for n, x in terms.items()}

    def _actions(self, name: str, parts: dict[int, Array]) -> dict[int, Array]:
        sharp = name.split(":")[-1].split("|")[0] not in SMOOTH
        return {j: (self.rows.filtered if sharp else self.rows.thin)(x) for j, x in parts.items()}


def even_blocks(
    n: int, start: Sequence[int], correlation: float, most: int = 36, least: int = 20
) -> list[Span]:
    """Stretches of equal length that do not cross a gap and are longer than the correlation.

    Args:
        n: Rows.
        start: First row of every run.
        correlation: Rows over which noise stays correlated.
        most: Largest number of blocks.
        least: Number below which intervals and shares say little: blocks are not made longer.
    """
    ends = [*start[1:], n]
    length = max(n / most, min(2 * correlation, n / least), 12.0)
    out: list[Span] = []
    for a, b in zip(start, ends, strict=True):
        if b - a < 8:
            continue
        k = max(1, int((b - a) / length))
        edges = np.linspace(a, b, k + 1).round().astype(int)
        out += [(int(x), int(y)) for x, y in pairwise(edges)]
    return out


def turns_of(blocks: int, folds: int = 6) -> list[NDArray[np.intp]]:
    """One block in so many: validation lies between what was learnt from.

    Blocks are longer than noise is correlated, so that neighbours tell each other no noise; a part
    of the motion that is left out as a whole would be judged by how well bodies extrapolate.
    """
    return [np.arange(k, blocks, folds) for k in range(min(folds, blocks))]


def folds_of(blocks: int, folds: int = 6) -> list[NDArray[np.intp]]:
    """Contiguous groups of blocks: validation is another part of the motion."""
    return [
        np.asarray(x, dtype=np.intp) for x in np.array_split(np.arange(blocks), folds) if x.size
    ]
