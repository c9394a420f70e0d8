"""The numbers the paper prints, with half their last digit and the part they play."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

from actuators.errors import UnitError, closest
from actuators.units import dimension
from pipeline.paper.errors import TargetError

PUBLISHED_FILE = Path(__file__).parent / "published_values.csv"
#: What part a printed number plays, and what is said of it.
ROLES = {
    "input": "put in",
    "target": "fitted to",
    "consequence": "follows from inputs and targets by Eq. 1, Ohm's law, P = U I and E = 3 P",
    "symmetry": "zero because the robot is symmetric",
    "prediction": "neither put in nor fitted nor a consequence of what was",
    "contradicted": "another printed number contradicts it",
}
_COLUMNS = ("id", "where", "quantity", "joint", "unit", "value", "half_width", "role", "note")


@dataclass(frozen=True)
class Published:
    """One printed number.

    Attributes:
        id: Short name.
        where: Table or section.
        quantity: In words.
        joint: Number of the joint, or empty.
        unit: As printed.
        value: As printed.
        half_width: Half of the last printed digit, or of the range the words leave.
        role: One of `ROLES`.
        note: Remark.
    """

    id: str
    where: str
    quantity: str
    joint: str
    unit: str
    value: float
    half_width: float
    role: str
    note: str

    def reproduced(self, computed: float) -> bool:
        """Whether a computed value lies within the half width of the printed one."""
        slack = 1e-9 * max(1.0, abs(self.value))
        return abs(computed - self.value) <= self.half_width + slack


def load_published(
    known: tuple[str, ...], dimensions: dict[str, str], path: Path = PUBLISHED_FILE
) -> dict[str, Published]:
    """Read the file of published values.

    Args:
        known: Every id that the model computes; each must be there exactly once.
        dimensions: Dimension each id must have.
        path: The file.

    Raises:
        TargetError: Missing or doubled id, unknown column or role, a unit that does not fit, or a
            number that is none.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file)
            header = tuple(reader.fieldnames or ())
            rows = list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise TargetError(f"{path.name}: cannot be read ({reason})") from None
    for column in _COLUMNS:
        if column not in header:
            raise TargetError(f"{path.name}: column '{column}' is missing")
    found: dict[str, Published] = {}
    for number, row in enumerate(rows, start=2):
        entry = _entry(row, f"{path.name}, line {number}", known, dimensions)
        if entry.id in found:
            raise TargetError(f"{path.name}, line {number}: id '{entry.id}' is there twice")
        found[entry.id] = entry
    for name in known:
        if name not in found:
            raise TargetError(f"{path.name}: id '{name}' is missing")
    return found


def _entry(
    row: dict[str, str | None], where: str, known: tuple[str, ...], dimensions: dict[str, str]
) -> Published:
    if None in row or any(row[column] is None for column in _COLUMNS):
        raise TargetError(f"{where}: the number of columns differs from the header's")
    text = {column: str(row[column]) for column in _COLUMNS}
    name = text["id"]
    if name not in known:
        raise TargetError(f"{where}: id '{name}' is not computed; {closest(name, list(known))}")
    if text["role"] not in ROLES:
        raise TargetError(f"{where}: role '{text['role']}'; {closest(text['role'], list(ROLES))}")
    try:
        found = dimension(text["unit"])
    except UnitError as error:
        raise TargetError(f"{where}: {error}") from None
    if found != dimensions[name]:
        raise TargetError(
            f"{where}: '{text['unit']}' is a unit of {found}, '{name}' is one of {dimensions[name]}"
        )
    numbers = []
    for column in ("value", "half_width"):
        try:
            number = float(text[column])
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise TargetError(f"{where}: {column} '{text[column]}' is not a finite number")
        numbers.append(number)
    if numbers[1] < 0:
        raise TargetError(f"{where}: half_width must not be negative")
    return Published(
        name,
        text["where"],
        text["quantity"],
        text["joint"],
        text["unit"],
        numbers[0],
        numbers[1],
        text["role"],
        text["note"],
    )
