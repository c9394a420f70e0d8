"""Standing and walking, once or in many cases, and what a motion demands of joints and costs."""

from __future__ import annotations

import argparse
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuators.energy import supply
from actuators.errors import LegwattError
from pipeline.commands.main import (
    OUT,
    AddVerb,
    add_machine_options,
    add_options,
    add_out_option,
    add_verbose_option,
    given_options,
)
from pipeline.commands.robots import machine_of, walking_machine
from pipeline.result import Result, of_table
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import (
    USUAL,
    Demand,
    Standing,
    Walking,
    WalkOptions,
    tables_of_standing,
    tables_of_walking,
)

if TYPE_CHECKING:
    from pandas import DataFrame

    from actuators.arrays import Array

logger = logging.getLogger("legwatt")


@dataclass(frozen=True, eq=False)
class Stand(Result):
    """The robot standing still."""

    shown = "standing_energy"
    result: Standing  #: Arrays: posture, demand, contacts, what holds, by drivetrain.
    #: Torque, current, voltage and power of every joint and drivetrain.
    holding = of_table("standing")
    energy = of_table("standing_energy")  #: By leg and drivetrain [J].
    contacts = of_table("standing_contacts")  #: Feet and ground forces.

    def printed(self, table: DataFrame) -> DataFrame:
        """Energy by drivetrain option and leg."""
        wide = table.pivot(index="alternative", columns="leg", values="energy_J")
        rows, columns = (table[name].unique() for name in ("alternative", "leg"))
        return wide.loc[rows, columns].add_suffix("_J").reset_index()


@dataclass(frozen=True, eq=False)
class Walk(Result):
    """The robot over one gait cycle, or another motion."""

    shown = "robot_energy"
    result: Walking  #: Arrays: motion, demand, margins, stages and supplies, by drivetrain.
    #: Position, velocity, acceleration and torque of every joint over time.
    demand = of_table("walking_joint_demand")
    energy = of_table("walking_energy")  #: Electrical, of one cycle by drivetrain and leg [J].
    stages = of_table("walking_stage_energy")  #: E(+) and E(-) of every drivetrain [J].


def stand(machine: Machine, actuator: str | None = None, **options: Any) -> Stand:
    """Stand still and hold, as the robot file says.

    Args:
        machine: From `load`, with a floating base.
        actuator: Name of a drivetrain option; all by default.
        **options: See `pipeline.simulation.walk_stand.WalkOptions`.

    Raises:
        StanceError: A foot would have to pull or slide.
        LegwattError: The robot stands on a fixed base. No such drivetrain or option.
    """
    own = machine.walking(**options) if options or machine.options is USUAL else machine
    result = own.stand(own.beside_ideal(actuator))
    return Stand("stand", tables_of_standing(own, result), own.record, own.inputs, result)


def walk(machine: Machine, actuator: str | None = None, **options: Any) -> Walk:
    """Walk one cycle of the robot file's gait, or move as given.

    Args:
        machine: From `load`, with a floating base where it walks its gait.
        actuator: Name of a drivetrain option, which the ideal one is put beside, since ratios refer
            to it; all by default.
        **options: See `pipeline.simulation.walk_stand.WalkOptions`.

    Raises:
        StanceError: A foot would have to pull or slide.
        LegwattError: The robot stands on a fixed base, or an option is out of range. No such
            drivetrain.
    """
    own = machine.walking(**options) if options or machine.options is USUAL else machine
    result = own.walk(own.beside_ideal(actuator))
    return Walk("walk", tables_of_walking(own, result), own.record, own.inputs, result)


def demand(machine: Machine, motion: Any = None, **options: Any) -> Demand:
    """What one cycle of a machine's gait, or another motion, demands of its joints.

    It holds for every machine whose bodies, gait and effects on bodies are the same: other
    actuators do not change it.

    Args:
        machine: From `load`, with a floating base where it walks its gait.
        motion: CSV file or DataFrame in place of the gait; see `WalkOptions`.
        **options: See `pipeline.simulation.walk_stand.WalkOptions`.

    Raises:
        StanceError: A foot would have to pull or slide.
        LegwattError: The robot stands on a fixed base, or the motion or an option cannot be used.
    """
    return machine.walking(motion=motion, **options).demand()


