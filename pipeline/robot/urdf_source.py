"""A URDF as text and as elements that know their line, with the faults that readers pass over.

A URDF reader says of a broken file that it is broken. Here every fault is told with its line and
element, before Pinocchio sees the text.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from actuators.errors import closest, one_line
from actuators.text_file import UnreadableTextError, read_file, utf8
from pipeline.errors import UrdfError

#: Meshes lie in files of their own; the largest URDFs of humanoids have under one megabyte.
LARGEST_URDF = 64 * 2**20  # [bytes]
#: Joints that one coordinate moves.
MOVING = ("revolute", "continuous", "prismatic")
#: What computes as a joint of no coordinate, and what has more than one.
TYPES = (*MOVING, "fixed", "floating", "planar")
INERTIA_KEYS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_NO_XML = ("solid ", "ply\n", "ply\r\n", "{")  # meshes and JSON, given by mistake

Array = NDArray[np.float64]


class Placed(ET.Element):
    """An element that knows the line it starts on; 0 where it was not read from a text."""

    line: int = 0


def read_urdf(path: Path) -> str:
    """The text of a URDF file in any encoding it declares.

    Raises:
        UrdfError: There is no such file, or it is no text.
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
    except UnreadableTextError as error:
        raise UrdfError(f"{path}: {error}") from None
    except (UnicodeDecodeError, LookupError) as error:
        raise UrdfError(f"{path}: cannot be read as text ({one_line(error)})") from None


