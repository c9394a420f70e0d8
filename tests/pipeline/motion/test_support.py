"""Margins of the support polygon against hand-drawn ones."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.motion.support import longitudinal_margin, support_margin

SQUARE = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
SHUFFLED = [SQUARE[k] for k in (2, 0, 3, 1)]
WEDGE = [[1, 0, 0], [-1, 1, 0], [-1, -1, 0]]  # the edges ahead are x = 1 - 2 |y|
LONG = [[2, -1, 0], [2, 1, 0], [-1, 1, 0], [-1, -1, 0]]


@pytest.mark.parametrize(
    ("feet", "point", "nearest", "along"),
    [
        (SQUARE, (0, 0), 1, 1),
        (SQUARE, (0.5, 0.2), 0.5, 0.5),
        (SHUFFLED, (0.5, 0.2), 0.5, 0.5),
        (SQUARE, (0.2, 0.9), 0.1, 0.8),  # the side's edge is met by no way along x
        (SQUARE, (1.25, 0), -0.25, -0.25),
        (SQUARE, (-1.5, 0), -0.5, -0.5),
        (LONG, (1.5, 0), 0.5, 0.5),
        (LONG, (-0.7, 0), 0.3, 0.3),
        (WEDGE, (0, 0.2), 0.6 / np.sqrt(5), 0.6),
        (WEDGE, (0, -0.2), 0.6 / np.sqrt(5), 0.6),
        (WEDGE, (-0.8, 0), 0.2, 0.2),
        (WEDGE, (0.8, 0.2), -0.2 / np.sqrt(5), -0.2),
    ],
)
def test_margins_are_distances_to_the_nearest_edge_and_along_the_heading(
    feet: list[list[float]], point: tuple[float, float], nearest: float, along: float
) -> None:
    corners, at = np.array([feet], dtype=float), np.array([point], dtype=float)
    assert support_margin(corners, at) == pytest.approx([nearest])
    assert longitudinal_margin(corners, at) == pytest.approx([along])


def test_the_longitudinal_margin_is_never_less_than_the_margin() -> None:
    rng = np.random.default_rng(3)
    feet, point = rng.normal(size=(200, 5, 3)), 0.2 * rng.normal(size=(200, 2))
    inside = support_margin(feet, point) > 0
    assert inside.any()
    assert (longitudinal_margin(feet, point) >= support_margin(feet, point))[inside].all()
