"""Which combinations of body parameters the motion tells: pivoted QR of the regressor.

Gautier, "Numerical calculation of the base inertial parameters of robots", 1991. Columns are scaled
by what the URDF's uncertainty lets each parameter be, so that condition number and rank do not
depend on units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from pipeline.regression.laws.bodies import PARAMETERS, UNITS, Bodies

Array = NDArray[np.float64]

#: A column whose remainder is smaller than this share of the largest is lost.
RANK: Final = 1e-7


@dataclass(frozen=True)
class BaseSet:
    """Base parameters as combinations of body parameters.

    Attributes:
        names: Of the combinations.
        units: Of the combinations.
        combine: (K, P), so that base parameters are `combine @ parameters`.
        condition: Condition number of the scaled regressor of the base parameters.
        lost: Names of parameters in no combination.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    combine: Array
    condition: float
    lost: tuple[str, ...]


def base_set(regressor: Array, bodies: Bodies, joints: tuple[str, ...]) -> BaseSet:
    """Base parameters of a motion.

    Args:
        regressor: Torque per body parameter, (N, J, P).
        bodies: Of the URDF.
        joints: Names of the joints that the bodies hang on.
    """
    free = np.flatnonzero(bodies.columns)
    labels = [f"{PARAMETERS[k % 10]}({joints[k // 10]})" for k in free]
    units = [UNITS[k % 10] for k in free]
    x = regressor.reshape(-1, regressor.shape[2])[:, free]
    scale = np.sqrt(np.diag(np.linalg.inv(bodies.metric[np.ix_(free, free)])))
    upper = np.linalg.qr(x * scale, mode="r")
    r, pivot = scipy.linalg.qr(upper, mode="r", pivoting=True)
    size = np.abs(np.diag(r))
    rank = int((size > RANK * size[0]).sum())
    head, tail = pivot[:rank], pivot[rank:]
    mix = scipy.linalg.solve_triangular(r[:rank, :rank], r[:rank, rank:])
    mix = np.where(np.abs(mix) < 1e-9, 0.0, mix)
    order = np.argsort(head)
    combine = np.zeros((rank, bodies.nominal.size))
    names = []
    for row, k in enumerate(order):
        combine[row, free[head[k]]] = 1.0
        text = labels[head[k]]
        for c, t in enumerate(tail):
            factor = mix[k, c] * scale[head[k]] / scale[t]
            if abs(mix[k, c]) > 1e-6:
                combine[row, free[t]] = factor
                text += f" {'+' if factor > 0 else '-'} {abs(factor):.4g} {labels[t]}"
        names.append(text)
    zero = np.linalg.norm(upper, axis=0) <= RANK * size[0]
    return BaseSet(
        tuple(names),
        tuple(units[head[k]] for k in order),
        combine,
        float(np.linalg.cond(r[:rank, :rank])),
        tuple(labels[k] for k in np.flatnonzero(zero)),
    )
