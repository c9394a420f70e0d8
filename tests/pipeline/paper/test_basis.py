"""A judgement belongs to the numbers it was made with."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from actuators.loading.build import CATALOG, Catalog, load_catalog
from pipeline.paper.judgement.basis import Basis, basis, differences, fingerprint
from pipeline.paper.judgement.judge import judge
from pipeline.paper.prior import Prior
from pipeline.paper.published import Published
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine
from tests.compared import walked_by


def given(root: Path, *options: str, robot: Path | None = None) -> Machine:
    file = str(robot or root / "urdf" / "hexapod.toml")
    return walked_by("reports", "--robot", file, *options)


def based(given: Machine) -> Basis:
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


def test_after_a_change_the_comparison_is_computed_anew_and_the_rest_left_out(root: Path) -> None:
    run = given(root, "--set", "harmonic_drive.load=0.1", "--samples", "51")
    by = based(run)
    assert by.changed == ("harmonic_drive.load",)
    assert by.word.startswith("harmonic_drive.load differs")
    judgement = judge(run.robot, by, samples=run.options.samples)
    rows = {row.id: row for row in judgement.reproduction}
    assert rows["reversible_motor_torque_2"].verdict == "not reproduced"
    assert rows["ideal_current_2"].verdict == "reproduced"
    for table in judgement.tables.values():
        for column in table:
            if column.startswith(("prior_", "left_out_", "met_share", "posterior_")):
                assert table[column].isna().all(), column


def test_without_one_of_the_papers_actuators_what_needs_it_is_left_out(
    root: Path, tmp_path: Path
) -> None:
    run = given(root, "--actuators", str(other_belt(tmp_path / "catalog")), "--samples", "51")
    by = based(run)
    assert (by.missing, by.others) == (("reversible",), ("reversible",))
    judgement = judge(run.robot, by, samples=run.options.samples)
    assert judgement.omissions is None
    assert "omissions" not in judgement.tables
    spoken = {row.where for row in judgement.conclusions}
    assert {"Section IV.A.1", "Section IV.A.2"} <= spoken
    assert not {"Section IV.A.3", "Section IV.A.4"} & spoken


def test_whatever_a_judgement_depends_on_is_noticed(
    spec: RobotSpec,
    catalog: Catalog,
    published: dict[str, Published],
    prior: Prior,
    results: dict[str, Any],
    tmp_path: Path,
) -> None:
    def changed(**other: Any) -> list[str]:
        own = {"spec": spec, "catalog": catalog, "published": published, "prior": prior}
        return differences(results["numbers"], fingerprint(**{**own, **other}))

    assert changed() == []
    viscous = catalog.parameter("harmonic_drive.viscous").value
    assert changed(catalog=catalog.replaced("harmonic_drive.viscous", viscous * (1 + 1e-9))) == []
    other = catalog.replaced("harmonic_drive.viscous", 1.0)
    assert changed(catalog=other) == ["harmonic_drive.viscous"]
    assert changed(catalog=load_catalog(other_belt(tmp_path / "c"))) == ["alternatives.reversible"]
    assert changed(spec=spec.with_parameters({"body_length": 0.601})) == ["robot.body_length"]
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
    other.write_text(text, encoding="utf-8")
    assert based(given(root, robot=other)).changed == ()  # a copy is the same robot
    other.write_text(text.replace('"rm"', '"mr"').replace("legs.rm", "legs.mr"), encoding="utf-8")
    assert basis(given(root, robot=other)) is None
