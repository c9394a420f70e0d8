"""Orthographic views of triangles, hidden surfaces removed, one lamp, edges drawn.

A depth buffer decides pixel by pixel what is in front; it is exact where bodies touch or enter one
another, which sorting polygons is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from reports.figures.robot.solids import Solid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Towards the lamp, in the camera's frame: right, up, towards the viewer.
_LAMP = np.array([-0.35, 0.75, 0.56]) / np.linalg.norm([-0.35, 0.75, 0.56])
_OVERSAMPLED = 2  # per pixel and direction, for smooth edges
#: A body nearer by less than this does not cover what was drawn before: coplanar faces.
_TOUCHING = 1e-6  # [m]


@dataclass(frozen=True)
class View:
    """A camera at infinity."""

    name: str  #: E.g. ``"front"``.
    #: Rows are the image's right, its up, and the direction towards the viewer, in the world, shape
    #: (3, 3); right-handed.
    axes: Array

    def project(self, points: Array) -> Array:
        """World points to (right, up, nearness), shape (..., 3) [m]."""
        return points @ self.axes.T


def camera(name: str, towards_viewer: Sequence[float], up: Sequence[float] = (0, 0, 1)) -> View:
    """A view from a direction, with another direction upwards in the image."""
    toward = np.asarray(towards_viewer, float) / np.linalg.norm(towards_viewer)
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    return View(name, np.array([right, np.cross(toward, right), toward]))


FRONT = camera("from ahead", (1, 0, 0))
SIDE = camera("from the right", (0, -1, 0))
TOP = camera("from above", (0, 0, 1), up=(0, 1, 0))
OBLIQUE = camera("oblique", (1.0, -1.35, 0.85))
OBLIQUE_LEFT = camera("oblique, from the left", (1.0, 1.35, 0.85))


def extent(view: View, scene: Sequence[Solid]) -> tuple[Array, Array]:
    """Lower left and upper right corner of a scene in the image, each of shape (2,) [m]."""
    seen = view.project(np.concatenate([solid.corners for solid in scene]))[:, :2]
    return seen.min(axis=0), seen.max(axis=0)


def draw_scene(
    axes: Axes, view: View, scene: Sequence[Solid], fade: float = 0.0, pixels: int = 600
) -> None:
    """Draw a scene into axes whose unit is the metre.

    Args:
        scene: What to draw; at least one solid.
        fade: From 0 to 1, towards white, for a robot behind its annotation.
        pixels: Along the longer side of the picture.
    """
    low, high = extent(view, scene)
    step = float((high - low).max()) / (pixels * _OVERSAMPLED)
    canvas = _Canvas(low - 4 * step, high + 4 * step, step)
    for solid in scene:
        canvas.draw(view, solid)
    image = canvas.picture()
    image[..., :3] += fade * (1 - image[..., :3])
    axes.imshow(image, extent=canvas.extent, origin="lower", zorder=2, interpolation="antialiased")
    axes.set_aspect("equal")


class _Canvas:
    """Colour, depth and identity of the foremost surface at every sample."""

    def __init__(self, low: Array, high: Array, step: float) -> None:
        n = np.ceil((high - low) / step / _OVERSAMPLED).astype(int) * _OVERSAMPLED
        self.low, self.step = low, step
        # Single precision is 1e-7 of a robot's size: enough, and half the time.
        self.x = (low[0] + step * (np.arange(n[0]) + 0.5)).astype(np.float32)
        self.y = (low[1] + step * (np.arange(n[1]) + 0.5)).astype(np.float32)
        self.color = np.ones((n[1], n[0], 3), dtype=np.float32)
        self.depth = np.full((n[1], n[0]), -np.inf, dtype=np.float32)
        self.surface = np.zeros((n[1], n[0]), dtype=int)
        self.surfaces = 0

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom, top [m]."""
        left, bottom = self.low
        right = left + self.x.size * self.step
        return float(left), float(right), float(bottom), float(bottom + self.y.size * self.step)

    def draw(self, view: View, solid: Solid) -> None:
        """Triangles, seen from both sides, shaded flat; a line around each side of the solid."""
        corners = view.project(solid.points)[solid.faces]  # (F, 3 corners, 3)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing = normal[:, 2]  # twice the area that is seen, signed
        area = np.abs(facing) if solid.kind == "mesh" else facing  # others hide their own backs
        shown = area > 1e-4 * self.step**2
        corners, normal, facing = corners[shown], normal[shown], facing[shown]
        color = normal * (np.sign(facing) / np.linalg.norm(normal, axis=1))[:, None]
        color = _shaded(solid.colors[shown], color).astype(np.float32)
        slope = -normal[:, :2] / facing[:, None] * self.step  # of the depth, per sample
        flat = (corners[..., :2] - self.low) / self.step - 0.5  # in samples
        first = np.maximum(np.ceil(flat[..., 1].min(axis=1)), 0).astype(int)
        last = np.minimum(np.floor(flat[..., 1].max(axis=1)), self.y.size - 1).astype(int)
        side = self.surfaces + 1 + solid.sides[shown]
        self.surfaces += 1 + int(solid.sides.max())
        rows = np.maximum(last - first + 1, 0)
        which = np.repeat(np.arange(rows.size), rows)
        y = first[which] + _counted_up(rows)
        begin, end = _spans(flat, which, y)
        begin, end = np.maximum(begin, 0), np.minimum(end, self.x.size - 1)
        at = flat[which, 0]
        depth = corners[which, 0, 2] + slope[which, 0] * (begin - at[:, 0])
        depth += slope[which, 1] * (y - at[:, 1])
        # Runs of samples along rows, each of one face and of a depth that grows by a slope.
        run = np.repeat(np.arange(y.size), np.maximum(end - begin + 1, 0))
        along = _counted_up(np.maximum(end - begin + 1, 0))
        sample = (y * self.x.size + begin)[run] + along
        near = (depth[run] + slope[which, 0][run] * along).astype(np.float32)
        seen = np.flatnonzero(near > self.depth.ravel()[sample] + _TOUCHING)
        if solid.kind == "mesh":
            seen = seen[np.argsort(near[seen], kind="stable")]  # the nearest last: it stays
        sample, face = sample[seen], which[run[seen]]
        self.depth.reshape(-1)[sample] = near[seen]
        self.color.reshape(-1, 3)[sample] = color[face]
        self.surface.reshape(-1)[sample] = side[face]

    def picture(self) -> Array:
        """Red, green, blue and opacity, with a dark line where one surface ends."""
        edge = np.zeros(self.surface.shape, dtype=bool)
        for axis in (0, 1):
            change = np.diff(self.surface, axis=axis) != 0
            before: tuple[slice, ...] = (slice(None, -1), slice(None))
            after: tuple[slice, ...] = (slice(1, None), slice(None))
            edge[before if axis == 0 else before[::-1]] |= change
            edge[after if axis == 0 else after[::-1]] |= change
        color = self.color.copy()
        color[edge] *= np.float32(0.35)
        opaque = (edge | (self.surface > 0)).astype(np.float32)[..., None]
        k = _OVERSAMPLED

        def averaged(values: NDArray[np.float32]) -> NDArray[np.float32]:
            parts = [values[i::k, j::k] for i in range(k) for j in range(k)]
            return sum(parts[1:], parts[0]) / np.float32(k * k)

        cover = averaged(opaque)
        mixed = averaged(color * opaque) / np.maximum(cover, 1e-9)
        return np.concatenate([mixed, cover], axis=-1)


