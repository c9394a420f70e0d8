"""Builds the URDF of the hexapod and of its single leg on a stand from the robot file.

Zero pose: every leg plane is vertical and square to the body's x axis, the femur horizontal
pointing outward, the tibia hanging straight down. Positive directions: joint 1 moves the foot
forward, joints 2 and 3 raise what lies outboard of them. Left legs mirror right legs, so equal
coordinates are mirrored poses. Joint 1's axis lies in the frontal plane, `joint_1_axis_angle` from
the vertical towards the outside: 0 is an insect-like yaw axis, 90 degrees a lateral axis about
which the leg plane swings fore and aft.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, FileSystemLoader, Template

from pipeline.errors import RobotFileError
from pipeline.robot.robot_file import STATIONS, LegSpec, RobotSpec

FOOT_RADIUS = 0.012  # [m] visual only; the foot point is the sphere's centre
#: Osmium's: no link is denser [kg/m^3].
DENSEST = 22600.0
_COLOURS: Final = {
    "trunk": "0.35 0.40 0.45 1",
    "drive": "0.20 0.20 0.22 1",
    "femur": "0.80 0.45 0.15 1",
    "tibia": "0.15 0.45 0.70 1",
    "foot": "0.10 0.10 0.10 1",
}
Point = tuple[float, float, float]


@cache
def _template() -> Template:
    folder = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=folder, trim_blocks=True, keep_trailing_newline=True)
    environment.filters |= {"number": _number, "numbers": _numbers}
    return environment.get_template("robot.urdf.jinja")


def build_urdf(spec: RobotSpec) -> str:
    """The URDF of a robot file with ``build``, as text, the same for the same file.

    Raises:
        RobotFileError: The masses of the legs leave nothing for the trunk, or a link would be
            denser than any metal.
    """
    p = spec.parameters
    width = 2 * (p["joint_2_lateral"] - p["coxa_length"]) + p["link_width"]
    size, com = (p["body_length"], width, p["trunk_height"]), (0.0, p["trunk_com_left"], 0.0)
    return _template().render(
        name=spec.name,
        file=spec.path.name,
        colours=_COLOURS,
        foot_radius=FOOT_RADIUS,
        effort=p["joint_effort_limit"],
        velocity=p["joint_velocity_limit"],
        trunk=_box(spec.base_link, "trunk", trunk_mass(spec), size, (0.0, 0.0, 0.0), com),
        legs=[
            {
                "name": leg.name,
                "foot": leg.foot,
                "foot_place": (0.0, 0.0, -p["tibia_length"]),
                "joints": list(_joints(spec, leg)),
            }
            for leg in spec.legs
        ],
    )


def leg_mass(spec: RobotSpec) -> float:
    """Mass of one leg [kg]."""
    p = spec.parameters
    return p["hip_link_mass"] + p["femur_mass"] + p["tibia_mass"]


def trunk_mass(spec: RobotSpec) -> float:
    """What the legs leave of the stated total mass [kg]; the stand counts as one sixth of a robot.

    Raises:
        RobotFileError: Nothing is left.
    """
    mass = spec.parameters["total_mass"] - len(spec.legs) * leg_mass(spec)
    if mass <= 0:
        raise RobotFileError(
            f"{spec.path}: {len(spec.legs)} legs of {leg_mass(spec):.3g} kg leave "
            f"{mass:.3g} kg for the trunk; lower the link masses or raise total_mass"
        )
    return mass


def _joints(spec: RobotSpec, leg: LegSpec) -> Iterator[dict[str, Any]]:
    """The joints of hip, femur and tibia, each with the link that it carries."""
    p = spec.parameters
    out = 1.0 if leg.side == "left" else -1.0  # y of "outward"
    angle, width, coxa = p["joint_1_axis_angle"], p["link_width"], p["coxa_length"]
    femur, tibia = p["femur_length"], p["tibia_length"]
    # An axis is a pseudo-vector: mirrored in the x-z plane, its x and z components change sign.
    axis_1, raising = (0.0, -math.sin(angle), -out * math.cos(angle)), (out, 0.0, 0.0)
    shoulder = (STATIONS[leg.station] * p["hip_spacing"], out * (p["joint_2_lateral"] - coxa), 0.0)
    hip, knee = (0.0, out * coxa, 0.0), (0.0, out * femur, 0.0)
    thick = (width, coxa + width, width), (width, femur, width), (width / 2, width / 2, tibia)
    centres = (0.0, out * coxa / 2, 0.0), (0.0, out * femur / 2, 0.0), (0.0, 0.0, -tibia / 2)
    coms = (
        centres[0],
        (0.0, out * femur * p["femur_com"], 0.0),
        (0.0, 0.0, -tibia * p["tibia_com"]),
    )
    masses = p["hip_link_mass"], p["femur_mass"], p["tibia_mass"]
    limits = (
        (-p["joint_1_range"], p["joint_1_range"]),
        (p["joint_2_lower"], p["joint_2_upper"]),
        (p["joint_3_lower"], p["joint_3_upper"]),
    )
    parent = spec.base_link
    for k, (link, part) in enumerate((("hip", "drive"), ("femur", "femur"), ("tibia", "tibia"))):
        child = _box(f"{leg.name}_{link}_link", part, masses[k], thick[k], centres[k], coms[k])
        yield {
            "name": leg.joints[k],
            "origin": (shoulder, hip, knee)[k],
            "parent": parent,
            "child": child,
            "axis": (axis_1, raising, raising)[k],
            "limits": limits[k],
        }
        parent = child["name"]


def _box(
    name: str, part: str, mass: float, size: Point, centre: Point, com: Point
) -> dict[str, Any]:
    """A link of some kg that is a solid cuboid, lengths in its frame [m].

    Its rotational inertia is the solid's about the centre of mass `com`.
    """
    volume = math.prod(size)
    if mass > DENSEST * volume:
        raise RobotFileError(
            f"link '{name}' has {mass:.4g} kg in {1e3 * volume:.3g} litres, denser than any "
            "metal; masses in kg, lengths in the unit stated?"
        )
    (x, y, z), m = size, mass / 12
    moments = (m * (y * y + z * z), m * (x * x + z * z), m * (x * x + y * y))
    return {
        "name": name,
        "part": part,
        "mass": mass,
        "size": size,
        "centre": centre,
        "com": com,
        "moments": moments,
    }


def _number(value: float) -> str:
    text = f"{value:.12g}"
    return "0" if text == "-0" else text


def _numbers(values: Sequence[float]) -> str:
    return " ".join(map(_number, values))
