"""One folder, one run: a run's files take the place of those of the run before, all or none.

A run gathers its files in a hidden folder inside the target. Renaming that to `DECIDED` decides:
`_finish` moves the files in, removes what the earlier run alone wrote, and moves the record of the
new files in last. It may be killed anywhere and started anew. Only files that are as a run wrote
them are replaced or removed; `datapackage.json` (a Frictionless Data Package) has their hashes.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import math
import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path, PurePath
from typing import Any

from actuators.errors import LegwattError
from pipeline.atomic import PREFIX, output_errors

RECORD = "datapackage.json"
GATHERED, DECIDED = PREFIX + "new-", PREFIX + "decided"
#: How CSV files are written, by their sign of decimals.
DIALECTS = {sign: {"delimiter": x, "decimalChar": sign} for sign, x in ((".", ","), (",", ";"))}
#: An absolute path, in Unix or Windows writing, that starts a word.
_PATH = re.compile(r"(?<![\w./])(?:/|[A-Za-z]:[\\/])(?:[^\s'\"/\\:;,()]+[/\\])+([^\s'\"/\\:;,()]*)")
#: Folders that this process holds: real paths to the descriptors that carry the locks.
_HELD: dict[str, int] = {}


def _release_in_child() -> None:
    """A forked worker must not keep a lock that outlives its parent."""
    while _HELD:
        os.close(_HELD.popitem()[1])


os.register_at_fork(after_in_child=_release_in_child)


def read_record(folder: Path) -> tuple[str, dict[str, str]]:
    """The verb that last wrote into a folder, and its files, the record last, by their SHA-256.

    Raises:
        LegwattError: The record is not as a run wrote it.
    """
    path = folder / RECORD
    try:
        said = json.loads(path.read_bytes())
        if said.pop("hash") != _digest(said):
            raise ValueError
        files = {one["path"]: one["hash"].removeprefix("sha256:") for one in said["resources"]}
        return said["verb"], {**files, RECORD: sha256(path)}
    except FileNotFoundError:
        return "", {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        raise LegwattError(
            f"{path}: edited or damaged, so it is not known which files are an earlier run's; "
            "move it away, or choose another folder"
        ) from None


def _digest(said: Mapping[str, object]) -> str:
    text = json.dumps(said, sort_keys=True, allow_nan=False)
    return "sha256:" + hashlib.sha256(text.encode()).hexdigest()


def sha256(path: Path) -> str:
    """Of a file's bytes; empty where it is no plain file."""
    if path.is_symlink() or not path.is_file():
        return ""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextmanager
