"""Where the demonstration log lies that `make gap` reads, and what is hidden in it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

#: The log; its robot is `urdf/hexapod.toml`, its actuator the catalogue's alternative "rotor".
DEMO = Path(__file__).parents[1] / "pipeline" / "identification" / "demo" / "walk.parquet"
#: Dry friction in the right middle hip, SI.
HIDDEN = SimpleNamespace(
    effect="coulomb_friction", place=("rm_joint_1",), parameters={"torque": 2.0}
)
