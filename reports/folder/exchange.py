"""The files of one run take the place of another's, all of them or none.

New files are gathered in a hidden folder inside the target, so that they lie on its disk before
anything changes. Renaming that folder to `EXCHANGE` decides: from then on the new set is the run's.
What is left are two renames per file, some milliseconds: first the old files move away, then the
new ones move in, so that files of two runs never stand side by side. A process killed before the
decision leaves the old set; one killed after it leaves part of one set, and `settle`, with which
every command that uses the folder begins, moves the rest in. A power cut is another matter: nothing
here waits for the disk.

A person's own files are never lost: what has no place in the new set stays, and what is in its way,
or was changed since a run wrote it, is renamed to `NAME.kept`.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from types import FrameType

from reports.errors import OutputError
from reports.folder.manifest import MANIFEST, Manifest, read_manifest, sha256

#: Of every hidden folder made here.
PREFIX = ".legwatt-"
#: A decided exchange that may not have ended.
EXCHANGE = PREFIX + "exchange"
_NEW, _OLD, _PLAN = "new", "old", "plan.json"
KEPT = ".kept"


@dataclass(frozen=True)
class Exchange:
    """What moves; names are relative to the folder.

    Attributes:
        old: Files of the earlier run, which go.
        aside: A person's file in the way, and the name it gets.
        new: Files that come.
    """

    old: Sequence[str]
    aside: Sequence[tuple[str, str]]
    new: Sequence[str]


@dataclass(frozen=True)
class Replaced:
    """What an exchange did to files that a reader may look for.

    Attributes:
        verb: Of the earlier run; empty without one.
        gone: Its files that have no successor of the same name.
        kept: A person's file in the way, and the name it has now.
    """

    verb: str
    gone: Sequence[str]
    kept: Sequence[tuple[str, str]]


def gathering(own: Path) -> Path:
    """The place for new files in a hidden folder of the target."""
    place = own / _NEW
    place.mkdir()
    return place


def exchange(
    folder: Path, own: Path, verb: str, inputs: Iterable[Path] = (), *, remembered: bool = True
) -> Replaced:
    """Let gathered files replace what the last run left; the caller holds the folder.

    Args:
        folder: The target.
        own: Hidden folder in the target, with the new files where `gathering` said.
        verb: That wrote them.
        inputs: Files the run read: of an earlier run in the same folder they stay.
        remembered: Whether the new files may be replaced by a later run; else they are a person's.

    Raises:
        OutputError: A folder is in the way of a file, or a file of a folder.
        OSError: The system refuses; everything is as it was.
    """
    before = read_manifest(folder)
    gathered = own / _NEW
    digests = {
        path.relative_to(gathered).as_posix(): sha256(path)
        for path in sorted(gathered.rglob("*"))
        if path.is_file()
    }
    plan, carried = _planned(folder, before, digests, {path.resolve() for path in inputs})
    if remembered:
        manifest = Manifest(verb, {**carried, **digests}).text()
        (gathered / MANIFEST).write_bytes(manifest.encode("utf-8"))
        plan = Exchange(plan.old, plan.aside, [*plan.new, MANIFEST])
    (own / _PLAN).write_text(json.dumps(asdict(plan)), encoding="utf-8")
    with _undisturbed():
        os.rename(own, folder / EXCHANGE)
        try:
            _forward(folder)
        except OSError:
            _back(folder)
            raise
    gone = [name for name in plan.old if name not in plan.new and name != MANIFEST]
    return Replaced(before.verb, gone, plan.aside)


def settle(folder: Path) -> None:
    """Bring an exchange to its end that a killed process left; the caller holds the folder.

    Hidden folders of killed processes go, too.

    Raises:
        OutputError: What it left is damaged.
        OSError: The system refuses.
    """
    if unsettled(folder):
        with _undisturbed():
            _forward(folder)
    for left in folder.glob(PREFIX + "*"):
        shutil.rmtree(left, ignore_errors=True)


def unsettled(folder: Path) -> bool:
    """Whether a decided exchange has not ended."""
    return (folder / EXCHANGE).is_dir()


def _planned(
    folder: Path, before: Manifest, digests: dict[str, str], inputs: set[Path]
) -> tuple[Exchange, dict[str, str]]:
    """What moves, and the entries of the earlier manifest that stay."""
    old: list[str] = []
    aside: list[tuple[str, str]] = []
    carried: dict[str, str] = {}
    for name in sorted({*before.files, *digests}):
        path = folder / name
        _check_place(folder, name)
        if not os.path.lexists(path) or (path.is_dir() and name not in digests):
            continue
        if path.is_dir():
            raise OutputError(f"{path}: is a folder, a file was to be written; remove it")
        if name not in digests and path.resolve() in inputs:
            carried[name] = before.files[name]
        elif _plain(path) and sha256(path) in (before.files.get(name), digests.get(name)):
            old.append(name)
        else:
            aside.append((name, _free(folder, name)))
    if before.verb:
        old.append(MANIFEST)
    return Exchange(old, aside, list(digests)), carried


def _plain(path: Path) -> bool:
    """Whether it is a file as a run writes it: no link, no pipe."""
    return path.is_file() and not path.is_symlink()


def _check_place(folder: Path, name: str) -> None:
    for above in (folder / name).parents:
        if above == folder:
            return
        if os.path.lexists(above) and not above.is_dir():
            raise OutputError(f"{above}: is a file, a folder was to be made; remove it")


def _free(folder: Path, name: str) -> str:
    """A name beside a person's file that nothing has yet."""
    number = 1
    while True:
        free = f"{name}{KEPT}{number if number > 1 else ''}"
        if not os.path.lexists(folder / free):
            return free
        number += 1


