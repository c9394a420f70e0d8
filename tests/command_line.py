"""The command line in this process, and the files that it leaves, for tests of all rooms."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from pipeline.cli.main import main

Rows = list[dict[str, str]]
#: Runs a verb on the hexapod with `--out`, and returns the exit code, argparse's own included.
Command = Callable[..., int]


def exit_code(arguments: Sequence[str]) -> int:
    try:
        return main(arguments)
    except SystemExit as stop:  # argparse refuses by leaving
        return int(str(stop.code))


def rows_of(path: Path, delimiter: str = ",") -> Rows:
    with path.open(encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file, delimiter=delimiter))


def sidecar_of(path: Path) -> dict[str, Any]:
    loaded = json.loads(path.with_suffix(".meta.json").read_text(encoding="utf-8"))
    assert isinstance(loaded, dict)
    return loaded


def stand_and_walk(folder: Path, command: Command, *more: str, **robot: Path) -> Path:
    """The tables of both verbs, which write a folder each, side by side."""
    for verb in ("stand", "walk"):
        assert command(verb, folder / verb, *more, **robot) == 0
        for path in results(folder / verb):
            shutil.copyfile(path, folder / path.name)
        shutil.rmtree(folder / verb)
    return folder


def results(folder: Path) -> list[Path]:
    """What a person sees in a folder."""
    return sorted(path for path in folder.iterdir() if not path.name.startswith("."))
