"""From the options of `gap` to a machine and what its logs must look like."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from actuators.errors import LegwattError
from actuators.loading.build import CATALOG, Catalog
from pipeline.effects.model_file import ModelFile, apply_edits, new_model_file
from pipeline.identification.workflow.options import Options
from pipeline.logs.formats.convert import is_log
from pipeline.logs.log_format import EFFORTS, Expected, expected_of_model, expected_of_robot
from pipeline.logs.reading.mapping import load_mapping
from pipeline.logs.reading.plan import plan_reading
from pipeline.machine.joint import Actuators, drivetrains_of
from pipeline.machine.machine import MachineModel, machine_of_robot, machine_of_urdf
from pipeline.machine.own_actuators import Motors, OwnActuators, motors_of
from pipeline.motion.gait import with_payload
from pipeline.robot.check import check_urdf, refuse_impossible, source_of, tolerated
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.urdf_source import MOVING, parse_elements, read_urdf
from pipeline.simulation.files import Files, read_files, stated

#: The alternative that holds nothing but a motor's data sheet: what gears lose is what a log shows.
DEFAULT_ALTERNATIVE = "rotor"
#: The channel that is compared without an actuator, for a robot file as for a bare URDF.
AT_JOINT = "torque"


@dataclass(frozen=True)
class Setup:
    """The machine as its files describe it."""

    files: Files  #: What was read.
    sources: tuple[Path, ...]  #: Every file that was read, for hashes.
    robot: Robot | None  #: None for a bare URDF.
    model: MachineModel  #: As the workflow computes it.
    expected: Expected  #: What a log of it looks like.
    own: OwnActuators  #: The actuators, with what single joints have of their own.
    alternative: str  #: Name of the actuator chain; empty without one.
    #: The model file whose edits are in `model`; without edits where none was given.
    file: ModelFile
    bare: MachineModel  #: The model before those edits.
    warnings: tuple[str, ...] = ()  #: What of the files a reader should know, in words.
    #: Joints of the URDF that mimic another, to the other's name; no log may move them.
    mimics: Mapping[str, str] = field(default_factory=dict)

    @property
    def catalog(self) -> Catalog:
        """Actuator components and alternatives."""
        return self.own.catalog

    @property
    def path(self) -> Path:
        """Robot file or URDF."""
        return self.files.robot

    @property
    def motors(self) -> Motors | None:
        """Whose motors the logs are compared with; None where torque is compared at the joints."""
        if not self.alternative:
            return None
        mass = float(sum(inertia.mass for inertia in self.bare.rigid.inertias))
        said = self.files.actuators is not None
        return motors_of(self.own, self.bare.joints, mass, self.alternative, stated=said)

    @property
    def legged(self) -> bool:
        """Whether the machine walks, so that its energy per gait cycle can be told."""
        return self.robot is not None and self.robot.floating


def setup(options: Options, files: Files | None = None) -> Setup:
    """Load the robot, its actuator and the model file.

    Args:
        options: Of the run.
        files: What names the machine, where it was read; by the options otherwise.

    Raises:
        LegwattError: The robot file or URDF cannot be used. The catalogue cannot be used, or has no
            such alternative. `--base` does not fit the robot, nothing says how it is driven, or the
            model file cannot be used.
    """
    files = _on_base(files or _files(options), options.base)
    said, path, given_file = stated(files, options.changes), files.robot, files.model
    alternative = _alternative(options, given_file)
    if said.spec is None:
        robot, text, where = None, read_urdf(path), str(path)
        chain = said.own.actuators(alternative) if alternative else None
        bare = machine_of_urdf(path, actuators=chain)
        expected = expected_of_model(
            bare.rigid, bare.name, joints=bare.joints, ratio=_ratio(chain, bare.joints)
        )
        sources: tuple[Path, ...] = (path,)
    else:
        robot = load_robot(said.spec)
        refuse_impossible(robot, tolerant=True)
        text, where = robot.urdf, source_of(robot)
        robot = with_payload(robot)
        # Motor-side positions need a ratio whatever channel is compared.
        usual = alternative or said.own.usual or _default(said.own.catalog)
        chain = said.own.actuators(usual)
        expected = expected_of_robot(robot, ratio=_ratio(chain, robot.joints))
        electrical = options.step == "power" or _channel(options, expected) != AT_JOINT
        if not alternative and electrical:
            alternative = usual
        bare = machine_of_robot(robot, chain if alternative else None)
        sources = (*robot.spec.sources, *(() if robot.spec.build else (robot.spec.urdf,)))
    folder = files.actuators or CATALOG
    edits = given_file.edits if given_file else ()
    noise = given_file.noise if given_file else {}
    # Moving joints that mimic another, to the other's name.
    mimics = {}
    for joint in parse_elements(text, str(path)).findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None and joint.get("type") in MOVING:
            mimics[joint.get("name", "")] = mimic.get("joint", "")
    numbers = ", ".join(f"{key}={value}" for key, value in options.changes.items())
    told = f"numbers changed for this run alone: {numbers}; a model file does not hold them"
    return Setup(
        files=files,
        sources=(*sources, *(sorted(folder.glob("*.toml")) if alternative else ())),
        robot=robot,
        model=apply_edits(bare, edits),
        expected=expected,
        own=said.own,
        alternative=alternative,
        file=replace(new_model_file(path, alternative, folder), edits=edits, noise=noise),
        bare=bare,
        warnings=(
            *([told] if options.changes else []),
            *said.notes,
            *tolerated(check_urdf(text, where)),
            *(given_file.changed if given_file else ()),
        ),
        mimics=mimics,
    )


def _files(options: Options) -> Files:
    return read_files(
        options.robot, model=options.model, gait=options.gait, actuators=options.actuators
    )


def _on_base(files: Files, base: str | None) -> Files:
    """The machine on the base that is asked for."""
    spec = files.spec
    if spec is not None and base == "fixed" and spec.floating:
        return replace(files, spec=replace(spec, floating=False))
    if base in ("level", "measured") and spec is None:
        raise LegwattError(
            f"{files.robot}: a bare URDF stands on a fixed base; write a robot file for "
            f"--base {base}"
        )
    if base in ("level", "measured") and spec is not None and not spec.floating:
        raise LegwattError(f"{files.robot}: its base is fixed; leave --base {base} out")
    return files


def _alternative(options: Options, file: ModelFile | None) -> str:
    """The actuator that options or model file name; empty where neither does."""
    asked: str = options.alternative or ""
    if file is None:
        return asked
    if asked and file.edits and file.alternative and asked != file.alternative:
        raise LegwattError(
            f"{options.model}: its effects were found against '{file.alternative}', which "
            f"--alternative {asked} contradicts; leave one of the two out"
        )
    return asked or file.alternative


def _default(catalog: Catalog) -> str:
    """The alternative of a machine of which nobody says how it is built."""
    if DEFAULT_ALTERNATIVE not in catalog.alternatives:
        known = ", ".join(f"'{name}'" for name in catalog.alternatives)
        raise LegwattError(
            f"nothing says how the machine's joints are driven, and there is no alternative "
            f"'{DEFAULT_ALTERNATIVE}' to assume: name one with --alternative: {known}"
        )
    return DEFAULT_ALTERNATIVE


def _channel(options: Options, expected: Expected) -> str:
    """The effort channel that will be compared, by the first log's header."""
    if options.effort:
        return str(options.effort)
    mapping = load_mapping(options.mapping) if options.mapping else None
    return plan_reading(options.logs[0], expected, mapping).channel