def _plan_of(place: Path) -> Exchange:
    try:
        content = json.loads((place / _PLAN).read_text(encoding="utf-8"))
        return Exchange(content["old"], [(a, b) for a, b in content["aside"]], content["new"])
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        raise OutputError(
            f"{place}: the exchange of results that it holds is damaged; choose another folder, or "
            "remove this one"
        ) from None


def _forward(folder: Path) -> None:
    """Move on from whatever was reached, any number of times, to the new set."""
    place = folder / EXCHANGE
    plan = _plan_of(place)
    waiting = [name for name in plan.new if os.path.lexists(place / _NEW / name)]
    moved_in = set(plan.new).difference(waiting)
    moves = [(folder / n, place / _OLD / n) for n in plan.old if n not in moved_in]
    moves += [
        (folder / name, folder / kept)
        for name, kept in plan.aside
        if name not in moved_in and not os.path.lexists(folder / kept)
    ]
    _move([pair for pair in moves if os.path.lexists(pair[0])])
    _move([(place / _NEW / name, folder / name) for name in waiting])
    _remove_empty(folder, plan.old)
    _end(folder)


def _back(folder: Path) -> None:
    """Undo whatever was reached."""
    place = folder / EXCHANGE
    plan = _plan_of(place)
    moves = [
        (folder / name, place / _NEW / name)
        for name in plan.new
        if not os.path.lexists(place / _NEW / name)
    ]
    moves += [(folder / kept, folder / name) for name, kept in plan.aside]
    moves += [(place / _OLD / n, folder / n) for n in plan.old]
    _move([pair for pair in moves if os.path.lexists(pair[0])])
    _remove_empty(folder, plan.new)
    _end(folder)


def _end(folder: Path) -> None:
    """One rename ends the exchange; what lies in its folder is of no more use."""
    done = folder / f"{PREFIX}done"
    shutil.rmtree(done, ignore_errors=True)
    os.rename(folder / EXCHANGE, done)
    shutil.rmtree(done, ignore_errors=True)


def _move(moves: Sequence[tuple[Path, Path]]) -> None:
    """Rename one after another, as fast as can be; their folders are made before."""
    for above in {target.parent for _, target in moves}:
        if not above.is_dir():
            above.mkdir(parents=True, exist_ok=True)
    for source, target in [(str(source), str(target)) for source, target in moves]:
        os.rename(source, target)


def _remove_empty(folder: Path, names: Sequence[str]) -> None:
    """Folders that hold nothing any more, below the target."""
    above = {p for name in names for p in (folder / name).parents if folder in p.parents}
    for path in sorted(above, key=lambda p: -len(p.parts)):
        with suppress(OSError):
            path.rmdir()


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let an interrupt or a request to end wait for the end of the block."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []

    def later(number: int, frame: FrameType | None) -> None:
        came.append(number)

    kinds = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    handlers = {kind: signal.signal(kind, later) for kind in kinds}
    try:
        yield
    finally:
        for kind, handler in handlers.items():
            signal.signal(kind, signal.SIG_DFL if handler is None else handler)
        for number in came:
            signal.raise_signal(number)
