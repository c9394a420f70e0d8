"""A robot and its actuators as files and changed numbers state them, and how the robot walks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from actuators.errors import LegwattError
from actuators.loading.build import Catalog
from pipeline.dynamics.force_rules import PAPER, GroundForces
from pipeline.dynamics.joint_demand import MotionDemand
from pipeline.effects.model_file import apply_edits
from pipeline.machine.joint import Actuators
from pipeline.machine.own_actuators import Motors, OwnActuators, motors_of
from pipeline.motion.gait import gait_table, with_payload
from pipeline.motion.motion import Motion
from pipeline.robot.check import refuse_impossible
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.files import Files, Stated, stated
from pipeline.simulation.walk_stand import (
    IDEAL,
    Adjust,
    Effects,
    Regeneration,
    Standing,
    Walking,
    demand_along,
    effects,
    stand,
    walk,
)

if TYPE_CHECKING:
    from pandas import DataFrame

    from actuators.arrays import Array

#: Every joint's energy is then within 0.7 % of the limit of fine sampling, on every transfer path.
LEAST_SAMPLES = 51
#: A cycle of a robot of 18 joints then takes some 7 GB of memory.
MOST_SAMPLES = 100_000
SAMPLES = 751


@dataclass(frozen=True, eq=False)
class Settings:
    """A loaded machine, and how it stands and walks."""

    files: Files  #: What the files say.
    changes: Mapping[str, object]  #: Numbers that differ from the files', by the keys of ``--set``.
    bare: Robot  #: The robot without the payload of its gait.
    robot: Robot  #: Loaded and checked, with the payload.
    own: OwnActuators  #: The actuators, with what single joints have of their own.
    effects: Effects | None = None  #: Of the model file; None without one.
    notes: tuple[str, ...] = ()  #: What a reader of the numbers should know of the changes.
    warnings: tuple[str, ...] = ()  #: The same of the robot's bodies.
    samples: int = SAMPLES  #: Per half period of the gait.
    quasi_static: bool = False  #: Whether the links' inertial terms are left out.
    #: What becomes of returned energy.
    regeneration: Regeneration = field(default_factory=Regeneration)
    forces: GroundForces = PAPER  #: How the ground's forces are chosen.
    motion: Motion | None = None  #: In place of the gait; None to walk.
    motion_file: Path | None = None  #: Where it was read; None without a file.

    def walking(
        self,
        *,
        samples: int = SAMPLES,
        quasi_static: bool = False,
        regeneration: str = "none",
        forces: str = PAPER.rule,
        friction_coefficient: float | None = None,
        motion: str | Path | DataFrame | Array | None = None,
    ) -> Settings:
        """The same machine, to walk in this way; defaults are the command line's.

        `regeneration`: ``none``, ``bus`` or a fraction of returned energy that is used again.
        `forces`, `friction_coefficient`: see `GroundForces`; the gait's coefficient holds where
        none is given. `motion`: see `pipeline.simulation.own_motion`. For the rest see `Settings`.

        Raises:
            LegwattError: Too few samples or too many, or forces that cannot be. The motion cannot
                be used. No such regeneration.
        """
        if samples < LEAST_SAMPLES:
            raise LegwattError(
                f"--samples {samples}: at least {LEAST_SAMPLES} samples per half period are needed "
                "for energies within 1 %"
            )
        if motion is not None and samples != SAMPLES:
            raise LegwattError(
                f"--samples {samples}: a motion of its own has the samples of its file"
            )
        if samples > MOST_SAMPLES:
            raise LegwattError(
                f"--samples {samples}: at most {MOST_SAMPLES} samples per half period are taken; "
                f"energies change by less than 1 % from {LEAST_SAMPLES} on"
            )
        spec = self.robot.spec
        if friction_coefficient is None and spec.floating:
            friction_coefficient = gait_table(spec).friction_coefficient
        motion = Path(motion) if isinstance(motion, str) else motion
        moved = None
        if motion is not None:
            from pipeline.simulation.own_motion import read_motion  # pandas, where it is needed

            moved = read_motion(motion, self.machine)
        return replace(
            self,
            samples=samples,
            quasi_static=quasi_static,
            regeneration=regeneration_of(regeneration),
            forces=GroundForces(forces, friction_coefficient),
            motion=moved,
            motion_file=motion if isinstance(motion, Path) else None,
        )

    def stand(self, chains: Mapping[str, Actuators]) -> Standing:
        """Stand still and hold; see `pipeline.simulation.walk_stand.stand`."""
        return stand(self.machine, chains, adjust=self.adjust, forces=self.forces)

    def demand(self, motion: Motion) -> MotionDemand:
        """What a motion demands of the actuators."""
        return demand_along(
            self.machine,
            motion,
            quasi_static=self.quasi_static,
            adjust=self.adjust,
            forces=self.forces,
        )

    def walk(self, chains: Mapping[str, Actuators]) -> Walking:
        """Walk one gait cycle, or move; see `pipeline.simulation.walk_stand.walk`."""
        return walk(
            self.machine,
            chains,
            samples=self.samples,
            quasi_static=self.quasi_static,
            regeneration=self.regeneration,
            adjust=self.adjust,
            forces=self.forces,
            motion=self.motion,
        )

    @property
    def catalog(self) -> Catalog:
        """Actuator components and alternatives."""
        return self.own.catalog

    @cached_property
    def _chains(self) -> dict[str, Actuators]:
        return {}

    def chain(self, alternative: str) -> Actuators:
        """An alternative with the model file's effects in it, built when it is first asked for.

        Raises:
            LegwattError: No such alternative.
        """
        if alternative not in self._chains:
            chain = self.own.actuators(alternative)
            self._chains[alternative] = self.effects.chain(chain) if self.effects else chain
        return self._chains[alternative]

    def chains(self, *names: str) -> Mapping[str, Actuators]:
        """Alternatives by name, all by default; see `chain`."""
        return {name: self.chain(name) for name in names or self.catalog.alternatives}

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a reader of the numbers should know of the changes, the robot and the effects."""
        return (*self.notes, *self.warnings, *(self.effects.remarks if self.effects else ()))

    @property
    def machine(self) -> Robot:
        """The robot with what the model file's effects change in bodies and ground."""
        return self.robot if self.effects is None else self.effects.robot

    @property
    def motors(self) -> Motors:
        """Whose motors drive the joints, and what they weigh."""
        stated = self.files.actuators is not None
        return motors_of(self.own, self.robot.joints, self.machine.mass, stated=stated)

    @property
    def adjust(self) -> Adjust | None:
        """What the model file's effects change in the demand on the actuators."""
        return None if self.effects is None else self.effects.demand


