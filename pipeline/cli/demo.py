"""Writes the demonstration logs that `make gap` reads: ``python -m pipeline.cli.demo``.

A hexapod of the blind trials' simulator walks with something hidden in it, and walks once more at
another speed, for the proof. The simulator shares no law with the workflow that is to find it, and
is not used when the demonstration runs.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.blind.twin.effects import Hidden
from pipeline.blind.twin.trial import make_trial
from reports.atomic import replacing

_FOLDER = Path(__file__).parents[1] / "identification" / "demo"
#: The log; its robot is `urdf/hexapod.toml`, its actuator the catalogue's alternative "rotor".
DEMO = _FOLDER / "walk.parquet"
#: The same machine at another speed, held out to prove.
SLOW = _FOLDER / "walk_slow.parquet"
SEED = 2018
RATE = 500.0  # [Hz]
#: What is hidden: dry friction in the right middle hip.
HIDDEN = Hidden("coulomb_friction", ("rm_joint_1",), {"torque": 2.0}, {"torque": "N*m"})


def write_demo(folder: Path = _FOLDER) -> tuple[Path, Path]:
    """Simulate and write both logs."""
    trial = make_trial(SEED, [HIDDEN], "walk", "low", logs=2, rate=RATE)
    paths = (folder / DEMO.name, folder / SLOW.name)
    with replacing(*paths) as temporary:
        for path, log in zip(temporary, ("log", "log_2"), strict=True):
            _write(trial.logs[log], path)
    return paths


def _write(log: dict[str, NDArray[np.float64]], path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns: dict[str, NDArray[np.float32] | NDArray[np.float64]] = {
        name: values if name == "time_s" else values.astype(np.float32)
        for name, values in log.items()
    }
    pq.write_table(
        pa.table(columns),
        path,
        compression="zstd",
        compression_level=19,
        use_dictionary=False,
        use_byte_stream_split=True,
    )


if __name__ == "__main__":
    print(*write_demo(), sep="\n")
