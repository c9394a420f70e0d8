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
from pipeline.simulation.export import mjcf, ros2_control, urdf
from pipeline.simulation.export.joints import found_text, joint_numbers, left_out
from pipeline.simulation.files import base_model

KINDS = ("mjcf", "urdf", "ros2_control")


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
    """Write the machine of a model file, with what was found on it, as one of `KINDS`.

    `robot`: in place of the model file's. `actuators`: folder; the robot file's or the project's by
    default. `mapping`: mapping file whose ``[pd_gains]`` are the servos' gains.

    Raises:
        GapError: The model file or mapping cannot be used.
        PipelineError: The robot cannot be used.
        ActuatorError: The actuator cannot be used.
    """
    if to not in KINDS:
        raise ModelFileError(f"'{one_line(to)}' is none of the formats; {closest(to, KINDS)}")
    file = read_model_file(model, actuators, robot)
    bare = base_model(file, actuators)
    machine = apply_edits(bare, file.edits)
    numbers = joint_numbers(machine)
    gains = None
    if mapping is not None:
        pd = load_mapping(mapping).pd_gains
        if pd is None:
            raise MappingError(f"{one_line(mapping.name)}: has no [pd_gains]")
        try:
            gains = pd.by_joint(machine.joints)
        except ValueError as error:
            raise MappingError(f"{one_line(mapping.name)}: {error}") from None
    fixed = {"mjcf": mjcf.LEFT, "urdf": urdf.LEFT, "ros2_control": ros2_control.LEFT}[to]
    left = (*left_out(machine, numbers), *fixed)
    remarks = [
        f"{machine.name} with what gap found ({one_line(model.name)}):",
        *(found_text(file.edits) or ["nothing"]),
        "Not carried over:",
        *left,
    ]
    if to == "mjcf":
        text = mjcf.mjcf(machine, numbers, remarks, gains)
    elif to == "ros2_control":
        text = ros2_control.ros2_control(numbers, remarks, gains)
    else:
        bare_urdf = file.robot.suffix.lower() == ".urdf"
        source = (
            read_urdf(file.robot) if bare_urdf else load_robot(load_robot_file(file.robot)).urdf
        )
        text = urdf.urdf(source, str(file.robot), bare, file.edits, numbers, remarks)
    return Exported(text, left, len(numbers), file.changed)
