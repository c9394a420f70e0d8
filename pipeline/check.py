"""Physical sense of a robot model: what Pinocchio and yourdfpy accept in silence is judged here.

Inertias must be those of a real distribution of mass: positive mass, positive definite inertia
about the centre of mass, and principal moments that fulfil the triangle inequality (each at most
the sum of the other two; Wensing, Kim and Slotine, IEEE RA-L 3(1), 2018).
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.errors import UrdfError
from pipeline.robot import Robot, load_robot, parse_urdf
from pipeline.robot_file import RobotSpec, load_robot_file

TRIANGLE_TOLERANCE = 1e-6  # relative to the largest principal moment
SYMMETRY_TOLERANCE = 1e-6  # relative
GEOMETRY_MARGIN = 1e-6  # [m]


@dataclass(frozen=True)
class Finding:
    """One thing that was checked.

    Attributes:
        subject: Link, joint, leg or robot.
        check: What was asked.
        passed: Whether it holds.
        detail: Numbers, with the remedy where it fails.
    """

    subject: str
    check: str
    passed: bool
    detail: str


def check_file(path: Path) -> list[Finding]:
    """Check a robot file or a bare URDF.

    Args:
        path: ``.toml`` robot file or URDF.

    Returns:
        Every check with its outcome.

    Raises:
        PipelineError: The file cannot be read at all.
    """
    if path.suffix.lower() == ".toml":
        return check_robot(load_robot(load_robot_file(path)))
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise UrdfError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError):
        raise UrdfError(f"{path}: cannot be read as text") from None
    findings = check_urdf(text, str(path))
    if all(finding.passed for finding in findings):
        parse_urdf(text, str(path), floating=False)  # what is left to refuse: names and topology
    return findings


def check_urdf(text: str, where: str) -> list[Finding]:
    """Check a URDF's inertias and limits.

    Args:
        text: The URDF.
        where: Its file, for messages.

    Raises:
        UrdfError: Malformed XML, or numbers that are none.
    """
    root = _root(text, where)
    return _inertias(root) + _limits(root)


def check_robot(robot: Robot) -> list[Finding]:
    """Check a loaded robot: its URDF, the stated mass, the symmetry of its legs."""
    spec = robot.spec
    total = float(sum(inertia.mass for inertia in robot.model.inertias))
    stated = spec.parameters["total_mass"]
    findings = check_urdf(robot.urdf, str(spec.urdf))
    findings.append(
        Finding(
            spec.name,
            "total mass",
            abs(total - stated) <= 1e-6 * stated,
            f"links add up to {total:.6g} kg, stated {stated:.6g} kg",
        )
    )
    findings.append(
        Finding(
            spec.name,
            "joints and feet found",
            True,  # loading refuses a robot whose names do not resolve
            f"{len(robot.joints)} joints, {len(spec.legs)} feet",
        )
    )
    return findings + _symmetry(robot, spec)


def _root(text: str, where: str) -> ET.Element:
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise UrdfError(f"{where}: malformed XML: {error}") from None
    if root.tag != "robot":
        raise UrdfError(f"{where}: the root element is <{root.tag}>, expected <robot>")
    return root


def _floats(text: str | None, where: str, default: tuple[float, ...]) -> np.ndarray:
    if text is None:
        return np.array(default)
    try:
        values = np.array([float(part) for part in text.split()])
    except ValueError:
        raise UrdfError(f"{where}: '{text}' is not a list of numbers") from None
    if values.size != len(default) or not np.isfinite(values).all():
        raise UrdfError(f"{where}: '{text}' should be {len(default)} finite numbers")
    return values


def _inertias(root: ET.Element) -> list[Finding]:
    findings = []
    for link in root.iter("link"):
        name = link.get("name", "?")
        inertial = link.find("inertial")
        if inertial is None:
            continue
        mass_element, tensor = inertial.find("mass"), inertial.find("inertia")
        if mass_element is None or tensor is None:
            findings.append(
                Finding(name, "inertia complete", False, "give both <mass> and <inertia>")
            )
            continue
        mass = float(_floats(mass_element.get("value"), f"link '{name}' mass", (0.0,))[0])
        findings.append(Finding(name, "mass positive", mass > 0, f"{mass:.6g} kg"))
        six = {
            key: float(_floats(tensor.get(key), f"link '{name}' {key}", (0.0,))[0])
            for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        }
        matrix = np.array(
            [
                [six["ixx"], six["ixy"], six["ixz"]],
                [six["ixy"], six["iyy"], six["iyz"]],
                [six["ixz"], six["iyz"], six["izz"]],
            ]
        )
        moments = np.linalg.eigvalsh(matrix)
        shown = ", ".join(f"{m:.4g}" for m in moments) + " kg*m^2"
        findings.append(
            Finding(name, "inertia positive definite", bool(moments[0] > 0), f"moments {shown}")
        )
        excess = moments[2] - moments[0] - moments[1]
        findings.append(
            Finding(
                name,
                "triangle inequality",
                bool(excess <= TRIANGLE_TOLERANCE * abs(moments[2])),
                f"moments {shown}: the largest may not exceed the sum of the others",
            )
        )
        findings.extend(_centre_in_geometry(link, inertial, name))
    return findings


def _centre_in_geometry(link: ET.Element, inertial: ET.Element, name: str) -> list[Finding]:
    origin = inertial.find("origin")
    centre = _floats(None if origin is None else origin.get("xyz"), f"link '{name}'", (0, 0, 0))
    boxes = []
    for shape in [*link.findall("visual"), *link.findall("collision")]:
        half = _half_size(shape, name)
        if half is None:
            return []  # a mesh: its extent is not known without the mesh file
        place = shape.find("origin")
        at = _floats(None if place is None else place.get("xyz"), f"link '{name}'", (0, 0, 0))
        rpy = _floats(None if place is None else place.get("rpy"), f"link '{name}'", (0, 0, 0))
        boxes.append((at, _rpy_matrix(rpy), half))
    if not boxes:
        return []
    inside = any(
        bool((np.abs(turn.T @ (centre - at)) <= half + GEOMETRY_MARGIN).all())
        for at, turn, half in boxes
    )
    where = "(" + ", ".join(f"{x:.4g}" for x in centre) + ") m"
    return [Finding(name, "centre of mass within the geometry", inside, where)]


def _half_size(shape: ET.Element, name: str) -> np.ndarray | None:
    geometry = shape.find("geometry")
    if geometry is None or len(geometry) == 0:
        return None
    solid = geometry[0]
    where = f"link '{name}' <{solid.tag}>"
    if solid.tag == "box":
        return _floats(solid.get("size"), where, (0, 0, 0)) / 2
    radius = float(_floats(solid.get("radius"), where, (0,))[0])
    if solid.tag == "sphere":
        return np.full(3, radius)
    if solid.tag in ("cylinder", "capsule"):
        length = float(_floats(solid.get("length"), where, (0,))[0])
        return np.array([radius, radius, length / 2 + (radius if solid.tag == "capsule" else 0)])
    return None


def _rpy_matrix(rpy: np.ndarray) -> np.ndarray:
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _limits(root: ET.Element) -> list[Finding]:
    findings = []
    for joint in root.iter("joint"):
        if joint.get("type") not in ("revolute", "prismatic", "continuous"):
            continue
        name = joint.get("name", "?")
        limit = joint.find("limit")
        if limit is None:
            findings.append(Finding(name, "limits present", False, "add a <limit> element"))
            continue
        keys = ["effort", "velocity"]
        keys += ["lower", "upper"] if joint.get("type") != "continuous" else []
        value = {}
        for key in keys:
            if limit.get(key) is not None:
                value[key] = float(_floats(limit.get(key), f"joint '{name}' {key}", (0,))[0])
        missing = [key for key in keys if key not in value]
        sensible = not missing and value["effort"] > 0 and value["velocity"] > 0
        sensible = sensible and value.get("lower", -1.0) < value.get("upper", 1.0)
        detail = f"missing {', '.join(missing)}" if missing else str(value)
        findings.append(Finding(name, "limits present", sensible, detail))
    return findings


def _symmetry(robot: Robot, spec: RobotSpec) -> list[Finding]:
    """A leg and its counterpart must be mirror images in masses, places and inertias."""
    partner = {"left": "right", "right": "left"}
    findings = []
    for leg in spec.legs:
        if leg.side != "left":
            continue
        x, y, z = leg.neutral_foot
        mirrored = [
            other
            for other in spec.legs
            if other.side == partner[leg.side]
            and np.allclose(other.neutral_foot, (x, -y, z), atol=1e-9)
        ]
        subject = leg.name if not mirrored else f"{leg.name}/{mirrored[0].name}"
        if not mirrored:
            findings.append(
                Finding(subject, "mirror symmetry", False, "no right leg with the mirrored foot")
            )
            continue
        worst = max(
            _mirror_difference(robot, a, b)
            for a, b in zip(leg.joints, mirrored[0].joints, strict=True)
        )
        findings.append(
            Finding(
                subject,
                "mirror symmetry",
                worst <= SYMMETRY_TOLERANCE,
                f"largest relative difference {worst:.2g}",
            )
        )
    return findings


def _mirror_difference(robot: Robot, left: str, right: str) -> float:
    flip = np.diag([1.0, -1.0, 1.0])
    model = robot.model
    i, j = model.getJointId(left), model.getJointId(right)
    a, b = model.inertias[i], model.inertias[j]
    scale_inertia = max(float(np.abs(b.inertia).max()), 1e-12)
    place_a, place_b = model.jointPlacements[i], model.jointPlacements[j]
    return max(
        abs(a.mass - b.mass) / max(b.mass, 1e-12),
        float(np.abs(flip @ a.lever - b.lever).max()),
        float(np.abs(flip @ a.inertia @ flip - b.inertia).max()) / scale_inertia,
        float(np.abs(flip @ place_a.translation - place_b.translation).max()),
        float(np.abs(flip @ place_a.rotation @ flip - place_b.rotation).max()),
    )
