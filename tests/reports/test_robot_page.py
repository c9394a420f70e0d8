"""The page of any robot: titles, first paragraphs, what is left out, no word of the paper."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from pipeline.api.figures import drawings
from pipeline.api.machine import load
from pipeline.api.pictures.scene import Scene
from pipeline.api.tables import tables_of_standing, tables_of_walking
from pipeline.simulation.settings import Settings
from pipeline.simulation.walk_stand import Standing, Walking, stand, walk
from reports.figures.save import save_figures
from reports.forms import html, markdown, write_pages
from reports.page import FigureBlock, Page, Section
from reports.pages.robot_page import first_picture, robot_page
from reports.pages.robot_words import limits_text, motors_text
from reports.table import Table
from tests.reports.browser import layout, needs_chromium

Run = tuple[Settings, Standing, Walking, Mapping[str, Table]]


@pytest.fixture(scope="module")
def solo(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Without the motors that its file states, as a robot is whose motors nobody knows."""
    text, _, _ = (root / "urdf" / "solo12.toml").read_text("utf-8").partition("[actuators]")
    path = tmp_path_factory.mktemp("robot") / "solo12.toml"
    path.write_text(text, encoding="utf-8")
    given = load(path).walking(samples=51)
    chains = given.chains()
    standing = stand(given.machine, chains)
    walking = walk(given.machine, chains, samples=given.samples)
    tables = tables_of_standing(given, standing) | tables_of_walking(given, walking)
    return given, standing, walking, {name: table() for name, table in tables.items()}


@pytest.fixture(scope="module")
def page(solo: Run, tmp_path_factory: pytest.TempPathFactory) -> tuple[Page, Path]:
    given, standing, walking, tables = solo
    folder = tmp_path_factory.mktemp("page")
    names = list(drawings(Scene(given.robot), given, standing, walking))
    for name in names:
        (folder / f"{name}.svg").write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    return robot_page(given, tables, folder, ["a remark"]), folder


def test_the_title_names_robot_and_gait(page: tuple[Page, Path]) -> None:
    assert page[0].title == "What it costs to actuate solo12, crawl gait"


def test_the_first_paragraphs_say_robot_cost_what_is_fitted_and_known(
    page: tuple[Page, Path], solo: Run
) -> None:
    what, cost, fitted, predicted, known = page[0].answer
    assert "every watt" in predicted
    assert "2.5" in what
    assert "4 legs of 3 joints" in what
    given, _, _, tables = solo
    for power in tables["robot_energy"].columns["average_power_W"]:
        assert f"{power:.3g}"[:3] in cost
    bases = [p.basis for c in given.catalog.components.values() for p in c.parameters.rows()]
    assert f"{bases.count('calibrated')} of the {len(bases)} numbers" in fitted
    assert f"{bases.count('assumed')} are assumed" in known
    least = min(tables["walking_stability"].columns["least_margin_m"])
    (said,) = (s.blocks[0] for s in page[0].sections if s.heading.endswith("stability"))
    assert isinstance(said, str)
    assert f"{1e3 * least:.3g}"[:3] in said
    assert page[0].sections[0] == Section("Notes", (("a remark",),))


def test_whose_motors_are_assumed_stands_first(page: tuple[Page, Path], solo: Run) -> None:
    """With their mass from the motor's file: 12 of 0.48 kg are heavier than the robot."""
    whose, beyond = page[0].notices
    for words in ("none are stated", "maxon RE 40", "400:1", "5.76 kg", "2.50 kg", "init-actuator"):
        assert words in whose
    assert "weigh more than the robot" in whose
    _, mass, friction, share = page[0].numbers
    assert (mass.value, mass.tone) == ("5.76 kg", "bad")
    columns = solo[3]["motor_limits"].columns
    worst = max(p / limit for p, limit in zip(columns["peak"], columns["limit"], strict=True))
    assert (share.value, share.tone) == (f"{100 * worst:.0f} %", "bad")
    needed = max(solo[3]["walking_stability"].columns["greatest_friction_needed"])
    assert (friction.value, friction.tone) == (f"{needed:.3g}", "good")
    assert beyond.startswith("**Beyond the motors:** walking takes ")
    assert markdown(page[0], page[1]).index(whose[:40]) < 200


