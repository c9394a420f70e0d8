"""Rows of a sweep as Parquet: a part for every finished block, one file in the end.

A part is written aside and renamed, so that it is there whole or not at all; which blocks are done
is which parts are there. The last step joins them in the order of the cases and removes them. Every
file carries the sweep's digest: parts or a file of another sweep are never touched.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Final

import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.atomic import replacing
from pipeline.sweep.case import Row, SweepRow
from pipeline.sweep.plan import Axis, SweepError

FILE: Final = "sweep.parquet"
PARTS: Final = "sweep.parts"
_KEY: Final = b"legwatt_sweep"


def schema_of(axes: Sequence[Axis], digest: str) -> pa.Schema:
    """Columns with unit and meaning, and the sweep they belong to."""
    columns = [pa.field("case", pa.int64(), metadata={"meaning": "number of the case, from 0"})]
    for axis in axes:
        words = any(isinstance(value, str) for value in axis.values)
        about = {"meaning": f"varied: {axis.key}", "unit": axis.unit}
        columns.append(
            pa.field(axis.header, pa.string() if words else pa.float64(), metadata=about)
        )
    for declared in fields(SweepRow):
        meaning, unit, _ = declared.metadata["column"]
        kind = pa.string() if declared.type == "str" else pa.float64()
        about = {"meaning": meaning, "unit": unit}
        columns.append(pa.field(declared.name, kind, metadata=about))
    return pa.schema(columns, metadata={_KEY: digest.encode()})


class Store:
    """The folder of one sweep."""

    def __init__(self, out: Path, axes: Sequence[Axis], digest: str, blocks: int) -> None:
        """Look at what is there.

        Args:
            out: Folder, which the caller holds.
            axes: What is varied.
            digest: Of the sweep.
            blocks: How many there are.

        Raises:
            SweepError: Something of another sweep is there.
        """
        self.out, self.blocks = out, blocks
        self.schema = schema_of(axes, digest)
        self.file, self.parts = out / FILE, out / PARTS
        self.complete = self.file.exists() and self._is_own(self.file)
        for path in sorted(self.parts.glob("*.parquet")):
            self._is_own(path)
        self.done = {k for k in range(blocks) if self._part(k).exists()}

    def _part(self, block: int) -> Path:
        return self.parts / f"{block:07d}.parquet"

    def _is_own(self, path: Path) -> bool:
        """True; else it raises."""
        try:
            said = (pq.read_schema(path).metadata or {}).get(_KEY)
        except (pa.ArrowInvalid, OSError):
            said = None
        if said != self.schema.metadata[_KEY]:
            raise SweepError(
                f"{path}: not of this sweep; choose another --out, or move or remove it"
            )
        return True

    def add(self, block: int, rows: Sequence[Row]) -> None:
        """Keep a finished block."""
        table = pa.Table.from_pylist([*rows], schema=self.schema)
        with replacing(self._part(block)) as temporary:
            pq.write_table(table, temporary)
        self.done.add(block)

    def finish(self) -> None:
        """Join all parts to the one file."""
        with (
            replacing(self.file) as temporary,
            pq.ParquetWriter(temporary, self.schema) as writer,
        ):
            for block in range(self.blocks):
                writer.write_table(pq.read_table(self._part(block), schema=self.schema))
            writer.close()
        shutil.rmtree(self.parts, ignore_errors=True)
        self.complete = True
