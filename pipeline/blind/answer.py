"""The workflow's answer to one trial: what `gap` wrote, asked for in a process of its own."""

from __future__ import annotations

import csv
import math
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

_ROOT: Final = Path(__file__).parents[2]
#: An answer takes some ten seconds of computing; after this much it counts as none [s].
PATIENCE: Final = 240
#: Exit code of an answer that was not given in time or broke.
FAILED: Final = -1
#: Exit code of a command that Ctrl-C ended.
INTERRUPTED: Final = 130
CONFIRMED: Final = "confirmed"
#: How `candidates.csv` says that two names cannot be told apart.
_CLASS: Final = "indistinguishable from "
_THREADS: Final = tuple(f"{name}_NUM_THREADS" for name in ("OMP", "OPENBLAS", "MKL", "ARROW"))


@dataclass(frozen=True)
class Name:
    """One name that the model file holds."""

    effect: str  #: In the catalogue's words.
    place: tuple[str, ...]  #: Where.
    level: str  #: ``"confirmed"`` or ``"approximate"``.
    #: Parameter to value and ends of the 95 % interval; NaN where there is none.
    values: dict[str, tuple[float, float, float]]
    rivals: tuple[str, ...] = ()  #: Names that the answer calls indistinguishable from it.


@dataclass(frozen=True)
class Answer:
    """What `gap` said about one log."""

    code: int  #: 0 explained, 1 a part unexplained, 2 refused, `FAILED` none.
    seconds: float  #: Of computing.
    names: tuple[Name, ...]  #: Of the model file, in its order.
    message: str = ""  #: Last line on standard error where no answer was given.

    @property
    def given(self) -> bool:
        """Whether there is one."""
        return self.code in (0, 1)


def ask(folder: Path, options: list[str]) -> dict[str, Any]:
    """Run the command in a trial's folder `given`, which holds nothing but what it may see.

    Args:
        folder: Of the trial; the answer is written to its folder `answer`.
        options: Of the trial's truth: log and what belongs to it.

    Returns:
        Exit code, seconds of computing and the last line on standard error.
    """
    out = (folder / "answer").resolve()
    shutil.rmtree(out, ignore_errors=True)  # an older answer is none
    command = [sys.executable, "-P", "-m", "pipeline", "gap", *options, "--out", str(out)]
    environment = {k: v for k, v in os.environ.items() if k in ("PATH", "HOME", "LANG")}
    environment |= {"PYTHONPATH": str(_ROOT), "MPLBACKEND": "Agg"} | dict.fromkeys(_THREADS, "1")
    # The limit is one of computing time: other work on the machine must not cost an answer.
    limited = ["/bin/sh", "-c", f'ulimit -t {PATIENCE}; exec "$@"', "gap", *command]
    process = subprocess.Popen(
        limited,
        cwd=folder / "given",
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    assert process.stderr is not None
    try:
        said = process.stderr.read().decode(errors="replace").strip().splitlines()
        _, status, used = os.wait4(process.pid, 0)
    except BaseException:
        process.kill()
        raise
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode == INTERRUPTED:
        raise KeyboardInterrupt
    code = process.returncode if process.returncode in (0, 1, 2) else FAILED
    if process.returncode < 0:
        said = [f"no answer within {PATIENCE} s of computing"]
    # A model file is written only where there is something to write; the table of names always.
    if code in (0, 1) and not (out / "candidates.csv").exists():
        code = FAILED
    return {
        "code": code,
        "seconds": used.ru_utime + used.ru_stime,
        "message": said[-1] if said and code not in (0, 1) else "",
    }


def read_answer(files: Mapping[str, str], run: dict[str, Any]) -> Answer:
    """Read what was written: names of `model.toml`, classes of `candidates.csv`.

    Args:
        files: Name to text.
        run: From `ask`.
    """
    names: tuple[Name, ...] = ()
    if run["code"] in (0, 1):
        edits = tomllib.loads(files.get("model.toml", "")).get("edit", [])
        classes = _classes(files.get("candidates.csv", ""))
        names = tuple(_name(edit, classes) for edit in edits)
    return Answer(run["code"], run["seconds"], names, run["message"])


def _name(edit: dict[str, Any], classes: dict[tuple[str, str], list[str]]) -> Name:
    place = tuple(edit.get("place", ()))
    values = {}
    for name, entry in edit["parameters"].items():
        low, high = entry.get("interval", (math.nan, math.nan))
        values[name] = (float(entry["value"]), float(low), float(high))
    rivals = tuple(classes.get((edit["effect"], "+".join(place)), ()))
    return Name(edit["effect"], place, edit.get("level", ""), values, rivals)


def _classes(text: str) -> dict[tuple[str, str], list[str]]:
    """Names that the answer cannot tell from one, both ways, by effect and place."""
    rows = list(csv.DictReader(text.splitlines()))
    out: dict[tuple[str, str], list[str]] = {}
    places: dict[str, set[str]] = {}
    for row in rows:
        places.setdefault(row["effect"], set()).add(row["place"])
    for row in rows:
        if row["verdict"].startswith(_CLASS):
            told = row["verdict"].removeprefix(_CLASS)
            others = [name for name in places if name in told]
            out.setdefault((row["effect"], row["place"]), []).extend(others)
            for other in others:
                for place in places[other]:
                    if place in told:
                        out.setdefault((other, place), []).append(row["effect"])
    return out
