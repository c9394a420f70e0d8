"""Files of arrays as columns: MATLAB by SciPy and pymatreader, HDF5 by h5py, npz by NumPy.

Nothing is ever unpickled.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from actuators.errors import LegwattError, one_line

#: Names of a time vector; with it the number of rows is known.
TIMES: Final = ("time_s", "time", "t", "timestamp", "timestamps", "stamp", "times", "__time")


def read_arrays(path: Path, kind: str) -> tuple[Any, tuple[str, ...]]:
    """Columns of a file of arrays as a pyarrow table, and a remark on what is none.

    An array with one row, or one column, per instant gives a column for each of the others, called
    ``name[0]``, ``name[1]`` and so on, or by the names of a list of texts of that length.

    Args:
        path: The file.
        kind: ``"mat"``, ``"h5"`` or ``"npz"``.

    Raises:
        LegwattError: No arrays of one length.
    """
    import pyarrow as pa

    arrays = dict(_flat("", {"mat": _matlab, "h5": _hdf5, "npz": _numpy}[kind](path)))
    rows = _rows(arrays)
    texts = [a.tolist() for a in arrays.values() if a.dtype.kind in "UTO" and a.ndim == 1]
    columns: dict[str, NDArray[Any]] = {}
    left = []
    for name, array in arrays.items():
        if array.ndim == 0 or array.dtype.kind in "UTO":
            continue
        if not _numeric(array) or rows not in array.shape:
            left.append(f"{name} {array.shape}")
            continue
        block = array.reshape(rows, -1) if array.shape[0] == rows else array.T
        named = [names for names in texts if len(names) == block.shape[1]]
        inner = named[0] if len(named) == 1 else range(block.shape[1])
        for which, column in zip(inner, block.T, strict=True):
            key = name if array.ndim == 1 else f"{name}[{which}]"
            columns[key] = np.ascontiguousarray(column)
    if rows < 2 or not columns:
        seen = ", ".join(f"{name} {a.shape}" for name, a in arrays.items())
        raise LegwattError(
            f"{one_line(path.name)}: no arrays of one length that could be columns; it has "
            f"{seen or 'none'}"
        )
    text = f"left out, not of {rows} rows or not of numbers: {', '.join(left)}"
    return pa.table(columns), (text,) if left else ()


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


def _flat(above: str, value: object) -> Iterator[tuple[str, NDArray[Any]]]:
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


def _numeric(array: NDArray[Any]) -> bool:
    return array.dtype.kind in "fiubM" and array.ndim in (1, 2)


def _rows(arrays: Mapping[str, NDArray[Any]]) -> int:
    """Length of the time vector, else the length that most numbers share."""
    for path, array in sorted(arrays.items(), key=lambda item: len(item[0])):
        last = path.rpartition("/")[2].lower()
        if last in TIMES and array.ndim == 1 and array.size > 1 and _numeric(array):
            return array.size
    seen = Counter[int]()
    for array in arrays.values():
        if _numeric(array):
            seen[max(array.shape)] += array.size
    return seen.most_common(1)[0][0] if seen else 0
