"""Ground forces that carry the robot with the least sum of squared tangential forces.

The wrench which floating-base inverse dynamics demands of the base (gravity and inertia of all
links) must come from the feet. With the feet of the stance on one plane, the three equations of
vertical force and tipping moments bind the normal forces alone, and the three of horizontal force
and yaw moment the tangential ones alone; "the tangential forces at the feet are the minimum ones
which guarantee the desired robot motion" (section II.B of the paper) then has a closed form: every
foot takes an equal share of the horizontal force, plus a share of the yaw moment in proportion to
its distance from the centroid of the stance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactForces:
    """Forces of the ground on the feet during one segment.

    Attributes:
        legs: All legs, in the robot file's order.
        stance: Those whose feet carry load.
        time: Shape (N,) [s].
        position: Foot points in the base frame [m], shape (N, L, 3).
        force: In the base frame, acting on the robot [N], shape (N, L, 3); zero in the air.
        force_world: The same in the world frame [N], shape (N, L, 3).
    """

    legs: tuple[str, ...]
    stance: tuple[str, ...]
    time: Array
    position: Array
    force: Array
    force_world: Array

    @property
    def friction_needed(self) -> Array:
        """Tangential over normal force per foot [1], shape (N, L); NaN where no load rests."""
        normal = self.force_world[..., 2]
        tangential = np.hypot(self.force_world[..., 0], self.force_world[..., 1])
        return np.divide(tangential, normal, out=np.full(normal.shape, np.nan), where=normal > 0)


def least_tangential_forces(wrench: Array, feet: Array) -> Array:
    """Foot forces that add up to a wrench, with the least sum of squared tangential forces.

    With more than three feet the tangential condition leaves the normal forces open; of those the
    least sum of squares is taken, and feet that would have to pull are released one by one.

    Args:
        wrench: Force and moment about the origin that the ground must supply, in a frame whose z
            axis is the ground's normal [N, N*m], shape (N, 6).
        feet: Foot points in the same frame [m], shape (N, F, 3), F >= 3.

    Returns:
        Forces on the robot [N], shape (N, F, 3). With three feet a normal force may come out
        negative: that foot would have to pull, and it is for the caller to refuse it. Feet in one
        line give normal forces that are not finite.

    Note:
        Feet at unequal heights are balanced exactly, but the tangential forces are then those of
        the equal-height solution, not the exact optimum.
    """
    n_feet = feet.shape[1]
    force = np.empty(feet.shape)
    centre = feet.mean(axis=1)
    from_centre = feet - centre[:, None]
    x, y = from_centre[..., 0], from_centre[..., 1]

    # Tangential: equal shares plus a rotation about the centroid; Lagrange multipliers of
    # min sum |t|^2 subject to sum t = F, sum (p x t)_z = M_z.
    yaw = wrench[:, 5] - (centre[:, 0] * wrench[:, 1] - centre[:, 1] * wrench[:, 0])
    spread = np.einsum("nf,nf->n", x, x) + np.einsum("nf,nf->n", y, y)
    turn = (yaw / spread)[:, None]
    force[..., 0] = wrench[:, 0, None] / n_feet - turn * y
    force[..., 1] = wrench[:, 1, None] / n_feet + turn * x

    # Normal: what vertical force and tipping moments leave after the tangential forces' moments.
    z = feet[..., 2]
    moment_x = wrench[:, 3] + np.einsum("nf,nf->n", z, force[..., 1]) - centre[:, 1] * wrench[:, 2]
    moment_y = wrench[:, 4] - np.einsum("nf,nf->n", z, force[..., 0]) + centre[:, 0] * wrench[:, 2]
    force[..., 2] = _normals(x, y, wrench[:, 2], moment_x, moment_y)
    if n_feet > 3:
        _release_pulling_feet(force, x, y, wrench[:, 2], moment_x, moment_y)
    return force


def _normals(x: Array, y: Array, total: Array, moment_x: Array, moment_y: Array) -> Array:
    # Least squares about the centroid: N_i = total/F + a x_i + b y_i, with
    # sum y N = moment_x and -sum x N = moment_y; exact and unique for three feet.
    xx, yy = np.einsum("nf,nf->n", x, x), np.einsum("nf,nf->n", y, y)
    xy = np.einsum("nf,nf->n", x, y)
    det = xx * yy - xy * xy
    with np.errstate(divide="ignore", invalid="ignore"):  # feet in one line: not finite, refused
        a = (-moment_y * yy - moment_x * xy) / det
        b = (moment_x * xx + moment_y * xy) / det
        return total[:, None] / x.shape[1] + a[:, None] * x + b[:, None] * y


def _release_pulling_feet(
    force: Array, x: Array, y: Array, total: Array, moment_x: Array, moment_y: Array
) -> None:
    for row in np.flatnonzero((force[..., 2] < 0).any(axis=1)):
        kept = np.arange(x.shape[1])
        normal = force[row, :, 2]
        while (normal[kept] < 0).any() and kept.size > 3:
            kept = np.delete(kept, int(np.argmin(normal[kept])))
            px, py = x[row, kept], y[row, kept]
            cx, cy = px.mean(), py.mean()
            part = _normals(
                (px - cx)[None],
                (py - cy)[None],
                total[row : row + 1],
                moment_x[row : row + 1] - cy * total[row],
                moment_y[row : row + 1] + cx * total[row],
            )
            normal = np.zeros(x.shape[1])
            normal[kept] = part[0]
        force[row, :, 2] = normal
