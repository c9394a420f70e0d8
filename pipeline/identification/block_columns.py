"""What competes as a block: one law at all joints that are alike, or one body; its Gram matrices.

A column is scaled so that a coefficient of one explains all of its joint's torque (a speed's column
counts in torque over speed), so that one prior scale serves a block at all joints, whatever their
size. Gram matrices are taken once, by chunk of the log and by equation; every estimate, trial of a
block and left-out chunk after that is a matter of their sums.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array, Index
from pipeline.dynamics.residual import EquationsOfMotion
from pipeline.dynamics.residual_columns import (
    body_columns,
    joint_columns,
    tilt_columns,
    zero_columns,
)
from pipeline.identification.regression.design_matrix import DataSet
from pipeline.logs.prepared.measurement import TRAIN, VALIDATION
from pipeline.machine.machine import MachineModel
from pipeline.simulation.rigid_bodies import changed_model, configuration, pseudo_inertia

#: Chunks of all logs together; an eighth of them is left out at a time.
CHUNKS: Final = 16
#: Speed over which Stribeck friction falls, in speeds of rest.
_SLOW: Final = 5.0
#: Least eigenvalue of a pseudo-inertia in its largest: what a file says less of may still move.
_LEAST: Final = 1e-6


@dataclass(frozen=True)
class Kind:
    """A law that a block may be."""

    effect: str  #: In the catalogue's words.
    parameter: str  #: Of that effect.
    unit: str  #: Of the coefficient.
    signed: bool = False  #: Whether it may be negative.
    #: Largest prior scale, in what the column counts in: what the thing has in practice.
    bound: float = np.inf
    common: bool = False  #: Whether every machine has it: it stays, shrunk.
    relative: bool = True  #: Whether columns count in the joint's torque.


#: Bounds: an encoder's zero after calibration is a fraction of a degree, a torque constant within
#: some per cent of its data sheet, a stand level within a few degrees.
KINDS: Final = {
    "viscous": Kind("viscous_friction", "coefficient", "N*m*s/rad", common=True),
    "coulomb": Kind("coulomb_friction", "torque", "N*m", common=True),
    "load": Kind("load_dependent_friction", "share", "1", common=True, relative=False),
    "rotor": Kind("rotor_inertia", "added", "kg*m^2", common=True),
    "offset": Kind("effort_offset", "offset", "N*m", signed=True, common=True),
    "stribeck": Kind("stribeck_friction", "excess", "N*m"),
    "drag": Kind("quadratic_drag", "quadratic", "N*m*s^2/rad^2"),
    "spring": Kind("parallel_spring", "stiffness", "N*m/rad"),
    "gain": Kind("effort_gain", "gain", "1", signed=True, bound=0.03, relative=False),
    "zero": Kind("position_offset", "angle", "rad", signed=True, bound=0.0087, relative=False),
    "tilt": Kind("base_tilt", "angle", "rad", signed=True, bound=0.05, relative=False),
    "delay": Kind("time_delay", "delay", "s", signed=True, relative=False),
    "coupling": Kind("transmission_coupling", "friction", "N*m"),
    "body": Kind("rigid_body_parameters", "", "", signed=True, bound=0.5, common=True),
}


@dataclass(frozen=True, eq=False)
class Block:
    """Columns that share one prior scale."""

    kind: str  #: Key of `KINDS`.
    places: tuple[str, ...]  #: Joint, or link, of every column.
    columns: Index  #: Numbers of its columns.
    #: What a coefficient of one is in the kind's unit, shape (n,); of a body ten ones.
    scale: Array
    joints: tuple[int, ...]  #: Equations that it touches.

    @property
    def law(self) -> Kind:
        """What it may be."""
        return KINDS[self.kind]


@dataclass(frozen=True, eq=False)
class Equation:
    """Rows of one joint's equation over all logs."""

    X: Array  #: Shape (R, K), in physical units.
    r: Array  #: Shape (R,) [N*m].
    chunk: NDArray[np.intp]  #: Of every row, shape (R,).


