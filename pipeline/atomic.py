"""Files that are there whole or not at all, and one line where a system will not write."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from actuators.errors import LegwattError

#: Of hidden files and folders that are there for the time being.
PREFIX = ".legwatt-"
_OWN = re.compile(rf"{re.escape(PREFIX)}(?:\d+-|[\w-]+(?:/|$))")


@contextmanager
def replacing(target: Path) -> Iterator[Path]:
    """Hand out a temporary file beside the target; when the block succeeds, it takes its place.

    Whatever stops the block, the old file stays as it was.

    Raises:
        LegwattError: The file cannot be written; names it and the reason.
    """
    temporary = target.with_name(f"{PREFIX}{os.getpid()}-{target.name}")
    with output_errors(target.parent):
        target.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield temporary
            os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str, encoding: str = "utf-8") -> None:
    """Write a text file with LF line ends, whole or not at all.

    Raises:
        LegwattError: The file cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(text.encode(encoding))


@contextmanager
def output_errors(out: Path) -> Iterator[None]:
    """Turn a system's refusal to write into one line about the place that was asked for.

    Raises:
        LegwattError: In place of the refusal.
    """
    try:
        yield
    except BrokenPipeError:  # of the terminal
        raise
    except OSError as error:
        place = _OWN.sub("", str(error.filename or out)).rstrip("/")  # never a name of our own
        reason = error.strerror or str(error)
        if isinstance(error, FileExistsError | NotADirectoryError):
            reason = "is a file or lies below one, not a folder"
        raise LegwattError(
            f"{place}: cannot be written ({reason}); choose another folder"
        ) from None
