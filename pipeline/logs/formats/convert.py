"""A foreign file becomes CSV or Parquet, once per process; the readers of these know no others.

Arrays of MATLAB, HDF5 and NumPy files become columns here; nothing is ever unpickled.
"""

from __future__ import annotations

import gzip
import hashlib
import shutil
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuators.errors import LegwattError, one_line
from pipeline.logs.formats.bags import NEEDS, SUFFIXES, read_bag
from pipeline.logs.formats.spool import Spool

Array = NDArray[Any]
#: Names of a time vector; with it the number of rows is known.
TIMES: Final = ("time_s", "time", "t", "timestamp", "timestamps", "stamp", "times", "__time")
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


def plain(path: Path) -> Plain:
    """The CSV or Parquet file of a log; the log itself where it is one.

    Args:
        path: File, or folder of a bag's files.

    Raises:
        OSError: It cannot be read.
        LegwattError: It is of a known kind and damaged, or holds no table; one line.
    """
    files = _files(path)
    if not files:
        raise LegwattError(
            f"{one_line(path)}: a folder without files of a bag ({', '.join(SUFFIXES)})"
        )
    ending = ".bag" if path.is_dir() else _ending(path)
    if not ending:
        return Plain(path)
    facts = [(file.stat().st_size, file.stat().st_mtime_ns) for file in files]
    key = (path.resolve(), *facts)
    if key not in _MADE:
        _MADE[key] = _converted(path, ending, Path(mkdtemp(dir=_folder().name)))
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


def _converted(path: Path, ending: str, target: Path) -> Plain:
    if ending in (".gz", ".zst"):
        inner = target / (path.stem if path.suffix == ending else path.name)
        _unpack(path, ending, inner)
        return plain(inner)
    out = target / "table.parquet"
    if ending in (".mat", ".h5", ".npz"):
        return Plain(out, tuple(read_arrays(path, ending, out)))
    if path.is_file() and path.suffix != ending:  # rosbags goes by endings
        link = target / f"{path.name}{ending}"
        link.symlink_to(path.resolve())
        path = link
    with Spool(target) as spool:
        read_bag(path, spool)
        return Plain(out, tuple(spool.write(out)))


def _unpack(path: Path, ending: str, target: Path) -> None:
    try:
        unpacker: Any = gzip
        if ending == ".zst":
            from backports import zstd as unpacker
        with unpacker.open(path) as packed, target.open("wb") as out:
            shutil.copyfileobj(packed, out)
    except ImportError:
        raise LegwattError(
            f"{one_line(path.name)}: is compressed by zstd; unpack it, or install the extra 'bags'"
        ) from None
    except (OSError, EOFError, ValueError) as error:
        raise LegwattError(
            f"{one_line(path.name)}: its compressed content is damaged ({one_line(error)})"
        ) from None


def read_arrays(path: Path, kind: str, out: Path) -> list[str]:
    """Write the columns of a file of arrays (``".mat"``, ``".h5"`` or ``".npz"``) as Parquet.

    An array with one row, or one column, per instant gives a column for each of the others, called
    ``name[0]``, ``name[1]`` and so on, or by the names of a list of texts of that length.

    Returns:
        What a reader should know of it.

    Raises:
        LegwattError: The extra is missing, the file is damaged or holds no columns; one line.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    where = one_line(path.name)
    try:
        arrays = dict(_flat("", _LOADERS[kind](path)))
    except ImportError:
        raise LegwattError(f"{where}: {NEEDS}") from None
    except Exception as error:  # the libraries raise whatever bytes make them
        reason = one_line(error) or type(error).__name__
        raise LegwattError(f"{where}: its arrays cannot be read: {reason}") from None
    rows = _rows(arrays)
    texts = [a.tolist() for a in arrays.values() if a.dtype.kind in "UTO" and a.ndim == 1]
    columns: dict[str, Array] = {}
    left = []
    for name, array in arrays.items():
        if array.ndim == 0 or array.dtype.kind in "UTO":
            continue
        if not _numeric(array) or rows not in array.shape:
            left.append(f"{name} {array.shape}")
        elif array.ndim == 1:
            columns[name] = array
        else:
            block = array if array.shape[0] == rows else array.T
            named = [names for names in texts if len(names) == block.shape[1]]
            inner = named[0] if len(named) == 1 else range(block.shape[1])
            for which, column in zip(inner, block.T, strict=True):
                columns[f"{name}[{which}]"] = np.ascontiguousarray(column)
    if rows < 2 or not columns:
        seen = ", ".join(f"{name} {a.shape}" for name, a in arrays.items())
        raise LegwattError(
            f"{where}: no arrays of one length that could be columns; it has {seen or 'none'}"
        )
    pq.write_table(pa.table(columns), out)
    return [f"left out, not of {rows} rows or not of numbers: {', '.join(left)}"] if left else []


def _matlab(path: Path) -> Mapping[str, Any]:
    from scipy.io import loadmat

    try:
        found = loadmat(path, simplify_cells=True)
    except NotImplementedError:  # 7.3, which is HDF5
        from pymatreader import read_mat

        found = read_mat(path)
    return {name: value for name, value in found.items() if not name.startswith("__")}


def _hdf5(path: Path) -> Mapping[str, Any]:
    import h5py

    found: dict[str, Any] = {}

    def take(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = item.asstr()[()] if h5py.check_string_dtype(item.dtype) else item[()]

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


def _numpy(path: Path) -> Mapping[str, Any]:
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


_LOADERS: Final = {".mat": _matlab, ".h5": _hdf5, ".npz": _numpy}


def _flat(above: str, value: object) -> Iterator[tuple[str, Array]]:
    """Arrays of nested tables, each by its path."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _flat(f"{above}/{name}" if above else str(name), inner)
        return
    array = np.asarray(value)
    if array.dtype.names:  # rows of named fields
        for name in array.dtype.names:
            yield f"{above}/{name}" if above else name, array[name].squeeze()
    elif array.dtype != object or all(isinstance(x, str) for x in array.flat):
        yield above, array.squeeze()


def _numeric(array: Array) -> bool:
    return array.dtype.kind in "fiubM" and array.ndim in (1, 2)


def _rows(arrays: Mapping[str, Array]) -> int:
    """Length of the time vector, else the length that most numbers share."""
    for name in TIMES:
        for path, array in arrays.items():
            last = path.rpartition("/")[2].lower()
            if last == name and array.ndim == 1 and array.size > 1 and _numeric(array):
                return array.size
    seen = Counter[int]()
    for array in arrays.values():
        if _numeric(array):
            seen[max(array.shape)] += array.size
    return seen.most_common(1)[0][0] if seen else 0
