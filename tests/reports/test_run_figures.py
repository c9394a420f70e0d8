"""Every figure of a run of several robots is drawn and names its run."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import pytest

import pipeline as lw
from reports.figures.run import drawings
from reports.figures.style import save_figure


@pytest.mark.parametrize(
    "name", ["hexapod", *(pytest.param(x, marks=pytest.mark.slow) for x in ("solo12", "anymal_c"))]
)
def test_every_figure_is_drawn_and_names_its_run(root: Path, tmp_path: Path, name: str) -> None:
    given = lw.load(root / "urdf" / f"{name}.toml").walking(samples=151)
    standing, walking = lw.stand(given), lw.walk(given)
    tables = standing.tables | walking.tables
    for title, draw in drawings(given, standing.result, walking.result, tables).items():
        figure = draw()
        save_figure(figure, tmp_path, title)
        words = [t.get_text() for t in figure.findobj(matplotlib.text.Text)]
        assert name in " ".join(words), title
