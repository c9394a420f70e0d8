"""Margins of the support polygon against hand-drawn ones."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.motion.support import support_margin

SQUARE = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
SHUFFLED = [SQUARE[k] for k in (2, 0, 3, 1)]
WEDGE = [[1, 0, 0], [-1, 1, 0], [-1, -1, 0]]
LONG = [[2, -1, 0], [2, 1, 0], [-1, 1, 0], [-1, -1, 0]]


@pytest.mark.parametrize(
    ("feet", "point", "nearest"),
    [
        (SQUARE, (0, 0), 1),
        (SQUARE, (0.5, 0.2), 0.5),
        (SHUFFLED, (0.5, 0.2), 0.5),
        (SQUARE, (0.2, 0.9), 0.1),
        (SQUARE, (1.25, 0), -0.25),
        (SQUARE, (-1.5, 0), -0.5),
        (LONG, (1.5, 0), 0.5),
        (LONG, (-0.7, 0), 0.3),
        (WEDGE, (0, 0.2), 0.6 / np.sqrt(5)),
        (WEDGE, (0, -0.2), 0.6 / np.sqrt(5)),
        (WEDGE, (-0.8, 0), 0.2),
        (WEDGE, (0.8, 0.2), -0.2 / np.sqrt(5)),
    ],
)
def test_margins_are_distances_to_the_nearest_edge(
    feet: list[list[float]], point: tuple[float, float], nearest: float
) -> None:
    corners, at = np.array([feet], dtype=float), np.array([point], dtype=float)
    assert support_margin(corners, at) == pytest.approx([nearest])
