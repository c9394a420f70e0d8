"""From files and changed numbers to a robot and its actuators."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from actuators.errors import ActuatorError, CatalogError, closest, one_line
from actuators.loading.build import CATALOG, Catalog, load_catalog
from actuators.parameters import ParameterSet
from actuators.units import to_si
from pipeline.effects.model_file import ModelFile, apply_edits, read_model_file
from pipeline.errors import GaitError, RobotFileError
from pipeline.machine.drivetrains import Actuators
from pipeline.motion.transfer_path import transfer_path
from pipeline.robot.check import refuse_impossible
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import DEFAULT_ROBOT, RobotSpec, check_parameters, load_robot_file
from pipeline.simulation.edited import IDEAL, Effects, effects
from pipeline.simulation.memory import refuse_beyond_memory
from pipeline.simulation.walk_stand import Adjust, Regeneration

TRANSFER_PATH_KEY = "gait.transfer_path"
#: Every joint's energy is then within 0.7 % of the limit of fine sampling, on every transfer path.
LEAST_SAMPLES = 51
SAMPLES = 751
#: Between these a ratio looks like a slip by a prefix of the unit, the value itself a little off.
_THOUSAND = (200.0, 5000.0)


@dataclass(frozen=True)
class Settings:
    """What a run computes with.

    Attributes:
        robot: Loaded and checked.
        catalog: Actuator components and alternatives.
        regeneration: Policy.
        samples: Per segment of the gait.
        quasi_static: Whether the links' inertial terms are left out.
        changes: What ``--set`` changed, as written.
        remarks: What a reader of the numbers should know of the robot and the changes.
        actuators: Folder of the user's own actuator files; None for the project's catalogue.
        effects: Of the model file; None without one.
        model: The model file; None without one.
    """

    robot: Robot
    catalog: Catalog
    regeneration: Regeneration
    samples: int
    quasi_static: bool
    changes: tuple[str, ...]
    remarks: tuple[str, ...] = ()
    actuators: Path | None = None
    effects: Effects | None = None
    model: Path | None = None

    def chains(self) -> Mapping[str, Actuators]:
        """Every alternative, with the model file's effects in it."""
        chains = self.catalog.chains()
        return chains if self.effects is None else self.effects.chains(chains)

    @property
    def machine(self) -> Robot:
        """The robot with what the model file's effects change in bodies and ground."""
        return self.robot if self.effects is None else self.effects.robot

    @property
    def adjust(self) -> Adjust | None:
        """What the model file's effects change in the demand on the actuators."""
        return None if self.effects is None else self.effects.demand


def settings(
    *,
    robot: Path | None = None,
    model: Path | ModelFile | None = None,
    changes: Sequence[str] = (),
    samples: int = SAMPLES,
    quasi_static: bool = False,
    regeneration: str = "none",
    actuators: Path | None = None,
    walks: bool = True,
) -> Settings:
    """Load robot, actuators and effects, and apply changes; defaults are the command line's.

    Args:
        robot: Robot file; the model file's or the hexapod by default.
        model: Model file with effects that `gap` found, or what it holds.
        changes: ``KEY=VALUE`` each, as ``--set`` takes them.
        samples: Per segment of the gait.
        quasi_static: Whether the links' inertial terms are left out.
        regeneration: ``none``, ``bus`` or a fraction of returned energy that is used again.
        actuators: Folder of actuator files; the project's catalogue by default.
        walks: Whether a gait cycle will be computed, which must fit into memory.

    Raises:
        PipelineError: The robot file or a change cannot be used.
        ActuatorError: A catalogue file or a changed parameter cannot be used.
        GapError: The model file cannot be used, or its effects do not fit the robot.
    """
    path = model if isinstance(model, Path) else None
    file = read_model_file(path) if path else model if isinstance(model, ModelFile) else None
    spec = load_robot_file(robot or (file.robot if file else DEFAULT_ROBOT))
    catalog = load_catalog(actuators or CATALOG)
    if samples < LEAST_SAMPLES:
        raise GaitError(
            f"--samples {samples}: at least {LEAST_SAMPLES} samples per segment are needed "
            "for energies within 1 %"
        )
    remarks = []
    for change in changes:
        key, equals, value = (part.strip() for part in change.partition("="))
        if not equals or not key or not value:
            raise RobotFileError(f"--set {one_line(change)}: expected KEY=VALUE")
        before = spec.parameters
        spec, catalog = _changed(spec, catalog, key, value)
        remarks += _thousandfold(before, spec.parameters, key)
    if changes:
        # After all changes: two numbers that bind each other may be changed together.
        check_parameters(spec.parameters, spec.build, "--set")
    loaded = load_robot(spec)
    remarks += refuse_impossible(loaded)
    if walks:
        refuse_beyond_memory(samples, len(loaded.joints), len(catalog.alternatives))
    return Settings(
        robot=loaded,
        catalog=catalog,
        regeneration=_regeneration(regeneration),
        samples=samples,
        quasi_static=quasi_static,
        changes=tuple(changes),
        remarks=tuple(remarks),
        actuators=actuators,
        effects=_effects(file, path or Path("model.toml"), loaded, catalog) if file else None,
        model=path,
    )


