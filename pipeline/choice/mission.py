"""A robot's day: a CSV of modes, each with its share of time and what the robot does in it.

`pipeline/choice/README.md` says what each column is; a word may be left empty.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pandas as pd

from actuators.checked import read_bytes, utf8
from actuators.errors import LegwattError, closest, one_line

STAND: Final = "stand"
DAY: Final = 24.0  # [h]
_CHOICES: Final = {"hold": ("motor", "brake", "none"), "drivers": ("on", "off")}
#: Column to the number of the gait that it changes.
_CHANGES: Final = {
    "speed": "gait.speed",
    "slope": "gait.slope_forward",
    "payload": "gait.payload_mass",
}
_COLUMNS: Final = (
    *("mode", "share", "hours", "gait", "motion", "standing"),
    *_CHANGES,
    *_CHOICES,
)
_SUM: Final = 1e-6


@dataclass(frozen=True)
class Mode:
    """What the robot does for some of the day."""

    name: str  #: Of the mode.
    hours: float  #: In a day.
    stands: bool  #: Whether it stands still.
    motion: Path | None  #: File of a motion in place of the gait; None to walk.
    #: Numbers of the robot's file that differ; see `Machine.with_values`.
    changes: Mapping[str, object]
    hold: str  #: ``motor``, ``brake`` or ``none``.
    drivers: bool  #: Whether drivers stay on where a joint locks and needs no current.
    where: str  #: File and row, for messages.
    forces: str = ""  #: Rule of the ground's forces; the walking options' own where empty.


def read_mission(path: Path, hours: float = DAY) -> tuple[Mode, ...]:
    """The modes of a mission's file, where shares are stated of so many hours a day.

    Raises:
        LegwattError: It cannot be read; a column, word or number is unknown or cannot be; shares do
            not sum to one, or hours to more than a day.
    """
    try:
        text = io.StringIO(utf8(read_bytes(path)))
        table = pd.read_csv(text, comment="#", dtype=str, keep_default_na=False)
    except (LegwattError, ValueError) as error:
        raise LegwattError(f"{path}: no mission that can be read: {one_line(error)}") from None
    table.columns = [str(name).strip() for name in table.columns]
    for name in table.columns:
        if name not in _COLUMNS and not name.startswith("gait."):
            raise LegwattError(f"{path}: no column '{one_line(name)}': {closest(name, _COLUMNS)}")
    times = [name for name in ("share", "hours") if name in table.columns]
    if "mode" not in table.columns or len(times) != 1:
        raise LegwattError(f"{path}: expected a column mode, and one of share and hours")
    if table.empty:
        raise LegwattError(f"{path}: no modes; add a row")
    rows = [{str(k): str(v).strip() for k, v in row.items()} for row in table.to_dict("records")]
    modes = tuple(_mode(row, path, n, times[0], hours) for n, row in enumerate(rows, start=2))
    names = [mode.name for mode in modes]
    if twice := [name for name in names if names.count(name) > 1]:
        raise LegwattError(f"{path}: mode '{twice[0]}' stands twice; rename one")
    total = sum(mode.hours for mode in modes)
    if times == ["share"] and abs(total / hours - 1.0) > _SUM:
        raise LegwattError(f"{path}: the shares sum to {total / hours:g}; they have to sum to 1")
    if total > DAY * (1 + _SUM):
        raise LegwattError(f"{path}: the modes take {total:g} h; a day has {DAY:g}")
    return modes


def _mode(row: Mapping[str, str], path: Path, line: int, time: str, day: float) -> Mode:
    name = row["mode"]
    where = f"{path}: row {line}, mode '{one_line(name)}'"
    if not name:
        raise LegwattError(f"{path}: row {line}: the mode has no name")
    try:
        span = float(row[time])
    except ValueError:
        span = math.nan
    if not 0.0 < span < math.inf:
        raise LegwattError(f"{where}: {time} '{one_line(row[time])}' is no number above 0")
    words = {key: row.get(key) or known[0] for key, known in _CHOICES.items()}
    for key, known in _CHOICES.items():
        if words[key] not in known:
            hint = closest(words[key], known)
            raise LegwattError(f"{where}: no {key} '{one_line(words[key])}': {hint}")
    gait, motion = row.get("gait", ""), row.get("motion", "")
    stands = gait == STAND
    for wrong, why in (
        (motion and gait, "gait and motion are both stated; leave one empty"),
        (stands and row.get("speed"), "standing has no speed; leave it empty"),
        (
            not stands and words["hold"] != "motor",
            f"hold is of standing; leave it empty, or write gait {STAND}",
        ),
        (
            not stands and words["drivers"] == "off",
            "a motion needs its drivers; leave drivers empty",
        ),
        (
            not stands and row.get("standing"),
            f"column standing is of gait {STAND}; leave it empty",
        ),
    ):
        if wrong:
            raise LegwattError(f"{where}: {why}")
    changes: dict[str, object] = {
        key: row[column] for column, key in _CHANGES.items() if row.get(column)
    }
    changes |= {key: text for key, text in row.items() if key.startswith("gait.") and text}
    if gait and not stands:
        changes["gait.name"] = gait
    if row.get("standing"):
        changes["standing.feet"] = ",".join(row["standing"].split())
    return Mode(
        name=name,
        hours=span * (day if time == "share" else 1.0),
        stands=stands,
        motion=path.parent / motion if motion else None,
        changes=changes,
        hold=words["hold"],
        drivers=words["drivers"] == "on",
        where=where,
    )
