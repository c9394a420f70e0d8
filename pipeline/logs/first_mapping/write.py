"""The first mapping file as text: one line per column, its reason behind it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line
from pipeline.logs.csv_head import unit_spelt
from pipeline.logs.first_mapping.guess import Guess, current_unit, guesses
from pipeline.logs.first_mapping.names import Named, clock_units, read_name, words_of
from pipeline.logs.formats import TIMES, Source, open_source
from pipeline.logs.log_format import (
    JOINT_COLUMNS,
    TIME,
    Expected,
    column_name,
    parse_column,
    plotted,
)
from pipeline.logs.mapping import CsvTable

_DIALECTS: Final = ((",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ","), ("|", "."))
_SECONDS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_ROWS: Final = 100_000  # that are looked at


@dataclass(frozen=True)
class FirstMapping:
    """A mapping file, and what became of the columns."""

    text: str  #: TOML.
    mapped: tuple[str, ...]  #: Columns that count.
    open: tuple[str, ...]  #: Columns that are remarks until somebody decides.
    unused: tuple[str, ...]  #: Columns that say nothing.
    #: Whether there are targets and no effort: the servos' gains are to be put in.
    asks_gains: bool


def first_mapping(path: Path, expected: Expected | None = None) -> FirstMapping:
    """Write a first mapping file for a log.

    Args:
        path: The log.
        expected: Names and limits of the robot, where one is given.

    Raises:
        LegwattError: The file is no table of numbers.
    """
    table, data = _numbers(path)
    own = {c for c in table.header if _known(c, expected, table.where)}
    clock, time, head = _clock(table, data, own)
    units = table.units
    foreign = [c for c in table.header if c in data and c not in own | {clock} and "*" not in c]
    named = [read_name(c, units.get(c, "")) for c in foreign]
    found, ratios, by = guesses(named, data, time, expected)
    found += _of_supply(named, data)
    lines, mapped, open_ = _lines(found, own)
    supply = next((n for n in named if n.quantity == "supply"), None)
    said = {g.column for g in found} | own | {clock} | ({supply.column} if supply else set())
    unused = tuple(c for c in table.header if c not in said)
    text = [
        f"# A first mapping of {table.where}: every line is a guess, with its reason behind it.",
        "# Remarks in front of a column are other readings of it; put the right one in its place.",
        "# Signs and zeros are the joint's in the file as here; `gap` itself names those that are",
        "# not, with the line that mends them (flip = true, zero = ...).",
        f"# Joints are recognised {by}." if lines else "# Its columns are those of the log format.",
    ]
    if table.dialect != CsvTable():
        dialect = table.dialect
        text += ["", "[csv]", f"delimiter = {json.dumps(dialect.delimiter)}"]
        text += [f"decimal = {json.dumps(dialect.decimal)}"]
    text += [*head, *(["", "[columns]", *lines] if lines else [])]
    if ratios:
        text += ["", "[gear_ratio]  # motor turns per joint turn, by the motion"]
        text += [f"{json.dumps(joint)} = {ratio:.6g}" for joint, ratio in ratios.items()]
    if supply:
        unit = supply.unit or "V"
        text += ["", "[supply]", f"column = {json.dumps(supply.column)}", f'unit = "{unit}"']
    gains = _gains(found, own)
    text += gains
    if unused:
        text += ["", "# Not used: " + json.dumps(list(unused), ensure_ascii=False)[1:-1]]
    return FirstMapping("\n".join(text) + "\n", mapped, open_, unused, bool(gains))


def _of_supply(named: Sequence[Named], data: Mapping[str, Array]) -> list[Guess]:
    """What the supply of all drives gives; of several columns of a kind none is it for sure."""
    out = []
    for quantity in ("supply_current", "supply_power"):
        columns = [n for n in named if n.quantity == quantity]
        why = "named of a supply; positive out of it: else add flip = true"
        if len(columns) > 1:
            why = "one of several named of a supply: put the one of all drives, or add them up"
        for n in columns:
            unit = n.unit
            if not unit and quantity == "supply_current":
                unit = current_unit(data[n.column])
            out.append(Guess(n.column, quantity, "supply", unit, why, sure=len(columns) == 1))
    return out


def _known(column: str, expected: Expected | None, where: str) -> bool:
    """Whether a column is one of the log format as it stands."""
    column = plotted(column)
    if expected is None:
        return column == TIME or column.rpartition("__")[2] in JOINT_COLUMNS
    try:
        return parse_column(column, expected, where) is not None
    except LegwattError:
        return False


def _numbers(path: Path) -> tuple[Source, dict[str, Array]]:
    """The file's columns that hold numbers, by the dialect that gives most of them."""
    reason: LegwattError | None = None
    for delimiter, decimal in _DIALECTS:
        try:
            table = open_source(
                path, CsvTable.model_validate({"delimiter": delimiter, "decimal": decimal})
            )
            data = _columns(table)
        except LegwattError as error:
            reason = reason or error
            continue
        if len(data) > 1:
            return table, data
        reason = reason or LegwattError(f"{table.where}: fewer than two columns of numbers")
        if not table.is_csv:
            break
    assert reason is not None
    raise reason


