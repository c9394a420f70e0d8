"""Whether a robot can do what its ``[gait]`` says: reach, limits, feet on the ground, balance."""

from __future__ import annotations

from pathlib import Path

from pipeline.dynamics.joint_demand import motion_demand
from pipeline.errors import PipelineError
from pipeline.motion.gait import gait_of
from pipeline.motion.support import stability_margins
from pipeline.motion.walking import walking_motion
from pipeline.robot.check import check_file, check_robot
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_check import Finding

#: In half a period: enough to see limits and balance, too few for energies.
_SAMPLES = 51


def check_gait(robot: Robot) -> list[Finding]:
    """Walk one cycle and say whether it can be walked.

    `robot`: with legs; one on a fixed base walks nowhere, and nothing is judged.
    """
    spec = robot.spec
    if not robot.floating or not spec.legs:
        return []
    try:
        gait = gait_of(spec)
        motion = walking_motion(robot, samples=_SAMPLES)
        motion_demand(robot, motion)  # feet that would have to pull are refused
    except PipelineError as error:
        said = str(error).removeprefix(f"{spec.path}: ")
        return [Finding(spec.name, "gait can be walked", False, said)]
    least = min(float(stability_margins(robot, part).min()) for part in motion.segments)
    detail = f"{gait.title}: least margin of static stability {1e3 * least:.3g} mm"
    return [Finding(spec.name, "gait can be walked", True, detail)]


def check_with_gait(path: Path) -> list[Finding]:
    """Check a robot file and its gait, or a bare URDF.

    `path`: ``.toml`` robot file, URDF, or the name of a robot in ``example-robot-data``.

    Raises:
        PipelineError: The file cannot be read at all.
    """
    if path.suffix.lower() != ".toml":
        return check_file(path)
    robot = load_robot(load_robot_file(path))
    return [*check_robot(robot), *check_gait(robot)]
