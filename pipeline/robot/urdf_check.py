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
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import some
from pipeline.robot.robot import parse_urdf
from pipeline.robot.urdf_source import (
    INERTIA_KEYS,
    MOVING,
    ends,
    half_size,
    number,
    place,
    read_elements,
)

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
    """One thing that was checked."""

    subject: str  #: Link, joint, leg or robot.
    check: str  #: What was asked.
    passed: bool  #: Whether it holds.
    detail: str  #: Numbers, with the remedy where it fails.
    note: bool = False  #: Passed, but the reader should know.
    tolerable: bool = False  #: Failed, but a comparison with a log goes on, with a warning.


@dataclass(frozen=True)
class Body:
    """Links that move as one, because fixed joints hold them together."""

    joint: str  #: That moves it; empty for the body at the root.
    links: list[ET.Element]  #: The first is the one that the joint carries.
    inertia: pin.Inertia  #: Of all links together, in the joint's frame.
    reach: float  #: Distance from this joint to the furthest that hangs on the body [m].
    carries: bool  #: Whether any body further out has mass.

    @property
    def name(self) -> str:
        """Of its first link."""
        return _name(self.links[0])


def _note(subject: str, check: str, detail: str) -> Finding:
    return Finding(subject, check, True, detail, note=True)


def check_urdf(text: str, where: str) -> list[Finding]:
    """Check a URDF's bodies, joints and limits.

    Raises:
        LegwattError: A fault of structure; one line with its place.
    """
    root = read_elements(text, where)
    bodies = merged_bodies(root, parse_urdf(text, where, floating=False))
    moving = (joint for joint in root.findall("joint") if joint.get("type") != "fixed")
    return [
        *_sizes(root, bodies),  # units first: they explain what comes after
        *(finding for joint in moving for finding in _joint(joint)),
        *(finding for body in bodies for finding in (*_links(body), *_body(body))),
    ]


def merged_bodies(root: ET.Element, model: pin.Model) -> list[Body]:
    """The bodies of a URDF, the root's first, then as the joints stand in the file."""
    links = {_name(link): link for link in root.findall("link")}
    top, moving = set(links), []
    held: dict[str, list[str]] = {name: [] for name in links}
    for joint in root.findall("joint"):
        parent, child = ends(joint)
        top.remove(child)
        if joint.get("type") == "fixed":
            held[parent].append(child)
        else:
            moving.append((_name(joint), child))
    bodies = []
    for name, first in (("", *top), *moving):
        together = [first]
        for link in together:  # grows while it runs
            together += held[link]
        index = model.getJointId(name) if name else 0
        ways = (model.jointPlacements[j].translation for j in model.children[index])
        reach = max((float(np.linalg.norm(way)) for way in ways), default=0.0)
        carries = any(model.inertias[j].mass > 0 for j in model.subtrees[index] if j != index)
        own = [links[link] for link in together]
        bodies.append(Body(name, own, model.inertias[index], reach, carries))
    return bodies


def _name(element: ET.Element) -> str:
    return element.get("name", "")


def _mass(link: ET.Element) -> float:
    mass = link.find("inertial/mass")
    return 0.0 if mass is None else number(mass, "value")


def _moments(link: ET.Element) -> Array:
    """Principal moments about the centre of mass, shape (3,) [kg*m^2], rising."""
    tensor = link.find("inertial/inertia")
    if tensor is None:
        return np.zeros(3)
    xx, xy, xz, yy, yz, zz = (number(tensor, key) for key in INERTIA_KEYS)
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


def _links(body: Body) -> Iterator[Finding]:
    """What no merging mends, and what the merged body no longer shows."""
    scale = float(np.abs(np.linalg.eigvalsh(body.inertia.inertia)).max())
    for link in body.links:
        mass, name = _mass(link), _name(link)
        if mass < 0:
            yield Finding(name, "mass positive", False, f"{mass:.6g} kg")
            continue
        if len(body.links) > 1:
            excess, detail = _excess(mass, _moments(link))
            if excess > MATERIAL * scale:
                yield Finding(name, "inertia possible", False, detail)
            elif excess > 0:
                detail += f"; below {100 * MATERIAL:g} % of '{body.name}', which carries it"
                yield _note(name, "inertia possible", detail)
        if mass > 0 and mass >= MATERIAL * body.inertia.mass:
            yield from _centre_in_geometry(link)


