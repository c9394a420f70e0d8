"""The page of any robot: titles, first paragraphs, what is left out, no word of the paper."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from pipeline.api.figures import drawings
from pipeline.api.tables import table_of_parameters, tables_of_standing, tables_of_walking
from pipeline.simulation.settings import Settings, settings
from pipeline.simulation.walk_stand import Standing, Walking, stand, walk
from reports.html import html
from reports.page import FigureBlock, Page
from reports.pages.robot_page import robot_page
from reports.table import Table

Run = tuple[Settings, Standing, Walking, Mapping[str, Table]]


@pytest.fixture(scope="module")
def solo(root: Path) -> Run:
    given = settings(robot=root / "urdf" / "solo12.toml", samples=51)
    chains = given.chains()
    standing = stand(given.machine, chains)
    walking = walk(given.machine, chains, samples=given.samples)
    tables = [*tables_of_standing(given, standing), *tables_of_walking(given, walking)]
    return given, standing, walking, {t.name: t for t in (*tables, table_of_parameters(given))}


@pytest.fixture(scope="module")
def page(solo: Run, tmp_path_factory: pytest.TempPathFactory) -> tuple[Page, Path]:
    given, standing, walking, tables = solo
    folder = tmp_path_factory.mktemp("page")
    names = [d.name for d in drawings(given, standing, walking)]
    for name in (*names, "gait_steps"):
        (folder / f"{name}.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    return robot_page(given, tables, folder, ["a remark"]), folder


def test_the_title_names_robot_and_gait(page: tuple[Page, Path]) -> None:
    assert page[0].title == "What it costs to actuate solo12, crawl gait"


def test_the_first_paragraphs_say_robot_cost_stability_motors(
    page: tuple[Page, Path], solo: Run
) -> None:
    what, cost, stability, motors, remark = page[0].answer
    assert "2.5" in what
    assert "4 legs of 3 joints" in what
    tables = solo[3]
    for power in tables["robot_energy"].columns["average_power_W"]:
        assert f"{power:.3g}"[:3] in cost
    least = min(tables["walking_stability"].columns["least_margin_m"])
    assert f"{1e3 * least:.3g}"[:3] in stability
    assert motors.startswith("**Motors")
    assert remark == "**Note:** a remark."


def test_every_figure_of_the_run_is_on_the_page_but_plain_ones(
    page: tuple[Page, Path], solo: Run
) -> None:
    given, standing, walking, _ = solo
    shown = {
        block.file.stem
        for section in page[0].sections
        for block in section.blocks
        if isinstance(block, FigureBlock)
    }
    drawn = {d.name for d in drawings(given, standing, walking)} | {"gait_steps"}
    assert drawn - shown == {"stage_energy_ideal", "stage_energy_rotor"}
    assert shown <= drawn


def test_another_robots_page_has_no_word_of_the_paper_but_sources_of_numbers(
    page: tuple[Page, Path],
) -> None:
    content, folder = page
    sections = tuple(s for s in content.sections if s.heading != "What went in")
    text = html(Page(content.title, content.answer, sections, content.files), folder)
    plain = re.sub(r"<style>.*?</style>|data:[^\"]*", "", text, flags=re.S)
    assert not re.search(r"\bpaper\b|Fig\. \d|\bsection III\b|hexapod|reproduced", plain)


def test_tables_of_another_robot_have_no_word_of_the_paper(solo: Run) -> None:
    for table in solo[3].values():
        meanings = " ".join(m[0] for m in table.meanings.values()) + table.description
        assert not re.search(r"\bpaper\b|Fig\.|section III|hexapod", meanings), table.name


def test_motors_within_their_limits_are_said_to_be(solo: Run, tmp_path: Path) -> None:
    from reports.pages.robot_page import breaches_text

    table = solo[3]["motor_limits"]
    columns = dict(table.columns) | {"breach": [False] * table.rows}
    calm = Table(table.name, columns, table.meanings, table.description)
    titles = {str(name): str(name) for name in table.columns["alternative"]}
    assert "stays within its data sheet" in breaches_text(calm, titles)
    over = dict(columns) | {"breach": [i == 0 for i in range(table.rows)]}
    text = breaches_text(Table(table.name, over, table.meanings), titles)
    assert str(table.columns["joint"][0]) in text
