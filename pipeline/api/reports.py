"""Everything a run of stand, walk or reports computes, written to a folder."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.api.machine import Machine
from pipeline.api.motion import stood, walked
from pipeline.dynamics.force_rules import LEAST_TANGENTIAL
from pipeline.simulation.settings import SAMPLES, Settings
from pipeline.simulation.walk_stand import Standing, Walking
from reports.folder import staged
from reports.page import plain
from reports.pages.robot_page import limits_text, motors_text, short_titles
from reports.writer import write_tables

if TYPE_CHECKING:
    from pandas import DataFrame

    from pipeline.paper.judgement.judge import Judgement

logger = logging.getLogger("legwatt")


def reports(
    machine: Machine,
    folder: str | Path,
    *,
    samples: int = SAMPLES,
    quasi_static: bool = False,
    regeneration: str = "none",
    forces: str = LEAST_TANGENTIAL,
    friction_coefficient: float | None = None,
    decimal: str = ".",
) -> tuple[str, ...]:
    """Stand, walk, hold it against the paper where it is the paper's robot; tables, figures, page.

    Args:
        machine: From `load`, with a floating base.
        folder: For everything written; a run that it held is replaced.
        samples: Per half period of the gait.
        quasi_static: Leave out the links' inertial terms.
        regeneration: What becomes of returned energy: ``none``, ``bus`` or a fraction.
        forces: Rule of the ground's forces: ``least_tangential`` or ``least_torque``.
        friction_coefficient: Greatest tangential over normal force of a foot [1]; no limit by
            default.
        decimal: ``","`` writes semicolons and decimal commas, for spreadsheets that do.

    Returns:
        What a reader should not overlook, a line each.

    Raises:
        StanceError: A foot would have to pull or slide.
        LegwattError: Unusable input. The folder cannot be written.
    """
    given = machine.walking(
        samples=samples,
        quasi_static=quasi_static,
        regeneration=regeneration,
        forces=forces,
        friction_coefficient=friction_coefficient,
    )
    return write(given, "reports", Path(folder), decimal)


def write(given: Settings, verb: str, folder: Path, decimal: str = ".") -> tuple[str, ...]:
    """Compute what a verb asks for, then write it.

    Args:
        given: Robot and actuators.
        verb: ``stand``, ``walk`` or ``reports``.
        folder: For everything written.
        decimal: Sign of decimals in the tables.

    Returns:
        What was written and what a reader should not overlook, a line each.

    Raises:
        LegwattError: Unusable input. The folder cannot be written.
    """
    said: list[str] = []
    standing = walking = judgement = None
    tables: dict[str, DataFrame] = {}
    if verb != "walk":
        logger.info("standing on %s", ", ".join(given.robot.spec.standing_feet))
        standing = stood(given)
        tables |= standing.tables
    if verb != "stand":
        logger.info("walking one cycle, %d samples per segment", given.samples)
        walking = walked(given)
        tables |= walking.tables
    first = standing or walking
    assert first is not None
    if verb == "reports":
        from pipeline.paper.judgement.basis import basis

        by = basis(given)
        if isinstance(by, str):
            said.append(f"not held against the paper: {by}")
        elif by is not None:
            from pipeline.paper.judgement.judge import judge

            logger.info("holding the run against the paper")
            judgement = judge(given.robot, by, samples=given.samples)
            tables |= judgement.tables
            said += [by.word] if by.word else []
    logger.info("writing tables")
    about: dict[str, Any] = {}
    how: Any = {"inputs": first.inputs, "decimal": decimal, "said": first.meta, "about": about}
    with staged(folder, verb, **how) as out:
        about |= write_tables(tables, out, decimal=decimal)
        files = len(tables)
        if standing and walking and verb == "reports":
            logger.info("drawing figures")
            both = standing.result, walking.result
            files += _pictures(given, both, judgement, tables, out, said)
    said.append(f"{files} tables{' and figures' if verb == 'reports' else ''} in {folder}")
    limits = limits_text(tables, short_titles(given.catalog), given.forces.friction_coefficient)
    motors = (motors_text(given.motors),) if judgement is None else ()
    return (*map(plain, (*motors, *limits)), *said, *given.remarks)


def _pictures(
    given: Settings,
    results: tuple[Standing, Walking],
    judgement: Judgement | None,
    tables: dict[str, DataFrame],
    out: Path,
    said: list[str],
) -> int:
    """Figures and pages; how many files."""
    from pipeline.api.figures import write_fig_21, write_figures
    from pipeline.api.pictures.scene import Scene
    from reports.page import write_page
    from reports.pages.robot_page import robot_page
    from reports.pages.summary import summary

    scene = Scene(given.robot)
    said += filter(None, [scene.remark])
    files = write_figures(scene, given, *results, out, paper=judgement is not None)
    if judgement is None:
        page = robot_page(given, tables, [*said, *given.remarks])
    else:
        titles = {name: a.title.split(": ")[-1] for name, a in given.catalog.alternatives.items()}
        files += write_fig_21(judgement, titles, out)
        page = summary(given, judgement, tables)
    write_page(page, out)
    return files + 1
