"""Physical sense of a URDF: what Pinocchio and yourdfpy accept in silence is judged here.

Links on fixed joints move as one body, and the equations of motion know that body alone. A sensor's
frame of 0 kg on a trunk is therefore no fault; what is judged is the body it merges into, and of a
single link only what would show in that body.

A body's inertia must be that of a real distribution of mass: positive mass, inertia about the
centre of mass without a negative principal moment, and moments that fulfil the triangle inequality
(each at most the sum of the other two; Wensing, Kim and Slotine, IEEE RA-L 3(1), 2018).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from pipeline.robot.robot import parse_urdf
from pipeline.robot.urdf_source import (
    INERTIA_KEYS,
    MOVING,
    ends,
    number,
    numbers,
    place,
    read_elements,
)

Array = NDArray[np.float64]

TRIANGLE_TOLERANCE = 1e-6  # relative to the largest principal moment
#: What moments written with two digits, or a density that CAD guessed, take a body beyond what is
#: possible, relative to the largest principal moment: a log's comparison can go on with it.
TOLERABLE_EXCESS = 0.05
GEOMETRY_MARGIN = 1e-6  # [m]
#: A link's impossible inertia counts from this share of the largest moment of the body it merges
#: into, and its centre of mass from this share of that body's mass.
MATERIAL = 0.01
#: Radius of gyration below which a body is a point, and its moments are rounding [m].
POINT = 1e-6
#: Joints closer than this are one compound joint, such as a universal one; what lies between them
#: may be without mass [m].
COMPOUND = 1e-3
#: Revolute joints of robots turn up to some 3 pi from zero; what is beyond two turns was written in
#: degrees [rad].
MOST_TURNS = 4 * math.pi
#: No angle in degrees is larger; numbers beyond say that there is no limit.
MOST_DEGREES = 1440.0
#: Length of one joint's offset that no robot has [m].
LONGEST = 10.0
#: A radius of gyration so many times the robot's size cannot be [1].
GYRATION = 10.0
#: A robot weighs more than the air in a cube with edges as long as the way from its root to its
#: furthest mass, less than the water, and cannot weigh what the steel does [kg/m^3]. Published
#: robots from hand to humanoid lie between 3 and 500, grams for kilograms at a thousand times that.
AIR, HEAVY, STEEL = 1.2, 1000.0, 7850.0
#: What says which links move as one; no warning.
MERGED = "merged over fixed joints"
#: Of a joint that mimics none.
OWN_DRIVE = "a drive of its own"
_SHOWN = 8  # names in one line


@dataclass(frozen=True)
class Finding:
    """One thing that was checked.

    Attributes:
        subject: Link, joint, leg or robot.
        check: What was asked.
        passed: Whether it holds.
        detail: Numbers, with the remedy where it fails.
        note: Passed, but the reader should know.
        tolerable: Failed, but a comparison with a log goes on, with a warning.
    """

    subject: str
    check: str
    passed: bool
    detail: str
    note: bool = False
    tolerable: bool = False


@dataclass(frozen=True)
class Body:
    """Links that move as one, because fixed joints hold them together.

    Attributes:
        joint: That moves it; empty for the body at the root.
        links: The first is the one that the joint carries.
        inertia: Of all links together, in the joint's frame.
        reaches: Distance from this joint to those that hang on the body [m].
        carries: Whether any body further out has mass.
    """

    joint: str
    links: tuple[ET.Element, ...]
    inertia: pin.Inertia
    reaches: tuple[float, ...]
    carries: bool

    @property
    def name(self) -> str:
        """Of its first link."""
        return _name(self.links[0])


def check_urdf(text: str, where: str) -> list[Finding]:
    """Check a URDF's bodies, joints and limits.

    Args:
        text: The URDF.
        where: Its file, for messages.

    Raises:
        UrdfError: A fault of structure; one line with its place.
    """
    root = read_elements(text, where)
    model = parse_urdf(text, where, floating=False)
    bodies = merged_bodies(root, model)
    # Units first: they explain what comes after.
    findings = [*_sizes(root, bodies, where), *_joints(root, where)]
    for body in bodies:
        findings += _links(body, where)
        findings += _body(body)
    return findings


def merged_bodies(root: ET.Element, model: pin.Model) -> list[Body]:
    """The bodies of a URDF, the root's first, then as the joints stand in the file.

    Args:
        root: Elements whose structure holds.
        model: Of the same text, with a fixed base.
    """
    links = {_name(link): link for link in root.findall("link")}
    joints = root.findall("joint")
    held: dict[str, list[str]] = {}
    moving = []
    for joint in joints:
        if joint.get("type") == "fixed":
            held.setdefault(ends(joint)[0], []).append(ends(joint)[1])
        else:
            moving.append(joint)
    top = next(iter(set(links) - {ends(joint)[1] for joint in joints}))
    bodies = []
    for name, first in (("", top), *((_name(joint), ends(joint)[1]) for joint in moving)):
        together = [first]
        for link in together:  # grows while it runs
            together += held.get(link, [])
        index = model.getJointId(name) if name else 0
        hung = [j for j in range(1, model.njoints) if model.parents[j] == index]
        beyond = [int(j) for j in model.subtrees[index] if j != index]
        bodies.append(
            Body(
                name,
                tuple(links[link] for link in together),
                model.inertias[index],
                tuple(float(np.linalg.norm(model.jointPlacements[j].translation)) for j in hung),
                any(model.inertias[j].mass > 0 for j in beyond),
            )
        )
    return bodies


def _name(element: ET.Element) -> str:
    return element.get("name", "")


def _mass(link: ET.Element, where: str) -> float:
    mass = link.find("inertial/mass")
    return 0.0 if mass is None else number(mass, "value", where)


def _moments(link: ET.Element, where: str) -> Array:
    """Principal moments about the centre of mass, shape (3,) [kg*m^2], rising."""
    tensor = link.find("inertial/inertia")
    if tensor is None:
        return np.zeros(3)
    xx, xy, xz, yy, yz, zz = (number(tensor, key, where) for key in INERTIA_KEYS)
    return np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


def _excess(mass: float, moments: Array) -> tuple[float, str]:
    """By how much an inertia is none [kg*m^2], and what is wrong; 0 where all is right."""
    shown = ", ".join(f"{m:.4g}" for m in moments) + " kg*m^2"
    if mass == 0 and moments.any():
        return float(np.abs(moments).max()), f"moments {shown} without mass"
    rounding = max(TRIANGLE_TOLERANCE * float(np.abs(moments).max()), mass * POINT**2)
    if moments[0] < -rounding:
        return float(-moments[0]), f"moments {shown}: none may be negative"
    excess = float(moments[2] - moments[0] - moments[1])
    if excess > rounding:
        return excess, f"moments {shown}: the largest may not exceed the sum of the others"
    return 0.0, f"moments {shown}"


def _links(body: Body, where: str) -> list[Finding]:
    """What no merging mends, and what the merged body no longer shows."""
    findings = []
    scale = float(np.abs(np.linalg.eigvalsh(body.inertia.inertia)).max())
    for link in body.links:
        mass, name = _mass(link, where), _name(link)
        if mass < 0:
            findings.append(Finding(name, "mass positive", False, f"{mass:.6g} kg"))
            continue
        if len(body.links) > 1:
            excess, detail = _excess(mass, _moments(link, where))
            if excess > MATERIAL * scale and excess > 0:
                findings.append(Finding(name, "inertia possible", False, detail))
            elif excess > 0:
                detail += f"; below {100 * MATERIAL:g} % of '{body.name}', which carries it"
                findings.append(Finding(name, "inertia possible", True, detail, note=True))
        if mass > 0 and mass >= MATERIAL * body.inertia.mass:
            findings += _centre_in_geometry(link, where)
    return findings


def _body(body: Body) -> list[Finding]:
    """The inertia that the equations of motion see."""
    mass = float(body.inertia.mass)
    findings = []
    held = [link for link in body.links[1:] if link.find("inertial") is not None]
    if held:
        names = [
            _name(link) + (" (0 kg)" if _mass(link, "") == 0 else "")
            for link in (held[:_SHOWN] if len(held) > _SHOWN + 1 else held)
        ]
        more = f" and {len(held) - len(names)} more" if len(held) > len(names) else ""
        detail = f"with {', '.join(names)}{more}: one body of {mass:.6g} kg"
        findings.append(Finding(body.name, MERGED, True, detail, note=True))
    if mass < 0:
        return findings  # reported for its link
    if mass == 0:
        return [*findings, *_without_mass(body)]
    findings.append(Finding(body.name, "mass positive", True, f"{mass:.6g} kg"))
    moments = np.linalg.eigvalsh(body.inertia.inertia)
    excess, detail = _excess(mass, moments)
    slight = 0 < excess <= TOLERABLE_EXCESS * float(np.abs(moments).max())
    findings.append(Finding(body.name, "inertia possible", excess == 0, detail, tolerable=slight))
    if excess == 0 and moments[2] <= mass * POINT**2 and body.joint:
        detail = f"{mass:.6g} kg without rotational inertia is computed as a point"
        findings.append(Finding(body.name, "rotational inertia", True, detail, note=True))
    return findings


def _without_mass(body: Body) -> list[Finding]:
    if not body.joint:
        detail = "0 kg: it stands still; with a floating base it needs mass"
        return [Finding(body.name, "mass of the root", True, detail, note=True)]
    if body.carries and all(reach < COMPOUND for reach in body.reaches):
        moments = np.linalg.eigvalsh(body.inertia.inertia)
        if moments.any():
            return [Finding(body.name, "inertia possible", False, _excess(0.0, moments)[1])]
        detail = "0 kg between joints at one place: computed as one compound joint"
        return [Finding(body.name, "mass", True, detail, note=True)]
    detail = (
        "0 kg"
        + ("" if body.carries else ", and so does all that hangs on it")
        + f": '{body.joint}' moves it; give it an <inertial>, or make the joint fixed"
    )
    return [Finding(body.name, "mass positive", False, detail)]


def _centre_in_geometry(link: ET.Element, where: str) -> list[Finding]:
    inertial, name = link.find("inertial"), _name(link)
    if inertial is None:
        return []
    centre, _ = place(inertial, where)
    boxes = []
    for shape in [*link.findall("visual"), *link.findall("collision")]:
        half = _half_size(shape, where)
        if half is None:
            return []  # a mesh: its extent is not known without the mesh file
        at, rpy = place(shape, where)
        boxes.append((at, pin.rpy.rpyToMatrix(rpy), half))
    if not boxes:
        return []
    # A shape for looks or contact is not the body: outside is odd, out by its own size is wrong.
    outs = [
        float(np.linalg.norm(np.maximum(np.abs(turn.T @ (centre - at)) - half, 0.0)))
        for at, turn, half in boxes
    ]
    # One that is large enough suffices: a small part beside it makes nothing worse.
    near = any(
        out <= GEOMETRY_MARGIN + float(np.linalg.norm(half))
        for out, (_, _, half) in zip(outs, boxes, strict=True)
    )
    out = min(outs)
    outside = out > GEOMETRY_MARGIN
    detail = "(" + ", ".join(f"{x:.4g}" for x in centre) + ") m"
    detail += f", {1e3 * out:.3g} mm outside" if outside else ""
    check = "centre of mass within the geometry"
    return [Finding(name, check, near, detail, note=outside)]


def _half_size(shape: ET.Element, where: str) -> Array | None:
    """Half the edges of the box around a primitive [m]; None for a mesh."""
    solid = shape.find("geometry/*")
    assert solid is not None  # the structure holds
    if solid.tag == "box":
        return numbers(solid, "size", where, (0, 0, 0)) / 2
    if solid.tag == "mesh":
        return None
    radius = number(solid, "radius", where)
    if solid.tag == "sphere":
        return np.full(3, radius)
    length = number(solid, "length", where)
    return np.array([radius, radius, length / 2 + (radius if solid.tag == "capsule" else 0)])


def _joints(root: ET.Element, where: str) -> list[Finding]:
    findings = []
    for joint in root.findall("joint"):
        kind, name = joint.get("type", ""), _name(joint)
        if kind == "fixed":
            continue
        if kind not in MOVING:
            detail = f"type '{kind}': joints of one coordinate are computed; make it fixed"
            findings.append(Finding(name, "one coordinate", False, detail))
            continue
        mimic = joint.find("mimic")
        if mimic is not None:
            detail = (
                f"it mimics '{mimic.get('joint')}': a drive that moves several joints is not "
                "computed; make it fixed, or remove <mimic> if it has a drive of its own"
            )
            findings.append(Finding(name, OWN_DRIVE, False, detail, tolerable=True))
        findings += _limits(joint, kind, where)
    return findings


def _limits(joint: ET.Element, kind: str, where: str) -> list[Finding]:
    name, limit = _name(joint), joint.find("limit")
    if limit is None:  # of a continuous joint, which needs none
        return [Finding(name, "limits", True, "a continuous joint without limits")]
    value = {
        key: number(limit, key, where)
        for key in ("lower", "upper", "effort", "velocity")
        if limit.get(key) is not None
    }
    findings = []
    for key in ("effort", "velocity"):
        detail = f"{value[key]:g}" + ("" if value[key] else " is taken for none")
        findings.append(Finding(name, f"{key} limit", True, detail, note=value[key] == 0))
    if kind == "continuous":
        return findings
    lower, upper = value.get("lower", 0.0), value.get("upper", 0.0)
    detail = f"lower {lower:g}, upper {upper:g}"
    if lower == upper:
        detail += ": no range, taken for no limit in a log; a leg cannot walk with it"
    findings.append(
        Finding(name, "lower limit below the upper", lower <= upper, detail, note=lower == upper)
    )
    if kind == "revolute":
        findings.append(_in_radians(name, lower, upper))
    return findings


def _in_radians(name: str, lower: float, upper: float) -> Finding:
    largest = max((lower, upper), key=abs)
    if abs(largest) > MOST_DEGREES:
        detail = f"{largest:g} rad is as good as none"
        return Finding(name, "limits in radians", True, detail, note=True)
    if abs(largest) > MOST_TURNS:
        detail = (
            f"{largest:g} rad are {abs(largest) / (2 * math.pi):.1f} turns; degrees? "
            f"{largest:g} deg = {math.radians(largest):.4g} rad; a joint that turns on and on is "
            "of type continuous"
        )
        return Finding(name, "limits in radians", False, detail)
    return Finding(name, "limits in radians", True, f"{lower:g} to {upper:g} rad")


def _sizes(root: ET.Element, bodies: Sequence[Body], where: str) -> list[Finding]:
    """Lengths in metres, inertias and masses that fit them."""
    findings = []
    above = {ends(joint)[1]: joint for joint in root.findall("joint")}

    def distance(link: str) -> float:
        """From the root along the joints [m]."""
        if link not in above:
            return 0.0
        return distance(ends(above[link])[0]) + float(np.linalg.norm(place(above[link], where)[0]))

    away = {link: distance(link) for link in above}
    for joint in above.values():
        xyz, _ = place(joint, where)
        if (offset := float(np.linalg.norm(xyz))) > LONGEST:
            written = " ".join(f"{x:g}" for x in xyz)
            detail = f"origin {written}: {offset:g} m from its parent; millimetres?"
            findings.append(Finding(_name(joint), "lengths in metres", False, detail))
    reach = furthest = max(away.values(), default=0.0)
    for body in bodies:
        mass = float(body.inertia.mass)
        lever = float(np.linalg.norm(body.inertia.lever))
        size = reach + lever
        if mass <= 0:
            continue
        radius = math.sqrt(max(0.0, float(np.linalg.eigvalsh(body.inertia.inertia)[2])) / mass)
        furthest = max(furthest, away.get(body.name, 0.0) + lever + radius)
        if size == 0 or not body.joint:
            continue
        detail = (
            f"radius of gyration {radius:.3g} m, the longest chain of joints {reach:.3g} m; "
            "inertia in kg*m^2, mass in kg, lengths in m?"
        )
        findings.append(
            Finding(body.name, "inertia fits the size", radius <= GYRATION * size, detail)
        )
    total = sum(float(body.inertia.mass) for body in bodies)
    return [*findings, *_total_mass(root.get("name", "robot"), total, furthest)]


def _total_mass(name: str, total: float, size: float) -> list[Finding]:
    """A robot's mass [kg] against what would fill a cube of its size [m]; none if usual."""
    volume = size * size * size  # where a power overflows
    if total <= 0 or size <= 0 or AIR * volume <= total <= HEAVY * volume:
        return []
    heavy = total > HEAVY * volume
    filled = (STEEL if heavy else AIR) * volume
    detail = (
        f"{total:.6g} kg within {size:.3g} m of its root, where a cube of that edge full of "
        f"{'steel' if heavy else 'air'} weighs {filled:.3g} kg; "
        + ("masses in g" if heavy else "masses in t, lengths in mm")
        + "? A URDF takes kg and m"
    )
    possible = not heavy or total <= filled
    return [Finding(name, "total mass", possible, detail, note=possible)]
