"""What the base of a legged robot carries beside its file, by the equations of motion alone.

Rows of base and joints with the ground's unknown forces eliminated (`equations_of`) are fitted by
mass and horizontal first moment of the base beside dry and viscous friction of all joints. A search
that judges joint by joint needs a rule for the ground's forces, and what hangs on the base hides in
it: this does not.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.dynamics.residual import EquationsOfMotion
from pipeline.dynamics.residual_columns import at_joints, body_columns
from pipeline.logs.errors import Finding
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.simulation.equations import equations_of
from pipeline.simulation.predict import Simulator

#: Rows that are looked at, without a gap: a minute of walking at the usual bandwidth.
ROWS: Final = 6000
#: Share of the whitened residual's variance that the load has to take ...
TAKES: Final = 0.1
#: ... and standard deviations by which a number of it leaves zero.
CLEAR: Final = 4.0
_PARTS: Final = 8


def base_load(model: MachineModel, log: Log) -> list[Finding]:
    """A finding where the base carries more or less than the model says, or elsewhere; else none.

    Args:
        model: Machine.
        log: Its log; one without torque, or of a machine on a fixed base, says nothing.
    """
    if not model.floating or model.legs is None or log.channels[0] != "torque":
        return []
    longest = max(log.pieces, key=lambda piece: piece.stop - piece.start)
    rows = np.arange(longest.start, min(longest.stop, longest.start + ROWS))
    part = log.at(rows)
    equations = equations_of(model, part, load=Simulator(part).load(model))
    if equations.known is None or equations.known.sum() < _PARTS * 10:
        return []
    rows = np.flatnonzero(equations.known)
    equations = equations.at(rows)
    y, X = equations.whitened(equations.residual), _columns(equations, part.at(rows))
    x, spread, before, after = _fit(X, y)
    if after > (1.0 - TAKES) * before or not (np.abs(x[:3]) > CLEAR * spread[:3]).any():
        return []
    mass, moment, half = float(x[0]), x[1:3], 1.96 * spread
    what = f"{mass:+.3g} kg ({mass - half[0]:.3g} to {mass + half[0]:.3g})"
    if abs(mass) > CLEAR * spread[0]:
        what += " at x {:.3f}, y {:.3f} m of it".format(*(moment / mass))
    else:
        what += " and a first moment of {:+.3g}, {:+.3g} kg*m".format(*moment)
    detail = (
        f"by the equations of motion, whatever the ground's forces, the base carries {what} beside "
        f"what the model says; that takes {100.0 * (1.0 - after / before):.0f} % of what is left"
    )
    return [Finding(log.name, "", "base_load", mass, "kg", "warning", detail)]


def _columns(equations: EquationsOfMotion, log: Log) -> Array:
    """Mass and first moment of the base, then friction, whitened, shape (N, nv, 3 + 2 J)."""
    assert equations.joints is not None
    nv = equations.torque.shape[1]
    sign = np.tanh(log.v / log.rest_speed) if log.sign is None else log.sign
    friction = [at_joints(x, equations.joints, nv) for x in (sign, log.v)]
    # The base is the first body.
    columns = np.concatenate([body_columns(equations)[..., :3], *friction], axis=2)
    return equations.whitened(columns)


def _sums(X: Array, y: Array) -> tuple[Array, Array]:
    flat = X.reshape(-1, X.shape[2])
    return flat.T @ flat, flat.T @ y.ravel()


def _solved(G: Array, h: Array) -> Array:
    return np.asarray(np.linalg.pinv(G, hermitian=True) @ h)


def _fit(X: Array, y: Array) -> tuple[Array, Array, float, float]:
    """Least squares, its standard deviation, squares left without the load and with it.

    The deviation is the wider of white noise's and a jackknife's over parts of the log.
    """
    parts = [_sums(X[p], y[p]) for p in np.array_split(np.arange(len(y)), _PARTS)]
    G, h = _sums(X, y)
    x, friction = _solved(G, h), _solved(G[3:, 3:], h[3:])
    after = float(np.sum(y**2) - h @ x)
    white = np.sqrt(after / y.size * np.diag(np.linalg.pinv(G, hermitian=True)))
    left = np.array([_solved(G - own[0], h - own[1]) for own in parts])
    spread = np.maximum(white, np.sqrt((_PARTS - 1) * left.var(axis=0)))
    return x, spread, float(np.sum(y**2) - h[3:] @ friction), after
