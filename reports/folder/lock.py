"""A folder that one process at a time may write into.

The lock (`flock` on the folder itself) leaves no file behind and ends with its process, however
that ends. On file systems that know no such lock (some network mounts) two runs at once are not
kept apart; what each writes is still exchanged as a whole.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from reports.errors import OutputError

#: Folders this process holds: real path to the descriptor that carries the lock.
_HELD: dict[str, int] = {}


def _let_go() -> None:
    """A forked worker must not keep a lock that outlives its parent."""
    for descriptor in _HELD.values():
        with suppress(OSError):
            os.close(descriptor)
    _HELD.clear()


os.register_at_fork(after_in_child=_let_go)


@contextmanager
def locked(folder: Path, *, wait: bool = False) -> Iterator[None]:
    """Hold a folder; a block inside a block of the same process shares the lock.

    Args:
        folder: Must exist.
        wait: Wait for another process instead of refusing.

    Raises:
        OutputError: Another process holds the folder.
        OSError: The folder cannot be opened.
    """
    key = os.path.realpath(folder)
    if key in _HELD:
        yield
        return
    descriptor = _opened(folder, wait)
    _HELD[key] = descriptor
    try:
        yield
    finally:
        del _HELD[key]
        os.close(descriptor)


def _opened(folder: Path, wait: bool) -> int:
    """A descriptor that carries the lock of the folder that has this name now."""
    while True:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            except BlockingIOError:
                raise OutputError(
                    f"{folder}: another run is writing here; wait for it or choose another folder"
                ) from None
            except OSError:
                return descriptor  # a file system without locks
            # Whoever held it may have removed or renamed the folder meanwhile.
            if os.path.samestat(os.fstat(descriptor), folder.stat()):
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)
