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

from pipeline.logs.reading.log_format import JOINT_COLUMNS, TIME

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
_ROWS: Final = 50_000  # of the table that are put together at once
#: What ROS calls a quantity, and its column's end in the log format.
_SUFFIX: Final = {quantity: suffix for suffix, (quantity, _) in JOINT_COLUMNS.items()} | {
    "effort": "torque_Nm"
}


class Column(NamedTuple):
    """Whose numbers these are.

    Attributes:
        topic: Of the bag.
        joint: By its name there.
        quantity: ``"position"``, ``"velocity"``, ``"effort"``, or another interface's name.
    """

    topic: str
    joint: str
    quantity: str


class _Block(NamedTuple):
    columns: tuple[Column, ...]
    stamps: Stamps
    logged: Stamps
    at: int  # in the file [B]


class Spool:
    """Blocks of numbers, kept in a file until all are there."""

    def __init__(self, folder: Path) -> None:
        """Begin.

        Args:
            folder: For the file, which goes when the spool does.
        """
        self._file: Any = TemporaryFile(dir=folder)  # noqa: SIM115  # as long as the spool
        self._blocks: list[_Block] = []
        self._messages: Counter[str] = Counter()

    def __enter__(self) -> Spool:
        return self

    def __exit__(self, *reason: object) -> None:
        self._file.close()

    def add(self, columns: Sequence[Column], stamps: Stamps, logged: Stamps, values: Array) -> None:
        """Keep numbers of messages with the same columns.

        Args:
            columns: Of the numbers.
            stamps: Of the headers, shape (N,) [ns].
            logged: When the messages were recorded, shape (N,) [ns].
            values: Shape (N, columns).
        """
        order = sorted(range(len(columns)), key=lambda k: columns[k])
        named = tuple(columns[k] for k in order)
        self._blocks.append(_Block(named, stamps, logged, self._file.tell()))
        self._file.write(np.ascontiguousarray(values[:, order], dtype="<f8").tobytes())
        self._messages.update({topic: stamps.size for topic in {c.topic for c in columns}})

    def write(self, path: Path) -> list[str]:
        """Write all numbers as a Parquet table of the log format, rows by time.

        Numbers of one instant stand in one row; where a message lacks a column its cell is empty.

        Returns:
            What a reader should know of the times and topics.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        stamps, remarks = self._times()
        names, more = self._names()
        start = min(int(s.min()) for s in stamps)
        rows, times = self._rows(stamps)
        schema = pa.schema([(name, pa.float64()) for name in (TIME, *names.values())])
        at = {column: k for k, column in enumerate(names, start=1)}
        with pq.ParquetWriter(path, schema) as writer:
            for first in range(0, times.size, _ROWS):
                last = min(first + _ROWS, times.size)
                out = np.full((last - first, len(names) + 1), np.nan)
                out[:, 0] = 1e-9 * (times[first:last] - start)
                for block, row in zip(self._blocks, rows, strict=True):
                    inside = (row >= first) & (row < last)
                    if inside.any():
                        places = [at[column] for column in block.columns]
                        out[np.ix_(row[inside] - first, places)] = self._values(block)[inside]
                writer.write_table(pa.table(list(out.T), schema=schema))
        return remarks + more

    def _values(self, block: _Block) -> Array:
        self._file.seek(block.at)
        count = block.stamps.size * len(block.columns)
        numbers = np.frombuffer(self._file.read(8 * count), dtype="<f8")
        return numbers.reshape(block.stamps.size, -1)

    def _times(self) -> tuple[list[Stamps], list[str]]:
        """Stamps of the headers, or recording times where any header has none; and remarks."""
        none = sum(int((block.stamps <= 0).sum()) for block in self._blocks)
        stamps = [block.logged if none else block.stamps for block in self._blocks]
        remarks = []
        if none:
            remarks.append(
                f"{none} messages have no stamp in their header: the times are those at which "
                "messages were recorded, late by what travelling takes, and unevenly so"
            )
        last: dict[tuple[Column, ...], int] = {}
        back = 0
        for block, when in zip(self._blocks, stamps, strict=True):
            before = np.concatenate([[last.get(block.columns, when[0])], when[:-1]])
            back += int((when < before).sum())
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

    def _rows(self, stamps: list[Stamps]) -> tuple[list[Stamps], Stamps]:
        """The row of every message, by block, and the rows' times [ns].

        Messages with the same columns never share a row: the second of two with one stamp is the
        reader's to drop and to tell.
        """
        turns: list[Stamps] = [np.zeros(0, dtype=np.int64)] * len(self._blocks)
        kinds: dict[tuple[Column, ...], list[int]] = {}
        for k, block in enumerate(self._blocks):
            kinds.setdefault(block.columns, []).append(k)
        for members in kinds.values():
            joined = np.concatenate([stamps[k] for k in members])
            order = np.argsort(joined, kind="stable")
            ordered = joined[order]
            turn = np.empty_like(order)
            turn[order] = np.arange(order.size) - np.searchsorted(ordered, ordered)
            cuts = np.cumsum([stamps[k].size for k in members])[:-1]
            for k, part in zip(members, np.split(turn, cuts), strict=True):
                turns[k] = part
        when, turn = np.concatenate(stamps), np.concatenate(turns)
        order = np.lexsort((turn, when))
        new = np.ones(order.size, dtype=np.bool_)
        new[1:] = (np.diff(when[order]) != 0) | (np.diff(turn[order]) != 0)
        row = np.empty_like(order)
        row[order] = np.cumsum(new) - 1
        cuts = np.cumsum([s.size for s in stamps])[:-1]
        return np.split(row, cuts), when[order][new]
