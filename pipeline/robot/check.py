"""Checks of physical sense on a robot: what readers of URDFs accept in silence is judged here.

Every ``<link>`` is judged as the file has it, and every body as fixed joints merge it, for the
equations of motion know the merged body alone. A sensor's frame of 0 kg on a trunk is no fault; a
negative moment is one even where the sum hides it.

1. joints that move: one at least, each of one coordinate and with a drive of its own;
2. limits: lower below upper, in radians;
3. lengths in metres;
4. mass positive;
5. inertia possible: no negative principal moment, none larger than the sum of the other two
   (Wensing, Kim and Slotine, IEEE RA-L 3(1), 2018);
6. inertia fits the size: radius of gyration and centre of mass against the chains of joints;
7. total mass against the size;
8. total mass against what the robot file states.
"""

import io
import math
import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import LegwattError, one_line, some
from pipeline.robot.robot import Robot
from pipeline.robot.urdf import MOVING, model_of_angles, parse_elements, parse_urdf

#: Of the stated mass, where the robot file gives no interval: masses are stated in three digits.
MASS_TOLERANCE = 0.005
_SHOWN = 3  # subjects that one line names
#: By which two placements may differ: rounding of both readers, in lengths of a metre and radians.
_ALIKE, _POSTURES = 1e-6, 5
#: Excess over what is possible that is rounding, relative to the largest principal moment.
TRIANGLE_TOLERANCE = 1e-6
#: A link's inertia counts from this share of the largest moment of the body it merges into.
MATERIAL = 0.01
#: Radius of gyration below which a body is a point, and its moments are rounding [m].
POINT = 1e-6
#: Joints closer than this are one compound joint; what lies between may be without mass [m].
COMPOUND = 1e-3
#: Revolute joints turn up to some 3 pi from zero; beyond two turns a limit was written in degrees,
#: and beyond the second number, which no angle in degrees reaches, there is none [rad].
MOST_TURNS, MOST_DEGREES = 4 * math.pi, 1440.0
#: Length of one joint's offset that no robot has [m].
LONGEST = 10.0
#: A radius of gyration or a centre of mass so many times the longest chain of joints cannot be [1].
GYRATION = 10.0
#: No robot weighs what steel does in a cube as wide as its longest chain of joints [kg/m^3].
STEEL = 7850.0

MOVE = "joints that move"  # the first check
STILL = "the base is fixed, so that it enters no number"


@dataclass(frozen=True)
class Finding:
    """One thing that was checked."""

    subject: str  #: Link, joint, leg or robot.
    check: str  #: What was asked.
    passed: bool  #: Whether it holds.
    detail: str  #: Numbers, with the remedy where it fails.
    note: bool = False  #: Passed, but the reader should know.
    tolerable: bool = False  #: Failed, but a comparison with a log goes on, with a warning.


def check_urdf(
    text: str, where: str, of_legs: Collection[str] = (), *, floating: bool = True
) -> list[Finding]:
    """Check a URDF's bodies, joints and limits.

    `of_legs`: joints that have to have a drive of their own; any other that mimics one is held.
    `floating`: whether the root moves; on a fixed base its inertia enters no equation of motion,
    and what is wrong with it is noted.

    Raises:
        LegwattError: A fault of structure; one line with its place.
    """
    root, model = parse_elements(text, where), parse_urdf(text, where, floating=False)
    apart = model_of_angles(text, where, floating=False, kind="fixed")  # a body for every link
    ways = [float(np.linalg.norm(place.translation)) for place in model.jointPlacements]
    chain = max(sum(ways[j] for j in support if j > 0) for support in model.supports)  # [m]
    findings = [*_joints(root, of_legs), *_total(root.get("name", "robot"), model, chain)]
    merged: dict[int, list[str]] = {index: [] for index in range(model.njoints)}
    for frame in model.frames:  # parents first
        if frame.type == pin.FrameType.BODY:
            merged[int(frame.parentJoint)].append(str(frame.name))
    for index, links in merged.items():
        largest = float(np.abs(np.linalg.eigvalsh(model.inertias[index].inertia)).max())
        first = len(findings)
        for name in links:
            link = apart.inertias[apart.frames[apart.getBodyId(name)].parentJoint]
            shows = MATERIAL * largest * (len(links) > 1)
            findings += _link(name, link, shows, chain if index else None)
        findings += _body(model, index, links[0])
        if index == 0 and not floating:
            findings[first:] = [
                f if f.passed else replace(f, passed=True, note=True, detail=f"{f.detail}; {STILL}")
                for f in findings[first:]
            ]
    return findings


