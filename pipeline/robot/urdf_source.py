"""A URDF as text and as elements that know their line, with the faults that readers pass over.

A URDF reader says of a broken file that it is broken. Here every fault is reported with its line
and element, before Pinocchio sees the text.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.parsers import expat

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError, closest, one_line
from actuators.text_file import read_file, utf8

#: Meshes lie in files of their own; the largest URDFs of humanoids have under one megabyte.
LARGEST_URDF = 64 * 2**20  # [bytes]
#: Joints that one coordinate moves.
MOVING = ("revolute", "continuous", "prismatic")
#: What computes as a joint of no coordinate, and what has more than one.
TYPES = (*MOVING, "fixed", "floating", "planar")
INERTIA_KEYS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
#: Shapes, and how many numbers each of their attributes has; a file's name is none.
_SHAPES: Mapping[str, Mapping[str, int]] = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "mesh": {"filename": 0},
}
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_NO_XML = ("solid ", "ply\n", "ply\r\n", "{")  # meshes and JSON, given by mistake


class Placed(ET.Element):
    """An element that knows the line it starts on; 0 where it was not read from a text."""

    line: int = 0


def read_urdf(path: Path) -> str:
    """The text of a URDF file in any encoding it declares.

    Raises:
        LegwattError: There is no such file, or it is no text.
    """
    try:
        content = read_file(path, LARGEST_URDF)
        if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
            return content.decode("utf-16")
        declared = re.match(rb"<\?xml[^>]*encoding=[\"']([\w.:-]+)[\"']", content[:200])
        encoding = declared[1].decode() if declared else "utf-8"
        if encoding.lower() in ("utf-8", "utf8", "us-ascii", "ascii", "utf-16"):
            return utf8(content)
        return content.decode(encoding)
    except LegwattError as error:
        raise LegwattError(f"{path}: {error}") from None
    except (UnicodeDecodeError, LookupError) as error:
        raise LegwattError(f"{path}: cannot be read as text ({one_line(error)})") from None


def parse_elements(text: str, where: str) -> Placed:
    """The elements of a URDF, without a look at what they say.

    Raises:
        LegwattError: Malformed XML, or another kind of file.
    """
    if not text.strip():
        raise LegwattError(f"{where}: the file is empty")
    if text.lstrip().lower().startswith(_NO_XML):
        raise LegwattError(f"{where}: line 1: not XML; a URDF is expected, a file of <robot>")
    builder = ET.TreeBuilder(element_factory=Placed)
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = builder.start(tag, attributes)
        assert isinstance(element, Placed)
        element.line = parser.CurrentLineNumber

    def refuse_entity(name: str, *_: object) -> None:
        # Pinocchio's reader does not know them and would take their names for text.
        raise LegwattError(
            f"{where}: line {parser.CurrentLineNumber}: entity '{one_line(name)}' is declared; "
            "write the text itself"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = refuse_entity
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise LegwattError(
            f"{where}: line {error.lineno}: malformed XML: {reason} at column {error.offset + 1}"
        ) from None
    except ValueError as error:  # lone surrogates
        raise LegwattError(f"{where}: malformed XML: {one_line(error)}") from None
    root = builder.close()
    assert isinstance(root, Placed)
    return root


def shown(element: ET.Element, where: str) -> str:
    """File, line and element, as every message begins."""
    name = element.get("name")
    named = f"<{element.tag}>" if name is None else f"<{element.tag} name='{one_line(name)}'>"
    line = getattr(element, "line", 0)
    return f"{where}: line {line}: {named}" if line else f"{where}: {named}"


def _fault(element: ET.Element, where: str, words: str) -> LegwattError:
    return LegwattError(f"{shown(element, where)}: {words}")


def numbers(element: ET.Element, key: str, where: str, default: Sequence[float]) -> Array:
    """The finite numbers of an attribute.

    `default`: without the attribute; its length is what is expected.

    Raises:
        LegwattError: Another count, or words that are no finite numbers.
    """
    text = element.get(key)
    if text is None:
        return np.array(default, dtype=np.float64)
    parts = text.split()
    if all(_NUMBER.fullmatch(part) for part in parts) and len(parts) == len(default):
        values = np.array([float(part) for part in parts])
        if np.isfinite(values).all():
            return values
    count = "a finite number" if len(default) == 1 else f"{len(default)} finite numbers"
    comma = "; write decimal dots" if re.search(r"\d,\d", text) else ""
    words = f"{key} = '{one_line(text)[:60]}', expected {count}{comma}"
    raise _fault(element, where, words)


def number(element: ET.Element, key: str, where: str = "") -> float:
    """One finite number, zero without the attribute.

    Raises:
        LegwattError: As for `numbers`.
    """
    return float(numbers(element, key, where, (0,))[0])


def place(element: ET.Element, where: str = "") -> tuple[Array, Array]:
    """An element's ``<origin>``: xyz [m] and rpy [rad], zero without one.

    Raises:
        LegwattError: As for `numbers`.
    """
    origin = element.find("origin")
    if origin is None:
        return np.zeros(3), np.zeros(3)
    return numbers(origin, "xyz", where, (0, 0, 0)), numbers(origin, "rpy", where, (0, 0, 0))


def half_size(shape: ET.Element) -> Array | None:
    """Half the edges of the box around a visual or collision shape [m]; None for a mesh."""
    solid = shape.find("geometry/*")
    assert solid is not None  # the structure holds
    if solid.tag == "box":
        return numbers(solid, "size", "", (0, 0, 0)) / 2
    if solid.tag == "mesh":
        return None
    radius = number(solid, "radius")
    if solid.tag == "sphere":
        return np.full(3, radius)
    length = number(solid, "length")
    return np.array([radius, radius, length / 2 + (radius if solid.tag == "capsule" else 0)])


def read_elements(text: str, where: str) -> Placed:
    """The elements of a URDF whose structure holds: every name, number and place was looked at.

    Raises:
        LegwattError: Malformed XML, a wrong root, a name that is missing, doubled or unknown, a
            number that is none, links that are no tree; file, line and element.
    """
    root = parse_elements(text, where)
    if root.tag != "robot":
        known = {"sdf": "SDF", "mujoco": "MJCF"}.get(root.tag)
        what = f" ({known}); convert it to URDF" if known else ""
        raise LegwattError(f"{where}: the root element is <{root.tag}>, expected <robot>{what}")
    for element in root.iter():
        if element.tag.startswith("xacro:"):
            words = "a macro; expand the file first: xacro FILE > robot.urdf"
            raise _fault(element, where, words)
    links, joints = (_named(root, tag, where) for tag in ("link", "joint"))
    if not links:
        raise LegwattError(f"{where}: no <link>; a robot has at least one")
    for link in links.values():
        _check_link(link, where)
    for joint in joints.values():
        _check_joint(joint, list(links), list(joints), where)
    above: dict[str, ET.Element] = {}  # every link but one hangs on one joint, none on itself
    for joint in root.findall("joint"):
        child = ends(joint)[1]
        if child in above:
            words = (
                f"its child '{one_line(child)}' already hangs on joint "
                f"'{one_line(above[child].get('name'))}'; closed chains are no URDF"
            )
            raise _fault(joint, where, words)
        above[child] = joint
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        words = (
            f"hangs on no joint, and neither does '{one_line(roots[0])}'; all links but one are "
            "some joint's child"
        )
        raise _fault(links[roots[1]], where, words)
    reached = list(roots)
    for parent in reached:  # grows while it runs
        reached += [child for child, joint in above.items() if ends(joint)[0] == parent]
    for name, link in links.items():
        if name not in reached:
            words = "the joints above it run in a circle and hang on no root"
            raise _fault(link, where, words)
    return root


def ends(joint: ET.Element) -> tuple[str, str]:
    """Parent and child link of a joint whose structure holds."""
    parent, child = joint.find("parent"), joint.find("child")
    assert parent is not None
    assert child is not None
    return parent.get("link", ""), child.get("link", "")


def _named(root: Placed, tag: str, where: str) -> dict[str, ET.Element]:
    """The root's children of one kind by name."""
    out: dict[str, ET.Element] = {}
    for element in root.findall(tag):
        name = element.get("name", "")
        if not name.strip():
            raise _fault(element, where, "has no name")
        if name in out:
            first = getattr(out[name], "line", 0)
            raise _fault(element, where, f"the name is taken by line {first}; rename one")
        out[name] = element
    return out


