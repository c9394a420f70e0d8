"""A judgement belongs to the numbers it was made with."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from actuators.loading.build import CATALOG, Catalog, load_catalog
from pipeline.api import judgement as judging
from pipeline.cli.main import parser
from pipeline.cli.options import settings_of
from pipeline.paper.calibration.fingerprint import differences, fingerprint
from pipeline.paper.calibration.prior import Prior
from pipeline.paper.judgement.basis import Basis, basis
from pipeline.paper.judgement.judge import Judgement
from pipeline.paper.judgement.sensitivity import Sensitivity
from pipeline.paper.omissions import Omission
from pipeline.paper.published import Published
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.settings import Settings
from reports.pages import paper_sections
from reports.pages.summary_words import first_paragraph, measure_next
from reports.table import table_of
from reports.tables import judgement as tables

#: Tables that rest on the calibration's sets.
OF_THE_SETS = {"readings", "leave_one_out", "calibration", "sensitivities"}


def given(root: Path, *options: str, robot: Path | None = None) -> Settings:
    file = robot or root / "urdf" / "hexapod.toml"
    return settings_of(parser().parse_args(["reports", "--robot", str(file), *options]))


def based(given: Settings) -> Basis:
    by = basis(given)
    assert isinstance(by, Basis)
    return by


def other_belt(folder: Path) -> Path:
    """A catalogue whose reversible actuator names a stage otherwise."""
    shutil.copytree(CATALOG, folder)
    file = folder / "alternatives.toml"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace('stage = "wg"', 'stage = "w"'), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def shipped(root: Path) -> Judgement:
    run = given(root)
    return judging.judged(run, based(run))[0]


def test_the_shipped_files_hold_the_numbers_the_calibration_was_made_with(
    shipped: Judgement,
) -> None:
    assert shipped.by.changed == ()
    assert shipped.by.word == ""


def test_after_a_change_the_comparison_is_computed_anew_and_the_rest_left_out(root: Path) -> None:
    run = given(root, "--set", "harmonic_drive.load=0.1")
    by = based(run)
    assert by.changed == ("harmonic_drive.load",)
    assert by.word.startswith("harmonic_drive.load differs")
    judged, found = judging.judged(run, by)
    assert not OF_THE_SETS & {table.name for table in found}
    rows = {row.id: row for row in judged.reproduction}
    assert rows["reversible_motor_torque_2"].verdict == "not reproduced"
    assert rows["ideal_current_2"].verdict == "reproduced"
    for table in found:
        for column in table.columns:
            if column.startswith(("prior_", "left_out_", "met_share", "posterior_")):
                assert all(v is None or v != v for v in table.columns[column]), column


def test_a_number_edited_in_the_robot_file_is_noticed(root: Path, tmp_path: Path) -> None:
    for name in ("hexapod.toml", "hexapod.urdf"):
        shutil.copyfile(root / "urdf" / name, tmp_path / name)
    robot = tmp_path / "hexapod.toml"
    assert based(given(root, robot=robot)).changed == ()  # a copy is the same robot
    text = robot.read_text(encoding="utf-8")
    robot.write_text(text.replace("value = 600", "value = 601", 1), encoding="utf-8")
    assert based(given(root, robot=robot)).changed == ("robot.body_length",)


def test_whatever_a_judgement_depends_on_is_noticed(
    spec: RobotSpec,
    catalog: Catalog,
    published: dict[str, Published],
    prior: Prior,
    results: dict[str, Any],
    tmp_path: Path,
) -> None:
    def changed(
        catalog: Catalog = catalog,
        published: dict[str, Published] = published,
        prior: Prior = prior,
    ) -> list[str]:
        return differences(results["numbers"], fingerprint(spec, catalog, published, prior))

    assert changed() == []
    viscous = catalog.parameter("harmonic_drive.viscous").value
    assert changed(catalog.replaced("harmonic_drive.viscous", viscous * (1 + 1e-9))) == []
    assert changed(catalog.replaced("harmonic_drive.viscous", 1.0)) == ["harmonic_drive.viscous"]
    assert changed(load_catalog(other_belt(tmp_path / "c"))) == ["alternatives.reversible"]
    name = "rotor_motor_torque_2"
    wider = published[name].model_copy(update={"half_width": 3e-5})
    assert changed(published=published | {name: wider}) == [f"published.{name}"]
    first, *others = prior.free
    moved = Prior((replace(first, centre=0.02), *others))
    assert changed(prior=moved) == [f"prior.{first.key}"]


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--quasi-static",), "inertia"),
        (("--regeneration", "bus"), "flows back"),
        (("--forces", "least_torque"), "ground forces"),
    ],
)
def test_a_run_the_paper_does_not_describe_is_left_out_with_a_reason(
    root: Path, options: tuple[str, ...], word: str
) -> None:
    reason = basis(given(root, *options))
    assert isinstance(reason, str)
    assert word in reason


def test_another_robot_is_not_held_against_the_paper(root: Path, tmp_path: Path) -> None:
    assert basis(given(root, robot=root / "urdf" / "hexapod_axis90.toml")) is None
    text = (root / "urdf" / "hexapod.toml").read_text(encoding="utf-8")
    other = tmp_path / "hexapod.toml"  # under the same file name
    other.write_text(text.replace('"rm"', '"mr"').replace("legs.rm", "legs.mr"), encoding="utf-8")
    assert basis(given(root, robot=other)) is None


def test_the_first_paragraph_names_what_is_fitted_predicted_contradicted_and_what_it_costs(
    shipped: Judgement,
) -> None:
    text = first_paragraph(shipped)
    for word in ("Fitted", "Predicted", "Contradicted", "price of the fit"):
        assert f"**{word}" in text or f"**The {word}" in text
    price = shipped.price
    assert price is not None
    assert f"{price.gear_friction:.1f} mN·m" in text
    assert f"{100 * price.no_load_share:.1f} % of the posterior" in text
    assert "3.575 and of 3.620 mN·m" in text
    assert "reproduced" not in text  # nothing outside printed precision is called so


def test_the_page_lays_out_section_iv_a_and_what_is_left_out(shipped: Judgement) -> None:
    rows = paper_sections.sentences(table_of(tables.ConclusionRow, shipped.conclusions))
    assert rows.headers == ("sentence: ratio", "joint 1", "joint 2", "joint 3", "holds", "paper")
    assert len(rows.rows) == 10
    assert [row[4] for row in rows.rows].count("no") == 2
    rows, said = paper_sections.omissions(table_of(Omission, shipped.omissions))
    assert rows.rows[0][1:3] == (pytest.approx(0.94, abs=1e-4), 0.0)
    assert len(rows.rows) == len(said) == len(shipped.omissions)
    assert any(str(row[0]).endswith("0.672 W") for row in rows.rows)


def test_without_one_of_the_papers_actuators_what_needs_it_is_left_out(
    root: Path, tmp_path: Path
) -> None:
    run = given(root, "--actuators", str(other_belt(tmp_path / "catalog")))
    by = based(run)
    assert by.missing == ("reversible",)
    judged, found = judging.judged(run, by)
    assert judged.omissions == ()
    assert "omissions" not in {table.name for table in found}
    spoken = {row.where for row in judged.conclusions}
    assert {"Section IV.A.1", "Section IV.A.2"} <= spoken
    assert not {"Section IV.A.3", "Section IV.A.4"} & spoken


def test_what_to_measure_next_is_named_only_where_it_is_known() -> None:
    def said(first: tuple[float, float], second: tuple[float, float]) -> str:
        named = zip("ab", (first, second), strict=True)
        return measure_next([Sensitivity("", name, 0.0, 0.0, *own) for name, own in named])

    assert said((0.6, 0.1), (0.3, 0.1)).startswith("**Measure next:** `a`")
    close = said((0.6, 0.2), (0.4, 0.1))
    assert "Measure next" not in close
    assert all(word in close for word in ("`a`", "`b`", "overlap"))
