"""Model files: what is written is read again, what is wrong is said in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.effects.model_file import (
    Edit,
    EditParameter,
    apply_edits,
    new_model_file,
    read_model_file,
)
from pipeline.identification.workflow.model_writer import model_text
from pipeline.logs.errors import GapError, ModelFileError
from pipeline.simulation.files import base_model


def _edit(value: float = 0.4) -> Edit:
    return Edit(
        "coulomb_friction",
        ("rm_joint_2",),
        (EditParameter("torque", value, "N*m", (0.3, 0.5)),),
        source="log.csv, SHA-256 00",
    )


def _written(tmp_path: Path, root: Path) -> Path:
    file = new_model_file(root / "urdf" / "leg.toml", "rotor").with_edits([_edit()])
    path = tmp_path / "model.toml"
    path.write_text(model_text(file, tmp_path), encoding="utf-8")
    return path


def test_round_trip(tmp_path: Path, root: Path) -> None:
    path = _written(tmp_path, root)
    file = read_model_file(path)
    assert file.edits == (_edit(),)
    assert file.alternative == "rotor"
    assert file.changed == ()
    machine = apply_edits(base_model(file), file.edits)
    names = [e.name for e in machine.actuator("rm_joint_2").elements]
    assert names[0] == "coulomb_friction"


def test_edits_leave_the_base_model_alone(root: Path) -> None:
    base = base_model(new_model_file(root / "urdf" / "leg.toml", "rotor"))
    before = base.actuators
    apply_edits(base, [_edit()])
    assert base.actuators is before


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("coulomb_friction", "coulomb_fricton", "did you mean 'coulomb_friction'"),
        ('unit = "N*m"', 'unit = "mm"', "expected 'N*m'"),
        ("value = 0.4", "value = 9.0", "outside its interval"),
        ("value = 0.4", "value = nan", "finite"),
        ("schema = 1", "schema = 2", "'schema' must be 1"),
        ("basis =", "bases =", "did you mean 'basis'"),
        ("parameters.torque", "parameters.torqe", "did you mean 'torque'"),
        ("schema = 1", "schema = [", "malformed TOML"),
    ],
)
def test_errors_are_one_clear_line(
    tmp_path: Path, root: Path, old: str, new: str, said: str
) -> None:
    path = _written(tmp_path, root)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ModelFileError) as error:
        read_model_file(path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_changed_sources_are_told(tmp_path: Path, root: Path) -> None:
    path = _written(tmp_path, root)
    text = path.read_text(encoding="utf-8")
    file = read_model_file(path)
    path.write_text(text.replace(file.robot_sha256, "0" * 64), encoding="utf-8")
    assert "other SHA-256" in read_model_file(path).changed[0]


def test_unknown_place_is_refused(root: Path) -> None:
    base = base_model(new_model_file(root / "urdf" / "leg.toml", "rotor"))
    edit = Edit("coulomb_friction", ("rm_join_2",), _edit().parameters)
    with pytest.raises(GapError, match="did you mean 'rm_joint_2'"):
        apply_edits(base, [edit])
