"""Figures of `gap`: every joint has its pair of bars, every term begins where that above ends."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from reports.figures.gap import by_joint_figure, power_shares_figure


def test_each_joint_has_its_gap_before_and_after() -> None:
    gaps = np.array([0.4, np.nan]), np.array([0.1, np.nan])
    figure = by_joint_figure(["a", "b"], gaps, np.array([0.05, 0.06]), "N*m", title="t")
    widths = [bar.get_width() for bar in figure.axes[0].patches]
    assert widths == [0.4, 0.0, 0.1, 0.0]  # nothing of a joint without rows
    assert [t.get_text() for t in figure.axes[0].get_yticklabels()] == ["a", "b"]


def test_terms_of_a_power_join_up() -> None:
    rows = [
        ("work", "model", 10.0, 10.0, 10.0),
        ("copper", "model", 5.0, 5.0, 5.0),
        ("constant", "found", 3.0, 2.5, 3.5),
        ("measured", "", 19.0, 19.0, 19.0),
        ("unexplained", "", 1.0, 0.5, 1.5),
    ]
    columns = ["term", "basis", "mean_W", "mean_low_W", "mean_high_W"]
    axes = power_shares_figure(pd.DataFrame(rows, columns=columns), title="t").axes[0]
    assert [bar.get_x() for bar in axes.patches] == pytest.approx([0.0, 10.0, 15.0])
