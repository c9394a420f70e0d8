"""A judgement belongs to the numbers it was made with."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path
from typing import Any

from actuators.loading.build import CATALOG, Catalog, load_catalog
from pipeline.paper.basis import Basis, basis, differences, fingerprint
from pipeline.paper.judgement import judge
from pipeline.paper.published import PUBLISHED_FILE
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine
from tests.compared import walked_by


def given(root: Path, *options: str, robot: Path | None = None) -> Machine:
    file = str(robot or root / "urdf" / "hexapod.toml")
    return walked_by("reports", "--robot", file, *options)


def other_belt(folder: Path) -> Path:
    """A catalogue whose reversible actuator names a stage otherwise."""
    shutil.copytree(CATALOG, folder)
    file = folder / "alternatives.toml"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace('stage = "wg"', 'stage = "w"'), encoding="utf-8")
    return folder


def test_after_a_change_the_comparison_is_computed_anew_and_the_rest_left_out(root: Path) -> None:
    run = given(root, "--set", "harmonic_drive.load=0.1", "--samples", "51")
    by = basis(run)
    assert isinstance(by, Basis)
    assert by.results is None
    assert by.word.startswith("not the calibration's: harmonic_drive.load;")
    tables = judge(run.robot, by, samples=run.options.samples).tables
    verdicts = tables["reproduction"].set_index("id")["verdict"]
    assert verdicts["reversible_motor_torque_2"] == "not reproduced"
    assert verdicts["ideal_current_2"] == "reproduced"
    for table in tables.values():
        for column in table:
            if column.startswith(("prior_", "left_out_", "met_share", "posterior_")):
                assert table[column].isna().all(), column


def test_whatever_a_run_may_change_is_noticed(
    spec: RobotSpec, catalog: Catalog, study: dict[str, Any], tmp_path: Path
) -> None:
    def changed(spec: RobotSpec = spec, catalog: Catalog = catalog) -> list[str]:
        return differences(study["numbers"], fingerprint(spec, catalog))

    assert changed() == []
    viscous = catalog.parameter("harmonic_drive.viscous").value
    assert changed(catalog=catalog.replaced("harmonic_drive.viscous", viscous * (1 + 1e-9))) == []
    other = catalog.replaced("harmonic_drive.viscous", 1.0)
    assert changed(catalog=other) == ["harmonic_drive.viscous"]
    assert changed(catalog=load_catalog(other_belt(tmp_path / "c"))) == ["alternatives.reversible"]
    assert changed(spec=spec.with_parameters({"body_length": 0.601})) == ["robot.body_length"]


def test_the_study_is_of_the_inputs_that_are_shipped(study: dict[str, Any]) -> None:
    for name, digest in study["files"].items():
        content = PUBLISHED_FILE.with_name(name).read_bytes()
        assert hashlib.sha256(content).hexdigest().startswith(digest), (
            f"{name}: make the study anew"
        )


def test_a_run_the_paper_does_not_describe_is_left_out_with_a_reason(root: Path) -> None:
    reasons = {
        ("--quasi-static",): "inertia",
        ("--regeneration", "bus"): "flows back",
        ("--forces", "least_torque"): "ground forces",
    }
    for options, word in reasons.items():
        assert word in str(basis(given(root, *options)))
    assert basis(given(root, robot=root / "urdf" / "hexapod_axis90.toml")) is None
