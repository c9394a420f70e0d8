"""URDFs written: those of the hexapod and of its leg from the robot file, others with new bodies.

Zero pose: every leg plane is vertical and square to the body's x axis, the femur horizontal
pointing outward, the tibia hanging straight down. Positive directions: joint 1 moves the foot
forward, joints 2 and 3 raise what lies outboard of them. Left legs mirror right legs, so equal
coordinates are mirrored poses. Joint 1's axis lies in the frontal plane, `joint_1_axis_angle` from
the vertical towards the outside: 0 is an insect-like yaw axis, 90 degrees a lateral axis about
which the leg plane swings fore and aft.

`with_inertials` replaces inertial elements in a URDF's text; all else stays as it is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, Final
from xml.parsers import expat

import numpy as np
import pinocchio as pin
from jinja2 import Environment, FileSystemLoader, Template

from pipeline.errors import RobotFileError, UrdfError
from pipeline.robot.robot_file import STATIONS, LegSpec, RobotSpec
from pipeline.robot.urdf_source import INERTIA_KEYS

#: A declared encoding that is not the one written.
_ENCODING = re.compile(r"""\s+encoding\s*=\s*(["'])(?!utf-8\1)[\w.:-]+\1(?=[^<>]*\?>)""", re.I)
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


def with_inertials(
    text: str, where: str, bodies: Mapping[str, pin.Inertia | None], why: str
) -> str:
    """A URDF with other bodies; comments, meshes and layout stay, but inside what is replaced.

    `text`: the URDF; its structure holds (`read_elements`). `bodies`: link to its body in the
    link's frame; None leaves a comment in place of the element. `why`: that comment, which stands
    beside every element that was replaced, too.

    Raises:
        UrdfError: A link that the text does not have.
    """
    # In UTF-8, in which it will be written and whose bytes the parser counts.
    content = _ENCODING.sub("", text, count=1).encode("utf-8")
    ends, elements = _places(content)
    edits: list[tuple[int, int, bytes]] = []
    for link, body in bodies.items():
        if link not in ends:
            raise UrdfError(f"{where}: no link '{link}'")
        for number, (start, stop) in enumerate(elements[link]):
            # A reader takes the first element; what stands behind it is not to take its place.
            new = b"" if number else _inertial(body, why, _margin(content, start))
            edits.append((start, stop, new))
        if body is not None and not elements[link]:
            edits.append(_inserted(content, ends[link], body, why))
    for start, stop, new in sorted(edits, reverse=True):
        content = content[:start] + new + content[stop:]
    return content.decode("utf-8")


def _places(content: bytes) -> tuple[dict[str, int], dict[str, list[tuple[int, int]]]]:
    """Of every link, where its end tag starts, and where its inertial elements stand [bytes]."""
    ends: dict[str, int] = {}
    elements: dict[str, list[tuple[int, int]]] = {}
    above: list[str] = []
    link, start = "", 0
    parser = expat.ParserCreate("utf-8")

    def opened(tag: str, attributes: dict[str, str]) -> None:
        nonlocal link, start
        above.append(tag)
        if above[1:] == ["link"]:
            link = attributes.get("name", "")
            elements[link] = []
        elif above[1:] == ["link", "inertial"]:
            start = parser.CurrentByteIndex

    def closed(tag: str) -> None:
        at = parser.CurrentByteIndex
        if above[1:] == ["link"]:
            ends[link] = at
        elif above[1:] == ["link", "inertial"]:
            # An element without content ends here, another with its end tag.
            full = content.startswith(b"</inertial", at)
            elements[link].append((start, content.index(b">", at) + 1 if full else at))
        above.pop()

    parser.StartElementHandler, parser.EndElementHandler = opened, closed
    parser.Parse(content, True)
    return ends, elements


def _margin(content: bytes, at: int) -> str:
    """The blanks in front of an element that begins its line."""
    before = content[content.rfind(b"\n", 0, at) + 1 : at].decode("utf-8", "replace")
    return before if not before.strip() else ""


def _inserted(content: bytes, end: int, body: pin.Inertia, why: str) -> tuple[int, int, bytes]:
    """An element more at the end of a link, which may be one without content."""
    if content.startswith(b"</link", end):
        outer = _margin(content, end)
        start, stop, before, after = len(content[:end].rstrip()), end, b"", b""
    else:
        start, stop = content.rindex(b"/", 0, end), end
        outer, before, after = _margin(content, content.rindex(b"<", 0, end)), b">", b"</link>"
    line = f"\n{outer}".encode()
    new = before + line + b"  " + _inertial(body, why, f"{outer}  ") + line + after
    return start, stop, new


def _inertial(body: pin.Inertia | None, why: str, margin: str) -> bytes:
    """The element, with digits that read back to the same numbers; a comment alone without body."""
    comment = f"<!-- {why} -->"
    if body is None:
        return comment.encode("utf-8")
    xyz = " ".join(repr(float(x)) for x in body.lever)
    upper = body.inertia[np.triu_indices(3)]  # in the order of the keys
    moments = " ".join(
        f'{key}="{float(value)!r}"' for key, value in zip(INERTIA_KEYS, upper, strict=True)
    )
    inner = (
        comment,
        f'<origin xyz="{xyz}" rpy="0 0 0"/>',
        f'<mass value="{float(body.mass)!r}"/>',
        f"<inertia {moments}/>",
    )
    lines = (*(f"{margin}  {line}" for line in inner), f"{margin}</inertial>")
    return "\n".join(("<inertial>", *lines)).encode("utf-8")
