"""Outlines of points: what a convex body shows of itself."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def outline(points: Array) -> Array:
    """Corners of the convex hull of points in a plane, counter-clockwise, shape (P, 2)."""
    order = sorted(set(map(tuple, np.round(points, 6).tolist())))
    if len(order) < 3:
        return np.array(order).reshape(-1, 2)
    return np.array(_chain(order) + _chain(reversed(order)))


def _chain(points: Iterable[tuple[float, ...]]) -> list[tuple[float, ...]]:
    """One side of the hull of sorted points (Andrew), without its last corner."""
    kept: list[tuple[float, ...]] = []
    for p in points:
        while len(kept) > 1 and _turn(kept[-2], kept[-1], p) <= 0:
            kept.pop()
        kept.append(p)
    return kept[:-1]


def _turn(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def hull_points(points: Array, cell: float) -> Array:
    """Corners of the convex hull of points in space, those within one cell drawn into one.

    Args:
        points: Shape (P, 3) [m].
        cell: [m].

    Returns:
        Shape (Q, 3) [m]; all points where they have no hull.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners = points[ConvexHull(points).vertices]
    except (QhullError, ValueError):
        corners = points
    cells = np.round(corners / cell).astype(np.int64)
    _, first = np.unique(cells, axis=0, return_index=True)
    return corners[np.sort(first)]
