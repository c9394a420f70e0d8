"""The command line in this process, and the files that it leaves, for tests of all packages."""

import csv
import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from pipeline.commands.main import main

Rows = list[dict[str, str]]
#: Runs a verb on the hexapod with `--out`, and returns the exit code, argparse's own included.
Command = Callable[..., int]
#: The log that `make gap` reads, of the hexapod with the catalogue's alternative "rotor", ...
DEMO = Path(__file__).parents[1] / "pipeline" / "identification" / "demo" / "walk.parquet"
#: ... and what is hidden in it: dry friction in the right middle hip, SI.
HIDDEN = SimpleNamespace(
    effect="coulomb_friction", place=("rm_joint_1",), parameters={"torque": 2.0}
)
#: Runs a command that is refused, and returns its one line.
Refused = Callable[..., str]


def exit_code(arguments: Sequence[str]) -> int:
    try:
        return main(arguments)
    except SystemExit as stop:  # argparse refuses by leaving
        return int(str(stop.code))


def rows_of(path: Path, delimiter: str = ",") -> Rows:
    with path.open(encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file, delimiter=delimiter))


def record_of(path: Path) -> dict[str, Any]:
    """What a run's record says of the run and of one of its files."""
    record = json.loads((path.parent / "datapackage.json").read_text(encoding="utf-8"))
    (own,) = (one for one in record["resources"] if one["path"] == path.name)
    return {**record, **own}


def stand_and_walk(folder: Path, command: Command, *more: str, **robot: Path) -> Path:
    """The tables of both verbs, which write a folder each, side by side."""
    files = []
    for verb in ("stand", "walk"):
        assert command(verb, folder / verb, *more, **robot) == 0
        record = json.loads((folder / verb / "datapackage.json").read_text(encoding="utf-8"))
        files += record["resources"]
        for path in results(folder / verb):
            shutil.copyfile(path, folder / path.name)
        shutil.rmtree(folder / verb)
    whole = json.dumps({**record, "resources": list({f["path"]: f for f in files}.values())})
    (folder / "datapackage.json").write_text(whole, encoding="utf-8")
    return folder


def results(folder: Path) -> list[Path]:
    """What a person sees in a folder, but for the run's record."""
    hidden = (".", "datapackage.json")
    return sorted(path for path in folder.iterdir() if not path.name.startswith(hidden))