def holding(out: Path, verb: str = "") -> Iterator[None]:
    """Hold a folder of results before anything is computed; what a killed run left is finished.

    It is made when it is missing, and goes again when nothing came of the run. A block inside a
    block of the same process shares the lock, which ends with its process.

    Args:
        out: The folder.
        verb: Of the run: files of an earlier run of this verb must be as that one wrote them.

    Raises:
        LegwattError: It cannot be written, another run holds it, or something is in the way.
    """
    key = os.path.realpath(out)
    if key in _HELD:
        yield
        return
    missing = [path for path in (out, *out.parents) if not path.exists()]
    with output_errors(out):
        out.mkdir(parents=True, exist_ok=True)
        _HELD[key] = os.open(out, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with output_errors(out):
            try:
                fcntl.flock(_HELD[key], fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                missing.clear()
                text = "another run is writing here; wait for it or choose another folder"
                raise LegwattError(f"{out}: {text}") from None
            except OSError:
                pass  # a file system without locks: two runs are not kept apart, each is whole
            os.rmdir(tempfile.mkdtemp(prefix=GATHERED, dir=out))  # where that goes, files go
            _finish(out)
            for left in out.glob(GATHERED + "*"):
                shutil.rmtree(left)
            wrote, files = read_record(out)
            if wrote == verb:
                _refuse_what_is_in_the_way(out, files, files)
        yield
    finally:
        os.close(_HELD.pop(key))
        for folder in missing:
            with suppress(OSError):  # it holds something now
                folder.rmdir()


@contextmanager
def staged(
    out: Path,
    verb: str,
    *,
    inputs: Iterable[Path] = (),
    decimal: str = ".",
    said: Mapping[str, Any] | None = None,
    about: Mapping[str, Any] | None = None,
) -> Iterator[Path]:
    """Hand out a temporary folder; when the block succeeds its files replace those in `out`.

    Whatever stops the block leaves `out` as it was.

    Args:
        out: Made when it is missing.
        verb: Of the run, with its step.
        inputs: Files the run reads: those that an earlier run left in `out` stay.
        decimal: Sign of decimals in the CSV files, for the record.
        said: Of the run, for the record: hashes of inputs, versions, options, warnings. Folders of
            absolute paths are left out, so that two machines write the same.
        about: Of files by name, for the record; the block may fill it in.

    Raises:
        LegwattError: `out` cannot be written, or something is in the way.
    """
    with holding(out), output_errors(out):
        folder = Path(tempfile.mkdtemp(prefix=GATHERED, dir=out))
        try:
            yield folder
            (wrote, before), read = read_record(out), {path.resolve() for path in inputs}
            files = {name: folder / name for name in _names(folder)}
            stay = {name: out / name for name in before if (out / name).resolve() in read}
            resources = []
            for name, path in sorted((stay | files).items()):
                one = {"name": name.lower(), "path": name, "bytes": path.stat().st_size}
                dialect = {"dialect": DIALECTS[decimal]} if path.suffix == ".csv" else {}
                more = (about or {}).get(name, {})
                resources.append({**one, "hash": f"sha256:{sha256(path)}", **dialect, **more})
            package = f"legwatt-{verb.replace(' ', '-')}"
            record = plain({**(said or {}), "name": package, "verb": verb, "resources": resources})
            record["hash"] = _digest(record)
            text = json.dumps(record, indent=1, ensure_ascii=False) + "\n"
            (folder / RECORD).write_text(text, encoding="utf-8")
            _refuse_what_is_in_the_way(out, {n: sha256(p) for n, p in files.items()}, before)
            os.rename(folder, out / DECIDED)
            _finish(out)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
            _finish(out)  # after Ctrl-C, too, once it is decided
    gone = before.keys() - files.keys() - stay.keys() - {RECORD}
    if gone and wrote != verb:
        print(f"{out} held a run of '{wrote}': {len(gone)} of its files have no successor")


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


def _names(folder: Path) -> list[str]:
    """Files in a folder, the record last."""
    names = (p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())
    return sorted(names, key=lambda name: (name == RECORD, name))


def _refuse_what_is_in_the_way(
    out: Path, files: Mapping[str, str], before: Mapping[str, str]
) -> None:
    """Refuse to write over what is neither as the run before wrote it nor the same bytes."""
    for name, digest in files.items():
        path = out / name
        above = [p for p in path.parents if out in p.parents and os.path.lexists(p)]
        found = [p for p in above if p.is_symlink() or not p.is_dir()]
        if os.path.lexists(path) and sha256(path) not in (digest, before.get(name)):
            found.append(path)
        if found:
            raise LegwattError(
                f"{found[0]}: {'is a folder' if path.is_dir() else 'is not as a run wrote it'} and "
                f"in the way of this run's {name}; move it away, or choose another folder"
            )


def _finish(out: Path) -> None:
    """Bring a decided replacement to its end, from wherever it was left."""
    decided = out / DECIDED
    if not decided.is_dir():
        return
    if (decided / RECORD).exists():
        (_, before), (_, after) = read_record(out), read_record(decided)
        names = _names(decided)
        _refuse_what_is_in_the_way(out, {name: sha256(decided / name) for name in names}, before)
        for name in names[:-1]:
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(decided / name, out / name)
        for name, digest in before.items():
            if name not in after and digest == sha256(out / name):
                (out / name).unlink()
                for folder in (p for p in (out / name).parents if out in p.parents):
                    with suppress(OSError):  # it holds something
                        folder.rmdir()
        os.replace(decided / RECORD, out / RECORD)
    shutil.rmtree(decided)


def settled(folder: Path) -> None:
    """Before files of a folder of results are read: end what a killed run left undone there."""
    if (folder / DECIDED).is_dir():
        with holding(folder):
            pass