def settings(
    files: Files, changes: Mapping[str, object], before: Settings | None = None
) -> Settings:
    """Apply changed numbers to what the files of a robot say, build robot, actuators and effects.

    `changes`: see `stated`. `before`: made of the same robot: what of it stays is not built again.

    Raises:
        LegwattError: A robot that cannot be, or a change that cannot be used. A changed parameter
            cannot be used. Effects do not fit the robot.
    """
    said = stated(files, changes)
    assert said.spec is not None
    bare, warnings = _bare(said.spec, before)
    robot = before.robot if before and bare is before.bare else with_payload(bare)
    effects = _effects(files, robot, said) if files.model else None
    return Settings(files, changes, bare, robot, said.own, effects, said.notes, warnings)


def _bare(spec: RobotSpec, before: Settings | None) -> tuple[Robot, tuple[str, ...]]:
    """The robot without its payload, and what of its bodies a reader should know."""
    if before is not None:
        old = before.robot.spec
        if spec == old:
            return before.bare, before.warnings
        if replace(spec, gait=old.gait, standing_feet=old.standing_feet) == old:
            return replace(before.bare, spec=spec), before.warnings
    bare = load_robot(spec)
    return bare, refuse_impossible(bare)


def _effects(files: Files, robot: Robot, said: Stated) -> Effects:
    """The model file's effects on this robot."""
    file = files.model
    assert file is not None
    others = [name for name in said.own.catalog.alternatives if name != IDEAL]
    if not (file.alternative or others):
        raise LegwattError("effects need an actuator with a motor of its own; add an alternative")
    return effects(
        robot,
        said.own.actuators(file.alternative or others[0]),
        lambda machine: apply_edits(machine, file.edits),
        tuple(edit.effect for edit in file.edits),
        found_with=file.alternative,
        warnings=file.changed,
    )


def regeneration_of(text: str) -> Regeneration:
    """What an option says of returned energy: ``none``, ``bus`` or a fraction.

    Raises:
        LegwattError: It says something else.
    """
    if text in ("none", "bus"):
        return Regeneration(text)
    try:
        share = float(text)
    except ValueError:
        share = -1.0
    if not 0 <= share <= 1:
        raise LegwattError(
            f"--regeneration {text}: expected none, bus or a fraction between 0 and 1"
        )
    return Regeneration("fraction", share)
