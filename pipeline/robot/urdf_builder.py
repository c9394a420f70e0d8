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
from collections.abc import Sequence
from xml.sax.saxutils import escape

from pipeline.errors import RobotFileError
from pipeline.robot.robot_file import STATIONS, LegSpec, RobotSpec

FOOT_RADIUS = 0.012  # [m] visual only; the foot point is the sphere's centre
#: Osmium's: no link is denser [kg/m^3].
DENSEST = 22600.0
_COLOURS = {
    "trunk": "0.35 0.40 0.45 1",
    "drive": "0.20 0.20 0.22 1",
    "femur": "0.80 0.45 0.15 1",
    "tibia": "0.15 0.45 0.70 1",
    "foot": "0.10 0.10 0.10 1",
}
_ROBOT = """<?xml version="1.0"?>
<robot name="{name}">
  <!-- Built from {file} by `make urdf`; change that file, not this one. -->
{parts}</robot>
"""
_VISUAL = """    <visual>
{origin}      <geometry>
        {shape}
      </geometry>
      <material name="{material}">
        <color rgba="{colour}" />
      </material>
    </visual>
"""
_LINK = """  <link name="{name}">
    <inertial>
      <origin xyz="{com}" rpy="0 0 0" />
      <mass value="{mass}" />
      <inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}" />
    </inertial>
{visual}  </link>
"""
_JOINT = """  <joint name="{name}" type="revolute">
    <origin xyz="{origin}" rpy="0 0 0" />
    <parent link="{parent}" />
    <child link="{child}" />
    <axis xyz="{axis}" />
    <limit lower="{lower}" upper="{upper}" effort="{effort}" velocity="{velocity}" />
  </joint>
"""
_FOOT = """  <joint name="{leg}_foot_joint" type="fixed">
    <origin xyz="{origin}" rpy="0 0 0" />
    <parent link="{parent}" />
    <child link="{foot}" />
  </joint>
  <link name="{foot}">
{visual}  </link>
"""


def build_urdf(spec: RobotSpec) -> str:
    """The URDF as text, the same for the same robot file.

    `spec`: a robot file with ``build``.

    Raises:
        RobotFileError: The masses of the legs leave nothing for the trunk, or a link would be
            denser than any metal.
    """
    p = spec.parameters
    width = 2 * (p["joint_2_lateral"] - p["coxa_length"]) + p["link_width"]
    size, com = (p["body_length"], width, p["trunk_height"]), (0, p["trunk_com_left"], 0)
    trunk = _box(spec.base_link, trunk_mass(spec), size, (0, 0, 0), com, "trunk")
    parts = [trunk, *(part for leg in spec.legs for part in _leg(spec, leg))]
    return _ROBOT.format(name=_name(spec.name), file=spec.path.name, parts="".join(parts))


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


def _leg(spec: RobotSpec, leg: LegSpec) -> list[str]:
    """Hip, femur and tibia, each on its joint, and the foot."""
    p = spec.parameters
    out = 1.0 if leg.side == "left" else -1.0  # y of "outward"
    angle, width, coxa = p["joint_1_axis_angle"], p["link_width"], p["coxa_length"]
    femur, tibia, hip = p["femur_length"], p["tibia_length"], (0, out * p["coxa_length"] / 2, 0)
    # An axis is a pseudo-vector: mirrored in the x-z plane, its x and z components change sign.
    axis_1, raising = (0.0, -math.sin(angle), -out * math.cos(angle)), (out, 0.0, 0.0)
    shoulder = (STATIONS[leg.station] * p["hip_spacing"], out * (p["joint_2_lateral"] - coxa), 0.0)
    names = [spec.base_link, *(f"{leg.name}_{part}_link" for part in ("hip", "femur", "tibia"))]
    limits = [
        (-p["joint_1_range"], p["joint_1_range"]),
        (p["joint_2_lower"], p["joint_2_upper"]),
        (p["joint_3_lower"], p["joint_3_upper"]),
    ]
    origins = (shoulder, (0, out * coxa, 0), (0, out * femur, 0))
    boxes = [
        _box(names[1], p["hip_link_mass"], (width, coxa + width, width), hip, hip, "drive"),
        _box(
            *(names[2], p["femur_mass"], (width, femur, width)),
            *((0, out * femur / 2, 0), (0, out * femur * p["femur_com"], 0), "femur"),
        ),
        _box(
            *(names[3], p["tibia_mass"], (width / 2, width / 2, tibia)),
            *((0, 0, -tibia / 2), (0, 0, -tibia * p["tibia_com"]), "tibia"),
        ),
    ]
    parts = []
    for k, axis in enumerate((axis_1, raising, raising)):
        joint = _JOINT.format(
            name=_name(leg.joints[k]),
            origin=_numbers(origins[k]),
            parent=_name(names[k]),
            child=_name(names[k + 1]),
            axis=_numbers(axis),
            lower=_number(limits[k][0]),
            upper=_number(limits[k][1]),
            effort=_number(p["joint_effort_limit"]),
            velocity=_number(p["joint_velocity_limit"]),
        )
        parts += [joint, boxes[k]]
    foot = _FOOT.format(
        leg=_name(leg.name),
        origin=_numbers((0, 0, -tibia)),
        parent=_name(names[3]),
        foot=_name(leg.foot),
        visual=_visual(f'<sphere radius="{_number(FOOT_RADIUS)}" />', "foot"),
    )
    return [*parts, foot]


def _box(
    name: str,
    mass: float,
    size: Sequence[float],
    centre: Sequence[float],
    com: Sequence[float],
    material: str,
) -> str:
    """A link that is a solid cuboid; its rotational inertia is the solid's about the com.

    `mass`: [kg]. `size`: edge lengths along the link's axes [m]. `centre`: of the solid in the
    link's frame [m]. `com`: centre of mass in the link's frame [m].
    """
    volume = math.prod(size)
    if mass > DENSEST * volume:
        raise RobotFileError(
            f"link '{name}' has {mass:.4g} kg in {1e3 * volume:.3g} litres, denser than any "
            "metal; masses in kg, lengths in the unit stated?"
        )
    (x, y, z), m = size, mass / 12
    return _LINK.format(
        name=_name(name),
        com=_numbers(com),
        mass=_number(mass),
        ixx=_number(m * (y * y + z * z)),
        iyy=_number(m * (x * x + z * z)),
        izz=_number(m * (x * x + y * y)),
        visual=_visual(
            f'<box size="{_numbers(size)}" />',
            material,
            f'      <origin xyz="{_numbers(centre)}" rpy="0 0 0" />\n',
        ),
    )


def _visual(shape: str, material: str, origin: str = "") -> str:
    return _VISUAL.format(origin=origin, shape=shape, material=material, colour=_COLOURS[material])


def _name(text: str) -> str:
    return escape(text, {'"': "&quot;"})


def _number(value: float) -> str:
    text = f"{value:.12g}"
    return "0" if text == "-0" else text


def _numbers(values: Sequence[float]) -> str:
    return " ".join(map(_number, values))
