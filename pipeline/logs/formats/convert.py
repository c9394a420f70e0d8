"""A foreign file becomes CSV or Parquet, once per process; the readers of these know no others."""

from __future__ import annotations

import gzip
import hashlib
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any, Final

from actuators.errors import one_line
from pipeline.logs.errors import LogFormatError
from pipeline.logs.formats.arrays import read_arrays
from pipeline.logs.formats.bags import SUFFIXES, read_bag
from pipeline.logs.formats.spool import Spool

Done = Callable[[float], None]
#: What files begin with, and the ending by which the libraries know them.
_BEGINNINGS: Final = {
    b"\x89MCAP0\r\n": ".mcap",
    b"SQLite format 3\x00": ".db3",
    b"#ROSBAG V2.0": ".bag",
    b"MATLAB 5.0 MAT": ".mat",
    b"MATLAB 7.3 MAT": ".mat",
    b"\x89HDF\r\n\x1a\n": ".h5",
    b"PK\x03\x04": ".npz",
    b"\x1f\x8b": ".gz",
    b"\x28\xb5\x2f\xfd": ".zst",
}
_MADE: Final[dict[tuple[object, ...], Plain]] = {}


@dataclass(frozen=True)
class Plain:
    """A table in a file that the readers know."""

    path: Path  #: CSV or Parquet.
    remarks: tuple[str, ...] = ()  #: What a reader should know of the file that it comes from.


def is_log(path: Path) -> bool:
    """Whether this may be a log: a file, or a folder of a bag's files."""
    return path.exists() and bool(_files(path))


def _files(path: Path) -> list[Path]:
    """The files of a log, in order; none for a folder that holds no bag."""
    if not path.is_dir():
        return [path]
    return sorted(p for p in path.iterdir() if {*p.suffixes} & {*SUFFIXES})


def sha256(path: Path) -> str:
    """SHA-256 in hexadecimal of a file's bytes, or of those of a bag's files in order."""
    whole = hashlib.sha256()
    for file in _files(path):
        with file.open("rb") as stream:
            while block := stream.read(1 << 22):
                whole.update(block)
    return whole.hexdigest()


def plain(path: Path, done: Done = lambda share: None) -> Plain:
    """The CSV or Parquet file of a log; the log itself where it is one.

    Args:
        path: File, or folder of a bag's files.
        done: Told the share that is converted, from 0 to 1.

    Raises:
        OSError: It cannot be read.
        LogFormatError: It is of a known kind and damaged, or holds no table; one line.
    """
    files = _files(path)
    if not files:
        raise LogFormatError(
            f"{one_line(path)}: a folder without files of a bag ({', '.join(SUFFIXES)})"
        )
    ending = ".bag" if path.is_dir() else _ending(path)
    if not ending:
        return Plain(path)
    facts = [(file.stat().st_size, file.stat().st_mtime_ns) for file in files]
    key = (path.resolve(), *facts)
    if key not in _MADE:
        _MADE[key] = _converted(path, ending, Path(mkdtemp(dir=_folder().name)), done)
    return _MADE[key]


@cache
def _folder() -> TemporaryDirectory[str]:
    """Where converted files stay until the process ends."""
    return TemporaryDirectory(prefix="legwatt-")


def _ending(path: Path) -> str:
    """By its content, the ending that a foreign file should have; empty for CSV and Parquet."""
    with path.open("rb") as stream:
        head = stream.read(16)
    known = (end for start, end in _BEGINNINGS.items() if head.startswith(start))
    return next(known, ".mat" if path.suffix == ".mat" else "")  # MATLAB 4 begins with no mark


def _converted(path: Path, ending: str, target: Path, done: Done) -> Plain:
    if ending in (".gz", ".zst"):
        inner = target / (path.stem if path.suffix == ending else path.name)
        _unpack(path, ending, inner)
        return plain(inner, done)
    out = target / "table.parquet"
    if ending in (".mat", ".h5", ".npz"):
        return Plain(out, tuple(read_arrays(path, ending, out)))
    if path.is_file() and path.suffix != ending:  # rosbags goes by endings
        link = target / f"{path.name}{ending}"
        link.symlink_to(path.resolve())
        path = link
    with Spool(target) as spool:
        read_bag(path, spool, done)
        return Plain(out, tuple(spool.write(out)))


def _unpack(path: Path, ending: str, target: Path) -> None:
    try:
        unpacker: Any = gzip
        if ending == ".zst":
            from backports import zstd as unpacker
        with unpacker.open(path) as packed, target.open("wb") as out:
            shutil.copyfileobj(packed, out)
    except ImportError:
        raise LogFormatError(
            f"{one_line(path.name)}: is compressed by zstd; unpack it, or install the extra 'bags'"
        ) from None
    except (OSError, EOFError, ValueError) as error:
        raise LogFormatError(
            f"{one_line(path.name)}: its compressed content is damaged ({one_line(error)})"
        ) from None
