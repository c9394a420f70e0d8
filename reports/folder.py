"""One folder, one run: a run's files take the place of those of the run before, all or none.

A run gathers its files aside, in a hidden folder on the target's disk. Renaming that folder to
`PENDING` decides: from then on the new files are the run's. `_finish` removes the old files, then
lets the manifest of the new ones take the place of the old one, then moves the new files in, so
that files of two runs never stand side by side. It may be stopped anywhere and started anew: a run
killed before the decision leaves the old files, one killed after it leaves a part of one set, and
the next command that uses the folder moves the rest in.

A person's own files are never lost: what has no place in the new set stays; what is in its way, or
was changed since a run wrote it, is renamed to `NAME.kept`.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import json
import logging
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from pipeline.atomic import PREFIX, make_folder, output_errors
from pipeline.errors import OutputError

logger = logging.getLogger("legwatt")
#: Files that are decided upon and may not all be in place.
PENDING = PREFIX + "pending"
#: Lies in the folder it describes; hidden, because it is no result.
MANIFEST = ".legwatt.json"
KEPT = ".kept"
_FORMAT = 1
#: Folders that this process holds: real path to the descriptor that carries the lock.
_HELD: dict[str, int] = {}


@dataclass(frozen=True)
class Manifest:
    """What a run wrote."""

    verb: str = ""  #: The command, e.g. ``"walk"`` or ``"gap add"``; empty where there was no run.
    #: Name relative to the folder, with slashes, to the SHA-256 of its bytes.
    files: Mapping[str, str] = field(default_factory=dict)


def read_manifest(folder: Path) -> Manifest:
    """What the last run left in a folder; no files where there was none.

    Raises:
        OutputError: There is a manifest that this program did not write.
    """
    path = folder / MANIFEST
    try:
        content = json.loads(path.read_bytes())
        files = {name: str(digest) for name, digest in content["files"].items()}
        inside = all(n and n[0] != "/" and ".." not in PurePosixPath(n).parts for n in files)
        if content["format"] != _FORMAT or not inside:
            raise ValueError
        return Manifest(str(content["verb"]), files)
    except FileNotFoundError:
        return Manifest()
    except OSError as error:
        raise OutputError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise OutputError(
            f"{path}: damaged, so it is not known which files are an earlier run's; choose another "
            "folder, or remove this one"
        ) from None


def _write_manifest(folder: Path, manifest: Manifest) -> None:
    content = {
        "about": "files of one run; the next run into this folder replaces them",
        "format": _FORMAT,
        "verb": manifest.verb,
        "files": dict(sorted(manifest.files.items())),
    }
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    (folder / MANIFEST).write_text(text, encoding="utf-8")


def _files(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.rglob("*")) if path.is_file()]


def sha256(path: Path) -> str:
    """Of a file's bytes; empty where it is no plain file."""
    if path.is_symlink() or not path.is_file():
        return ""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextmanager
def holding(out: Path) -> Iterator[None]:
    """Hold a folder of results for a run, before anything is computed; a second run is refused.

    It is made when it is missing, and goes again when nothing came of the run. A block inside a
    block of the same process shares the lock, which ends with its process, however that ends.

    Raises:
        OutputError: It cannot be written into, or another run holds it.
    """
    missing = [path for path in (out, *out.parents) if not path.exists()]
    own = False
    try:
        with output_errors(out):
            make_folder(out)
            own = _lock(out)
            if not os.access(out, os.W_OK | os.X_OK):
                read_only = os.statvfs(out).f_flag & os.ST_RDONLY
                reason = errno.EROFS if read_only else errno.EACCES
                raise OSError(reason, os.strerror(reason), str(out))
            if own:
                _finish(out)
                for left in out.glob(PREFIX + "*"):
                    shutil.rmtree(left, ignore_errors=True)
        yield
    finally:
        if own:
            os.close(_HELD.pop(os.path.realpath(out)))
        for folder in missing:
            with suppress(OSError):  # it holds something now
                folder.rmdir()


