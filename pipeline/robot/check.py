"""A robot or a URDF held against physics and against what its file states."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pinocchio as pin

from actuators.errors import LegwattError, one_line, some
from pipeline.robot.robot import Robot
from pipeline.robot.urdf_check import MOVE, Finding, check_urdf

#: Of the stated mass, where the robot file gives no interval: masses are stated in three digits.
MASS_TOLERANCE = 0.005
_SHOWN = 3  # subjects that one line names
#: By which two placements may differ: rounding of both readers, in lengths of a metre and radians.
_ALIKE, _POSTURES = 1e-6, 5


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
    findings = [*check_urdf(robot.urdf, source_of(robot), of_legs)]
    findings.append(Finding(spec.name, "total mass", near, detail))
    if robot.floating and robot.model.inertias[1].mass <= 0:
        detail = "0 kg: a floating base needs mass"
        findings.append(Finding(spec.base_link, "mass positive", False, detail))
    return findings


def source_of(robot: Robot) -> str:
    """The file to correct: the robot file where the URDF is built from it."""
    return str(robot.spec.path if robot.spec.build else robot.spec.urdf)


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


def tolerated(findings: Sequence[Finding]) -> tuple[str, ...]:
    """What a comparison with a log goes on with all the same, in words."""
    failed = [f for f in findings if not f.passed and f.tolerable]
    held = [f for f in findings if f.passed and f.note and f.check == MOVE]
    return (
        *(f"{f.subject}: {f.check} fails ({f.detail}): kept as stated" for f in failed),
        *(f"{f.subject}: {f.detail}" for f in held),
    )


def refused(
    findings: Sequence[Finding], where: str, file: str, *, tolerant: bool = False
) -> tuple[str, ...]:
    """Stop before a body that cannot exist gives numbers that look like any other.

    Returns what was found and does no harm, for the run's record.

    `tolerant`: go on where a finding is tolerable, for a comparison with a log.

    Raises:
        LegwattError: One failed that is not tolerable, or that nothing tolerates.
    """
    failed = [f for f in findings if not f.passed and not (tolerant and f.tolerable)]
    if failed:
        first, more = failed[0], f", and {len(failed) - 1} more" if failed[1:] else ""
        raise LegwattError(
            f"{where}: {first.subject}: {first.check} fails ({first.detail}){more}; "
            f"`check` of it lists all"
        )
    notes = together(finding for finding in findings if finding.note)
    return tuple(f"{subjects}: {said.check}: {said.detail}" for subjects, said in notes)


def together(findings: Iterable[Finding]) -> Iterator[tuple[str, Finding]]:
    """Findings that say the same as one: their subjects, and the first of them."""
    same: dict[tuple[bool, bool, str, str], list[Finding]] = {}
    for f in findings:
        same.setdefault((f.passed, f.note, f.check, f.detail), []).append(f)
    for group in same.values():
        yield some([finding.subject for finding in group], _SHOWN), group[0]
