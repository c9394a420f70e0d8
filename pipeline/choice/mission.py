"""A robot's day: a CSV of modes, each with its share of time and what the robot does in it.

`pipeline/choice/README.md` says what each column is; a word may be left empty.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal, Self

import pandas as pd
from pydantic import ConfigDict, Field, model_validator

from actuators.checked import Table, Text, checked, read_bytes, utf8
from actuators.errors import LegwattError, known, one_line

STAND: Final = "stand"
PAYLOAD: Final = "gait.payload_mass"
DAY: Final = 24.0  # [h]
_SUM: Final = 1e-6
_Time = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=False)]


@dataclass(frozen=True)
class Mode:
    """What the robot does for some of the day."""

    name: str  #: Of the mode.
    hours: float  #: In a day; 0 for a load case.
    stands: bool  #: Whether it stands still.
    motion: Path | None  #: File of a motion in place of the gait; None to walk.
    #: Numbers of the robot's file that differ; see `Machine.with_values`.
    changes: Mapping[str, object]
    hold: str  #: ``motor``, ``brake`` or ``none``.
    drivers: bool  #: Whether drivers stay on where a joint locks and needs no current.
    where: str  #: File and row, for messages.
    forces: str = ""  #: Rule of the ground's forces; the walking options' own where empty.


class _Row(Table):
    """A row of a mission's file; empty cells are left out. Others are ``gait.KEY``."""

    model_config = ConfigDict(extra="ignore")
    noun = "column"
    mode: Text
    share: _Time | None = None
    hours: _Time | None = None
    gait: str = ""
    motion: str = ""
    standing: str = ""
    speed: str = ""
    slope: str = ""
    payload: str = ""
    hold: Literal["motor", "brake", "none"] = "motor"
    drivers: Literal["on", "off"] = "on"

    @model_validator(mode="after")
    def _fits(self) -> Self:
        stands = self.gait == STAND
        for wrong, why in (
            ((self.share is None) == (self.hours is None), "state one of share and hours"),
            (self.motion and self.gait, "gait and motion are both stated; leave one empty"),
            (stands and self.speed, "standing has no speed; leave it empty"),
            (not stands and self.hold != "motor", f"hold is of standing, of gait {STAND}"),
            (not stands and self.drivers == "off", "a motion needs its drivers"),
            (not stands and self.standing, f"column standing is of gait {STAND}"),
        ):
            if wrong:
                raise ValueError(why)
        return self


def read_mission(path: Path, hours: float = DAY) -> tuple[Mode, ...]:
    """The modes of a mission's file, where shares are stated of so many hours a day.

    Raises:
        LegwattError: It cannot be read, or a column, word or number cannot be.
    """
    try:
        text = utf8(read_bytes(path))
        head = next((line for line in text.splitlines() if line[:1] != "#"), "")
        sep, stream = ";" if ";" in head else ",", io.StringIO(text)
        table = pd.read_csv(stream, sep=sep, comment="#", dtype=str, keep_default_na=False)
    except (LegwattError, ValueError) as error:
        raise LegwattError(f"{path}: no mission that can be read: {one_line(error)}") from None
    table.columns = [str(name).strip() for name in table.columns]
    for name in table.columns:
        if not name.startswith("gait."):
            known("no column", name, _Row.model_fields, str(path))
    if table.empty:
        raise LegwattError(f"{path}: no modes; add a row")
    rows = [{str(k): str(v).strip() for k, v in row.items()} for row in table.to_dict("records")]
    modes = tuple(_mode(row, path, n, hours) for n, row in enumerate(rows, start=2))
    names = [mode.name for mode in modes]
    if twice := [name for name in names if names.count(name) > 1]:
        raise LegwattError(f"{path}: mode '{twice[0]}' stands twice; rename one")
    total = sum(mode.hours for mode in modes)
    if "share" in table and abs(total / hours - 1.0) > _SUM:
        raise LegwattError(f"{path}: the shares sum to {total / hours:g}; they have to sum to 1")
    if total > DAY * (1 + _SUM):
        raise LegwattError(f"{path}: the modes take {total:g} h; a day has {DAY:g}")
    return modes


def _mode(cells: Mapping[str, str], path: Path, line: int, day: float) -> Mode:
    where = f"{path}: row {line}, mode '{one_line(cells.get('mode', ''))}'"
    row = checked(_Row, {key: cell for key, cell in cells.items() if cell}, where)
    changes: dict[str, object] = {
        "gait.speed": row.speed,
        "gait.slope_forward": row.slope,
        PAYLOAD: row.payload,
        "gait.name": "" if row.gait == STAND else row.gait,
        "standing.feet": ",".join(row.standing.split()),
    }
    changes |= {key: text for key, text in cells.items() if key.startswith("gait.")}
    return Mode(
        name=row.mode,
        hours=row.hours or (row.share or 0.0) * day,
        stands=row.gait == STAND,
        motion=path.parent / row.motion if row.motion else None,
        changes={key: text for key, text in changes.items() if text},
        hold=row.hold,
        drivers=row.drivers == "on",
        where=where,
    )
