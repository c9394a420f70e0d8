"""Standing and walking: one call, one result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.api.machine import Machine
from pipeline.api.result import Result
from pipeline.api.tables import inputs_of, said_of, tables_of_standing, tables_of_walking
from pipeline.dynamics.force_rules import LEAST_TANGENTIAL
from pipeline.machine.joint import Actuators
from pipeline.simulation.edited import IDEAL
from pipeline.simulation.settings import SAMPLES, Settings
from pipeline.simulation.walk_stand import Standing, Walking
from reports.table import Table

if TYPE_CHECKING:
    import pandas

    from actuators.arrays import Array


@dataclass(frozen=True, eq=False)
class Stand(Result):
    """The robot standing still."""

    result: Standing  #: Arrays: posture, demand, contacts, what holds, by alternative.

    @property
    def holding(self) -> Table:
        """Torque, current, voltage and power of every joint and alternative."""
        return self.table("standing")

    @property
    def energy(self) -> Table:
        """Energy by leg and alternative [J]."""
        return self.table("standing_energy")

    @property
    def contacts(self) -> Table:
        """Feet and ground forces."""
        return self.table("standing_contacts")


@dataclass(frozen=True, eq=False)
class Walk(Result):
    """The robot over one gait cycle."""

    #: Arrays: motion, demand, margins, stages and supplies, by alternative.
    result: Walking

    @property
    def demand(self) -> Table:
        """Position, velocity, acceleration and torque of every joint over time."""
        return self.table("walking_joint_demand")

    @property
    def energy(self) -> Table:
        """Electrical energy of one cycle by alternative and leg [J]."""
        return self.table("walking_energy")

    @property
    def stages(self) -> Table:
        """E(+) and E(-) at every stage of every actuator [J]."""
        return self.table("walking_stage_energy")


def stand(
    machine: Machine,
    actuator: str | None = None,
    *,
    forces: str = LEAST_TANGENTIAL,
    friction_coefficient: float | None = None,
) -> Stand:
    """Stand still and hold, as the robot file says.

    Args:
        machine: From `load`, with a floating base.
        actuator: Name of an alternative; all by default.
        forces: Rule of the ground's forces: ``least_tangential`` or ``least_torque``.
        friction_coefficient: Greatest tangential over normal force of a foot [1]; no limit by
            default.

    Raises:
        StanceError: A foot would have to pull or slide.
        PipelineError: The robot stands on a fixed base.
        ActuatorError: No such alternative.
    """
    given = machine.walking(forces=forces, friction_coefficient=friction_coefficient)
    return stood(given, actuator)


def stood(given: Settings, actuator: str | None = None) -> Stand:
    """Standing as settings say; see `stand`."""
    result = given.stand(_beside_ideal(given, actuator))
    tables = tables_of_standing(given, result)
    return Stand("stand", tables, said_of(given), inputs_of(given), result)


def walk(
    machine: Machine,
    actuator: str | None = None,
    *,
    motion: str | Path | pandas.DataFrame | Array | None = None,
    samples: int = SAMPLES,
    quasi_static: bool = False,
    regeneration: str = "none",
    forces: str = LEAST_TANGENTIAL,
    friction_coefficient: float | None = None,
) -> Walk:
    """Walk one cycle of the robot file's gait, or move as given.

    Args:
        machine: From `load`, with a floating base.
        actuator: Name of an alternative, which the ideal one is put beside, since ratios refer to
            it; all alternatives by default.
        motion: CSV file, table or array of time, joint positions and contacts in place of the
            gait, for a robot on a fixed base, too; see `pipeline.simulation.own_motion` for its
            columns.
        samples: Per half period of the gait.
        quasi_static: Leave out the links' inertial terms.
        regeneration: What becomes of returned energy: ``none``, ``bus`` or a fraction.
        forces: Rule of the ground's forces: ``least_tangential`` or ``least_torque``.
        friction_coefficient: Greatest tangential over normal force of a foot [1]; no limit by
            default.

    Raises:
        StanceError: A foot would have to pull or slide.
        PipelineError: The robot stands on a fixed base, or an argument is out of range.
        ActuatorError: No such alternative.
    """
    given = machine.walking(
        motion=motion,
        samples=samples,
        quasi_static=quasi_static,
        regeneration=regeneration,
        forces=forces,
        friction_coefficient=friction_coefficient,
    )
    return walked(given, actuator)


def walked(given: Settings, actuator: str | None = None) -> Walk:
    """Walking as settings say; see `walk`."""
    result = given.walk(_beside_ideal(given, actuator))
    return Walk("walk", tables_of_walking(given, result), said_of(given), inputs_of(given), result)


def _beside_ideal(given: Settings, actuator: str | None) -> Mapping[str, Actuators]:
    if actuator is None:
        return given.chains()
    given.chain(actuator)  # refuses one that there is not
    return given.chains(*(n for n in given.catalog.alternatives if n in (IDEAL, actuator)))
