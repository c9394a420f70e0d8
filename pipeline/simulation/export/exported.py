"""A model file's machine as other tools read it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from actuators.errors import closest, one_line
from pipeline.effects.model_file import apply_edits, read_model_file
from pipeline.logs.errors import MappingError, ModelFileError
from pipeline.logs.reading.mapping import load_mapping
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file
from pipeline.robot.urdf_source import read_urdf
from pipeline.simulation.export.formats import LEFT, Gains, mjcf, ros2_control, urdf
from pipeline.simulation.export.joints import found_text, joint_numbers, left_out
from pipeline.simulation.files import base_model
from pipeline.simulation.found_bodies import corrected_urdf


@dataclass(frozen=True)
class Exported:
    """A file for another tool."""

    text: str  #: Its contents.
    left: tuple[str, ...]  #: What it cannot hold, in words.
    joints: int  #: How many joints it has.
    remarks: tuple[str, ...]  #: What of the files the machine comes from is odd.


def exported(
    model: Path,
    to: str,
    *,
    robot: Path | None = None,
    actuators: Path | None = None,
    mapping: Path | None = None,
) -> Exported:
    """Write the machine of a model file, with what was found on it, as one of the kinds of `LEFT`.

    `robot`: in place of the model file's. `actuators`: folder; the robot file's or the project's by
    default. `mapping`: mapping file whose ``[pd_gains]`` are the servos' gains.

    Raises:
        GapError: The model file or mapping cannot be used.
        PipelineError: The robot cannot be used.
        ActuatorError: The actuator cannot be used.
    """
    if to not in LEFT:
        raise ModelFileError(f"'{one_line(to)}' is none of the formats; {closest(to, [*LEFT])}")
    file = read_model_file(model, actuators, robot)
    bare = base_model(file, actuators)
    machine = apply_edits(bare, file.edits)
    numbers = joint_numbers(machine)
    gains = _gains(mapping, machine.joints) if mapping is not None else {}
    left = (*left_out(machine, numbers), *LEFT[to])
    remarks = [
        f"{machine.name} with what gap found ({one_line(model.name)}):",
        *(found_text(file.edits) or ["nothing"]),
        "Not carried over:",
        *left,
    ]
    if to == "mjcf":
        text = mjcf(machine, numbers, remarks, gains)
    elif to == "ros2_control":
        text = ros2_control(numbers, remarks, gains)
    else:
        source = _urdf_of(file.robot)
        found = corrected_urdf(source, str(file.robot), bare, file.edits)
        text = urdf(found, numbers, remarks)
    return Exported(text, left, len(numbers), file.changed)


def _urdf_of(robot: Path) -> str:
    if robot.suffix.lower() == ".urdf":
        return read_urdf(robot)
    return load_robot(load_robot_file(robot)).urdf


def _gains(mapping: Path, joints: tuple[str, ...]) -> Gains:
    pd = load_mapping(mapping).pd_gains
    if pd is None:
        raise MappingError(f"{one_line(mapping.name)}: has no [pd_gains]")
    try:
        return pd.by_joint(joints)
    except ValueError as error:
        raise MappingError(f"{one_line(mapping.name)}: {error}") from None