def _joints(root: ET.Element, of_legs: Collection[str]) -> Iterator[Finding]:
    """Of all joints that are not fixed: one coordinate, a drive of its own, limits, metres."""
    moving = [joint for joint in root.findall("joint") if joint.get("type") != "fixed"]
    if not moving:
        detail = "every joint is fixed, so that nothing is actuated; give one a type that moves"
        yield Finding(root.get("name", "robot"), MOVE, False, detail)
    for joint in moving:
        name, kind, mimic = joint.get("name", ""), joint.get("type", ""), joint.find("mimic")
        if kind not in MOVING:
            detail = f"type '{kind}': joints of one coordinate are computed; make it fixed"
            yield Finding(name, MOVE, False, detail)
        elif mimic is not None:
            other = mimic.get("joint", "")
            still = {name, other}.isdisjoint(of_legs)
            remedy = (
                "both are held still, in no leg" if still else "make it fixed, or remove <mimic>"
            )
            detail = f"it mimics '{other}': a drive of several joints is not computed; {remedy}"
            yield Finding(name, MOVE, still, detail, note=still)
        origin, limit = joint.find("origin"), joint.find("limit")
        xyz = "0 0 0" if origin is None else origin.get("xyz", "0 0 0")
        if math.hypot(*map(float, xyz.split())) > LONGEST:
            detail = f"origin {xyz} m from its parent; millimetres?"
            yield Finding(name, "lengths in metres", False, detail)
        if limit is not None and kind in ("revolute", "prismatic"):
            lower, upper = (float(limit.get(key, 0)) for key in ("lower", "upper"))
            largest, fits = max(abs(lower), abs(upper)), lower <= upper
            detail = f"lower {lower:g}, upper {upper:g}"
            detail += ": no range, taken for no limit" if lower == upper else ""
            if kind == "revolute" and MOST_TURNS < largest <= MOST_DEGREES:
                fits = False
                detail += (
                    f": {largest / (2 * math.pi):.1f} turns; degrees? turns without end: continuous"
                )
            yield Finding(name, "limits", fits, detail, note=lower == upper)


def _link(name: str, link: pin.Inertia, shows: float, chain: float | None) -> Iterator[Finding]:
    """A link as the file has it.

    `shows`: inertia that would show in the body it merges into, 0 where it is the body [kg*m^2].
    `chain`: the longest of joints [m]; None for a link that does not move.
    """
    mass, moments = float(link.mass), np.linalg.eigvalsh(link.inertia)
    if mass < 0:
        yield Finding(name, "mass positive", False, f"{mass:.6g} kg")
        return
    excess, detail = _excess(mass, moments)
    if excess > shows > 0:
        yield Finding(name, "inertia possible", False, detail)
    if mass > 0 and moments[2] >= shows and chain is not None:
        away = float(np.linalg.norm(link.lever))
        radius, most = math.sqrt(max(0.0, moments[2]) / mass), GYRATION * (chain + away)
        detail = (
            f"radius of gyration {radius:.3g} m, centre of mass {away:.3g} m from its frame, the "
            f"longest chain of joints {chain:.3g} m; kg*m^2, kg and m?"
        )
        fits = (radius <= most or most == 0) and away <= max(GYRATION * chain, LONGEST)
        yield Finding(name, "inertia fits the size", fits, detail)


def _body(model: pin.Model, index: int, name: str) -> Iterator[Finding]:
    """The inertia that the equations of motion see."""
    body, joint = model.inertias[index], model.names[index]
    mass, moments = float(body.mass), np.linalg.eigvalsh(body.inertia)
    if mass > 0:
        yield Finding(name, "mass positive", True, f"{mass:.6g} kg")
    elif mass == 0 and index > 0:  # a negative one is its link's finding
        further = [model.jointPlacements[j].translation for j in model.children[index]]
        carries = any(model.inertias[j].mass > 0 for j in model.subtrees[index])
        compound = carries and all(np.linalg.norm(way) < COMPOUND for way in further)
        detail = "0 kg between joints at one place: computed as one compound joint"
        if not compound:
            detail = f"0 kg: '{joint}' moves it; give it an <inertial>, or make the joint fixed"
        yield Finding(name, "mass positive", compound, detail, note=compound)
    if mass > 0 or moments.any():
        excess, detail = _excess(mass, moments)
        finite = mass > 0 and bool(moments[0] >= 0)  # wrong, and a log can show by how much
        yield Finding(name, "inertia possible", excess == 0, detail, tolerable=finite)


def _excess(mass: float, moments: Array) -> tuple[float, str]:
    """By how much an inertia is none [kg*m^2], and what is wrong; 0 where all is right."""
    shown = "moments " + ", ".join(f"{m:.4g}" for m in moments) + " kg*m^2"
    if mass == 0 and moments.any():
        return float(np.abs(moments).max()), f"{shown} without mass"
    rounding = max(TRIANGLE_TOLERANCE * float(np.abs(moments).max()), mass * POINT**2)
    if moments[0] < -rounding:
        return float(-moments[0]), f"{shown}: none may be negative"
    excess = float(moments[2] - moments[0] - moments[1])
    if excess > rounding:
        return excess, f"{shown}: the largest may not exceed the sum of the others"
    return 0.0, shown