def _lock(out: Path) -> bool:
    """Lock a folder (`flock`, which leaves no file behind); False where this process has it."""
    key = os.path.realpath(out)
    if key in _HELD:
        return False
    descriptor = os.open(out, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise OutputError(
            f"{out}: another run is writing here; wait for it or choose another folder"
        ) from None
    except OSError:
        pass  # a file system without locks: two runs are not kept apart, each is whole
    _HELD[key] = descriptor
    return True


def _release_in_child() -> None:
    """A forked worker must not keep a lock that outlives its parent."""
    while _HELD:
        os.close(_HELD.popitem()[1])


os.register_at_fork(after_in_child=_release_in_child)


@contextmanager
def staged(
    out: Path, verb: str, *, inputs: Iterable[Path] = (), remembered: bool = True
) -> Iterator[Path]:
    """Hand out a temporary folder; when the block succeeds its files replace those in `out`.

    Whatever stops the block leaves `out` as it was.

    Args:
        out: Made when it is missing.
        verb: Of the run, with its step.
        inputs: Files the run reads: those that an earlier run left in `out` stay.
        remembered: Whether a later run may replace the files; else they belong to the user.

    Raises:
        OutputError: `out` cannot be written.
    """
    with holding(out), output_errors(out):
        folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=out))
        try:
            with output_errors(out, {folder: out}):
                yield folder
                before = read_manifest(out)
                new = {p.relative_to(folder).as_posix(): sha256(p) for p in _files(folder)}
                _check_places(out, new)
                read = {path.resolve() for path in inputs}
                stays = {
                    name: digest
                    for name, digest in before.files.items()
                    if name not in new and (out / name).resolve() in read
                }
                _write_manifest(folder, Manifest(verb, {**stays, **new}))
                try:
                    os.rename(folder, out / PENDING)
                    _finish(out)
                except KeyboardInterrupt:
                    _finish(out)
                    raise
                if not remembered:
                    (out / MANIFEST).unlink()
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    gone = [name for name in before.files if name not in new and name not in stays]
    if gone and before.verb != verb:
        print(
            f"{out} held a run of '{before.verb}': its files were replaced, "
            f"{len(gone)} of them have no successor"
        )


def _check_places(out: Path, new: Iterable[str]) -> None:
    """Refuse a folder in the way of a file, or a file in the way of a folder."""
    for name in new:
        if (out / name).is_dir() and not (out / name).is_symlink():
            raise OutputError(f"{out / name}: is a folder, a file was to be written; remove it")
        for above in (out / name).parents:
            if above != out and out in above.parents and above.exists() and not above.is_dir():
                raise OutputError(f"{above}: is a file, a folder was to be made; remove it")


def _finish(out: Path) -> None:
    """Bring a decided replacement to its end, from wherever it was left."""
    pending = out / PENDING
    if not pending.is_dir():
        return
    if (pending / MANIFEST).exists():  # the old files are still there, or a part of them
        before, after = read_manifest(out).files, read_manifest(pending).files
        for name in {**before, **after}:
            path = out / name
            stays = name in after and not (pending / name).exists()
            if stays or not os.path.lexists(path) or (path.is_dir() and not path.is_symlink()):
                continue
            if sha256(path) and sha256(path) in (before.get(name), after.get(name)):
                path.unlink()
            else:
                kept = _free(path)
                path.rename(kept)
                logger.warning("%s: not as a run wrote it; kept as %s", path, kept.relative_to(out))
        for name in before:
            for above in (p for p in (out / name).parents if out in p.parents):
                with suppress(OSError):  # it holds something
                    above.rmdir()
        os.replace(pending / MANIFEST, out / MANIFEST)
    for path in _files(pending):
        target = out / path.relative_to(pending)
        target.parent.mkdir(parents=True, exist_ok=True)
        os.replace(path, target)
    shutil.rmtree(pending)


def _free(path: Path) -> Path:
    """A name beside a person's file that nothing has yet."""
    number, free = 1, path.with_name(path.name + KEPT)
    while os.path.lexists(free):
        number += 1
        free = path.with_name(f"{path.name}{KEPT}{number}")
    return free


def settled(folder: Path) -> None:
    """Before files of a folder of results are read: end what a killed run left undone there.

    Raises:
        OutputError: The folder cannot be written.
    """
    if (folder / PENDING).is_dir():
        with holding(folder):
            pass
