"""Every figure of a run of several robots: drawn, named, and no text cut by its edge."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import pytest

import pipeline as lw
from reports.figures.run import drawings
from tests.compared import walked_by
from tests.reports.outside import outside


@pytest.mark.parametrize(
    ("name", "gait"),
    [
        ("hexapod", "hexapod, tripod gait"),
        pytest.param("hexapod_axis90", "hexapod_axis90, tripod gait", marks=pytest.mark.slow),
        pytest.param("solo12", "solo12, crawl gait", marks=pytest.mark.slow),
        pytest.param("anymal_c", "anymal_c, crawl gait", marks=pytest.mark.slow),
    ],
)
def test_no_text_is_cut_and_every_figure_names_its_run(root: Path, name: str, gait: str) -> None:
    robot = str(root / "urdf" / f"{name}.toml")
    given = walked_by("reports", "--robot", robot, "--samples", "151")
    standing, walking = lw.stand(given), lw.walk(given)
    tables = standing.tables | walking.tables
    every = drawings(given, standing.result, walking.result, tables)
    for figure, draw in every.items():
        drawn = draw()
        assert outside(drawn) == [], figure
        words = " ".join(t.get_text() for t in drawn.findobj(matplotlib.text.Text))
        assert figure in ("robot", "gait") or gait in words.replace("\n", " "), figure
