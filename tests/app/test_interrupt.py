"""A run that is stopped leaves every file whole: the old one, or the new one."""

from __future__ import annotations

import hashlib
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.app.cli import main
from tests.app.conftest import Command, sidecar_of

#: Kills its own process at the given call of os.replace, by which finished files are put in place.
KILLED = """
import os, signal, sys
real, calls = os.replace, []
def replace(source, target):
    calls.append(target)
    if len(calls) == {at}:
        os.kill(os.getpid(), signal.SIGKILL)
    real(source, target)
os.replace = replace
from pipeline.app.cli import main
sys.exit(main(sys.argv[1:]))
"""


def contents(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.iterdir() if not p.name.startswith(".")}


@pytest.mark.parametrize("at", [1, 4, 9])
def test_a_killed_process_leaves_whole_files(
    root: Path, tmp_path: Path, command: Command, at: int
) -> None:
    assert command("stand", tmp_path) == 0
    old = contents(tmp_path)
    new_run = ["stand", "--robot", str(root / "urdf/hexapod.toml"), "--out", str(tmp_path)]
    new_run += ["--set", "hip_spacing=280"]
    killed = subprocess.run(
        [sys.executable, "-c", KILLED.format(at=at), *new_run], cwd=root, check=False, timeout=120
    )
    assert killed.returncode == -signal.SIGKILL
    left = contents(tmp_path)
    assert set(left) == set(old)
    # A second, undisturbed run of the same command says what the new files are.
    assert command("stand", tmp_path, "--set", "hip_spacing=280") == 0
    new = contents(tmp_path)
    for name, content in left.items():
        assert content in (old[name], new[name]), f"{name} is neither the old nor the new file"
    assert any(left[name] == old[name] != new[name] for name in left)


def test_an_interrupt_leaves_nothing_temporary(
    tmp_path: Path,
    command: Command,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Ctrl-C between two files: one line, exit 130, the files before it are finished."""
    real = os.replace
    calls: list[object] = []

    def replace(source: object, target: object) -> None:
        calls.append(target)
        if len(calls) == 5:
            raise KeyboardInterrupt
        real(source, target)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "replace", replace)
    assert command("walk", tmp_path) == 130
    assert capsys.readouterr().err.count("\n") == 1
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]
    finished = [p for p in tmp_path.glob("*.csv") if p.with_suffix(".meta.json").exists()]
    assert finished
    for path in finished:
        assert sidecar_of(path)["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()


def test_bad_input_leaves_the_last_run_alone(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("stand", tmp_path) == 0
    before = contents(tmp_path)
    assert command("stand", tmp_path, "--set", "femur_mass=-1") == 2
    assert command("walk", tmp_path, "--set", "hip_spacing=200") == 1
    assert contents(tmp_path) == before
    capsys.readouterr()


def test_check_and_urdf_verbs(
    root: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """0 sound, 1 a finding that fails, 2 unreadable; `urdf` writes what the robot file says."""
    for name in ("hexapod.toml", "hexapod_axis90.toml", "leg.toml"):
        (tmp_path / name).write_bytes((root / "urdf" / name).read_bytes())
        assert main(["urdf", str(tmp_path / name)]) == 0
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
