"""From the command line's options to a robot and its actuators."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace

from actuators.build import Catalog, load_catalog
from actuators.errors import closest
from actuators.units import to_si
from pipeline.app.compute import Regeneration
from pipeline.errors import RobotFileError
from pipeline.robot import Robot, load_robot
from pipeline.robot_file import RobotSpec, load_robot_file
from pipeline.transfer_path import transfer_path

TRANSFER_PATH_KEY = "gait.transfer_path"


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
    """

    robot: Robot
    catalog: Catalog
    regeneration: Regeneration
    samples: int
    quasi_static: bool
    changes: tuple[str, ...]


def settings(options: argparse.Namespace) -> Settings:
    """Load what the options name and apply their changes.

    Raises:
        PipelineError: The robot file or a change cannot be used.
        ActuatorError: A catalogue file or a changed parameter cannot be used.
    """
    spec = load_robot_file(options.robot)
    catalog = load_catalog()
    for change in options.set:
        key, equals, value = change.partition("=")
        if not equals or not key or not value:
            raise RobotFileError(f"--set {change}: expected KEY=VALUE")
        spec, catalog = _changed(spec, catalog, key.strip(), value.strip())
    return Settings(
        robot=load_robot(spec),
        catalog=catalog,
        regeneration=_regeneration(options.regeneration),
        samples=options.samples,
        quasi_static=options.quasi_static,
        changes=tuple(options.set),
    )


def _changed(spec: RobotSpec, catalog: Catalog, key: str, value: str) -> tuple[RobotSpec, Catalog]:
    if key == TRANSFER_PATH_KEY:
        return replace(spec, transfer_path=transfer_path(value).name), catalog
    references = [f"{component}.{p.name}" for component, p in catalog.rows()]
    known = [TRANSFER_PATH_KEY, *spec.parameters, *references]
    if key in spec.parameters:
        unit = spec.parameters.parameter(key).unit
        return spec.with_parameters({key: to_si(_number(key, value), unit)}), catalog
    if key in references:
        unit = catalog.parameter(key).unit
        return spec, catalog.replaced(key, to_si(_number(key, value), unit))
    raise RobotFileError(f"--set {key}: there is no such number; {closest(key, known)}")


def _number(key: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise RobotFileError(
            f"--set {key}={text}: expected a number in the unit its file writes"
        ) from None


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