def energy(
    machine: Machine, demand: Demand, actuator: str | None = None, *, regeneration: str = "none"
) -> Mapping[str, Array]:
    """Electrical energy that a demand takes from the supply.

    No file is read and no table made: for 51 samples of 18 joints 0.2 to 0.7 ms per drivetrain.

    Args:
        machine: Whose actuators answer.
        demand: From `demand`, of this machine or of one that differs in actuators alone.
        actuator: Name of a drivetrain option; all by default.
        regeneration: What becomes of returned energy: ``none``, ``bus`` or a fraction.

    Returns:
        By drivetrain, for each joint (J,) [J]; one number (1,) for joints that share a bus.

    Raises:
        LegwattError: The robot has no actuators or other joints than the demand, or no such
            regeneration. No such drivetrain.
    """
    if demand.joints != machine.robot.joints:
        raise LegwattError(f"{machine.path}: the demand is of a robot with other joints")
    chains = machine.chains(*([actuator] if actuator else []))
    return {
        name: supply(chain.inverse(demand.series), regeneration).supplied_energy
        for name, chain in chains.items()
    }


def reports(machine: Machine, folder: str | Path, **options: Any) -> tuple[str, ...]:
    """Stand, walk, hold it against the paper where it is the paper's robot; tables, figures, page.

    Args:
        machine: From `load`, with a floating base.
        folder: For everything written; a run that it held is replaced.
        **options: See `pipeline.simulation.walk_stand.WalkOptions`.

    Returns:
        What a reader should not overlook, a line each.

    Raises:
        LegwattError: Unusable input, a robot that cannot stand or walk, a folder that cannot be
            written.
    """
    from reports.run import write_reports

    own = machine.walking(**options)
    logger.info("standing, and walking one cycle, %d samples per segment", own.options.samples)
    standing, walking = stand(own), walk(own)
    results, tables = (standing.result, walking.result), standing.tables | walking.tables
    return write_reports(own, results, tables, standing.meta, Path(folder))


def add_verbs(add: AddVerb) -> None:
    """Declare the verbs stand, walk, reports and sweep."""
    shared = [name for name in WalkOptions.model_fields if name != "motion"]
    for verb, text in (
        ("stand", "standing still: torques, currents, power of every drivetrain option"),
        ("walk", "one walking cycle: demand, stage energies, losses, limits"),
        ("reports", "stand and walk, with all figures and a page, index.html"),
    ):
        sub = add(verb, text, run_reports)
        add_machine_options(sub, "robot file")
        add_options(sub, WalkOptions, *shared, *(["motion"] if verb == "walk" else []))
        add_out_option(sub)
        add_verbose_option(sub)
    text = "walk with many speeds, loads, postures, dimensions; a row for each case and actuator"
    sub = add("sweep", text, run_sweep)
    sub.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="NAME=VALUES",
        help="a number of --set with its values, 'speed=0.1:0.4:7 m/s' (first, last, how many), "
        "or 'payload_mass=0,5,10 kg'; 'gait.' may be left out",
    )
    add_machine_options(sub, "robot file")
    add_options(sub, WalkOptions, *shared, samples=101)
    text = "number of processes, 2, or the address of a Dask scheduler, such as tcp://host:8786"
    sub.add_argument("--workers", type=number_or_address, default=2, metavar="N|ADDRESS", help=text)
    add_out_option(sub, OUT / "sweep")
    add_verbose_option(sub)


def number_or_address(text: str) -> int | str:
    """How many processes, or where a scheduler is."""
    return text if "://" in text else int(text)


def run_reports(options: argparse.Namespace) -> int:
    """Compute what the verb asks for and write it to the output folder."""
    from reports.run import overlooked

    machine = walking_machine(options)
    if options.verb == "reports":
        lines = reports(machine, options.out, **dict(machine.options))
    else:
        result = stand(machine) if options.verb == "stand" else walk(machine)
        result.save(options.out)
        many = f"{len(result.tables)} tables in {options.out}"
        lines = (*overlooked(machine, result.tables), *machine.remarks, str(result), many)
    print(*lines, sep="\n")
    return 0


def run_sweep(options: argparse.Namespace) -> int:
    """Walk every case; 1 where the robot walks in none."""
    from pipeline.sweeps import sweep

    how = given_options(options, WalkOptions)
    done = sweep(machine_of(options), options.vary, options.out, workers=options.workers, **how)
    done.save(options.out)
    done.point.unlink(missing_ok=True)
    print(done)
    return int(done.refused.total() == done.rows["case"].nunique())
