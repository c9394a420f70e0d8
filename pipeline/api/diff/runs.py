"""A finished run as its folder states it: tables, what went in, figures."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actuators.errors import one_line
from pipeline.errors import ReportError
from reports.folder import DIALECTS, read_record, settled, sha256

if TYPE_CHECKING:
    import pandas

#: First word of a run's verb to the kind of run; runs of one kind are compared.
KINDS: Final = {"stand": "walk", "walk": "walk", "reports": "walk", "gap": "gap"}
#: Header of the first column of a table that holds a quantity over time.
TIME: Final = "time_s"


@dataclass(frozen=True, eq=False)
class RunTable:
    """A table of a run."""

    frame: pandas.DataFrame  #: Cells; those of names as text, the rest as numbers.
    meanings: Mapping[str, str]  #: Header to meaning.
    #: Header to unit; empty for names and flags, ``"see COLUMN"`` where another holds it.
    units: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class Run:
    """What a run left in its folder."""

    folder: Path  #: As given.
    verb: str  #: That wrote it.
    tables: Mapping[str, RunTable]  #: By name; those over time left out.
    meta: Mapping[str, Any]  #: What every sidecar says of the run.
    figures: Mapping[str, str]  #: Names of the SVG files to their SHA-256.
    changed: tuple[str, ...]  #: Tables that are no longer as the run wrote them.

    @property
    def kind(self) -> str:
        """Which runs it can be compared with."""
        return KINDS[self.verb.split()[0]]


def read_run(folder: Path) -> Run:
    """Read what a run left.

    Raises:
        ReportError: There is no such folder, no run in it, one of a verb that is not compared, or a
            file that cannot be read.
    """
    shown = one_line(folder)
    expected = "expected a folder that stand, walk, reports or gap wrote"
    if not folder.is_dir():
        raise ReportError(
            f"{shown}: {'is a file' if folder.exists() else 'no such folder'}; {expected}"
        )
    settled(folder)
    verb, files = read_record(folder)
    if not verb:
        raise ReportError(f"{shown}: holds no run; {expected}")
    if verb.split()[0] not in KINDS:
        raise ReportError(f"{shown}: holds a run of '{one_line(verb)}'; {expected}")
    tables: dict[str, RunTable] = {}
    changed = []
    meta: dict[str, Any] = {}
    for name, digest in files.items():
        side, path = folder / f"{name[:-4]}.meta.json", folder / name
        if not name.endswith(".csv") or not side.is_file() or not path.is_file():
            continue
        said = _sidecar(side)
        meta = meta or said
        if said["columns"][0]["name"] == TIME:
            continue
        tables[said["table"]] = _table(path, said)
        if sha256(path) != digest:
            changed.append(name)
    figures = {n: d for n, d in files.items() if n.endswith(".svg") and (folder / n).is_file()}
    return Run(folder, verb, tables, meta, figures, tuple(changed))


def _sidecar(path: Path) -> dict[str, Any]:
    try:
        said = json.loads(path.read_bytes())
        for column in said["columns"]:
            _ = column["name"], column["meaning"], column["unit"]
        _ = said["table"], said["columns"][0]
        said.setdefault("dialect", DIALECTS["."])  # of runs before `--decimal` chose one
        _ = said["dialect"]["delimiter"], said["dialect"]["decimalChar"]
    except OSError as error:
        raise ReportError(f"{one_line(path)}: cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError, IndexError):
        raise ReportError(f"{one_line(path)}: damaged; run the command again") from None
    return dict(said)


def _table(path: Path, said: Mapping[str, Any]) -> RunTable:
    import pandas

    columns, dialect = said["columns"], said["dialect"]
    form = {"sep": dialect["delimiter"], "encoding": "utf-8-sig"}
    try:
        frame = pandas.read_csv(path, dtype=str, keep_default_na=False, **form)
    except (OSError, ValueError) as error:
        raise ReportError(f"{one_line(path)}: cannot be read ({one_line(error)})") from None
    names = [column["name"] for column in columns]
    if list(frame.columns) != names:
        raise ReportError(f"{one_line(path)}: its columns are not those of its .meta.json")
    if dialect["decimalChar"] == ",":
        frame = frame.replace(r"^([-+]?\d+),(\d*(?:e[-+]?\d+)?)$", r"\1.\2", regex=True)
    for column in columns:
        if column["unit"]:
            frame[column["name"]] = pandas.to_numeric(frame[column["name"]], errors="coerce")
    return RunTable(
        frame,
        {column["name"]: column["meaning"] for column in columns},
        {column["name"]: column["unit"] for column in columns},
    )