def _columns(table: Source) -> dict[str, Array]:
    """Columns with finite numbers; others are NaN there, those of text are left out."""
    data: dict[str, Array] = {}
    try:
        data = table.columns(table.header)
    except LegwattError:
        for name in table.header:
            with suppress(LegwattError):
                data |= table.columns([name])
    finite = {name: np.where(np.isfinite(x), x, np.nan)[:_ROWS] for name, x in data.items()}
    return {name: x for name, x in finite.items() if np.isfinite(x).any()}


def _clock(table: Source, data: Mapping[str, Array], own: set[str]) -> tuple[str, Array, list[str]]:
    """The column of time, its numbers in seconds, and the lines that say so."""
    names: list[str] = [c for c in (TIME, "__time") if c in own and c in data]
    foreign = [c for c in data if c not in own]
    for column in names or sorted(foreign, key=lambda c: not {*words_of(c), c} & {*TIMES}):
        units = clock_units(data[column])
        stated = table.units.get(column) or unit_spelt(column.rpartition("_")[2])
        if stated in _SECONDS:
            units = [stated, *(u for u in units if u != stated)]
        if not units:
            continue
        factor = _SECONDS[units[0]]
        time = factor * data[column]
        lines = ["", "[time]"] if column not in names or units[0] != "s" else []
        if column not in names:
            lines.append(f"column = {json.dumps(column, ensure_ascii=False)}")
        if lines:
            typical = float(np.nanmedian(np.diff(time)))
            other = "".join(f"; or {unit}" for unit in units[1:] if stated not in _SECONDS)
            lines.append(f'unit = "{units[0]}"  # {1.0 / max(typical, 1e-9):.4g} Hz{other}')
        return column, time, lines
    n = len(next(iter(data.values())))
    lines = ["", "[time]  # no column runs on like a clock: put the rate at which it was logged"]
    return "", np.arange(n) / 1000.0, [*lines, 'sample_rate = {value = 1000, unit = "Hz"}']


def _lines(
    found: Sequence[Guess], own: set[str]
) -> tuple[list[str], tuple[str, ...], tuple[str, ...]]:
    """Lines of the table of columns, and which columns count and which wait."""
    taken = {plotted(c) for c in own}
    lines: list[str] = []
    mapped: list[str] = []
    open_: list[str] = []
    for guess in found:
        target = column_name(guess.joint, guess.quantity)
        twice = guess.sure and target in taken
        why = f"{guess.why}; another column gives the same" if twice else guess.why
        counts = guess.sure and not twice
        for quantity, unit, when in guess.others:
            other = _line(guess, quantity, unit)
            lines.append(f"# {other}  # or {when}")
        line = f"{_line(guess, guess.quantity, guess.unit)}  # {one_line(why)}"
        lines.append(line if counts else f"# {line}")
        (mapped if counts else open_).append(guess.column)
        taken |= {target} if counts else set()
    return lines, tuple(mapped), tuple(open_)


def _line(guess: Guess, quantity: str, unit: str) -> str:
    """One line of the table of columns."""
    name = json.dumps(guess.column, ensure_ascii=False)
    parts = [f"as = {json.dumps(column_name(guess.joint, quantity), ensure_ascii=False)}"]
    if unit:
        parts.append(f'unit = "{unit}"')
    if guess.scale != 1.0:
        parts.append(f"scale = {guess.scale:.6g}")
    return f"{name} = {{{', '.join(parts)}}}"


def _gains(found: Sequence[Guess], own: set[str]) -> list[str]:
    """What a log without any effort needs: the servos' law."""
    efforts = {"torque", "current", "voltage", "power"}
    suffixes = {plotted(c).rpartition("__")[2] for c in own if not c.startswith("supply__")}
    have = {g.quantity for g in found if g.sure} | {
        JOINT_COLUMNS[s][0] for s in suffixes if s in JOINT_COLUMNS
    }
    if efforts & have or "goal_position" not in have:
        return []
    return [
        "",
        "# Targets and no effort: with the gains of the servos their law gives the torque.",
        "# [pd_gains]",
        "# kp = 50.0  # [N*m/rad], of all joints; or {hip = 60.0, knee = 40.0}",
        "# kd = 1.0  # [N*m*s/rad]",
        "# limit = 20.0  # largest torque [N*m]",
    ]