def _check_link(link: ET.Element, where: str) -> None:
    inertial = link.find("inertial")
    if inertial is not None:
        place(inertial, where)
        for tag, keys, unit in (("mass", ("value",), "kg"), ("inertia", INERTIA_KEYS, "kg*m^2")):
            element = inertial.find(tag)
            if element is None:
                raise _fault(link, where, f"<inertial> without <{tag}>; give both")
            for key in keys:
                if element.get(key) is None:
                    raise _fault(link, where, f"<{tag}> without {key} [{unit}]")
                try:
                    number(element, key, where)
                except LegwattError as error:  # which link's
                    raise LegwattError(f"{error} (link '{one_line(link.get('name'))}')") from None
    for shape in (*link.findall("visual"), *link.findall("collision")):
        place(shape, where)
        solid = shape.find("geometry/*")
        if solid is None:
            raise _fault(link, where, f"<{shape.tag}> without <geometry> and a shape in it")
        if solid.tag not in _SHAPES:
            raise _fault(link, where, f"shape <{solid.tag}>; {closest(solid.tag, list(_SHAPES))}")
        for key, count in _SHAPES[solid.tag].items():
            if not solid.get(key):
                raise LegwattError(f"{shown(solid, where)} without {key}")
            if count:
                numbers(solid, key, where, (0,) * count)


