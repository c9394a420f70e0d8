"""A long Parquet log streams within two gigabytes, however long it is."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

JOINTS = 18
GROUP = 250_000
CHILD = """
import resource, sys
from pathlib import Path
import numpy as np
from pipeline.logs.log_format import Expected
from tests.pipeline.logs.made import stream_prepared
wide = np.full(18, np.inf)
expected = Expected("long", tuple(f"j{k}" for k in range(18)), -wide, wide, wide, wide)
rows = sum(p.core.stop - p.core.start for _, p in stream_prepared(Path(sys.argv[1]), expected))
print(rows, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def write_log(path: Path, groups: int) -> None:
    """`groups` row groups of 18 joints at 500 Hz; rounded, so that the file stays small."""
    rng = np.random.default_rng(0)
    names = ["time_s"]
    names += [f"j{k}__{q}" for k in range(JOINTS) for q in ("position_rad", "current_A")]
    schema = pa.schema([(name, pa.float64()) for name in names])
    with pq.ParquetWriter(path, schema, compression="zstd", compression_level=1) as writer:
        for g in range(groups):
            t = (g * GROUP + np.arange(GROUP)) / 500.0
            columns = [t]
            for k in range(JOINTS):
                phase = 2 * np.pi * (0.3 + 0.01 * k) * t
                columns.append(np.round(np.sin(phase) / 1e-4 + rng.normal(0, 1, GROUP)) * 1e-4)
                columns.append(np.round(np.cos(phase) + rng.normal(0, 0.05, GROUP), 2))
            writer.write_table(pa.table(columns, schema=schema), row_group_size=GROUP)


@pytest.mark.slow
@pytest.mark.parametrize("groups", [4, 40])
def test_memory_does_not_grow_with_the_log(root: Path, tmp_path: Path, groups: int) -> None:
    path = tmp_path / "long.parquet"
    write_log(path, groups)
    run = subprocess.run(
        [sys.executable, "-c", CHILD, str(path)], cwd=root, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    rows, kilobytes = (int(word) for word in run.stdout.split())
    assert rows == groups * GROUP
    assert kilobytes < 2_000_000
