"""Everything a run of stand, walk or reports computes, written to a folder."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import Standing, Walking
from reports.folder import staged
from reports.page import plain
from reports.pages.robot_page import limits_text, motors_text, short_titles
from reports.writer import write_tables

if TYPE_CHECKING:
    from pandas import DataFrame

    from pipeline.paper.judgement import Judgement

logger = logging.getLogger("legwatt")


def write_run(
    machine: Machine,
    verb: str,
    results: tuple[Standing | None, Walking | None],
    tables: dict[str, DataFrame],
    record: tuple[tuple[Path, ...], Mapping[str, Any]],
    folder: Path,
    decimal: str = ".",
) -> tuple[str, ...]:
    """Write a run: tables; for ``reports`` figures, a page, and the paper's numbers beside it.

    Args:
        machine: That stood and walked.
        verb: ``stand``, ``walk`` or ``reports``.
        results: Of standing and walking.
        tables: By file name.
        record: Files that were read, and what the record says of the run.
        folder: For everything written.
        decimal: Sign of decimals in the tables.

    Returns:
        What was written and what a reader should not overlook, a line each.

    Raises:
        LegwattError: The folder cannot be written.
    """
    said: list[str] = []
    judgement: Judgement | None = None
    if verb == "reports":
        from pipeline.paper.judgement import judged

        judgement, word = judged(machine)
        said += [word] if word else []
        tables = tables | (judgement.tables if judgement else {})
    logger.info("writing tables")
    about: dict[str, Any] = {}
    inputs, meta = record
    how: Any = {"inputs": inputs, "decimal": decimal, "said": meta, "about": about}
    standing, walking = results
    with staged(folder, verb, **how) as out:
        about |= write_tables(tables, out, decimal=decimal)
        if standing and walking and verb == "reports":
            logger.info("drawing figures")
            said += _pictures(machine, (standing, walking), judgement, tables, out, said)
    what = "tables, figures and index.html" if verb == "reports" else f"{len(tables)} tables"
    said.append(f"{what} in {folder}")
    limits = limits_text(tables, short_titles(machine.catalog), machine.forces.friction_coefficient)
    motors = (motors_text(machine.motors),) if judgement is None else ()
    return (*map(plain, (*motors, *limits)), *said, *machine.remarks)


def _pictures(
    machine: Machine,
    results: tuple[Standing, Walking],
    judgement: Judgement | None,
    tables: dict[str, DataFrame],
    out: Path,
    said: list[str],
) -> list[str]:
    """Figures and page; what is to be said of meshes."""
    from reports.figures.run import drawings, fig_21
    from reports.figures.style import save_figures
    from reports.scene import Scene

    scene = Scene(machine.robot)
    every = drawings(scene, machine, *results, tables)
    remarks = [scene.remark] if scene.remark else []
    if judgement is None:
        from reports.pages.robot_page import write_robot_page

        write_robot_page(machine, tables, [*said, *remarks, *machine.remarks], out)
    else:
        from reports.pages.summary import write_summary

        every |= fig_21(tables, short_titles(machine.catalog))
        write_summary(machine, judgement, tables, out)
    save_figures(every, out)
    return remarks
