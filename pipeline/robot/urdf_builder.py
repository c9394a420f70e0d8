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
import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RobotFileError
from pipeline.robot.robot_file import STATIONS, LegSpec, RobotSpec

Array = NDArray[np.float64]
FOOT_RADIUS = 0.012  # [m] visual only; the foot point is the sphere's centre
#: Osmium's: no link is denser [kg/m^3].
DENSEST = 22600.0


@dataclass(frozen=True)
class Box:
    """A solid cuboid that carries a link's mass and shows it.

    Attributes:
        mass: [kg].
        size: Edge lengths along the link's axes [m].
        centre: Of the solid in the link's frame [m].
        com: Centre of mass in the link's frame [m]; the rotational inertia is the solid's.
    """

    mass: float
    size: tuple[float, float, float]
    centre: tuple[float, float, float]
    com: tuple[float, float, float]

    @property
    def inertia(self) -> tuple[float, float, float]:
        """Principal moments of the uniform solid [kg*m^2]."""
        x, y, z = self.size
        m = self.mass / 12
        return m * (y * y + z * z), m * (x * x + z * z), m * (x * x + y * y)


def build_urdf(spec: RobotSpec) -> str:
    """The URDF as text, the same for the same robot file.

    Args:
        spec: A robot file with ``build``.

    Raises:
        RobotFileError: The masses of the legs leave nothing for the trunk, or a link would be
            denser than any metal.
    """
    root = ET.Element("robot", name=spec.name)
    root.append(
        ET.Comment(f" Built from {spec.path.name} by `make urdf`; change that file, not this one. ")
    )
    _link(root, spec.base_link, _trunk(spec), "trunk")
    for leg in spec.legs:
        _leg(root, spec, leg)
    ET.indent(root, "  ")
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


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


def _trunk(spec: RobotSpec) -> Box:
    p = spec.parameters
    width = 2 * (p["joint_2_lateral"] - p["coxa_length"]) + p["link_width"]
    size = (p["body_length"], width, p["trunk_height"])
    return Box(trunk_mass(spec), size, (0, 0, 0), (0, p["trunk_com_left"], 0))


def _leg(root: ET.Element, spec: RobotSpec, leg: LegSpec) -> None:
    p = spec.parameters
    out = 1.0 if leg.side == "left" else -1.0  # y of "outward"
    angle = p["joint_1_axis_angle"]
    # An axis is a pseudo-vector: mirrored in the x-z plane, its x and z components change sign.
    axis_1 = (0.0, -math.sin(angle), -out * math.cos(angle))
    axis_raise = (out, 0.0, 0.0)
    width, coxa = p["link_width"], p["coxa_length"]
    femur, tibia = p["femur_length"], p["tibia_length"]
    links = [*(f"{leg.name}_{part}_link" for part in ("hip", "femur", "tibia")), leg.foot]
    _joint(
        root,
        leg.joints[0],
        (spec.base_link, links[0]),
        (STATIONS[leg.station] * p["hip_spacing"], out * (p["joint_2_lateral"] - coxa), 0.0),
        axis_1,
        (-p["joint_1_range"], p["joint_1_range"]),
        spec,
    )
    _link(
        root,
        links[0],
        Box(
            p["hip_link_mass"],
            (width, coxa + width, width),
            (0, out * coxa / 2, 0),
            (0, out * coxa / 2, 0),
        ),
        "drive",
    )
    _joint(
        root,
        leg.joints[1],
        (links[0], links[1]),
        (0, out * coxa, 0),
        axis_raise,
        (p["joint_2_lower"], p["joint_2_upper"]),
        spec,
    )
    _link(
        root,
        links[1],
        Box(
            p["femur_mass"],
            (width, femur, width),
            (0, out * femur / 2, 0),
            (0, out * femur * p["femur_com"], 0),
        ),
        "femur",
    )
    _joint(
        root,
        leg.joints[2],
        (links[1], links[2]),
        (0, out * femur, 0),
        axis_raise,
        (p["joint_3_lower"], p["joint_3_upper"]),
        spec,
    )
    _link(
        root,
        links[2],
        Box(
            p["tibia_mass"],
            (width / 2, width / 2, tibia),
            (0, 0, -tibia / 2),
            (0, 0, -tibia * p["tibia_com"]),
        ),
        "tibia",
    )
    _foot(root, leg, links, tibia)


def _foot(root: ET.Element, leg: LegSpec, links: list[str], tibia: float) -> None:
    fixed = ET.SubElement(root, "joint", name=f"{leg.name}_foot_joint", type="fixed")
    ET.SubElement(fixed, "origin", xyz=_numbers((0, 0, -tibia)), rpy="0 0 0")
    ET.SubElement(fixed, "parent", link=links[2])
    ET.SubElement(fixed, "child", link=links[3])
    foot = ET.SubElement(root, "link", name=links[3])
    visual = ET.SubElement(foot, "visual")
    geometry = ET.SubElement(visual, "geometry")
    ET.SubElement(geometry, "sphere", radius=_number(FOOT_RADIUS))
    _material(visual, "foot")


def _joint(
    root: ET.Element,
    name: str,
    links: tuple[str, str],
    origin: tuple[float, float, float],
    axis: tuple[float, float, float],
    limits: tuple[float, float],
    spec: RobotSpec,
) -> None:
    p = spec.parameters
    joint = ET.SubElement(root, "joint", name=name, type="revolute")
    ET.SubElement(joint, "origin", xyz=_numbers(origin), rpy="0 0 0")
    ET.SubElement(joint, "parent", link=links[0])
    ET.SubElement(joint, "child", link=links[1])
    ET.SubElement(joint, "axis", xyz=_numbers(axis))
    ET.SubElement(
        joint,
        "limit",
        lower=_number(limits[0]),
        upper=_number(limits[1]),
        effort=_number(p["joint_effort_limit"]),
        velocity=_number(p["joint_velocity_limit"]),
    )


_COLOURS = {
    "trunk": "0.35 0.40 0.45 1",
    "drive": "0.20 0.20 0.22 1",
    "femur": "0.80 0.45 0.15 1",
    "tibia": "0.15 0.45 0.70 1",
    "foot": "0.10 0.10 0.10 1",
}


def _link(root: ET.Element, name: str, box: Box, material: str) -> None:
    volume = math.prod(box.size)
    if box.mass > DENSEST * volume:
        raise RobotFileError(
            f"link '{name}' has {box.mass:.4g} kg in {1e3 * volume:.3g} litres, denser than any "
            "metal; masses in kg, lengths in the unit stated?"
        )
    link = ET.SubElement(root, "link", name=name)
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=_numbers(box.com), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=_number(box.mass))
    ixx, iyy, izz = box.inertia
    ET.SubElement(
        inertial,
        "inertia",
        ixx=_number(ixx),
        ixy="0",
        ixz="0",
        iyy=_number(iyy),
        iyz="0",
        izz=_number(izz),
    )
    visual = ET.SubElement(link, "visual")
    ET.SubElement(visual, "origin", xyz=_numbers(box.centre), rpy="0 0 0")
    geometry = ET.SubElement(visual, "geometry")
    ET.SubElement(geometry, "box", size=_numbers(box.size))
    _material(visual, material)


def _material(visual: ET.Element, name: str) -> None:
    material = ET.SubElement(visual, "material", name=name)
    ET.SubElement(material, "color", rgba=_COLOURS[name])


def _number(value: float) -> str:
    text = f"{value:.12g}"
    return "0" if text == "-0" else text


def _numbers(values: tuple[float, float, float]) -> str:
    return " ".join(_number(value) for value in values)
