"""A run's files appear in their folder together, at the end, or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from reports.atomic import replacing


@contextmanager
def staged(out: Path, last: tuple[str, ...] = ()) -> Iterator[Path]:
    """Hand out a temporary folder; when the block succeeds its files move to `out`.

    Each file is replaced in one step. Whatever stops the block leaves `out` as it was.

    Args:
        out: Made when it is missing.
        last: Names of files that move after all others: who sees them sees everything.

    Raises:
        OutputError: `out` cannot be written.
    """
    with tempfile.TemporaryDirectory(prefix="legwatt-") as name:
        folder = Path(name)
        yield folder
        files = [path for path in sorted(folder.rglob("*")) if path.is_file()]
        files.sort(key=lambda path: last.index(path.name) if path.name in last else -1)
        for path in files:
            with replacing(out / path.relative_to(folder)) as (temporary,):
                shutil.copyfile(path, temporary)
