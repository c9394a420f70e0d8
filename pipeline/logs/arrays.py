"""Files of arrays as columns: MATLAB by SciPy and pymatreader, HDF5 by h5py, npz by NumPy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuators.errors import LegwattError, one_line
from pipeline.logs.formats import TIMES


def read_arrays(path: Path, kind: str) -> tuple[Any, tuple[str, ...]]:
    """Columns of a file of arrays as a pyarrow table, and a remark on what is none.

    A vector with a number per instant is a column; an array with one row, or one column, per
    instant gives a column for each of the others, called ``name[0]``, ``name[1]`` and so on.

    Args:
        path: The file.
        kind: ``"mat"``, ``"h5"`` or ``"npz"``.

    Raises:
        LegwattError: No arrays of one length.
    """
    import pyarrow as pa

    arrays = dict(_flat("", {"mat": _matlab, "h5": _hdf5, "npz": _numpy}[kind](path)))
    shapes = {name: f"{name} {array.shape}" for name, array in arrays.items() if array.ndim}
    numbers = {n: a for n, a in arrays.items() if a.dtype.kind in "fiubM" and a.ndim in (1, 2)}
    # The length of the time vector, else the one that most numbers share.
    sizes = Counter[int]()
    for name, array in numbers.items():
        is_time = array.ndim == 1 and name.rpartition("/")[2].lower() in TIMES
        sizes[max(array.shape)] += array.size + is_time * 10**12
    rows = sizes.most_common(1)[0][0] if sizes else 0
    columns: dict[str, NDArray[Any]] = {}
    for name, array in numbers.items():
        if rows in array.shape:
            block = array.reshape(rows, -1) if array.shape[0] == rows else array.T
            for k, column in enumerate(block.T):
                key = name if array.ndim == 1 else f"{name}[{k}]"
                columns[key] = np.ascontiguousarray(column)
            del shapes[name]
    left = ", ".join(shapes.values())
    if rows < 2 or not columns:
        raise LegwattError(
            f"{one_line(path.name)}: no arrays of one length that could be columns; it has "
            f"{left or 'none'}"
        )
    text = f"left out, not of {rows} rows or not of numbers: {left}"
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
            found[name] = item[()]

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


def _numpy(path: Path) -> Mapping[str, Any]:
    with np.load(path, allow_pickle=False) as file:  # nothing is ever unpickled
        return {name: file[name] for name in file.files}


def _flat(above: str, value: object) -> Iterator[tuple[str, NDArray[Any]]]:
    """Arrays of nested tables, each by its path."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _flat(f"{above}/{name}" if above else str(name), inner)
        return
    array = np.asarray(value)
    if array.dtype.names:  # rows of named fields
        yield from _flat(above, {name: array[name] for name in array.dtype.names})
    elif array.dtype != object:
        yield above, array.squeeze()