def _body(body: Body) -> Iterator[Finding]:
    """The inertia that the equations of motion see."""
    mass = float(body.inertia.mass)
    held = [link for link in body.links[1:] if link.find("inertial") is not None]
    if held:
        names = some([_name(x) + (" (0 kg)" if _mass(x) == 0 else "") for x in held], _SHOWN)
        yield _note(body.name, MERGED, f"with {names}: one body of {mass:.6g} kg")
    if mass == 0:
        yield _without_mass(body)
    if mass <= 0:  # a negative one is its link's finding
        return
    yield Finding(body.name, "mass positive", True, f"{mass:.6g} kg")
    moments = np.linalg.eigvalsh(body.inertia.inertia)
    excess, detail = _excess(mass, moments)
    slight = 0 < excess <= TOLERABLE_EXCESS * float(np.abs(moments).max())
    yield Finding(body.name, "inertia possible", excess == 0, detail, tolerable=slight)
    if excess == 0 and moments[2] <= mass * POINT**2 and body.joint:
        detail = f"{mass:.6g} kg without rotational inertia is computed as a point"
        yield _note(body.name, "rotational inertia", detail)


def _without_mass(body: Body) -> Finding:
    if not body.joint:
        detail = "0 kg: it stands still; with a floating base it needs mass"
        return _note(body.name, "mass of the root", detail)
    if body.carries and body.reach < COMPOUND:
        moments = np.linalg.eigvalsh(body.inertia.inertia)
        if moments.any():
            return Finding(body.name, "inertia possible", False, _excess(0.0, moments)[1])
        detail = "0 kg between joints at one place: computed as one compound joint"
        return _note(body.name, "mass", detail)
    detail = "0 kg" if body.carries else "0 kg, and so does all that hangs on it"
    detail += f": '{body.joint}' moves it; give it an <inertial>, or make the joint fixed"
    return Finding(body.name, "mass positive", False, detail)


def _centre_in_geometry(link: ET.Element) -> Iterator[Finding]:
    """A shape for looks or contact is not the body: outside is odd, by its own size is wrong."""
    inertial = link.find("inertial")
    shapes = [*link.findall("visual"), *link.findall("collision")]
    if inertial is None or not shapes:
        return
    centre, _ = place(inertial)
    near, out = False, np.inf
    for shape in shapes:
        (at, rpy), half = place(shape), half_size(shape)
        if half is None:
            return  # the extent of a mesh is not known without the mesh file
        beside = np.abs(pin.rpy.rpyToMatrix(rpy).T @ (centre - at)) - half
        own = float(np.linalg.norm(np.maximum(beside, 0.0)))
        # One that is large enough suffices: a small part in addition makes nothing worse.
        near |= own <= GEOMETRY_MARGIN + float(np.linalg.norm(half))
        out = min(out, own)
    outside, check = out > GEOMETRY_MARGIN, "centre of mass within the geometry"
    detail = "(" + ", ".join(f"{x:.4g}" for x in centre) + ") m"
    detail += f", {1e3 * out:.3g} mm outside" if outside else ""
    yield Finding(_name(link), check, near, detail, note=outside)


