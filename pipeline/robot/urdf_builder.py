"""The URDFs of the hexapod and of its leg on a stand, from the numbers of their robot files.

Zero pose: every leg plane is vertical and square to the body's x axis, the femur horizontal
pointing outward, the tibia hanging straight down. Positive directions: joint 1 moves the foot
forward, joints 2 and 3 raise what lies outboard of them. Left legs mirror right legs, so equal
coordinates are mirrored poses. Joint 1's axis lies in the frontal plane, `joint_1_axis_angle` from
the vertical towards the outside: 0 is an insect-like yaw axis, 90 degrees a lateral axis about
which the leg plane swings fore and aft.

`python -m pipeline.robot.urdf_builder [FILE...]` (`make urdf`) writes the URDF of each robot file
with ``build``, of all in urdf/ by default, over the file that ``robot.urdf`` names.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Comment, Element, indent, tostring

from actuators.errors import LegwattError
from pipeline.atomic import write_text
from pipeline.robot.robot_file import STATIONS, RobotSpec, load_robot_file
from pipeline.robot.robot_tables import LegSpec

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
_ORIGIN: Final[Point] = (0.0, 0.0, 0.0)


def build_urdf(spec: RobotSpec) -> str:
    """The URDF of a robot file with ``build``, as text, the same for the same file.

    Raises:
        LegwattError: The masses of the legs leave nothing for the trunk, or a link would be denser
            than any metal.
    """
    p = spec.parameters
    width = 2 * (p["joint_2_lateral"] - p["coxa_length"]) + p["link_width"]
    size, com = (p["body_length"], width, p["trunk_height"]), (0.0, p["trunk_com_left"], 0.0)
    # The legs leave the rest of the total mass; the stand counts as one sixth of a robot.
    leg = p["hip_link_mass"] + p["femur_mass"] + p["tibia_mass"]
    mass = p["total_mass"] - len(spec.legs) * leg
    if mass <= 0:
        raise LegwattError(
            f"{spec.path}: {len(spec.legs)} legs of {leg:.3g} kg leave "
            f"{mass:.3g} kg for the trunk; lower the link masses or raise total_mass"
        )
    trunk = _box(spec.base_link, "trunk", mass, size, _ORIGIN, com)
    legs = (part for own in spec.legs for part in _leg(spec, own))
    robot = _element("robot", trunk, *legs, name=spec.name)
    said = f" Built from {spec.path.name} by `make urdf`; change that file, not this one. "
    robot.insert(0, Comment(said))
    indent(robot)
    return f'<?xml version="1.0"?>\n{tostring(robot, encoding="unicode")}\n'


def _leg(spec: RobotSpec, leg: LegSpec) -> Iterator[Element]:
    """The joints of hip, femur and tibia, each with the link that it carries, and the foot."""
    p = spec.parameters
    out = 1.0 if leg.side == "left" else -1.0  # y of "outward"
    angle, width, coxa = p["joint_1_axis_angle"], p["link_width"], p["coxa_length"]
    femur, tibia, swing = out * p["femur_length"], -p["tibia_length"], p["joint_1_range"]
    hip = (STATIONS[leg.station] * p["hip_spacing"], out * (p["joint_2_lateral"] - coxa), 0.0)
    # An axis is a pseudo-vector: mirrored in the x-z plane, its x and z components change sign.
    yaw, raising = (0.0, -math.sin(angle), -out * math.cos(angle)), (out, 0.0, 0.0)
    middle, slim = (0.0, out * coxa / 2, 0.0), (width / 2, width / 2, -tibia)
    boxes = (  # part, mass, size, centre, centre of mass
        ("drive", p["hip_link_mass"], (width, coxa + width, width), middle, middle),
        ("femur", p["femur_mass"], (width, out * femur, width), (0.0, femur / 2, 0.0))
        + ((0.0, femur * p["femur_com"], 0.0),),
        ("tibia", p["tibia_mass"], slim, (0.0, 0.0, tibia / 2), (0.0, 0.0, tibia * p["tibia_com"])),
    )
    joints = (  # place, axis, limits
        (hip, yaw, -swing, swing),
        ((0.0, out * coxa, 0.0), raising, p["joint_2_lower"], p["joint_2_upper"]),
        ((0.0, femur, 0.0), raising, p["joint_3_lower"], p["joint_3_upper"]),
    )
    strength = {"effort": p["joint_effort_limit"], "velocity": p["joint_velocity_limit"]}
    parent = spec.base_link
    for k, link in enumerate(("hip", "femur", "tibia")):
        (place, axis, lower, upper), child = joints[k], f"{leg.name}_{link}_link"
        limit = _element("limit", lower=lower, upper=upper, **strength)
        more = (_element("axis", xyz=axis), limit)
        yield _joint(leg.joints[k], "revolute", place, parent, child, *more)
        yield _box(child, *boxes[k])
        parent = child
    yield _joint(f"{leg.name}_foot_joint", "fixed", (0.0, 0.0, tibia), parent, leg.foot)
    sphere = _element("sphere", radius=FOOT_RADIUS)
    yield _element("link", _visual("foot", sphere), name=leg.foot)


def _box(name: str, part: str, mass: float, size: Point, centre: Point, com: Point) -> Element:
    """A link of some kg that is a solid cuboid, lengths in its frame [m].

    Its rotational inertia is the solid's about the centre of mass `com`.
    """
    volume = math.prod(size)
    if mass > DENSEST * volume:
        raise LegwattError(
            f"link '{name}' has {mass:.4g} kg in {1e3 * volume:.3g} litres, denser than any "
            "metal; masses in kg, lengths in the unit stated?"
        )
    x, y, z = size
    xx, yy, zz = (mass / 12 * (a * a + b * b) for a, b in ((y, z), (x, z), (x, y)))
    inertial = _element(
        "inertial",
        _element("origin", xyz=com, rpy=_ORIGIN),
        _element("mass", value=mass),
        _element("inertia", ixx=xx, ixy=0.0, ixz=0.0, iyy=yy, iyz=0.0, izz=zz),
    )
    place = _element("origin", xyz=centre, rpy=_ORIGIN)
    return _element("link", inertial, _visual(part, _element("box", size=size), place), name=name)


def _visual(part: str, solid: Element, *place: Element) -> Element:
    colour = _element("material", _element("color", rgba=_COLOURS[part]), name=part)
    return _element("visual", *place, _element("geometry", solid), colour)


def _joint(name: str, kind: str, place: Point, parent: str, child: str, *more: Element) -> Element:
    links = _element("parent", link=parent), _element("child", link=child)
    origin = _element("origin", xyz=place, rpy=_ORIGIN)
    return _element("joint", origin, *links, *more, name=name, type=kind)


def _element(tag: str, *inside: Element, **attributes: str | float | Point) -> Element:
    def text(value: str | float | Point) -> str:
        if isinstance(value, float):
            return f"{value + 0.0:.12g}"  # never "-0"
        return value if isinstance(value, str) else " ".join(map(text, value))

    made = Element(tag, {key: text(value) for key, value in attributes.items()})
    made.extend(inside)
    return made


def main(arguments: Sequence[str]) -> int:
    """Write the URDF of every robot file that says how; the exit code."""
    try:
        for path in map(Path, arguments or sorted(map(str, Path("urdf").glob("*.toml")))):
            spec = load_robot_file(path)
            if spec.build:
                write_text(spec.urdf, build_urdf(spec))
                print(f"{spec.urdf}: built from {path}")
            else:
                print(f"{path}: nothing built, its URDF {spec.urdf.name} is its own")
    except LegwattError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
