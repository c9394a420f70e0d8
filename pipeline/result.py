"""What every result can do: show its tables as DataFrames, print itself, and save them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from itertools import count
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Any, ClassVar, Final

from actuators.errors import known
from pipeline.logs.formats import sha256
from pipeline.simulation.walk_stand import Computed
from reports.folder import staged

if TYPE_CHECKING:
    from pandas import DataFrame

#: Whose versions numbers hang on.
PACKAGES: Final = ("legwatt", "pin", "numpy", "scipy", "pyarrow", "matplotlib")


def of_table(name: str) -> Any:
    """An attribute of a result that is one of its tables."""
    return property(lambda self: self.table(name))


@dataclass(frozen=True, eq=False)
class Result:
    """Tables by name; some are attributes, too."""

    shown: ClassVar[str] = ""  #: The table that is printed; the first by default.
    verb: str  #: Of the command line that writes the same.
    _tables: Computed = field(repr=False)  #: By file name, computed when they are asked for.
    #: What the record says of the run beside inputs and versions.
    _said: Mapping[str, Any] = field(repr=False)
    #: Files that were read; they stay where they lie in a folder that is written.
    inputs: tuple[Path, ...] = field(repr=False)

    def table(self, name: str) -> DataFrame:
        """One table, computed when it is first asked for; `pipeline/columns.csv` says its columns.

        Args:
            name: As the file is called, e.g. ``walking_energy``.

        Raises:
            LegwattError: There is none; the message offers the closest.
        """
        known("no table", name, self._tables)
        if name not in self._computed:
            self._computed[name] = self._tables[name]()
        return self._computed[name]

    @cached_property
    def _computed(self) -> dict[str, DataFrame]:
        return {}

    @property
    def tables(self) -> dict[str, DataFrame]:
        """All of them, as the command line writes them."""
        return {name: self.table(name) for name in self._tables}

    @cached_property
    def meta(self) -> dict[str, Any]:
        """What the record says of the run: inputs by hash, versions, options."""
        return {**run_meta(self.inputs), **self._said}

    def printed(self, table: DataFrame) -> DataFrame:
        """What is printed of the table that is."""
        return table

    def __str__(self) -> str:
        """Its tables by name, and the first rows of one."""
        name = self.shown or next(iter(self._tables))
        table = self.printed(self.table(name))
        shown = table.iloc[:6, :10].dropna(axis=1, how="all")
        head = shown.to_string(index=False, max_colwidth=30, float_format="{:.4g}".format)
        more = [f"({len(table)} rows)"] if len(table) > 6 else []
        names = ", ".join(self._tables)
        lines = [shorten(f"{self.verb}: {names}", 120), f"{name}:", head, *more]
        return "\n".join(lines)

    def save(self, folder: str | Path) -> Path:
        """Write every table as CSV, and `datapackage.json`; a run that was there is replaced.

        Raises:
            LegwattError: The folder cannot be written.
        """
        about: dict[str, Any] = {}
        how: Any = {"inputs": self.inputs, "said": self.meta, "about": about}
        with staged(Path(folder), self.verb, **how) as out:
            about |= self._write(out)
        return Path(folder)

    def _write(self, out: Path) -> dict[str, Any]:
        """Write the files; what the record says of them."""
        from reports.folder import write_tables

        return write_tables(self.tables, out)


def run_meta(inputs: Sequence[Path]) -> dict[str, Any]:
    """What the record of every run says: its inputs by hash, and versions.

    Inputs are called by their names, with as many folders before these as tell them apart.
    """
    files = list(dict.fromkeys(path.resolve() for path in inputs))
    depth = next(n for n in count(1) if len({f.parts[-n:] for f in files}) == len(files))
    hashes = {"/".join(file.parts[-depth:]): sha256(file) for file in files}
    return {"inputs_sha256": hashes, "versions": {name: version(name) for name in PACKAGES}}
