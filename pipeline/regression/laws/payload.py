"""A weight that a link carries: the point mass that is nearest to what its body has more."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from pipeline.regression.laws.friction import LAW
from pipeline.simulation.rigid_bodies import point_mass

Array = NDArray[np.float64]
#: Of what a body has more, the share that a weight leaves at most.
MOST = 0.5


@dataclass(frozen=True)
class Payload:
    """A point mass on a body.

    Attributes:
        body: Which.
        mass: [kg].
        place: In the frame of the body's joint, (3,) [m].
        mass_error: Standard error [kg].
        place_error: (3,) [m].
    """

    body: int
    mass: float
    place: Array
    mass_error: float
    place_error: Array

    @property
    def parameters(self) -> Array:
        """Its ten parameters."""
        return point_mass([self.mass, *(self.mass * self.place)])


def nearest(body: int, more: Array, covariance: Array) -> Payload | None:
    """The point mass that is nearest to what a body has more, by what is known of that.

    Least squares over mass and first moments of (p(m, m c) - d)^T C^-1 (p(m, m c) - d); the errors
    are those of its linear neighbourhood, and that no model of the rest holds better than `LAW`.

    Args:
        body: Which.
        more: Ten parameters by which it is more than its URDF, d.
        covariance: Of them, C, (10, 10).

    Returns:
        None where no mass explains most of it.
    """
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    value, vector = np.linalg.eigh(covariance / np.outer(size, size))
    white = (vector / np.sqrt(np.maximum(value, 1e-12 * value.max()))).T / size

    def off(x: Array) -> Array:
        return np.asarray(white @ (point_mass([float(np.exp(x[0])), *x[1:]]) - more))

    # Where the mass itself is hardly known the moments tell about it by the inertia.
    starts = [max(float(more[0]), 1e-3), *(float(np.exp(k)) for k in np.linspace(-4.0, 3.0, 8))]
    fits = [
        scipy.optimize.least_squares(off, np.array([np.log(m), *more[1:4]]), x_scale="jac")
        for m in starts
    ]
    best = min(fits, key=lambda f: float(f.cost))
    mass, moment = float(np.exp(best.x[0])), best.x[1:]
    slopes = np.asarray(best.jac)
    spread = np.linalg.pinv(slopes.T @ slopes, rcond=1e-12, hermitian=True)
    error = np.sqrt(np.maximum(np.diag(spread), 0.0))
    whole = 0.5 * float(np.sum((white @ more) ** 2))
    if best.cost > MOST * whole or not np.isfinite(error).all():
        return None
    place = moment / mass
    # c = (m c) / m, with m = exp(x0)
    slope = np.column_stack([-place, np.eye(3) / mass])
    place_error = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slope, spread, slope), 0.0))
    return Payload(
        body,
        mass,
        np.asarray(place),
        float(mass * np.hypot(error[0], LAW)),
        np.hypot(place_error, LAW * np.abs(place)),
    )