@dataclass(frozen=True, eq=False)
class BlockData:
    """Everything that a fit of blocks needs."""

    blocks: tuple[Block, ...]  #: Bodies first.
    equations: tuple[Equation, ...]  #: One per joint.
    start: Array  #: Ten inertial parameters of every body of the model, shape (B, 10).
    joints: tuple[str, ...]  #: Names of the equations.

    @cached_property
    def grams(self) -> tuple[Array, Array, Array, Array]:
        """X^T X (C, J, K, K), X^T r (C, J, K), r^T r and rows (C, J) of every chunk."""
        K = self.blocks[-1].columns[-1] + 1
        shape = (CHUNKS, len(self.equations))
        G, h = np.zeros((*shape, K, K)), np.zeros((*shape, K))
        s, n = np.zeros(shape), np.zeros(shape)
        for j, e in enumerate(self.equations):
            for c in range(CHUNKS):
                X, r = e.X[e.chunk == c], e.r[e.chunk == c]
                G[c, j], h[c, j], s[c, j], n[c, j] = X.T @ X, X.T @ r, r @ r, r.size
        return G, h, s, n

    @cached_property
    def roots(self) -> Array:
        """Cholesky roots of the bodies' pseudo-inertias, of the nearest bodies, (B, 4, 4)."""
        J = np.array([pseudo_inertia(ten) for ten in self.start])
        size, axes = np.linalg.eigh(J)
        least = np.maximum(_LEAST * size[:, -1:], 1e-9)
        J = (axes * np.maximum(size, least)[:, None]) @ axes.swapaxes(-1, -2)
        return np.asarray(np.linalg.cholesky(J))

    @cached_property
    def total(self) -> tuple[Array, Array, Array, Array]:
        """The same of all chunks."""
        G, h, s, n = (x.sum(axis=0) for x in self.grams)
        return G, h, s, n

    def sums(self, chunks: Index) -> tuple[Array, Array, Array, Array]:
        """The same of some chunks."""
        G, h, s, n = (x[chunks].sum(axis=0) for x in self.grams)
        return G, h, s, n


def block_data(model: MachineModel, data_sets: Sequence[DataSet]) -> BlockData:
    """Columns and residuals of a machine on a fixed base whose log holds torque at its joints.

    Args:
        model: What the engineer has.
        data_sets: Logs, from `make_data_sets`.
    """
    made = [_columns(model, d) for d in data_sets]
    measured = [d.measurement for d in data_sets]
    T = np.sqrt(np.mean([np.mean(m.effort[..., 0] ** 2, axis=0) for m in measured], axis=0))
    bodies = len(model.rigid.names) - 1
    blocks: list[Block] = []
    carrier = {joint: link for link, joint in model.links.items()}
    for b in range(bodies):
        name = carrier.get(str(model.rigid.names[b + 1]), str(model.rigid.names[b + 1]))
        touched = tuple(j for j in range(len(model.joints)) if _seen(made, j, b))
        ids = np.arange(10 * b, 10 * b + 10)
        blocks.append(Block("body", (name,) * 10, ids, np.ones(10), touched))
    at = 10 * bodies
    for kind, places, joints in _laws(model):
        ids = np.arange(at, at + len(places))
        size = np.ones(ids.size)
        if KINDS[kind].relative:
            for n, (column, own) in enumerate(zip(ids, joints, strict=True)):
                # The least of the two where it acts at two joints.
                size[n] = min(
                    T[j] / max(_rms([x[j][:, column] for x, _ in made]), 1e-12) for j in own
                )
        blocks.append(Block(kind, places, ids, size, tuple(sorted({j for o in joints for j in o}))))
        at += len(places)
    start = np.array(
        [np.asarray(model.rigid.inertias[b + 1].toDynamicParameters()) for b in range(bodies)]
    )
    return BlockData(
        tuple(blocks), tuple(_equations(data_sets, made)), start.reshape(bodies, 10), model.joints
    )


def _laws(model: MachineModel) -> list[tuple[str, tuple[str, ...], list[tuple[int, ...]]]]:
    """Kinds with the place and the equations of each column, in the columns' order."""
    own: list[tuple[int, ...]] = [(j,) for j in range(len(model.joints))]
    every = tuple(range(len(model.joints)))
    out: list[tuple[str, tuple[str, ...], list[tuple[int, ...]]]] = [
        (kind, model.joints, own) for kind in _OWN
    ]
    out.append(("zero", model.joints, [every for _ in own]))
    out.append(("tilt", ("ground", "ground"), [every, every]))
    out.append(("delay", ("effort channels",), [every]))
    for i, k in pairwise(every):
        for sign in "+-":
            place = f"{model.joints[k]} {sign} {model.joints[i]}"
            out.append(("coupling", (place,) * 3, [(i, k)] * 3))
    return out


