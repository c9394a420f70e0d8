"""Files that are there whole or not at all, and one line where a system will not write."""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from pipeline.errors import OutputError

#: Of every hidden folder of results.
PREFIX = ".legwatt-"


@contextmanager
def replacing(*targets: Path) -> Iterator[tuple[Path, ...]]:
    """Hand out temporary files beside the targets and rename them when the block succeeds.

    Whatever stops the block, the old files stay as they were and nothing half-written is left. What
    a killed process left goes when its file is next written.

    Raises:
        OutputError: A folder or file cannot be written; names it and the reason.
    """
    temporary = tuple(t.with_name(f".{t.name}.{os.getpid()}.tmp") for t in targets)
    pairs = dict(zip(temporary, targets, strict=True))
    try:
        with output_errors(targets[0].parent, pairs):
            for target in targets:
                make_folder(target.parent)
                if target.is_dir():
                    raise OutputError(f"{target}: is a folder, a file was to be written; remove it")
                for path in target.parent.glob(f".{glob.escape(target.name)}.*.tmp"):
                    number = path.name.split(".")[-2]
                    if number.isdecimal() and not _runs(int(number)):
                        path.unlink(missing_ok=True)
            yield temporary
            for source, target in pairs.items():
                os.replace(source, target)
    finally:
        for source in temporary:
            with suppress(OSError):
                source.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except OSError as error:
        return not isinstance(error, ProcessLookupError)
    return True


def make_folder(folder: Path) -> None:
    """Make a folder with those above it.

    Raises:
        OutputError: A file is in the way.
    """
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


@contextmanager
def output_errors(out: Path, stand_ins: Mapping[Path, Path] | None = None) -> Iterator[None]:
    """Turn a system's refusal to write into one line about the place that was asked for.

    Args:
        stand_ins: What is written for the time being, to what it stands for.

    Raises:
        OutputError: In place of the refusal.
    """

    def meant(text: str) -> str:
        for written, asked in (stand_ins or {}).items():
            text = text.replace(str(written), str(asked))
        return re.sub(rf"/{re.escape(PREFIX)}[^/:\s]*", "", text)  # never a name of our own

    try:
        yield
    except OutputError as error:
        raise OutputError(meant(str(error))) from None
    except BrokenPipeError:  # of the terminal
        raise
    except OSError as error:
        place, reason = meant(str(error.filename or out)), error.strerror or str(error)
        raise OutputError(f"{place}: cannot be written ({reason}); choose another folder") from None
