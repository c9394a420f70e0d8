"""Files that are there whole or not at all."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from reports.errors import OutputError


@contextmanager
def replacing(*targets: Path) -> Iterator[tuple[Path, ...]]:
    """Hand out temporary files beside the targets and rename them when the block succeeds.

    Whatever stops the block, an exception or an interrupt, the old files stay as they were and
    nothing half-written is left. What a killed process left goes when its file is next written.

    Args:
        targets: Files to write; their folder is made when it is missing.

    Yields:
        One temporary path per target, in the same folder, for the block to write.

    Raises:
        OutputError: A folder or file cannot be written; names it and the reason.
    """
    temporary = tuple(t.with_name(f".{t.name}.{os.getpid()}.tmp") for t in targets)
    try:
        for target in targets:
            _make_folder(target.parent)
            if target.is_dir():
                raise OutputError(f"{target}: is a folder, a file was to be written; remove it")
            _remove_left_over(target)
        yield temporary
        for source, target in zip(temporary, targets, strict=True):
            os.replace(source, target)
    except OSError as error:
        meant = {str(source): target for source, target in zip(temporary, targets, strict=True)}
        place = meant.get(str(error.filename), error.filename or targets[0].parent)
        reason = error.strerror or str(error)
        raise OutputError(f"{place}: cannot be written ({reason}); choose another folder") from None
    finally:
        for source in temporary:
            with suppress(OSError):
                source.unlink(missing_ok=True)


def _remove_left_over(target: Path) -> None:
    """Temporary files of processes that were killed before they could rename or remove them."""
    for path in target.parent.glob(f".{glob.escape(target.name)}.*.tmp"):
        number = path.name.split(".")[-2]
        if number.isdecimal() and not _runs(int(number)):
            with suppress(OSError):
                path.unlink()


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise OutputError(
            f"{folder}: is a file or lies below one, not a folder; choose another folder"
        ) from None


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8 with LF line ends, whole or not at all.

    Raises:
        OutputError: The file cannot be written.
    """
    with replacing(path) as (temporary,):
        temporary.write_bytes(text.encode("utf-8"))
