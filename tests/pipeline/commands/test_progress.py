"""Steps of a run are lines on standard error: on a terminal, or with -v; elsewhere nothing."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

from tests.command_line import Command

STEPS = ["walking one cycle, 51 samples per segment", "writing tables"]


def test_a_terminal_shows_every_step(root: Path, tmp_path: Path) -> None:
    ours, theirs = pty.openpty()
    run = [sys.executable, "-m", "pipeline", "walk", "--samples", "51", "--out", str(tmp_path)]
    process = subprocess.Popen(run, cwd=root, stdout=subprocess.DEVNULL, stderr=theirs)
    os.close(theirs)
    said = b""
    try:
        while part := os.read(ours, 4096):
            said += part
    except OSError:  # the other end is closed
        pass
    os.close(ours)
    assert process.wait() == 0
    assert said.decode().splitlines() == STEPS


def test_elsewhere_they_are_shown_when_asked_for(
    tmp_path: Path,
    command: Command,
    capsys: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    assert command("walk", tmp_path, "--samples", "51") == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert said.out.endswith(f"in {tmp_path}\n")
    assert not caplog.messages
    assert command("walk", tmp_path, "--samples", "51", "-v") == 0
    assert caplog.messages == STEPS
