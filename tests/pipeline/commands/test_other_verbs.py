"""What `check` says of the URDFs that the builder writes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipeline.commands.main import main
from pipeline.robot.urdf_builder import main as build


def test_check_judges_what_the_builder_writes(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """0 sound, 1 a finding that fails, 2 unreadable."""
    for name in ("hexapod.toml", "hexapod_axis90.toml", "leg.toml"):
        (tmp_path / name).write_bytes((root / "urdf" / name).read_bytes())
        assert build([str(tmp_path / name)]) == 0
        built = (tmp_path / name).with_suffix(".urdf")
        assert built.read_bytes() == (root / "urdf" / built.name).read_bytes()
        assert main(["check", str(built)]) == 0
    assert main(["check", "-v", str(tmp_path / "hexapod.toml")]) == 0
    assert "FAIL" not in capsys.readouterr().out
    tibia = r'(<link name="rm_tibia_link">.*?<mass value=")[^"]*"'
    light = re.sub(tibia, r'\1-0.5"', built.read_text(encoding="utf-8"), count=1, flags=re.S)
    built.write_text(light, encoding="utf-8")
    assert main(["check", str(built)]) == 1
    assert "FAIL rm_tibia_link: mass positive: -0.5 kg" in capsys.readouterr().out
    assert main(["check", str(tmp_path / "none.urdf")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