def _check_joint(joint: ET.Element, links: list[str], joints: list[str], where: str) -> None:
    """Its type, the names of what it joins, its axis, limits and friction."""
    kind, axis, limit = joint.get("type"), joint.find("axis"), joint.find("limit")
    if kind not in TYPES:
        known = f"has no type; known: {', '.join(TYPES)}"
        other = f"type '{one_line(kind)}'; {closest(kind or '', TYPES)}"
        raise _fault(joint, where, known if kind is None else other)
    place(joint, where)
    for tag in ("parent", "child"):
        name = getattr(joint.find(tag), "attrib", {}).get("link")
        if not name:
            raise _fault(joint, where, f"has no <{tag} link=...>")
        if name not in links:
            words = f"{tag} '{one_line(name)}' is no link; {closest(name, links)}"
            raise _fault(joint, where, words)
    if len(set(ends(joint))) == 1:
        raise _fault(joint, where, "parent and child are the same link")
    mimic = joint.find("mimic")
    other = "" if mimic is None else mimic.get("joint", "")
    if mimic is not None and other not in joints:
        words = f"mimics '{one_line(other)}', which is no joint; {closest(other, joints)}"
        raise _fault(joint, where, words)
    directed = kind in (*MOVING, "planar")
    if axis is not None and directed and not numbers(axis, "xyz", where, (1, 0, 0)).any():
        raise _fault(joint, where, f"<axis> '{axis.get('xyz')}' has no direction")
    if limit is None and kind in ("revolute", "prismatic"):
        words = f"a {kind} joint needs <limit> with lower, upper, effort and velocity"
        raise _fault(joint, where, words)
    if limit is not None and kind in MOVING:
        for key in ("effort", "velocity"):
            if limit.get(key) is None:
                raise _fault(joint, where, f"<limit> without {key}")
            if number(limit, key, where) < 0:
                written = one_line(limit.get(key))
                raise _fault(joint, where, f"<limit>: {key} = '{written}', may not be negative")
        for key in ("lower", "upper"):
            number(limit, key, where)
    dynamics = joint.find("dynamics")
    if dynamics is not None:
        for key in ("damping", "friction"):
            number(dynamics, key, where)
