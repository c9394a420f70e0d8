"""A robot or a URDF held against physics and against what its file states."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from actuators.errors import LegwattError, some
from pipeline.robot.published import named_robot
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_check import Finding, check_urdf
from pipeline.robot.urdf_source import read_urdf

__all__ = ["Finding", "check_file", "check_robot", "check_urdf", "refuse_impossible", "refuse_urdf"]

#: Of the stated mass, where the robot file gives no interval: masses are stated in three digits.
MASS_TOLERANCE = 0.005
_SHOWN = 3  # subjects that one line names


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
    """Check a loaded robot: its URDF and the stated mass."""
    return [*check_urdf(robot.urdf, source_of(robot)), *_stated(robot)]


def source_of(robot: Robot) -> str:
    """The file to correct: the robot file where the URDF is built from it."""
    return str(robot.spec.path if robot.spec.build else robot.spec.urdf)


def _stated(robot: Robot) -> Iterator[Finding]:
    """What the bodies weigh against what the robot file states; units of joints that slide."""
    spec = robot.spec
    row = spec.parameters.parameter("total_mass")
    total, stated = robot.mass, row.value
    low, high = row.interval or (stated, stated)
    near = low <= total <= high or abs(total - stated) / stated <= MASS_TOLERANCE
    detail = f"links add up to {total:.8g} kg, stated {stated:.8g} kg"
    if not near:
        detail += f" ({100 * MASS_TOLERANCE:g} % or the stated interval allowed); correct one"
    yield Finding(spec.name, "total mass", near, detail)
    if robot.floating and robot.model.inertias[1].mass <= 0:
        yield Finding(spec.base_link, "mass positive", False, "0 kg: a floating base needs mass")
    detail = (
        "it slides: metres and newtons, also in tables of one row a joint, under headings in rad "
        "and Nm; its actuator's ratio is turned radians per metre"
    )
    for joint in robot.sliding_joints:
        yield Finding(joint, "unit of the joint", True, detail, note=True)


def refuse_impossible(robot: Robot, *, tolerant: bool = False) -> tuple[str, ...]:
    """Stop before a body that cannot exist gives numbers that look like any other.

    `tolerant`: go on where a finding is tolerable, for a comparison with a log. Returns what was
    found and does no harm, for the run's record.

    Raises:
        LegwattError: A check failed.
    """
    where = source_of(robot)
    return refused(check_robot(robot), where, str(robot.spec.path), tolerant=tolerant)


def refuse_urdf(text: str, where: str) -> None:
    """The same for a bare URDF on a fixed base, with which logs are compared and nothing else done.

    Raises:
        LegwattError: As for `refuse_impossible`. A fault of structure.
    """
    refused(check_urdf(text, where), where, where, tolerant=True)


def tolerated(findings: Sequence[Finding]) -> tuple[str, ...]:
    """What failed and does not stop a comparison with a log, in words."""
    return tuple(
        f"{f.subject}: {f.check} fails ({f.detail}): "
        + ("held still" if f.check == "joints that move" else "kept as stated")
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
    notes = together(finding for finding in findings if finding.note)
    return tuple(f"{subjects}: {said.check}: {said.detail}" for subjects, said in notes)


def together(findings: Iterable[Finding]) -> Iterator[tuple[str, Finding]]:
    """Findings that say the same as one: their subjects, and the first of them."""
    same: dict[tuple[bool, bool, str, str], list[Finding]] = {}
    for finding in findings:
        key = (finding.passed, finding.note, finding.check, finding.detail)
        same.setdefault(key, []).append(finding)
    for group in same.values():
        yield some([finding.subject for finding in group], _SHOWN), group[0]
