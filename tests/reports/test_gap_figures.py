"""Figures of `gap`: every joint has its pair of bars."""

from __future__ import annotations

import numpy as np

from reports.figures.gap import by_joint_figure


def test_each_joint_has_its_gap_before_and_after() -> None:
    gaps = np.array([0.4, np.nan]), np.array([0.1, np.nan])
    figure = by_joint_figure(["a", "b"], gaps, np.array([0.05, 0.06]), "N*m", title="t")
    widths = [bar.get_width() for bar in figure.axes[0].patches]
    assert widths == [0.4, 0.0, 0.1, 0.0]  # nothing of a joint without rows
    assert [t.get_text() for t in figure.axes[0].get_yticklabels()] == ["a", "b"]