def _effects(file: ModelFile, path: Path, robot: Robot, catalog: Catalog) -> Effects:
    """A model file's effects on this robot."""
    names = tuple(edit.effect for edit in file.edits)
    others = [name for name in catalog.alternatives if name != IDEAL]
    if not (file.alternative or others):
        raise CatalogError("effects need an actuator with a motor of its own; add an alternative")
    alternative = file.alternative or others[0]
    chain = catalog.chain(alternative)
    return effects(
        robot,
        chain,
        lambda m: apply_edits(m, file.edits),
        names,
        path.name,
        found_with=file.alternative,
        warnings=file.changed,
    )


def _changed(spec: RobotSpec, catalog: Catalog, key: str, value: str) -> tuple[RobotSpec, Catalog]:
    """One change; numbers in the unit their file writes."""
    place = f"--set {one_line(key)}={one_line(value)}"
    if key == TRANSFER_PATH_KEY:
        try:
            return replace(spec, transfer_path=transfer_path(value).name), catalog
        except GaitError as error:
            raise RobotFileError(f"{place}: {error}") from None
    references = [f"{component}.{p.name}" for component, p in catalog.rows()]
    if key not in spec.parameters and key not in references:
        known = [TRANSFER_PATH_KEY, *spec.parameters, *references]
        raise RobotFileError(f"{place}: there is no such number; {_hint(key, known)}")
    try:
        if key in spec.parameters:
            unit = spec.parameters.parameter(key).unit
            return spec.with_parameters({key: to_si(_number(place, value), unit)}), catalog
        unit = catalog.parameter(key).unit
        return spec, catalog.replaced(key, to_si(_number(place, value), unit))
    except ActuatorError as error:
        raise RobotFileError(f"{place}: {error}") from None


def _thousandfold(before: ParameterSet, after: ParameterSet, key: str) -> list[str]:
    """Say when a change looks like another unit: about a thousand times more or less."""
    if key not in before or before[key] == 0 or after[key] == 0:
        return []
    ratio = abs(after[key] / before[key])
    if not (_THOUSAND[0] < max(ratio, 1 / ratio) < _THOUSAND[1]):
        return []
    old, new = before.parameter(key), after.parameter(key)
    return [
        f"{key} = {new.value_as_written:g} {new.unit} is about a thousand times "
        f"{'more' if ratio > 1 else 'less'} than the file's {old.value_as_written:g}; --set takes "
        f"it in {new.unit}"
    ]


def _hint(key: str, known: list[str]) -> str:
    hint = closest(key, known)
    # All names fill several screens; parameters.csv has them in order.
    return hint if hint.startswith("did") else "parameters.csv of any run lists all names"


def _number(place: str, text: str) -> float:
    """A finite number in Python's and TOML's writing."""
    try:
        number = float(text)
    except ValueError:
        raise RobotFileError(f"{place}: expected a number in the unit its file writes") from None
    if not math.isfinite(number):
        raise RobotFileError(f"{place}: expected a finite number")
    return number


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
