"""What every result of the API can do: show its tables as frames, and save them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from actuators.errors import closest
from reports.errors import TableError
from reports.folder.staging import staged
from reports.table import Table
from reports.writer import write_table


@dataclass(frozen=True, eq=False)
class Result:
    """Tables by name; each is an attribute, too, and has `.frame()`.

    Attributes:
        tables: As the command line writes them, by file name.
        verb: Of the command line that writes the same.
        meta: What every sidecar says of the run.
    """

    tables: Mapping[str, Table]
    verb: str
    meta: Mapping[str, Any] = field(repr=False)

    def table(self, name: str) -> Table:
        """One table.

        Args:
            name: As the file is called, e.g. ``walking_energy``.

        Raises:
            TableError: There is none; the message offers the closest.
        """
        if name not in self.tables:
            raise TableError(f"no table '{name}'; {closest(name, list(self.tables))}")
        return self.tables[name]

    def save(self, folder: str | Path, *, decimal: str = ".") -> Path:
        """Write every table as CSV with its sidecar; a run that the folder held is replaced.

        Args:
            folder: Made when it is missing.
            decimal: ``","`` writes copies for a decimal-comma spreadsheet, too.

        Raises:
            ReportError: The folder cannot be written.
        """
        with staged(Path(folder), self.verb) as out:
            self._write(out, decimal)
        return Path(folder)

    def _write(self, out: Path, decimal: str) -> None:
        for table in self.tables.values():
            write_table(table, out, meta=dict(self.meta), decimal=decimal)


def by_name(tables: Sequence[Table]) -> dict[str, Table]:
    """Tables by the name of their file."""
    return {table.name: table for table in tables}
