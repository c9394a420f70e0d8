"""One folder, one run: a run's files take the place of those of the run before, all or none.

A folder of results holds the files of one run of one verb, and what a person put there. A run of
any verb replaces what the run before left, whichever verb that was, and nothing else. It gathers
its files beside them and exchanges the sets at its end (`exchange.py` says what a killed
process leaves). While it runs it holds the folder; a second one is refused.
"""

from __future__ import annotations

import errno
import logging
import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from reports.errors import OutputError
from reports.folder.exchange import PREFIX, Replaced, exchange, gathering, settle, unsettled
from reports.folder.lock import locked

logger = logging.getLogger("legwatt")
#: What a system says when it will not write.
_REFUSALS = {
    *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS, errno.EACCES, errno.EPERM),
    *(errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.ENAMETOOLONG, errno.ELOOP, errno.ENOENT),
    *(errno.EBUSY, errno.EXDEV, errno.ENOTEMPTY),
}


@contextmanager
def holding(out: Path) -> Iterator[None]:
    """Hold a folder of results for a run, before anything is computed.

    It is made when it is missing, and goes again when nothing came of the run.

    Raises:
        OutputError: It cannot be written into, or another run holds it.
    """
    made: list[Path] = []
    try:
        with ExitStack() as held:
            with told(out):
                made += _make(out)
                held.enter_context(locked(out))
                if not os.access(out, os.W_OK | os.X_OK):
                    closed = os.statvfs(out).f_flag & os.ST_RDONLY
                    reason = errno.EROFS if closed else errno.EACCES
                    raise OSError(reason, os.strerror(reason), str(out))
                settle(out)
            yield
    finally:
        for folder in reversed(made):
            with suppress(OSError):  # it holds something now
                folder.rmdir()


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
    with holding(out), told(out):
        own = Path(tempfile.mkdtemp(prefix=PREFIX, dir=out))
        try:
            folder = gathering(own)
            with told(out, folder):
                yield folder
            replaced = exchange(out, own, verb, inputs, remembered=remembered)
        finally:
            shutil.rmtree(own, ignore_errors=True)
    _say(out, verb, replaced)


def settled(folder: Path) -> None:
    """Before files of a folder of results are read: end what a killed run left undone there.

    Raises:
        OutputError: The folder cannot be written.
    """
    if unsettled(folder):
        with told(folder), locked(folder, wait=True):
            settle(folder)


@contextmanager
def told(out: Path, folder: Path | None = None) -> Iterator[None]:
    """Turn a system's refusal to write into one line about the place that was asked for.

    Args:
        out: That place.
        folder: What stands for it while the files are gathered.

    Raises:
        OutputError: In place of the refusal.
    """
    try:
        yield
    except OutputError as error:
        raise OutputError(_meant(str(error), out, folder)) from None
    except OSError as error:
        if error.errno not in _REFUSALS:
            raise
        place = _meant(str(error.filename or out), out, folder)
        raise OutputError(
            f"{place}: cannot be written ({error.strerror}); choose another folder"
        ) from None


def _meant(text: str, out: Path, folder: Path | None) -> str:
    text = text if folder is None else text.replace(str(folder), str(out))
    return re.sub(rf"/{re.escape(PREFIX)}[^/:\s]*", "", text)  # never a name of our own


def _make(out: Path) -> list[Path]:
    """Make a folder and those above it; which were made, the topmost first."""
    missing = [path for path in (out, *out.parents) if not path.exists()]
    made: list[Path] = []
    try:
        for path in reversed(missing):
            path.mkdir(exist_ok=True)
            made.append(path)
        if not out.is_dir():
            raise NotADirectoryError
    except OSError as error:
        for path in reversed(made):
            with suppress(OSError):
                path.rmdir()
        if isinstance(error, FileExistsError | NotADirectoryError):
            raise OutputError(
                f"{out}: is a file or lies below one, not a folder; choose another folder"
            ) from None
        raise
    return made


def _say(out: Path, verb: str, replaced: Replaced) -> None:
    """What a person may look for in vain."""
    if replaced.gone and replaced.verb != verb:
        print(
            f"{out} held a run of '{replaced.verb}': its files were replaced, "
            f"{len(replaced.gone)} of them have no successor"
        )
    for name, kept in replaced.kept:
        logger.warning("%s: not as a run wrote it; kept as %s", out / name, kept)
