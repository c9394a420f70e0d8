"""A URDF as text, as elements and as a Pinocchio model; that of the hexapod and of its leg, built.

Pinocchio's reader goes on without an element that it cannot read and says so on the standard error
stream alone. Here every such line is a refusal, and so is what it passes over without a word.

The hexapod and its leg on a stand are built from the numbers of their robot files. Zero pose: every
leg plane is vertical and square to the body's x axis, the femur horizontal pointing outward, the
tibia hanging straight down. Positive directions: joint 1 moves the foot forward, joints 2 and 3
raise what lies outboard of them. Left legs mirror right legs, so equal coordinates are mirrored
poses. Joint 1's axis lies in the frontal plane, `joint_1_axis_angle` from the vertical towards the
outside: 0 is an insect-like yaw axis, 90 degrees a lateral axis about which the leg plane swings
fore and aft. Links are solid cuboids (`hexapod.urdf.jinja`).

`python -m pipeline.robot.urdf [FILE...]` (`make urdf`) writes those of robot files with ``build``,
of all in urdf/ by default.
"""

import math
import os
import re
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from actuators.checked import read_bytes, utf8, write_text
from actuators.errors import LegwattError, known, one_line, some
from pipeline.robot.robot_file import STATIONS, RobotSpec, load_robot_file

#: Joints that one coordinate moves.
MOVING = ("revolute", "continuous", "prismatic")
#: No robot's mass, length or inertia is as large in SI; products of what is beyond overflow.
BEYOND = 1e9
#: Attributes of ``<inertia>``, in the order of a symmetric matrix's upper triangle.
INERTIA_KEYS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def read_urdf(path: Path) -> str:
    """The text of a URDF file.

    Raises:
        LegwattError: There is no such file, or it is no text in UTF-8.
    """
    try:
        return utf8(read_bytes(path))
    except LegwattError as error:
        raise LegwattError(f"{path}: {error}") from None


def parse_elements(text: str, where: str) -> ET.Element:
    """The elements of a URDF, comments included, without a look at what they say.

    Raises:
        LegwattError: Malformed XML, or another kind of file.
    """
    if "<xacro:" in re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL):
        raise LegwattError(f"{where}: holds macros; expand them first: xacro FILE > robot.urdf")
    if "<!ENTITY" in text:  # Pinocchio's reader would take its name for text
        raise LegwattError(f"{where}: an <!ENTITY is declared; write the text itself")
    try:
        builder = ET.TreeBuilder(insert_comments=True)
        root = ET.fromstring(text, ET.XMLParser(target=builder))
    except (ET.ParseError, ValueError) as error:  # ValueError: lone surrogates
        empty = "" if text.strip() else "the file is empty: "
        raise LegwattError(f"{where}: {empty}malformed XML: {one_line(error)}") from None
    if root.tag != "robot":
        tag = one_line(root.tag)
        raise LegwattError(f"{where}: root element <{tag}>, expected <robot>; convert it to URDF")
    return root


def parse_urdf(text: str, where: str, *, floating: bool) -> pin.Model:
    """A Pinocchio model from URDF text; a continuous joint is a cosine and a sine.

    Raises:
        LegwattError: Something that Pinocchio's reader does not understand or passes over.
    """
    root = parse_elements(text, where)
    base = [pin.JointModelFreeFlyer()] if floating else []
    said: list[str] = []
    model = None
    with _standard_error(said):
        try:
            model = pin.buildModelFromXML(text, *base)
        except (ValueError, RuntimeError) as error:
            reason = str(error)
    if said or model is None:
        raise LegwattError(f"{where}: {one_line('; '.join(said) or reason)}")
    links = {str(frame.name) for frame in model.frames if frame.type == pin.FrameType.BODY}
    lost = [link.get("name", "") for link in root.findall("link") if link.get("name") not in links]
    if lost:
        words = "hang on no root; joints run in a circle, or a link is the child of two"
        raise LegwattError(f"{where}: {some(lost, 8)} {words}")
    for element in (*root.iterfind("link/inertial/*"), *root.iterfind("joint/origin")):
        for key, written in element.items():
            if any(abs(float(word)) > BEYOND for word in written.split()):
                shown = f"<{element.tag} {key}='{written}'>"
                raise LegwattError(f"{where}: {one_line(shown)} is beyond any robot")
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    for name, joint in joints.items():
        axis, mimic = joint.find("axis"), joint.find("mimic")
        xyz = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
        if joint.get("type") != "fixed" and not any(float(x) for x in xyz.split()):
            raise LegwattError(f"{where}: joint '{name}': axis '{xyz}' has no direction")
        if mimic is not None:
            known(f"joint '{name}' mimics no joint", mimic.get("joint", ""), joints, where)
    return model


@contextmanager
def _standard_error(said: list[str]) -> Iterator[None]:
    """Gather what C++ code calls errors instead of writing it to the process's standard error."""
    sys.stderr.flush()
    saved = os.dup(2)
    with tempfile.TemporaryFile() as sink:
        os.dup2(sink.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            sink.seek(0)
            lines = sink.read().decode("utf-8", "replace").splitlines()
            said += [" ".join(x[6:].split()) for x in lines if x.startswith("Error:")]


def model_of_angles(
    text: str, where: str, *, floating: bool, kind: str = "continuous"
) -> pin.Model:
    """A model whose joints all have one number: a continuous joint is an angle without limits.

    Limits without a range are none, too. With `kind` "fixed" fixed joints turn in place of
    continuous ones, so that every link is a body of its own. Raises as `parse_urdf`.
    """
    root = parse_elements(text, where)
    endless = [joint for joint in root.findall("joint") if joint.get("type") == kind]
    for joint in endless:
        joint.set("type", "revolute")
        axis, limit = joint.find("axis"), joint.find("limit")
        if kind == "fixed" and axis is not None:
            joint.remove(axis)  # it may be zero
        if limit is None:
            limit = ET.SubElement(joint, "limit", {"effort": "0", "velocity": "0"})
        limit.attrib |= {"lower": "0", "upper": "0"}
    if endless:
        text = ET.tostring(root, encoding="unicode")
    model = parse_urdf(text, where, floating=floating)
    lower, upper = model.lowerPositionLimit.copy(), model.upperPositionLimit.copy()
    none = lower == upper
    lower[none], upper[none] = -np.inf, np.inf
    model.lowerPositionLimit, model.upperPositionLimit = lower, upper
    return model


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
