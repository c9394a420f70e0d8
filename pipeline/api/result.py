"""What every result of the API can do: show its tables as frames, and save them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from actuators.errors import LegwattError, closest
from pipeline.logs.formats.convert import sha256
from reports.folder import staged
from reports.table import Table
from reports.writer import write_table

#: Tables by file name, computed when they are asked for.
Computed = dict[str, Callable[[], Table]]
#: Whose versions numbers hang on.
PACKAGES: Final = ("legwatt", "pin", "numpy", "scipy", "pyarrow", "matplotlib")


@dataclass(frozen=True, eq=False)
class Result:
    """Tables by name; some are attributes, too. A table has `.frame()`."""

    verb: str  #: Of the command line that writes the same.
    _tables: Mapping[str, Table | Callable[[], Table]] = field(repr=False)
    #: What its sidecars say of the run beside inputs and versions.
    _said: Mapping[str, Any] = field(repr=False)
    #: Files that were read; they stay where they lie in a folder that is written.
    inputs: tuple[Path, ...] = field(repr=False)

    def table(self, name: str) -> Table:
        """One table, computed when it is first asked for.

        Args:
            name: As the file is called, e.g. ``walking_energy``.

        Raises:
            LegwattError: There is none; the message offers the closest.
        """
        if name not in self._tables:
            raise LegwattError(f"no table '{name}'; {closest(name, list(self._tables))}")
        if name not in self._computed:
            made = self._tables[name]
            self._computed[name] = made if isinstance(made, Table) else made()
        return self._computed[name]

    @cached_property
    def _computed(self) -> dict[str, Table]:
        return {}

    @property
    def tables(self) -> dict[str, Table]:
        """All of them, as the command line writes them."""
        return {name: self.table(name) for name in self._tables}

    @cached_property
    def meta(self) -> dict[str, Any]:
        """What every sidecar says of the run: inputs by hash, versions, options."""
        return {**run_meta(self.inputs), **self._said}

    def save(self, folder: str | Path, *, decimal: str = ".") -> Path:
        """Write every table as CSV with its sidecar; a run that the folder held is replaced.

        Args:
            folder: Made when it is missing.
            decimal: ``","`` writes semicolons and decimal commas, for spreadsheets that do.

        Raises:
            LegwattError: The folder cannot be written.
        """
        with staged(Path(folder), self.verb, inputs=self.inputs, decimal=decimal) as out:
            self._write(out, decimal)
        return Path(folder)

    def _write(self, out: Path, decimal: str) -> None:
        for table in self.tables.values():
            write_table(table, out, meta=self.meta, decimal=decimal)


def by_name(tables: Sequence[Table]) -> dict[str, Table]:
    """Tables by the name of their file."""
    return {table.name: table for table in tables}


def run_meta(inputs: Sequence[Path]) -> dict[str, Any]:
    """What the sidecars of every run say: its inputs by hash, and versions."""
    hashes = zip(own_names(inputs), map(sha256, inputs), strict=True)
    return {"inputs_sha256": dict(hashes), "versions": {name: version(name) for name in PACKAGES}}


def own_names(paths: Sequence[Path]) -> list[str]:
    """Name of each file; with as many folders before it as tell it from others of that name."""
    whole = [path.resolve().parts for path in paths]
    out = []
    for parts in whole:
        others = {o for o in whole if o != parts}
        tail = next(
            n for n in range(1, len(parts) + 1) if all(o[-n:] != parts[-n:] for o in others)
        )
        out.append("/".join(parts[-tail:]))
    return out