_OWN: Final = (
    *("viscous", "coulomb", "load", "rotor", "offset"),
    *("stribeck", "drag", "spring", "gain"),
)


def _columns(model: MachineModel, data_set: DataSet) -> tuple[list[Array], list[Array]]:
    """Columns (R, K) and residual (R,) of every joint, at the bandwidth, of one log's rows."""
    m, rows = data_set.measurement, data_set.rows
    prediction = data_set.simulator.predict(model)
    rigid = changed_model(model.rigid, model.bodies)
    q, v, a, at = configuration(model, rigid, (m.q, m.v, m.a))
    torque = np.zeros_like(v)
    equations = EquationsOfMotion(rigid, (q, v, a), torque, np.eye(rigid.nv))
    sign = np.tanh(m.v / m.rest_speed)
    load = prediction.torque
    slow = _SLOW * m.rest_speed
    rate = m.derivative(load)
    laws = joint_columns(m.v, m.a, sign=sign, load=load, rate=rate, slow=slow)
    laws["spring"] = m.q - m.q.mean(axis=0)

    def build(moved: Array) -> EquationsOfMotion:
        other = configuration(model, rigid, (moved, m.v, m.a))[:3]
        return EquationsOfMotion(rigid, other, torque, equations.noise)

    bodies = body_columns(equations)[:, at]
    zeros, tilt = -zero_columns(build, m.q)[:, at], tilt_columns(equations)[:, at]
    n, J = m.q.shape
    coupled = []
    for i, k in pairwise(range(J)):
        for s in (1.0, -1.0):
            both = m.v[:, k] + s * m.v[:, i]
            rest = np.hypot(m.rest_speed[i], m.rest_speed[k])
            for law in (both, np.tanh(both / rest), m.a[:, k] + s * m.a[:, i]):
                column = np.zeros((n, J))
                column[:, k], column[:, i] = law, s * law
                coupled.append(column)
    X, r = [], []
    smooth = m.smooth(prediction.effort)[..., 0]
    for j in range(J):
        own = np.zeros((n, len(_OWN) * J))
        for c, kind in enumerate(_OWN):
            own[:, c * J + j] = laws[kind][:, j]
        whole = [bodies[:, j], own, zeros[:, j], tilt[:, j], laws["delay"][:, j, None]]
        whole += [column[:, j, None] for column in coupled]
        good = m.mask[rows, j]
        X.append(np.where(good[:, None], m.smooth(np.hstack(whole))[rows], 0.0))
        r.append(np.where(good, m.effort[rows, j, 0] - smooth[rows, j], 0.0))
    return X, r


def _rms(columns: Sequence[Array]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(columns) ** 2)))


def _seen(made: Sequence[tuple[list[Array], list[Array]]], j: int, b: int) -> bool:
    return any(x[j][:, 10 * b : 10 * b + 10].any() for x, _ in made)


def _equations(
    data_sets: Sequence[DataSet], made: Sequence[tuple[list[Array], list[Array]]]
) -> list[Equation]:
    # Rows in time's order, so that neighbours are neighbours; chunks of all that has a say.
    orders, total = [], 0
    for d in data_sets:
        m = d.measurement
        said = np.flatnonzero(np.isin(m.part[d.rows], (TRAIN, VALIDATION)))
        orders.append(said[np.argsort(d.rows[said], kind="stable")])
        total += said.size
    chunk = (np.arange(total) * CHUNKS) // max(total, 1)
    out = []
    for j in range(len(made[0][0])):
        good = np.concatenate(
            [d.measurement.mask[d.rows[o], j] for d, o in zip(data_sets, orders, strict=True)]
        )
        X = np.concatenate([x[j][o] for (x, _), o in zip(made, orders, strict=True)])
        r = np.concatenate([y[j][o] for (_, y), o in zip(made, orders, strict=True)])
        out.append(Equation(X[good], r[good], chunk[good]))
    return out
