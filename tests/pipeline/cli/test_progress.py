"""What a person sees while a run goes on: a bar on a terminal, nothing elsewhere."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from pipeline.progress import Progress
from tests.command_line import Command
from tests.demo import DEMO

_RUN = [sys.executable, "-c", "import sys; from pipeline.cli.main import main; sys.exit(main())"]


def on_a_terminal(root: Path, *arguments: str) -> str:
    """What a command writes to a terminal."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    process = subprocess.Popen([*_RUN, *arguments], cwd=root, stdout=theirs, stderr=theirs)
    os.close(theirs)
    said = b""
    try:
        while part := os.read(ours, 4096):
            said += part
    except OSError:  # the other end is closed
        pass
    os.close(ours)
    assert process.wait() == 0
    return said.decode()


@pytest.mark.parametrize(
    ("arguments", "steps"),
    [
        (("walk", "--samples", "51"), ["loading", "walking", "writing tables"]),
        (("gap", "read", str(DEMO)), ["loading", "reading and judging the logs"]),
    ],
)
def test_a_terminal_shows_the_step_and_the_time_left(
    root: Path, tmp_path: Path, arguments: tuple[str, ...], steps: list[str]
) -> None:
    said = on_a_terminal(root, *arguments, "--out", str(tmp_path / "out"))
    places = [said.index(f"\r{step} ") for step in steps]
    assert places == sorted(places)
    assert re.search(r"\d\d:\d\d, about (\d\d:\d\d|\?) left", said)
    # The bar is gone before the lines that stay.
    assert "left" not in said[places[-1] :].split("\n", 1)[1]
    assert re.search(r"\r {40,}\r", said[places[-1] :])


def test_elsewhere_nothing_is_shown(
    tmp_path: Path, command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("walk", tmp_path, "--samples", "51") == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert said.out.endswith(f"in {tmp_path}\n")


def test_times_of_steps_are_taken_without_a_terminal() -> None:
    with Progress("reports") as progress:
        progress.step("walking")
        progress.step("drawing figures")
        progress.done(0.5)
    assert set(progress.seconds) == {"walking", "drawing figures"}
    assert "walking" in progress.took()