def test_motors_that_are_stated_are_no_assumption(root: Path) -> None:
    folder = root / "tests" / "pipeline" / "data_files" / "xl330_actuators"
    motors = load(root / "urdf" / "solo12.toml", actuators=folder).ready.motors
    text = motors_text(motors)
    assert motors.stated
    assert "as stated for this robot, XL330-M288" in text
    assert "state no `mass`" in text
    assert "init-actuator" not in text
    assert "weigh" not in text


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
    drawn = {*drawings(Scene(given.robot), given, standing, walking)}
    first = page[0].picture
    assert first is not None
    assert drawn - shown == {"stage_energy_ideal", "stage_energy_rotor", first.file.stem}
    assert shown <= drawn


def test_another_robots_page_has_no_word_of_the_paper_but_sources_of_numbers(
    page: tuple[Page, Path],
) -> None:
    content, folder = page
    sections = tuple(s for s in content.sections if s.heading != "What went in")
    text = html(replace(content, sections=sections), folder)
    plain = re.sub(r"<style>.*?</style>|data:[^\"]*", "", text, flags=re.S)
    assert not re.search(r"\bpaper\b|Fig\. \d|\bsection III\b|hexapod|reproduced", plain)


def test_tables_of_another_robot_have_no_word_of_the_paper(solo: Run) -> None:
    for table in solo[3].values():
        meanings = " ".join(m[0] for m in table.meanings.values()) + table.description
        assert not re.search(r"\bpaper\b|Fig\.|section III|hexapod", meanings), table.name


def limits(table: Table, **columns: object) -> Table:
    return Table(table.name, dict(table.columns) | columns, table.meanings, table.description)


def test_what_motors_and_ground_cannot_give_is_said(solo: Run) -> None:
    """Each quantity once, by its worst joint; friction against what the ground offers."""
    tables = {name: solo[3][name] for name in ("motor_limits", "walking_stability")}
    table, rows = tables["motor_limits"], tables["motor_limits"].rows
    titles = {str(name): str(name) for name in table.columns["alternative"]}
    calm = tables | {"motor_limits": limits(table, breach=[False] * rows)}
    assert limits_text(calm, titles, None) == ()
    over = limits(
        table,
        breach=[i in (0, 3) for i in range(rows)],
        quantity=["current", "x", "x", "rms_current"] + ["x"] * (rows - 4),
        peak=[9.0] * rows,
        limit=[4.0] * rows,
    )
    (text,) = limits_text({"motor_limits": over}, titles, None)
    assert "walking takes 9 A where the motor bears 4 A at most" in text
    assert "9 A root mean square where the motor bears 4 A continuously" in text
    assert str(table.columns["joint"][0]) in text
    stability = tables["walking_stability"]
    steep = [2.6] + [0.1] * (stability.rows - 1)
    slippery = calm | {"walking_stability": limits(stability, greatest_friction_needed=steep)}
    (text,) = limits_text(slippery, titles, None)
    assert "needs a coefficient of friction of **2.6**" in text
    assert "`--friction-coefficient 0.8`" in text
    assert limits_text(slippery, titles, 3.0) == ()


@needs_chromium
@pytest.mark.parametrize("width", [1280, 400])
def test_all_of_it_is_seen_at_first_sight(
    solo: Run, page: tuple[Page, Path], tmp_path: Path, width: int
) -> None:
    given, standing, walking, _ = solo
    name = "electrical_energy"
    save_figures({name: drawings(Scene(given.robot), given, standing, walking)[name]}, tmp_path)
    content = replace(page[0], picture=first_picture(tmp_path), sections=())
    write_pages(content, tmp_path)
    seen = layout(tmp_path / "index.html", width, tmp_path)
    assert seen.at_first_sight()
    assert seen.letters >= 9.5
    assert seen.page <= seen.window
