"""Numbers that come in any order and with any columns, brought to one Parquet table by time.

They wait in a file, so that memory holds three integers per message and no more.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import one_line
from pipeline.logs.log_format import JOINT_COLUMNS, TIME

Stamps = NDArray[np.int64]
_ROWS: Final = 50_000  # of the table that are put together at once
#: Times the usual step beyond which nothing is drawn between two messages.
_GAP: Final = 5.0
#: What ROS calls a quantity, and its column's end in the log format.
_SUFFIX: Final = {quantity: suffix for suffix, (quantity, _) in JOINT_COLUMNS.items()} | {
    "effort": "torque_Nm"
}


class Column(NamedTuple):
    """Whose numbers these are."""

    topic: str  #: Of the bag.
    joint: str  #: By its name there.
    quantity: str  #: ``"position"``, ``"velocity"``, ``"effort"``, or another interface's name.


class _Block(NamedTuple):
    columns: tuple[Column, ...]
    stamps: Stamps
    logged: Stamps
    at: int  # in the file [B]


class _Sender(NamedTuple):
    """Blocks that share columns: what one publisher sends."""

    columns: tuple[Column, ...]  #: Of all of them.
    blocks: list[_Block]  #: The blocks.
    rows: list[Stamps]  #: The row of every message, by block.
    times: Stamps  #: Of the rows [ns].


class Spool:
    """Blocks of numbers, kept in a file until all are there."""

    def __init__(self, folder: Path) -> None:
        """Begin, with a file in a folder that goes when the spool does."""
        self._file: Any = TemporaryFile(dir=folder)  # noqa: SIM115  # as long as the spool
        self._blocks: list[_Block] = []
        self._messages: Counter[str] = Counter()

    def __enter__(self) -> Spool:
        return self

    def __exit__(self, *reason: object) -> None:
        self._file.close()

    def add(self, columns: Sequence[Column], stamps: Stamps, logged: Stamps, values: Array) -> None:
        """Keep numbers (N, columns) of messages with the same columns.

        Stamps are those of the headers, `logged` the times of recording, each shape (N,) [ns].
        """
        order = sorted(range(len(columns)), key=lambda k: columns[k])
        named = tuple(columns[k] for k in order)
        self._blocks.append(_Block(named, stamps, logged, self._file.tell()))
        self._file.write(np.ascontiguousarray(values[:, order], dtype="<f8").tobytes())
        self._messages.update({topic: stamps.size for topic in {c.topic for c in columns}})

    def write(self, path: Path) -> list[str]:
        """Write all numbers as a Parquet table of the log format, rows by time.

        Numbers of one instant stand in one row; where a message lacks a column its cell is empty.
        What others send on stamps of their own is brought to the rows of the one that sends the
        joints' states, or most, by straight lines.

        Returns:
            What a reader should know of the times and topics.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        stamps, remarks = self._times()
        names, more = self._names()
        main, *others = self._senders(stamps)
        columns = [c for sender in (main, *others) for c in sender.columns]
        schema = pa.schema([(n, pa.float64()) for n in (TIME, *(names[c] for c in columns))])
        with pq.ParquetWriter(path, schema) as writer:
            for first in range(0, main.times.size, _ROWS):
                times = main.times[first : first + _ROWS]
                blocks = [self._rows(main, first, first + times.size)]
                blocks += [self._between(sender, times) for sender in others]
                seconds = 1e-9 * (times - main.times[0])
                arrays = [seconds, *np.concatenate(blocks, axis=1).T]
                writer.write_table(pa.table(arrays, schema=schema))
        apart = [s for s in others if not np.isin(s.times, main.times).all()]
        if apart:
            count = sum(len(sender.columns) for sender in apart)
            apart_text = (
                f"{count} columns come at other times ({one_line(names[apart[0].columns[0]])}"
            )
            more.append(
                f"{apart_text}, ...) and are brought to those of the others by straight lines"
            )
        return remarks + more

    def _senders(self, stamps: list[Stamps]) -> list[_Sender]:
        """Blocks that share columns together, those of the joints' states or most rows first."""
        groups: list[tuple[set[Column], list[int]]] = []
        for k, block in enumerate(self._blocks):
            same = [g for g in groups if g[0] & {*block.columns}]
            groups = [g for g in groups if g not in same]
            columns = {*block.columns}.union(*(g[0] for g in same))
            groups.append((columns, [*(m for g in same for m in g[1]), k]))
        senders = []
        for columns, members in groups:
            blocks = [self._blocks[k] for k in members]
            rows, times = _ordered(blocks, [stamps[k] for k in members])
            senders.append(_Sender(tuple(sorted(columns)), blocks, rows, times))
        return sorted(
            senders, key=lambda s: ("state" not in s.columns[0].topic, -s.times.size, s.columns)
        )

    def _rows(self, sender: _Sender, first: int, last: int) -> Array:
        """Some of a sender's rows, shape (last - first, columns)."""
        out = np.full((last - first, len(sender.columns)), np.nan)
        at = {column: k for k, column in enumerate(sender.columns)}
        for block, row in zip(sender.blocks, sender.rows, strict=True):
            inside = (row >= first) & (row < last)
            if inside.any():
                places = np.array([at[column] for column in block.columns])
                out[np.ix_(row[inside] - first, places)] = self._values(block)[inside]
        return out

    def _between(self, sender: _Sender, times: Stamps) -> Array:
        """A sender's numbers at other times (N,), shape (N, columns); empty in its gaps."""
        own = sender.times
        after = np.clip(np.searchsorted(own, times), 0, own.size - 1)
        before = np.maximum(after - 1, 0)
        first, last = int(before.min()), int(after.max()) + 1
        values = self._rows(sender, first, last)
        width = own[after] - own[before]
        usual = np.median(np.diff(own)) if own.size > 1 else 0
        share = np.where(width > 0, (times - own[before]) / np.maximum(width, 1), 1.0)
        with np.errstate(invalid="ignore"):
            low, high = values[before - first], values[after - first]
            out = low + share[:, None] * (high - low)
        exact = own[after] == times
        out[exact] = high[exact]
        outside = (width == 0) | (width > _GAP * usual) | (share < 0.0) | (share > 1.0)
        out[~exact & outside] = np.nan
        return np.asarray(out)

    def _values(self, block: _Block) -> Array:
        self._file.seek(block.at)
        count = block.stamps.size * len(block.columns)
        numbers = np.frombuffer(self._file.read(8 * count), dtype="<f8")
        return numbers.reshape(block.stamps.size, -1)

    def _times(self) -> tuple[list[Stamps], list[str]]:
        """Stamps of the headers, or recording times where any header has none; and remarks."""
        none = sum(int((block.stamps <= 0).sum()) for block in self._blocks)
        stamps = [block.logged if none else block.stamps for block in self._blocks]
        remarks = [
            f"{none} messages have no stamp in their header: the times are those at which messages "
            "were recorded, late by what travelling takes, and unevenly so"
        ] * bool(none)
        last: dict[tuple[Column, ...], int] = {}
        back = 0
        for block, when in zip(self._blocks, stamps, strict=True):
            back += int((np.diff(when, prepend=last.get(block.columns, when[0])) < 0).sum())
            last[block.columns] = int(when[-1])
        if back:
            remarks.append(f"{back} messages are stamped before the one that came before; sorted")
        return stamps, remarks

    def _names(self) -> tuple[dict[Column, str], list[str]]:
        """Every column's name in the table, and remarks where topics tell the same.

        What several topics tell of one joint is taken from the one called after states, else the
        one with more messages; the others' columns keep their topic's name.
        """

        def rank(topic: str) -> tuple[bool, int, str]:
            return "state" not in topic, -self._messages[topic], topic

        topics = sorted(self._messages, key=rank)
        columns = dict.fromkeys(c for block in self._blocks for c in block.columns)
        names: dict[Column, str] = {}
        taken: dict[str, str] = {}
        for column in sorted(columns, key=lambda c: topics.index(c.topic)):
            suffix = _SUFFIX.get(column.quantity)
            name = f"{column.joint}__{suffix}" if suffix else ""
            if not name or taken.setdefault(name, column.topic) != column.topic:
                name = f"{column.topic}/{column.joint}/{column.quantity}"
            names[column] = name
        others = sorted({c.topic for c, n in names.items() if n.startswith(f"{c.topic}/")})
        first = sorted({c.topic for c, n in names.items() if not n.startswith(f"{c.topic}/")})
        if not others:
            return names, []
        text = f"columns of {', '.join(others)} are kept as TOPIC/JOINT/QUANTITY"
        return names, [f"joints are those of {', '.join(first)}; {text}"]


def _ordered(blocks: Sequence[_Block], stamps: Sequence[Stamps]) -> tuple[list[Stamps], Stamps]:
    """The row of every message, by block, and the rows' times [ns].

    Messages with the same columns never share a row: the second of two with one stamp is the
    reader's to drop and to tell.
    """
    kinds = {columns: k for k, columns in enumerate(dict.fromkeys(b.columns for b in blocks))}
    when = np.concatenate(stamps)
    kind = np.concatenate([np.full(b.stamps.size, kinds[b.columns]) for b in blocks])
    order = np.lexsort((kind, when))
    new = np.ones(order.size, dtype=np.bool_)
    new[1:] = (np.diff(when[order]) != 0) | (np.diff(kind[order]) != 0)
    start = np.maximum.accumulate(np.where(new, np.arange(order.size), 0))
    turn = np.empty_like(order)
    turn[order] = np.arange(order.size) - start  # how many of this kind and stamp came before
    order = np.lexsort((turn, when))
    new[1:] = (np.diff(when[order]) != 0) | (np.diff(turn[order]) != 0)
    row = np.empty_like(order)
    row[order] = np.cumsum(new) - 1
    cuts = np.cumsum([s.size for s in stamps])[:-1]
    return np.split(row, cuts), when[order][new]