def _joint(joint: ET.Element) -> Iterator[Finding]:
    """One coordinate, a drive that moves nothing else, and limits."""
    name, kind, mimic = _name(joint), joint.get("type"), joint.find("mimic")
    if kind not in MOVING:
        detail = f"type '{kind}': joints of one coordinate are computed; make it fixed"
        yield Finding(name, "one coordinate", False, detail)
        return
    if mimic is not None:
        detail = (
            f"it mimics '{mimic.get('joint')}': a drive that moves several joints is not "
            "computed; make it fixed, or remove <mimic> if it has a drive of its own"
        )
        yield Finding(name, OWN_DRIVE, False, detail, tolerable=True)
    limit = joint.find("limit")
    if limit is None:  # a continuous joint needs none
        yield Finding(name, "limits", True, "a continuous joint without limits")
        return
    for key in ("effort", "velocity"):
        value = number(limit, key)
        detail = f"{value:g}" + ("" if value else " is taken for none")
        yield Finding(name, f"{key} limit", True, detail, note=value == 0)
    if kind == "continuous":
        return
    lower, upper = number(limit, "lower"), number(limit, "upper")
    detail, none = f"lower {lower:g}, upper {upper:g}", lower == upper
    if none:
        detail += ": no range, taken for no limit in a log; a leg cannot walk with it"
    yield Finding(name, "lower limit below the upper", lower <= upper, detail, note=none)
    if kind != "revolute":
        return
    largest, check = max((lower, upper), key=abs), "limits in radians"
    if abs(largest) > MOST_DEGREES:
        yield _note(name, check, f"{largest:g} rad is as good as none")
        return
    detail, fits = f"{lower:g} to {upper:g} rad", abs(largest) <= MOST_TURNS
    if not fits:
        detail = (
            f"{largest:g} rad are {abs(largest) / (2 * math.pi):.1f} turns; degrees? "
            f"{largest:g} deg = {math.radians(largest):.4g} rad; a joint that turns on and on is "
            "of type continuous"
        )
    yield Finding(name, check, fits, detail)


def _sizes(root: ET.Element, bodies: Sequence[Body]) -> Iterator[Finding]:
    """Offsets of joints in metres, inertias that fit the size, and a mass that fits the volume."""
    above: dict[str, tuple[str, float]] = {}  # of a link its parent and the way from there [m]
    for joint in root.findall("joint"):
        (parent, child), (xyz, _) = ends(joint), place(joint)
        offset = float(np.linalg.norm(xyz))
        above[child] = parent, offset
        if offset > LONGEST:
            written = " ".join(f"{x:g}" for x in xyz)
            detail = f"origin {written}: {offset:g} m from its parent; millimetres?"
            yield Finding(_name(joint), "lengths in metres", False, detail)

    def distance(link: str) -> float:
        """From the root along the joints [m]."""
        total = 0.0
        while link in above:
            link, offset = above[link]
            total += offset
        return total

    reach = furthest = max(map(distance, above), default=0.0)
    for body in bodies:
        mass, lever = float(body.inertia.mass), float(np.linalg.norm(body.inertia.lever))
        if mass <= 0:
            continue
        radius = math.sqrt(max(0.0, float(np.linalg.eigvalsh(body.inertia.inertia)[2])) / mass)
        furthest = max(furthest, distance(body.name) + lever + radius)
        if reach + lever > 0 and body.joint:
            detail = (
                f"radius of gyration {radius:.3g} m, the longest chain of joints {reach:.3g} m; "
                "inertia in kg*m^2, mass in kg, lengths in m?"
            )
            fits = radius <= GYRATION * (reach + lever)
            yield Finding(body.name, "inertia fits the size", fits, detail)
    total = sum(float(body.inertia.mass) for body in bodies)
    volume = furthest * furthest * furthest  # where a power overflows
    if total <= 0 or furthest <= 0 or AIR * volume <= total <= HEAVY * volume:
        return
    heavy = total > HEAVY * volume
    filled = (STEEL if heavy else AIR) * volume
    detail = (
        f"{total:.6g} kg within {furthest:.3g} m of its root, where a cube of that edge full of "
        f"{'steel' if heavy else 'air'} weighs {filled:.3g} kg; "
        f"masses in {'g' if heavy else 't, lengths in mm'}? A URDF takes kg and m"
    )
    fits = not heavy or total <= filled
    yield Finding(root.get("name", "robot"), "total mass", fits, detail, note=fits)
