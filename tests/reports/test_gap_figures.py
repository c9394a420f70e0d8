"""Figures and tables of the gap workflow."""

from __future__ import annotations

import numpy as np
import pytest

from actuators.errors import LegwattError
from reports.figures.bars import gap_waterfall_figure
from reports.figures.gap import (
    GapTrace,
    WhereGroup,
    binned,
    gap_signature_figure,
    gap_time_figure,
    where_map_figure,
)


def trace(rows: int = 400) -> GapTrace:
    t = np.linspace(0.0, 2.0, rows)
    truth = np.sin(3 * t)
    noise = 0.02 * np.random.default_rng(3).standard_normal(rows)
    measured = truth + 0.2 * np.sign(np.cos(3 * t)) + noise
    compared = np.ones(rows, dtype=bool)
    compared[100:120] = False
    after = truth + 0.2 * np.sign(np.cos(3 * t))
    return GapTrace("rm_joint_2", t, measured, compared, truth, after, 0.02, "A")


def test_gap_in_time_tells_what_is_left() -> None:
    figure = gap_time_figure([trace()], title="t", channel="current")
    bottom = figure.axes[1]
    assert "0.0200 with" in bottom.get_title(loc="left")
    gap = np.asarray(bottom.lines[2].get_ydata(), dtype=float)
    assert np.sqrt(np.nanmean(gap**2)) == pytest.approx(0.02, rel=0.2)


def test_measured_signal_stays_visible_where_it_is_not_compared() -> None:
    figure = gap_time_figure([trace()], title="t", channel="current")
    top, bottom = figure.axes
    lines = {line.get_label(): np.asarray(line.get_ydata(), float) for line in top.lines}
    left_out = np.isnan(lines["measured, compared"])
    assert left_out.sum() == 20
    assert np.isfinite(lines["measured, not compared"]).all()
    assert np.isnan(np.asarray(bottom.lines[2].get_ydata(), float)[left_out]).all()


def test_signature_means_are_those_of_the_bins() -> None:
    rng = np.random.default_rng(0)
    x = rng.uniform(-1, 1, 4000)
    centre, mean = binned(x, np.sign(x))
    assert np.all(mean[centre < -0.1] == -1)
    assert np.all(mean[centre > 0.1] == 1)
    signature = "velocity [rad/s]", x, (np.sign(x), 0 * x), 0.1, "A"
    figure = gap_signature_figure(*signature, title="t")
    assert figure.axes[0].get_ylim() == figure.axes[1].get_ylim()
    empty = "velocity [rad/s]", x, (np.full_like(x, np.nan), 0 * x), 0.1, "A"
    with pytest.raises(LegwattError, match="no rows"):
        gap_signature_figure(*empty, title="t")


def test_waterfall_bars_join_up() -> None:
    steps = [("friction at a", 0.6), ("mass at b", 0.2)]
    figure = gap_waterfall_figure(1.0, steps, 0.1, "A", title="t")
    bars = sorted(figure.axes[0].patches, key=lambda bar: bar.get_y())
    assert [round(b.get_width(), 6) for b in bars] == [1.0, 0.4, 0.4, 0.2]
    assert [round(b.get_x(), 6) for b in bars] == [0.0, 0.6, 0.2, 0.0]


def test_where_map_shows_every_known_cell() -> None:
    table = np.array([[1.0, 5.0], [np.nan, 30.0]])
    figure = where_map_figure(
        ["a", "b"], [WhereGroup("phase", ("support", "transfer"), table)], title="t"
    )
    assert sorted(text.get_text() for text in figure.axes[0].texts) == ["1.0", "30", "5.0"]