def _counted_up(counts: NDArray[np.intp]) -> NDArray[np.intp]:
    """0, 1, ... for every count in a row."""
    first = np.repeat(np.cumsum(counts) - counts, counts)
    counted: NDArray[np.intp] = np.arange(first.size) - first
    return counted


def _spans(
    flat: Array, which: NDArray[np.intp], y: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and last sample of rows that lie within triangles.

    Args:
        flat: Corners of triangles [samples], shape (F, 3, 2).
    """
    low, high = np.full(y.size, np.inf), np.full(y.size, -np.inf)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a, b = flat[which, i], flat[which, j]
        rise = b[:, 1] - a[:, 1]
        crossed = (np.minimum(a[:, 1], b[:, 1]) <= y) & (y <= np.maximum(a[:, 1], b[:, 1]))
        crossed &= rise != 0
        x = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / np.where(crossed, rise, 1.0)
        low, high = (
            np.where(crossed, np.minimum(low, x), low),
            np.where(crossed, np.maximum(high, x), high),
        )
    crossed = low <= high
    low, high = np.where(crossed, low, 0.0), np.where(crossed, high, -1.0)
    # Samples on an edge, which may be that of two faces, belong to both.
    return np.ceil(low - 1e-6).astype(np.intp), np.floor(high + 1e-6).astype(np.intp)


def _shaded(color: Array, normal: Array) -> Array:
    """Lambert's law with some ambient light; lightened, so that labels stay legible on top."""
    light = 0.66 + 0.34 * np.maximum(0.0, normal @ _LAMP)
    shaded: Array = (0.22 + 0.78 * color) * light[..., None]
    return np.clip(shaded, 0, 1)
