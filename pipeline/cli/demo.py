"""Where the demonstration logs lie that `make gap` reads, and what is hidden in them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

_FOLDER: Final = Path(__file__).parents[1] / "identification" / "demo"
#: The log; its robot is `urdf/hexapod.toml`, its actuator the catalogue's alternative "rotor".
DEMO: Final = _FOLDER / "walk.parquet"
#: The same machine at another speed, held out for the test.
SLOW: Final = _FOLDER / "walk_slow.parquet"


@dataclass(frozen=True)
class Hidden:
    """What the demonstration's machine has and its model has not.

    Attributes:
        effect: Name.
        place: Joints.
        parameters: Values, SI.
    """

    effect: str
    place: tuple[str, ...]
    parameters: dict[str, float]


#: Dry friction in the right middle hip.
HIDDEN: Final = Hidden("coulomb_friction", ("rm_joint_1",), {"torque": 2.0})