def _ratio(actuators: Actuators | None, joints: tuple[str, ...]) -> np.ndarray | None:
    if actuators is None:
        return None
    return np.array([joint.ratio for joint in drivetrains_of(actuators, joints).joints])


def check_options(options: Options, files: Files | None = None) -> None:
    """Refuse options that cannot be, before anything is read.

    Raises:
        LegwattError: A file that does not exist.
    """
    if not options.logs:
        raise LegwattError(f"gap {options.step}: no log given; name a CSV or Parquet file")
    for path in (*options.logs, *options.holdout):
        if path.is_dir() and not is_log(path):
            raise LegwattError(f"{path}: is a folder; name its CSV or Parquet files")
        if not is_log(path):
            raise LegwattError(f"{path}: no such log; name a CSV or Parquet file")
    for file, what, error in (
        (options.mapping, "mapping", LegwattError),
        (options.model, "model", LegwattError),
    ):
        if file and not file.is_file():
            fact = "is a folder, expected a" if file.is_dir() else "no such"
            raise error(f"{file}: {fact} {what} file")
    if options.step == "shrink" and not (options.model or (files and files.model)):
        raise LegwattError("gap shrink: name the model file to check with --model")
    if options.gait_start is not None and not math.isfinite(options.gait_start):
        raise LegwattError(f"--gait-start {options.gait_start}: expected a time in the log [s]")
    if options.effort and options.effort not in EFFORTS:
        raise LegwattError(f"--effort {options.effort}: expected one of {', '.join(EFFORTS)}")