def parse_elements(text: str, where: str) -> Placed:
    """The elements of a URDF, without a look at what they say.

    Args:
        text: The URDF.
        where: Its file, for messages.

    Raises:
        UrdfError: Malformed XML, or another kind of file.
    """
    if not text.strip():
        raise UrdfError(f"{where}: the file is empty")
    if text.lstrip().lower().startswith(_NO_XML):
        raise UrdfError(f"{where}: line 1: not XML; a URDF is expected, a file of <robot>")
    builder = ET.TreeBuilder(element_factory=Placed)
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = builder.start(tag, attributes)
        assert isinstance(element, Placed)
        element.line = parser.CurrentLineNumber

    def refuse_entity(name: str, *_: object) -> None:
        # Pinocchio's reader does not know them and would take their names for text.
        raise UrdfError(
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
        raise UrdfError(
            f"{where}: line {error.lineno}: malformed XML: {reason} at column {error.offset + 1}"
        ) from None
    except ValueError as error:  # lone surrogates
        raise UrdfError(f"{where}: malformed XML: {one_line(error)}") from None
    root = builder.close()
    assert isinstance(root, Placed)
    return root


def shown(element: ET.Element, where: str) -> str:
    """File, line and element, as every message begins."""
    name = element.get("name")
    named = f"<{element.tag}>" if name is None else f"<{element.tag} name='{one_line(name)}'>"
    line = getattr(element, "line", 0)
    return f"{where}: line {line}: {named}" if line else f"{where}: {named}"


def numbers(element: ET.Element, key: str, where: str, default: Sequence[float]) -> Array:
    """The finite numbers of an attribute.

    Args:
        element: Which holds it.
        key: The attribute.
        where: File, for messages.
        default: Without the attribute; its length is what is expected.

    Raises:
        UrdfError: Another count, or words that are no finite numbers.
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
    raise UrdfError(
        f"{shown(element, where)}: {key} = '{one_line(text)[:60]}', expected {count}{comma}"
    )


def read_elements(text: str, where: str) -> Placed:
    """The elements of a URDF whose structure holds: every name, number and place was looked at.

    Args:
        text: The URDF.
        where: Its file, for messages.

    Raises:
        UrdfError: Malformed XML, a wrong root, a name that is missing, doubled or unknown, a number
            that is none, links that are no tree; file, line and element.
    """
    root = parse_elements(text, where)
    if root.tag != "robot":
        known = {"sdf": "SDF", "mujoco": "MJCF"}.get(root.tag)
        what = f" ({known}); convert it to URDF" if known else ""
        raise UrdfError(f"{where}: the root element is <{root.tag}>, expected <robot>{what}")
    for element in root.iter():
        if element.tag.startswith("xacro:"):
            raise UrdfError(
                f"{shown(element, where)}: a macro; expand the file first: xacro FILE > robot.urdf"
            )
    links = _named(root, "link", where)
    joints = _named(root, "joint", where)
    if not links:
        raise UrdfError(f"{where}: no <link>; a robot has at least one")
    for link in links.values():
        _look_at_link(link, where)
    for joint in joints.values():
        _look_at_joint(joint, list(links), list(joints), where)
    _look_at_tree(root, links, where)
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
        name = element.get("name")
        if not name or not name.strip():
            raise UrdfError(f"{shown(element, where)}: has no name")
        if name in out:
            first = getattr(out[name], "line", 0)
            raise UrdfError(
                f"{shown(element, where)}: the name is taken by line {first}; rename one"
            )
        out[name] = element
    return out


def _origin(element: ET.Element, where: str) -> None:
    origin = element.find("origin")
    if origin is not None:
        numbers(origin, "xyz", where, (0, 0, 0))
        numbers(origin, "rpy", where, (0, 0, 0))


def _look_at_link(link: ET.Element, where: str) -> None:
    inertial = link.find("inertial")
    place = shown(link, where)
    if inertial is not None:
        _origin(inertial, where)
        mass, tensor = inertial.find("mass"), inertial.find("inertia")
        if mass is None or tensor is None:
            lacking = "mass" if mass is None else "inertia"
            raise UrdfError(f"{place}: <inertial> without <{lacking}>; give both")
        if mass.get("value") is None:
            raise UrdfError(f"{place}: <mass> without value [kg]")
        _inertial_number(mass, "value", link, where)
        for key in INERTIA_KEYS:
            if tensor.get(key) is None:
                raise UrdfError(f"{place}: <inertia> without {key} [kg*m^2]")
            _inertial_number(tensor, key, link, where)
    for shape in (*link.findall("visual"), *link.findall("collision")):
        _origin(shape, where)
        _look_at_shape(shape, place, where)


def _inertial_number(element: ET.Element, key: str, link: ET.Element, where: str) -> None:
    try:
        numbers(element, key, where, (0,))
    except UrdfError as error:  # which link's
        raise UrdfError(f"{error} (link '{one_line(link.get('name'))}')") from None


def _look_at_shape(shape: ET.Element, place: str, where: str) -> None:
    geometry = shape.find("geometry")
    if geometry is None or len(geometry) == 0:
        raise UrdfError(f"{place}: <{shape.tag}> without <geometry> and a shape in it")
    solid = geometry[0]
    needs = {
        "box": {"size": 3},
        "sphere": {"radius": 1},
        "cylinder": {"radius": 1, "length": 1},
        "capsule": {"radius": 1, "length": 1},
        "mesh": {},
    }
    if solid.tag not in needs:
        raise UrdfError(f"{place}: shape <{solid.tag}>; {closest(solid.tag, list(needs))}")
    for key, count in needs[solid.tag].items():
        if solid.get(key) is None:
            raise UrdfError(f"{shown(solid, where)} without {key}")
        numbers(solid, key, where, (0,) * count)
    if solid.tag == "mesh" and not solid.get("filename"):
        raise UrdfError(f"{shown(solid, where)} without filename")


def _look_at_joint(joint: ET.Element, links: list[str], joints: list[str], where: str) -> None:
    place = shown(joint, where)
    kind = joint.get("type")
    if kind is None:
        raise UrdfError(f"{place}: has no type; known: {', '.join(TYPES)}")
    if kind not in TYPES:
        raise UrdfError(f"{place}: type '{one_line(kind)}'; {closest(kind, TYPES)}")
    _origin(joint, where)
    for tag in ("parent", "child"):
        end = joint.find(tag)
        name = None if end is None else end.get("link")
        if not name:
            raise UrdfError(f"{place}: has no <{tag} link=...>")
        if name not in links:
            raise UrdfError(f"{place}: {tag} '{one_line(name)}' is no link; {closest(name, links)}")
    if len(set(ends(joint))) == 1:
        raise UrdfError(f"{place}: parent and child are the same link")
    axis = joint.find("axis")
    if axis is not None and kind in (*MOVING, "planar"):
        direction = numbers(axis, "xyz", where, (1, 0, 0))
        if not direction.any():
            raise UrdfError(f"{place}: <axis> '{axis.get('xyz')}' has no direction")
    limit = joint.find("limit")
    if limit is None:
        if kind in ("revolute", "prismatic"):
            raise UrdfError(
                f"{place}: a {kind} joint needs <limit> with lower, upper, effort and velocity"
            )
    elif kind in MOVING:
        for key in ("effort", "velocity"):
            if limit.get(key) is None:
                raise UrdfError(f"{place}: <limit> without {key}")
            if numbers(limit, key, where, (0,))[0] < 0:
                raise UrdfError(
                    f"{place}: <limit>: {key} = '{one_line(limit.get(key))}', may not be negative"
                )
        for key in ("lower", "upper"):
            numbers(limit, key, where, (0,))
    mimic = joint.find("mimic")
    if mimic is not None:
        other = mimic.get("joint", "")
        if other not in joints:
            raise UrdfError(
                f"{place}: mimics '{one_line(other)}', which is no joint; {closest(other, joints)}"
            )
    dynamics = joint.find("dynamics")
    if dynamics is not None:
        for key in ("damping", "friction"):
            numbers(dynamics, key, where, (0,))


def _look_at_tree(root: Placed, links: dict[str, ET.Element], where: str) -> None:
    above: dict[str, ET.Element] = {}
    for joint in root.findall("joint"):
        child = ends(joint)[1]
        if child in above:
            raise UrdfError(
                f"{shown(joint, where)}: its child '{one_line(child)}' already hangs on joint "
                f"'{one_line(above[child].get('name'))}'; closed chains are no URDF"
            )
        above[child] = joint
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        raise UrdfError(
            f"{shown(links[roots[1]], where)}: hangs on no joint, and neither does "
            f"'{one_line(roots[0])}'; all links but one are some joint's child"
        )
    reached = set(roots)
    below: dict[str, list[str]] = {}
    for child, joint in above.items():
        below.setdefault(ends(joint)[0], []).append(child)
    stack = list(roots)
    while stack:
        for child in below.get(stack.pop(), ()):
            reached.add(child)
            stack.append(child)
    for name, link in links.items():
        if name not in reached:
            raise UrdfError(
                f"{shown(link, where)}: the joints above it run in a circle and hang on no root"
            )
