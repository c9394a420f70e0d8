"""A machine to ask: robot, actuators, and the effects that a log showed it to have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pipeline.api.init import robot_file_of
from pipeline.effects.model_file import ModelFile, read_model_file
from pipeline.errors import RobotFileError
from pipeline.identification.workflow.model_writer import model_text
from pipeline.robot.published import published_names
from pipeline.robot.robot_file import DEFAULT_ROBOT
from pipeline.simulation.ground_forces.force_choice import ForceChoice
from pipeline.simulation.settings import PAPER_FORCES, Settings, settings
from reports.atomic import write_text


@dataclass(frozen=True)
class Machine:
    """What `load` returns and every other function takes.

    Attributes:
        path: Robot file, or the URDF of a robot on a fixed base.
        actuators: Folder of actuator files; None for the project's catalogue.
        changes: Numbers that differ from the files', ``KEY=VALUE`` each, as ``--set`` takes them.
        model: Effects on top of the files; None without.
        gait: Gait file to walk instead of the robot file's gait; None without.
    """

    path: Path
    actuators: Path | None = None
    changes: tuple[str, ...] = ()
    model: ModelFile | None = None
    gait: Path | None = None

    def settings(
        self,
        *,
        samples: int,
        quasi_static: bool = False,
        regeneration: str = "none",
        forces: ForceChoice = PAPER_FORCES,
        compare_forces: bool = False,
        walks: bool = True,
    ) -> Settings:
        """The machine ready to stand and walk; see `pipeline.simulation.settings.settings`."""
        return settings(
            robot=self.path,
            model=self.model,
            gait=self.gait,
            changes=self.changes,
            samples=samples,
            quasi_static=quasi_static,
            regeneration=regeneration,
            actuators=self.actuators,
            forces=forces,
            compare_forces=compare_forces,
            walks=walks,
        )

    def save(self, path: str | Path) -> Path:
        """Write the effects as a model file, which `load` and the command line's ``--model`` read.

        Changed numbers are not in it: `load` takes them again.

        Raises:
            RobotFileError: The machine has no effects.
            ReportError: The file cannot be written.
        """
        if self.model is None:
            raise RobotFileError(f"{self.path}: the machine has no effects to write")
        file = Path(path)
        write_text(file, model_text(self.model, file.absolute().parent))
        return file


def load(
    robot: str | Path | None = None,
    *,
    model: str | Path | None = None,
    actuators: str | Path | None = None,
    gait: str | Path | None = None,
    changes: Mapping[str, object] | None = None,
) -> Machine:
    """Name a machine by its files, and refuse what cannot be used.

    Args:
        robot: Robot file (.toml), the URDF of a robot on a fixed base, or the name of a robot in
            ``example-robot-data``, with the stance and gait that `init` guesses for it; the model
            file's or the project's hexapod by default.
        model: Model file with effects that `identify` found.
        actuators: Folder of actuator files; the project's catalogue by default.
        gait: File with a table ``[gait]`` to walk instead of the robot file's.
        changes: Name of a number to its value, in the unit its file writes: ``hip_spacing``,
            ``harmonic_drive.load``; what ``[gait]`` states, ``gait.slope_forward`` with its unit in
            the text; ``standing.feet``.

    Raises:
        PipelineError: Robot file or URDF cannot be used; one line says where and what to do.
        ActuatorError: An actuator file cannot be used.
        GapError: The model file cannot be used.
    """
    folder = Path(actuators) if actuators else None
    file = None
    if model is not None:
        file = read_model_file(Path(model), folder)
    path = Path(robot) if robot is not None else file.robot if file else DEFAULT_ROBOT
    if not path.exists() and str(robot) in published_names():
        path = robot_file_of(str(robot))
    texts = tuple(f"{name}={value}" for name, value in (changes or {}).items())
    machine = Machine(path, folder, texts, file, Path(gait) if gait else None)
    if path.suffix.lower() == ".toml":
        machine.settings(samples=51, walks=False)
    elif not path.is_file():
        raise RobotFileError(f"{path}: no such robot file; name a robot file or URDF")
    return machine