def _total(name: str, model: pin.Model, chain: float) -> Iterator[Finding]:
    """A mass that fits the volume."""
    total = float(sum(inertia.mass for inertia in model.inertias))
    size = chain + max(float(np.linalg.norm(inertia.lever)) for inertia in model.inertias)
    steel = STEEL * size * size * size  # where a power overflows
    if chain > 0 and total > steel:
        cube = f"a cube of {size:.3g} m, its reach, full of steel weighs {steel:.3g} kg"
        detail = f"{total:.6g} kg, where {cube}; masses in g? A URDF takes kg and m"
        yield Finding(name, "total mass", False, detail)


def check_robot(robot: Robot) -> list[Finding]:
    """Check a loaded robot: its URDF and the stated mass."""
    spec = robot.spec
    row = spec.parameters.parameter("total_mass")
    total, stated = robot.mass, row.value
    low, high = row.interval or (stated, stated)
    near = low <= total <= high or abs(total - stated) / stated <= MASS_TOLERANCE
    detail = f"links add up to {total:.8g} kg, stated {stated:.8g} kg"
    if not near:
        detail += f" ({100 * MASS_TOLERANCE:g} % or the stated interval allowed); correct one"
    of_legs = [joint for leg in spec.legs for joint in leg.joints]
    findings = check_urdf(robot.urdf, source_of(robot), of_legs, floating=robot.floating)
    findings.append(Finding(spec.name, "total mass", near, detail))
    if robot.floating and robot.model.inertias[1].mass <= 0:
        detail = "0 kg: a floating base needs mass"
        findings.append(Finding(spec.robot.base_link, "mass positive", False, detail))
    return findings


def source_of(robot: Robot) -> str:
    """The file to correct: the robot file where the URDF is built from it."""
    return str(robot.spec.path if robot.spec.robot.build else robot.spec.urdf)


def check_second_reader(urdf: str, where: str) -> Finding:
    """Whether yourdfpy puts every link where Pinocchio does, in postures drawn at random.

    Two parsers that share no code rarely read an axis or an order of angles wrongly in the same
    way. A joint that mimics another is moved like any other.

    `urdf`: its text. `where`: its file, for the finding.
    """
    import yourdfpy

    name, draw = "read alike by a second reader", np.random.default_rng(0)
    try:
        text = io.BytesIO(urdf.encode())
        read = yourdfpy.URDF.load(text, build_scene_graph=False, load_meshes=False).robot
        for joint in read.joints:
            joint.mimic = None
        other = yourdfpy.URDF(read, build_scene_graph=True, load_meshes=False)
        model = pin.buildModelFromXML(urdf)
        data, neutral = model.createData(), pin.neutral(model)
        for _ in range(_POSTURES):
            names, velocity = other.actuated_joint_names, np.zeros(model.nv)
            turn = draw.uniform(-1.0, 1.0, len(names))
            velocity[[model.joints[model.getJointId(joint)].idx_v for joint in names]] = turn
            pin.framesForwardKinematics(model, data, pin.integrate(model, neutral, velocity))
            other.update_cfg(turn)
            for frame, place in zip(model.frames, data.oMf, strict=True):
                if frame.type != pin.FrameType.BODY:
                    continue
                if np.abs(place.homogeneous - other.get_transform(frame.name)).max() > _ALIKE:
                    detail = f"link '{frame.name}' lies elsewhere for Pinocchio than for yourdfpy"
                    return Finding(where, name, False, detail)
    except Exception as error:  # of a library that reads what another one refused to
        detail = f"one of the two cannot read it ({one_line(error)[:80]})"
        return Finding(where, name, True, detail, note=True)
    return Finding(where, name, True, f"{len(read.links)} links in {_POSTURES} postures")


def refused(findings: Sequence[Finding], where: str, *, tolerant: bool = False) -> tuple[str, ...]:
    """Stop before a body that cannot exist gives numbers that look like any other.

    Returns what was found and does no harm, for the run's record.

    `tolerant`: go on where a finding is tolerable, for a comparison with a log.

    Raises:
        LegwattError: One failed that is not tolerable, or that nothing tolerates.
    """
    failed = [f for f in findings if not f.passed]
    kept = [f for f in failed if tolerant and f.tolerable]
    if len(failed) > len(kept):
        failed = [f for f in failed if f not in kept]
        first, more = failed[0], f", and {len(failed) - 1} more" if failed[1:] else ""
        raise LegwattError(
            f"{where}: {first.subject}: {first.check} fails ({first.detail}){more}; "
            f"`check` of it lists all"
        )
    notes = together(finding for finding in findings if finding.note)
    return (
        *(f"{f.subject}: {f.check} fails ({f.detail}): kept as stated" for f in kept),
        *(f"{subjects}: {said.check}: {said.detail}" for subjects, said in notes),
    )


def together(findings: Iterable[Finding]) -> Iterator[tuple[str, Finding]]:
    """Findings that say the same as one: their subjects, and the first of them."""
    same: dict[tuple[bool, bool, str, str], list[Finding]] = {}
    for f in findings:
        same.setdefault((f.passed, f.note, f.check, f.detail), []).append(f)
    for group in same.values():
        yield some([finding.subject for finding in group], _SHOWN), group[0]
