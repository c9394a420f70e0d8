"""Writes the demonstration log that `make gap` reads: ``python -m pipeline.app.demo``.

A hexapod of the blind trials' simulator walks with something hidden in it. The simulator shares no
law with the workflow that is to find it, and is not used when the demonstration runs.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.gap.twin.effects import Hidden
from pipeline.gap.twin.trial import make_trial
from reports.atomic import replacing

#: The log; its robot is `urdf/hexapod.toml`, its actuator the catalogue's alternative "rotor".
DEMO = Path(__file__).parents[1] / "gap" / "demo" / "walk.parquet"
SEED = 2018
RATE = 500.0  # [Hz]
#: What is hidden: dry friction in the right middle hip.
HIDDEN = Hidden("coulomb_friction", ("rm_joint_1",), {"torque": 2.0}, {"torque": "N*m"})


def write_demo(path: Path = DEMO) -> Path:
    """Simulate and write the log."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    trial = make_trial(SEED, [HIDDEN], "walk", "low", rate=RATE)
    columns: dict[str, NDArray[np.float32] | NDArray[np.float64]] = {
        name: values if name == "time_s" else values.astype(np.float32)
        for name, values in trial.logs["log"].items()
    }
    with replacing(path) as (temporary,):
        pq.write_table(
            pa.table(columns),
            temporary,
            compression="zstd",
            compression_level=19,
            use_dictionary=False,
            use_byte_stream_split=True,
        )
    return path


if __name__ == "__main__":
    print(write_demo())
