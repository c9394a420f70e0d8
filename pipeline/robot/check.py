"""A robot file or a URDF held against physics, against what it states, and against its mirror."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from actuators.errors import LegwattError, some
from pipeline.robot.published import named_robot
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_check import MERGED, OWN_DRIVE, Finding, check_urdf
from pipeline.robot.urdf_source import read_urdf

__all__ = ["Finding", "check_file", "check_robot", "check_urdf", "refuse_impossible", "refuse_urdf"]

#: Relative, lengths to the leg's: left and right of CAD exports differ.
SYMMETRY_TOLERANCE = 0.01
#: Up to here a difference is one of parts and noted, beyond it is a mistake: a wrong sign makes 2.
SYMMETRY_FAULT = 0.1
#: Of the leg's reach, within which a foot is the mirror image of another.
MIRRORED_FOOT = 0.05
#: Of the stated mass, where the robot file gives no interval: masses are stated in three digits.
MASS_TOLERANCE = 0.005


def check_file(path: Path) -> list[Finding]:
    """Check a robot file or a bare URDF.

    `path`: ``.toml`` robot file, URDF, or the name of a robot in ``example-robot-data``. Returns
    every check with its outcome.

    Raises:
        LegwattError: The file cannot be read at all.
    """
    if path.suffix.lower() == ".toml":
        return check_robot(load_robot(load_robot_file(path)))
    known = named_robot(str(path))
    return check_urdf(known.text if known else read_urdf(path), str(path))


def check_robot(robot: Robot) -> list[Finding]:
    """Check a loaded robot: its URDF, the stated mass, the symmetry of its legs."""
    spec = robot.spec
    # Loading refuses a robot whose names do not resolve.
    named = f"{len(robot.joints)} joints, {len(spec.legs)} feet"
    return [
        *check_urdf(robot.urdf, source_of(robot)),
        *_masses(robot),
        Finding(spec.name, "joints and feet found", True, named),
        *_sliding(robot),
        *_symmetry(robot),
    ]


def _sliding(robot: Robot) -> Iterator[Finding]:
    """Joints whose numbers are metres and newtons under headings for those that turn."""
    detail = (
        "it slides: metres and newtons, also in tables of one row a joint, under headings in rad "
        "and Nm; its actuator's ratio is turned radians per metre"
    )
    for joint in robot.sliding_joints:
        yield Finding(joint, "unit of the joint", True, detail, note=True)


def source_of(robot: Robot) -> str:
    """The file to correct: the robot file where the URDF is built from it."""
    return str(robot.spec.path if robot.spec.build else robot.spec.urdf)


def _masses(robot: Robot) -> Iterator[Finding]:
    """What the bodies weigh against what the robot file states."""
    spec = robot.spec
    row = spec.parameters.parameter("total_mass")
    total, stated = robot.mass, row.value
    apart = abs(total - stated) / stated
    low, high = row.interval or (stated, stated)
    near = low <= total <= high or apart <= MASS_TOLERANCE
    factor = max(total, stated) / min(total, stated) if total > 0 else np.inf
    by = f"{100 * apart:.2g} % apart" if factor < 2 else f"{factor:.3g} times apart"
    detail = f"links add up to {total:.8g} kg, stated {stated:.8g} kg, {by}"
    if not near:
        detail += f" ({100 * MASS_TOLERANCE:g} % or the stated interval allowed); correct one"
    yield Finding(spec.name, "total mass", near, detail)
    if robot.floating:
        base = robot.model.inertias[1].mass
        yield Finding(spec.base_link, "floating base has mass", base > 0, f"{base:.6g} kg")


def refuse_impossible(robot: Robot, *, tolerant: bool = False) -> tuple[str, ...]:
    """Stop before a body that cannot exist gives numbers that look like any other.

    `tolerant`: go on where a finding is tolerable, for a comparison with a log. Returns what was
    found and does no harm, for the run's record.

    Raises:
        LegwattError: A body's mass or inertia is impossible, a limit missing or in another unit, a
            joint without a drive of its own, or another mass than the stated one.
    """
    where = source_of(robot)
    findings = [*check_urdf(robot.urdf, where), *_masses(robot), *_sliding(robot)]
    return refused(findings, where, str(robot.spec.path), tolerant=tolerant)


def refuse_urdf(text: str, where: str) -> None:
    """The same for a bare URDF on a fixed base, with which logs are compared and nothing else done.

    Raises:
        LegwattError: As for `refuse_impossible`. A fault of structure.
    """
    refused(check_urdf(text, where), where, where, tolerant=True)


def tolerated(findings: Sequence[Finding]) -> tuple[str, ...]:
    """What failed and does not stop a comparison with a log, in words."""
    mimics = "it mimics another joint: held still"
    return tuple(
        f"{f.subject}: {f.check} fails "
        f"({mimics if f.check == OWN_DRIVE else f'{f.detail}: kept as stated'})"
        for f in findings
        if not f.passed and f.tolerable
    )


def refused(
    findings: Sequence[Finding], where: str, file: str, *, tolerant: bool = False
) -> tuple[str, ...]:
    """Raise the first finding that failed; return the notes.

    Raises:
        LegwattError: One failed that is not tolerable, or that nothing tolerates.
    """
    failed = [f for f in findings if not f.passed and not (tolerant and f.tolerable)]
    if failed:
        first, more = failed[0], len(failed) - 1
        raise LegwattError(
            f"{where}: {first.subject}: {first.check} fails ({first.detail})"
            + (f", and {more} more" if more else "")
            + f"; `python -m pipeline check {file}` lists all"
        )
    notes = [finding for finding in findings if finding.note and finding.check != MERGED]
    return tuple(f"{subjects}: {said.check}: {said.detail}" for subjects, said in together(notes))


#: Subjects that one line names of those of which the same is said, where they are more.
_SHOWN = 3


def together(findings: Iterable[Finding]) -> Iterator[tuple[str, Finding]]:
    """Findings that say the same as one: their subjects, and the first of them."""
    same: dict[tuple[bool, bool, str, str], list[Finding]] = {}
    for finding in findings:
        key = (finding.passed, finding.note, finding.check, finding.detail)
        same.setdefault(key, []).append(finding)
    for group in same.values():
        yield some([finding.subject for finding in group], _SHOWN), group[0]


def _symmetry(robot: Robot) -> Iterator[Finding]:
    """A leg and its counterpart must be mirror images in masses, places and inertias.

    A robot none of whose hips has a counterpart, as in some stars, is made so, not by mistake.
    """
    legs, check = robot.spec.legs, "mirror symmetry"
    if not any(near is not None for near in _counterparts(robot, robot.chains.offset[0]).values()):
        detail = "no hip is the mirror image of another; left and right are not compared"
        yield Finding(robot.spec.name, check, True, detail, note=True)
        return
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, pin.neutral(robot.model))
    for i, near in _counterparts(robot, np.array([leg.neutral_foot for leg in legs])).items():
        if near is None:
            yield Finding(legs[i].name, check, False, "no right leg with the mirrored foot")
            continue
        left, right, subject = legs[i], legs[near], f"{legs[i].name}/{legs[near].name}"
        if len(left.joints) != len(right.joints):
            detail = f"{len(left.joints)} joints against {len(right.joints)}"
            yield Finding(subject, check, False, detail)
            continue
        worst = max(_mirror_difference(robot, data, i, near, k) for k in range(len(left.joints)))
        yield Finding(
            *(subject, check, worst <= SYMMETRY_FAULT, f"largest relative difference {worst:.2g}"),
            note=SYMMETRY_TOLERANCE < worst <= SYMMETRY_FAULT,
        )


def _counterparts(robot: Robot, points: Array) -> dict[int, int | None]:
    """Of every left leg the right leg whose point mirrors its own, if any does."""
    legs = robot.spec.legs
    right = [k for k, leg in enumerate(legs) if leg.side == "right"]
    out: dict[int, int | None] = {}
    for i, leg in enumerate(legs):
        if leg.side != "left":
            continue
        near = MIRRORED_FOOT * float(robot.chains.reach[i])
        apart = np.linalg.norm(points - points[i] * [1, -1, 1], axis=1)
        partner = min(right, key=lambda k: float(apart[k]), default=None)
        if partner is not None and apart[partner] <= near:
            out[i] = partner
        elif abs(points[i, 1]) > near:
            out[i] = None
    return out


def _mirror_difference(robot: Robot, data: pin.Data, left: int, right: int, k: int) -> float:
    """Largest relative difference of one body and its axis from the mirror image of another.

    In the base frame at the zero pose: which way a file turns its joint frames is its own matter.
    """
    flip = np.diag([1.0, -1.0, 1.0])
    model, chains = robot.model, robot.chains
    base = data.oMi[1 if robot.floating else 0].inverse()
    bodies, places, axes = [], [], []
    for leg in (left, right):
        index = model.getJointId(robot.spec.legs[leg].joints[k])
        places.append(base * data.oMi[index])
        bodies.append(places[-1].act(model.inertias[index]))
        axes.append(places[-1].rotation @ chains.axis[k, leg])
    (a, b), length = bodies, max(float(chains.reach[right]), 1e-6)
    # An axis is a pseudo-vector, and a joint may count either way.
    turn = min(float(np.abs(flip @ axes[0] - sign * axes[1]).max()) for sign in (1.0, -1.0))
    moved = flip @ places[0].translation - places[1].translation
    return max(
        abs(a.mass - b.mass) / max(b.mass, 1e-12),
        float(np.abs(flip @ a.lever - b.lever).max()) / length,
        float(np.abs(flip @ a.inertia @ flip - b.inertia).max())
        / max(float(np.abs(b.inertia).max()), 1e-12),
        float(np.abs(moved).max()) / length,
        turn,
    )
