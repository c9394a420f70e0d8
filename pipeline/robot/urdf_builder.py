"""The URDFs of the hexapod and of its leg on a stand, from the numbers of their robot files.

Zero pose: every leg plane is vertical and square to the body's x axis, the femur horizontal
pointing outward, the tibia hanging straight down. Positive directions: joint 1 moves the foot
forward, joints 2 and 3 raise what lies outboard of them. Left legs mirror right legs, so equal
coordinates are mirrored poses. Joint 1's axis lies in the frontal plane, `joint_1_axis_angle` from
the vertical towards the outside: 0 is an insect-like yaw axis, 90 degrees a lateral axis about
which the leg plane swings fore and aft. Links are solid cuboids (`hexapod.urdf.jinja`).

`python -m pipeline.robot.urdf_builder [FILE...]` (`make urdf`) writes those of robot files with
``build``, of all in urdf/ by default.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from actuators.errors import LegwattError
from pipeline.atomic import write_text
from pipeline.robot.robot_file import STATIONS, RobotSpec, load_robot_file


def build_urdf(spec: RobotSpec) -> str:
    """The URDF of a robot file with ``build``, as text, the same for the same file.

    Raises:
        LegwattError: The masses of the legs leave nothing for the trunk.
    """
    p = spec.parameters
    # The legs leave the rest of the total mass; the stand counts as one sixth of a robot.
    leg = p["hip_link_mass"] + p["femur_mass"] + p["tibia_mass"]
    mass = p["total_mass"] - len(spec.legs) * leg
    if mass <= 0:
        raise LegwattError(
            f"{spec.path}: {len(spec.legs)} legs of {leg:.3g} kg leave "
            f"{mass:.3g} kg for the trunk; lower the link masses or raise total_mass"
        )
    functions = {"sin": math.sin, "cos": math.cos, "stations": STATIONS}
    text = _template().render(spec=spec, p=dict(p), trunk_mass=mass, **functions)
    return str(text) + "\n"


@cache
def _template() -> Any:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    folder = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=folder, undefined=StrictUndefined, autoescape=True)
    environment.filters["written"] = _written
    return environment.get_template("hexapod.urdf.jinja")


def _written(value: float | Sequence[float]) -> str:
    """A number, or several, with twelve digits and never "-0"."""
    if isinstance(value, Sequence):
        return " ".join(map(_written, value))
    return f"{value + 0.0:.12g}"


def main(arguments: Sequence[str]) -> int:
    """Write the URDF of every robot file that says how; the exit code."""
    try:
        for path in map(Path, arguments or sorted(map(str, Path("urdf").glob("*.toml")))):
            spec = load_robot_file(path)
            if spec.robot.build:
                write_text(spec.urdf, build_urdf(spec))
                print(f"{spec.urdf}: built from {path}")
    except LegwattError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
