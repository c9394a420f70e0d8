"""One folder, one run: its tables and record are gathered and take the place of the run's before.

`datapackage.json` (a Frictionless Data Package) names the files of a run; only those are replaced
or removed by the next one. Tables are CSV: comma and decimal dot, UTF-8, LF, one header row. Floats
have the shortest digits that read back to the same number; NaN and None are empty cells. No file
holds a time stamp or a path: the same table gives the same bytes.
"""

from __future__ import annotations

import json
import math
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Final

from actuators.checked import PREFIX, output_errors, write_text
from actuators.errors import LegwattError
from pipeline.columns import about, column

if TYPE_CHECKING:
    from pandas import DataFrame

#: Sums of large terms that cancel leave some 1e-16 of them, 2.2e-32 N*m behind a ratio of 400: a
#: reader takes it for a result. In SI no quantity of a machine that walks is as small as this.
ROUND_OFF: Final = 1e-11
#: Whose numbers were given and not computed, so that none is round-off.
EXACT: Final = ("parameters",)
_TYPES: Final = {"f": "number", "i": "integer", "u": "integer", "b": "boolean"}


def write_tables(tables: Mapping[str, DataFrame], out: Path) -> dict[str, Any]:
    """Write each table as `<name>.csv`.

    Args:
        tables: By name; their columns are declared in `pipeline/columns.csv`.
        out: Folder; made when it is missing.

    Returns:
        For the run's record, by file name: what the table holds, and of every column the name,
        type, unit and meaning.

    Raises:
        LegwattError: A column that is not declared, or a folder that cannot be written.
    """
    said = {}
    for name, table in tables.items():
        shown = without_roundoff(name, table)
        fields = []
        for header in map(str, shown):
            unit, meaning, _ = column(name, header)
            kind = _TYPES.get(shown[header].dtype.kind, "string")
            fields.append({"name": header, "type": kind, "unit": unit, "description": meaning})
        write_text(out / f"{name}.csv", shown.to_csv(index=False, lineterminator="\n"))
        words = {"description": about(name)} if about(name) else {}
        said[f"{name}.csv"] = {**words, "rows": len(table), "schema": {"fields": fields}}
    return said


def without_roundoff(name: str, table: DataFrame) -> DataFrame:
    """A copy of a table with zero in place of round-off."""
    out = table.infer_objects()
    for header in out.select_dtypes("float") if name not in EXACT else ():
        out[header] = out[header].mask(out[header].abs() < ROUND_OFF, 0.0)
    return out.copy() if out is table else out


RECORD = "datapackage.json"
#: An absolute path, in Unix or Windows writing, that starts a word.
_PATH = re.compile(r"(?<![\w./])(?:/|[A-Za-z]:[\\/])(?:[^\s'\"/\\:;,()]+[/\\])+([^\s'\"/\\:;,()]*)")


def check_writable(out: Path) -> Path:
    """Refuse a folder that cannot be written before anything is computed.

    Returns:
        The folder, or the nearest one above it that exists.

    Raises:
        LegwattError: That is a file or not the user's.
    """
    there = next(path for path in (out, *out.absolute().parents) if path.exists())
    with output_errors(out):
        if not there.is_dir():
            raise NotADirectoryError(str(there))
        if not os.access(there, os.W_OK):
            raise PermissionError(0, "Permission denied", str(out))
    return there


@contextmanager
def staged(
    out: Path,
    verb: str,
    *,
    inputs: Iterable[Path] = (),
    said: Mapping[str, Any] | None = None,
    about: Mapping[str, Any] | None = None,
) -> Iterator[Path]:
    """Hand out a temporary folder; when the block succeeds its files replace those in `out`.

    An error in the block leaves `out` as it was.

    Args:
        out: Made when it is missing.
        verb: Of the run, with its step.
        inputs: Files the run reads: those that an earlier run left in `out` stay.
        said: Of the run, for the record: hashes of inputs, versions, options, warnings. Folders of
            absolute paths are left out, so that two machines write the same.
        about: Of files by name, for the record; the block may fill it in.

    Raises:
        LegwattError: `out` cannot be written, or a file that no run wrote is in the way.
    """
    with (
        output_errors(out),
        tempfile.TemporaryDirectory(prefix=PREFIX, dir=check_writable(out)) as place,
    ):
        folder = Path(place)
        yield folder
        found = (path for path in folder.rglob("*") if path.is_file())
        names = sorted(path.relative_to(folder).as_posix() for path in found)
        before, read = written(out), {path.resolve() for path in inputs}
        for name in names:
            if name not in before and os.path.lexists(out / name):
                raise LegwattError(
                    f"{out / name}: no run wrote it, and this one would replace it; move it away, "
                    "or choose another folder"
                )
        stay = [name for name in before if (out / name).resolve() in read]
        resources = []
        for name in sorted({*names, *stay}):
            more = (about or {}).get(name, {})
            resources.append({"name": name.lower(), "path": name, **more})
        package = {"name": f"legwatt-{verb.replace(' ', '-')}", "verb": verb}
        record = plain({**(said or {}), **package, "resources": resources})
        text = json.dumps(record, indent=1, ensure_ascii=False) + "\n"
        (folder / RECORD).write_text(text, encoding="utf-8")
        for name in set(before).difference(names, stay):
            (out / name).unlink(missing_ok=True)
            with suppress(OSError):  # it holds something
                (out / name).parent.rmdir()
        for name in (RECORD, *names):
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(folder / name, out / name)


def written(folder: Path) -> list[str]:
    """The files that the last run wrote there; none where there was none.

    Raises:
        LegwattError: The record is damaged.
    """
    path = folder / RECORD
    try:
        names = [one["path"] for one in json.loads(path.read_bytes())["resources"]]
        inside = [name for name in names if ".." not in Path(name).parts and name[:1] != "/"]
    except FileNotFoundError:
        return []
    except (OSError, ValueError, KeyError, TypeError):
        raise LegwattError(
            f"{path}: damaged, so it is not known which files are an earlier run's; move it away, "
            "or choose another folder"
        ) from None
    return inside


def plain(value: Any) -> Any:
    """The value in terms of JSON; of absolute paths the last part alone."""
    if isinstance(value, Mapping):
        return {str(plain(str(key))): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, PurePath):
        return value.name if value.is_absolute() else value.as_posix()
    if isinstance(value, str):
        return _PATH.sub(lambda match: match.group(1), value)
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)  # JSON has neither
    return value
