"""From files and changed numbers to a robot and its actuators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from actuators.errors import CatalogError
from actuators.loading.build import CATALOG, Catalog, load_catalog
from pipeline.dynamics.force_rules import GroundForces
from pipeline.effects.model_file import ModelFile, apply_edits, read_model_file
from pipeline.errors import GaitError, RobotFileError
from pipeline.machine.drivetrains import Actuators
from pipeline.machine.motors import Motors, motors_of
from pipeline.machine.own_actuators import OwnActuators, actuator_folder, own_actuators
from pipeline.motion.gait import gait_table
from pipeline.motion.gait_table import spec_with_gait
from pipeline.motion.payload import with_payload
from pipeline.robot.check import refuse_impossible
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import DEFAULT_ROBOT, RobotSpec
from pipeline.simulation.changes import changed
from pipeline.simulation.edited import IDEAL, Effects, effects
from pipeline.simulation.ground_forces.force_choice import ForceChoice
from pipeline.simulation.ground_forces.least_power import Adjust
from pipeline.simulation.memory import refuse_beyond_memory
from pipeline.simulation.walk_stand import Regeneration

#: Every joint's energy is then within 0.7 % of the limit of fine sampling, on every transfer path.
LEAST_SAMPLES = 51
SAMPLES = 751
PAPER_FORCES = ForceChoice()


@dataclass(frozen=True)
class Settings:
    """What a run computes with.

    Attributes:
        robot: Loaded and checked.
        catalog: Actuator components and alternatives.
        regeneration: Policy.
        samples: Per half period of the gait.
        quasi_static: Whether the links' inertial terms are left out.
        changes: What ``--set`` changed, as written.
        remarks: What a reader of the numbers should know of the robot and the changes.
        actuators: Folder of the user's own actuator files; None for the project's catalogue.
        own: What single joints have of their own.
        effects: Of the model file; None without one.
        model: The model file; None without one.
        gait: The gait file; None without one.
        forces: How the ground's forces are chosen.
        compare_forces: Whether the rules for them are to be compared.
    """

    robot: Robot
    catalog: Catalog
    regeneration: Regeneration
    samples: int
    quasi_static: bool
    changes: tuple[str, ...]
    remarks: tuple[str, ...] = ()
    actuators: Path | None = None
    own: OwnActuators = field(default_factory=OwnActuators)
    effects: Effects | None = None
    model: Path | None = None
    gait: Path | None = None
    forces: ForceChoice = PAPER_FORCES
    compare_forces: bool = False

    def chains(self) -> Mapping[str, Actuators]:
        """Every alternative, with the model file's effects in it."""
        chains = self.own.every(self.catalog)
        return chains if self.effects is None else self.effects.chains(chains)

    @property
    def machine(self) -> Robot:
        """The robot with what the model file's effects change in bodies and ground."""
        return self.robot if self.effects is None else self.effects.robot

    @property
    def motors(self) -> Motors:
        """Whose motors drive the joints, and what they weigh."""
        return motors_of(
            self.catalog,
            self.own,
            self.own.every(self.catalog),
            self.robot.joints,
            self.machine.mass,
            stated=self.actuators is not None,
        )

    @property
    def adjust(self) -> Adjust | None:
        """What the model file's effects change in the demand on the actuators."""
        return None if self.effects is None else self.effects.demand

    @property
    def ground(self) -> GroundForces:
        """Rule and friction of the ground's forces."""
        return self.forces.ground(self.chains(), self.regeneration.recovered, self.adjust)


def settings(
    *,
    robot: Path | None = None,
    model: Path | ModelFile | None = None,
    gait: Path | None = None,
    changes: Sequence[str] = (),
    samples: int = SAMPLES,
    quasi_static: bool = False,
    regeneration: str = "none",
    actuators: Path | None = None,
    forces: ForceChoice = PAPER_FORCES,
    compare_forces: bool = False,
    walks: bool = True,
) -> Settings:
    """Load robot, actuators and effects, and apply changes; defaults are the command line's.

    Args:
        robot: Robot file; the model file's or the hexapod by default.
        model: Model file with effects that `gap` found, or what it holds.
        gait: File with a table ``[gait]`` to walk instead of the robot file's.
        changes: ``KEY=VALUE`` each, as ``--set`` takes them.
        samples: Per half period of the gait.
        quasi_static: Whether the links' inertial terms are left out.
        regeneration: ``none``, ``bus`` or a fraction of returned energy that is used again.
        actuators: Folder of actuator files; the project's catalogue by default.
        forces: Rule and friction of the ground's forces.
        compare_forces: Whether what the rules cost is to be compared.
        walks: Whether a gait cycle will be computed, which must fit into memory.

    Raises:
        PipelineError: The robot file or a change cannot be used.
        ActuatorError: A catalogue file or a changed parameter cannot be used.
        GapError: The model file cannot be used, or its effects do not fit the robot.
    """
    _refuse_few(samples)
    path = model if isinstance(model, Path) else None
    file = read_model_file(model, actuators) if isinstance(model, Path) else model
    spec = spec_with_gait(robot or (file.robot if file else DEFAULT_ROBOT), gait)
    actuators = actuators or actuator_folder(spec)
    spec, catalog, remarks = changed(spec, load_catalog(actuators or CATALOG), changes)
    catalog = (own := own_actuators(spec, catalog)).catalog(catalog)
    loaded, warnings = _loaded(spec)
    if walks:
        refuse_beyond_memory(samples, len(loaded.joints), len(catalog.alternatives))
    return Settings(
        robot=loaded,
        catalog=catalog,
        regeneration=_regeneration(regeneration),
        samples=samples,
        quasi_static=quasi_static,
        changes=tuple(changes),
        remarks=(*remarks, *warnings),
        actuators=actuators,
        own=own,
        effects=_effects(file, path or Path("model.toml"), loaded, catalog, own) if file else None,
        model=path,
        gait=gait,
        forces=forces.on(_friction(spec)).checked(catalog.alternatives),
        compare_forces=compare_forces,
    )


def _friction(spec: RobotSpec) -> float | None:
    return gait_table(spec).friction_coefficient if spec.floating else None


def _loaded(spec: RobotSpec) -> tuple[Robot, Sequence[str]]:
    """The robot with its payload, and what of it a reader should know."""
    bare = load_robot(spec)
    return with_payload(bare), refuse_impossible(bare)


def _refuse_few(samples: int) -> None:
    if samples < LEAST_SAMPLES:
        raise GaitError(
            f"--samples {samples}: at least {LEAST_SAMPLES} samples per half period are needed "
            "for energies within 1 %"
        )


def _effects(
    file: ModelFile, path: Path, robot: Robot, catalog: Catalog, own: OwnActuators
) -> Effects:
    """A model file's effects on this robot."""
    names = tuple(edit.effect for edit in file.edits)
    others = [name for name in catalog.alternatives if name != IDEAL]
    if not (file.alternative or others):
        raise CatalogError("effects need an actuator with a motor of its own; add an alternative")
    alternative = file.alternative or others[0]
    return effects(
        robot,
        own.actuators(catalog, alternative),
        lambda m: apply_edits(m, file.edits),
        names,
        path.name,
        found_with=file.alternative,
        warnings=file.changed,
    )


def _regeneration(text: str) -> Regeneration:
    if text in ("none", "bus"):
        return Regeneration(text)
    try:
        share = float(text)
    except ValueError:
        share = -1.0
    if not 0 <= share <= 1:
        raise RobotFileError(
            f"--regeneration {text}: expected none, bus or a fraction between 0 and 1"
        )
    return Regeneration("fraction", share)
