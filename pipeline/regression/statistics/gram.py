"""Normal equations per block: to draw blocks anew or leave some out is to add them up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.regression.statistics.noise import Colour, Span, weights

Array = NDArray[np.float64]
Key = tuple[str, str]


@dataclass(frozen=True)
class Columns:
    """What torque is linear in.

    Attributes:
        bodies: Torque per body parameter, (N, J, P).
        local: Per joint its own terms, name to column (N,).
        shared: Terms that act on several joints: name to {joint: column (N,)}.
        doubt: Variance of the sign of the velocity, (N, J).
    """

    bodies: Array
    local: Sequence[Mapping[str, Array]]
    shared: Mapping[str, Mapping[int, Array]]
    doubt: Array

    @property
    def keys(self) -> list[Key]:
        """Place and term of every column, bodies first."""
        out: list[Key] = [("body", str(k)) for k in range(self.bodies.shape[2])]
        for j, terms in enumerate(self.local):
            out += [(str(j), name) for name in terms]
        out += [("shared", name) for name in self.shared]
        return out


@dataclass(frozen=True)
class System:
    """Whitened normal equations of B blocks.

    Attributes:
        keys: Place and term of every column, (P,).
        gram: (B, P, P).
        moment: (B, P).
        power: Sum of squares of the whitened torque, (B,).
        rows: Whitened rows, (B,).
        where: Column of every key.
    """

    keys: tuple[Key, ...]
    gram: Array
    moment: Array
    power: Array
    rows: Array
    where: Mapping[Key, int]

    def index(self, keys: Sequence[Key]) -> NDArray[np.intp]:
        """Columns of keys."""
        return np.array([self.where[k] for k in keys], dtype=np.intp)


def system(
    columns: Columns,
    tau: Array,
    blocks: Sequence[Span],
    noise: Sequence[Colour],
    friction: Array | None = None,
) -> System:
    """Whiten and add up.

    Args:
        columns: Of N rows.
        tau: Target, (N, J) [N*m].
        blocks: Contiguous stretches, first row and row after the last.
        noise: Of every joint.
        friction: Size of every joint's friction, which rows of doubtful sign are unsure of, (J,).
    """
    keys = tuple(columns.keys)
    where = {k: i for i, k in enumerate(keys)}
    nb, n_body, joints = len(blocks), columns.bodies.shape[2], tau.shape[1]
    gram = np.zeros((nb, len(keys), len(keys)))
    moment, power, rows = np.zeros((nb, len(keys))), np.zeros(nb), np.zeros(nb)
    for j in range(joints):
        shared = [(name, c[j]) for name, c in columns.shared.items() if j in c]
        at = np.concatenate(
            [
                np.arange(n_body),
                [where[(str(j), name)] for name in columns.local[j]],
                [where[("shared", name)] for name, _ in shared],
            ]
        ).astype(np.intp)
        x = np.column_stack(
            [columns.bodies[:, j], *columns.local[j].values(), *(c for _, c in shared), tau[:, j]]
        )
        if friction is not None:
            x = x * weights(columns.doubt[:, j], friction[j], noise[j].level)[:, None]
        for b, (first, last) in enumerate(blocks):
            z = noise[j].whiten(x[first:last])
            g = z.T @ z
            gram[b][np.ix_(at, at)] += g[:-1, :-1]
            moment[b][at] += g[:-1, -1]
            power[b] += g[-1, -1]
            rows[b] += len(z)
    return System(keys, gram, moment, power, rows, where)
