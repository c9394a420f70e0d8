"""The workflow's answer to one trial: `gap` in a process and a folder of its own."""

from __future__ import annotations

import csv
import os
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pipeline.identification.results import CONFIRMED, INDISTINGUISHABLE

_ROOT = Path(__file__).parents[2]
#: An answer takes some ten seconds of computing; after this much it counts as failed [s].
_PATIENCE: Final = 120
FAILED: Final = -1
#: Processes that answer now, and whether they are to end.
_running: Final[set[subprocess.Popen[bytes]]] = set()
_stopped: Final = threading.Event()


@dataclass(frozen=True)
class Named:
    """One effect that was found.

    Attributes:
        effect: Name.
        place: Where.
        rivals: What the answer calls indistinguishable from it, in its words; empty where the name
            is given with confidence.
        intervals: Parameter to value and ends of the 95 % interval.
        doubt: Why the answer does not trust the name; empty where it does.
        gap_before: Error on *prove* without it.
        gap_after: The same with it.
        noise_floor: Of the joints it acts on.
        written: Whether the model file holds it.
        level: ``"confirmed"``, ``"approximate"`` or ``"suspected"``.
        share: How often the name wins on redrawn blocks; NaN where the answer states none.
        amounts_to: Effects of one term each that it is the sum of.
    """

    effect: str
    place: tuple[str, ...]
    rivals: str
    doubt: str
    intervals: dict[str, tuple[float, float, float]]
    gap_before: float
    gap_after: float
    noise_floor: float
    written: bool = True
    level: str = ""
    share: float = float("nan")
    amounts_to: tuple[str, ...] = ()

    @property
    def confident(self) -> bool:
        """Whether the name is trusted and nothing else is offered beside it."""
        return not self.rivals and not self.doubt


@dataclass(frozen=True)
class Answer:
    """What `gap` said about one log.

    Attributes:
        code: Exit code, `FAILED` where it did not end.
        seconds: Of computing.
        named: In the order of acceptance.
        message: Its last line on standard error, where it gave none of the answers.
    """

    code: int
    seconds: float
    named: tuple[Named, ...]
    message: str = ""


def begin_answers() -> None:
    """Let answers be given, after others were stopped."""
    _stopped.clear()


def stop_answers() -> None:
    """End the processes that answer; none begins after them."""
    _stopped.set()
    for process in list(_running):
        process.kill()


def ask(folder: str, robot: str, out: str, more: Sequence[str] = ()) -> dict[str, Any]:
    """Run `gap name` in a folder that holds nothing but log, robot and actuators.

    Args:
        folder: Of the trial.
        robot: Robot file, relative to the folder.
        out: Where `gap` writes; outside of the folder.
        more: Further options; by default the folder's actuators.

    Returns:
        What `read_answer` needs beside the files.
    """
    shutil.rmtree(out, ignore_errors=True)  # an older answer is none
    command = [sys.executable, "-P", "-m", "pipeline", "gap", "name", "log.csv"]
    command += ["--robot", robot, "--out", str(Path(out).resolve())]
    command += more or ("--actuators", "actuators")
    environment = {k: v for k, v in os.environ.items() if k in ("PATH", "HOME", "LANG")}
    environment |= {"PYTHONPATH": str(_ROOT), "MPLBACKEND": "Agg"}
    environment |= dict.fromkeys(
        ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "ARROW_NUM_THREADS"), "1"
    )
    with tempfile.TemporaryFile() as said:
        # The limit is one of computing time: other work on the machine must not cost an answer.
        # Ctrl-C is answered by the process that asks: it ends this one with `stop_answers`.
        prepared = f"ulimit -t {_PATIENCE}; trap '' INT; exec \"$@\""
        limited = ["/bin/sh", "-c", prepared, "gap", *command]
        process = subprocess.Popen(
            limited, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=said
        )
        _running.add(process)
        try:
            if _stopped.is_set():
                process.kill()
            _, status, used = os.wait4(process.pid, 0)
        except BaseException:
            process.kill()
            raise
        finally:
            _running.discard(process)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        lines = said.read().decode(errors="replace").strip().splitlines()
    code, seconds = process.returncode, used.ru_utime + used.ru_stime
    if code < 0:
        lines = [f"no answer within {_PATIENCE} s of computing"]
    return {"code": code, "seconds": seconds, "message": lines[-1] if lines else ""}


def read_answer(run: dict[str, Any], out: Path) -> Answer:
    """Read what `gap` wrote.

    Args:
        run: From `ask`.
        out: Its folder.
    """
    if run["code"] not in (0, 1):
        code = run["code"] if run["code"] == 2 else FAILED
        return Answer(code, run["seconds"], (), run["message"])
    if not (out / "candidates.csv").exists():
        return Answer(FAILED, run["seconds"], (), "candidates.csv was not written")
    rivals = {
        (row["effect"], row["place"]): row["verdict"].removeprefix(INDISTINGUISHABLE)
        for row in _rows(out / "candidates.csv")
        if row["verdict"].startswith(INDISTINGUISHABLE)
    }
    grouped: dict[tuple[int, str, str], list[dict[str, str]]] = {}
    for row in _rows(out / "found.csv"):
        grouped.setdefault((int(row["order"]), row["effect"], row["place"]), []).append(row)
    named = []
    for (_, effect, place), rows in sorted(grouped.items()):
        first = rows[0]
        named.append(
            Named(
                effect=effect,
                place=tuple(place.split("+")),
                rivals=rivals.get((effect, place), ""),
                doubt=first["reason"] or ("" if first["level"] == CONFIRMED else first["level"]),
                intervals={
                    row["parameter"]: (
                        _number(row["value"]),
                        _number(row["ci_low"]),
                        _number(row["ci_high"]),
                    )
                    for row in rows
                },
                gap_before=_number(first["gap_before"]),
                gap_after=_number(first["gap_after"]),
                noise_floor=_number(first["noise_floor"]),
                written=first["written"] == "true",
                level=first["level"],
                share=_number(first["share"]),
                amounts_to=tuple(filter(None, first["amounts_to"].split("+"))),
            )
        )
    return Answer(run["code"], run["seconds"], tuple(named))


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _number(text: str) -> float:
    return float(text) if text else float("nan")
