"""A report: standing and walking with figures, a page, and the paper's numbers beside them."""

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

logger = logging.getLogger("legwatt")


def overlooked(machine: Machine, tables: Mapping[str, DataFrame]) -> tuple[str, ...]:
    """What a reader of a run should not overlook: whose motors, and what they cannot give."""
    said = motors_text(machine.motors), *limits_text(machine, tables)
    return tuple(map(plain, said))


def write_reports(
    machine: Machine,
    results: tuple[Standing, Walking],
    tables: dict[str, DataFrame],
    meta: Mapping[str, Any],
    folder: Path,
) -> tuple[str, ...]:
    """Write tables, figures and the page.

    Args:
        machine: That stood and walked.
        results: Of standing and walking.
        tables: Of both, by name.
        meta: What the record says of the run.
        folder: For everything written.

    Returns:
        What was written and what a reader should not overlook, a line each.

    Raises:
        LegwattError: The folder cannot be written.
    """
    from pipeline.paper.judgement import judged
    from reports.figures.run import drawings, fig_21
    from reports.figures.style import save_figures
    from reports.pages.robot_page import write_robot_page
    from reports.pages.summary import write_summary

    judgement, word = judged(machine)
    said = [word] if word else []
    tables = tables | (judgement.tables if judgement is not None else {})
    about: dict[str, Any] = {}
    with staged(folder, "reports", inputs=machine.inputs, said=meta, about=about) as out:
        about |= write_tables(tables, out)
        logger.info("drawing figures")
        every = drawings(machine, *results, tables)
        if judgement is None:
            write_robot_page(machine, tables, [*said, *machine.remarks], out)
        else:
            every |= fig_21(tables, short_titles(machine.catalog))
            write_summary(machine, judgement, tables, out)
        save_figures(every, out)
    said.append(f"tables, figures and index.html in {folder}")
    first = overlooked(machine, tables)
    if judgement is not None:  # whose motors are the paper's
        first = first[1:]
    return (*first, *said, *machine.remarks)
