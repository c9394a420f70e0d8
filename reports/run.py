"""A report: standing and walking, figures, a page; tables by `pipeline.simulation.tables`."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.motion.gait import gait_table
from pipeline.paper.judgement import NO_LOAD_CURRENT, NOTABLE, REPRODUCED, Judgement, judged
from pipeline.paper.published import EVEN, ROLES
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import Standing, Walking
from reports.folder import staged, write_tables
from reports.page import plain, rendered, write_page
from reports.pages.robot_page import (
    facts,
    limits_text,
    motors_text,
    short_titles,
    write_robot_page,
)

if TYPE_CHECKING:
    from pandas import DataFrame

logger = logging.getLogger("legwatt")


#: Sentences of the paper whose numbers stand first, where the run has them.
_FIRST = ("walking_ratio_reversible", "walking_ratio_irreversible", EVEN)
_ENDS = ["prior_low", "prior_high", "left_out_low", "left_out_high"]


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
    from reports.figures.run import drawings, fig_21
    from reports.figures.style import save_figures

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
            _write_summary(machine, judgement, tables, out)
        save_figures(every, out)
    said.append(f"tables, figures and index.html in {folder}")
    first = overlooked(machine, tables)
    if judgement is not None:  # whose motors are the paper's
        first = first[1:]
    return (*first, *said, *machine.remarks)


def _write_summary(
    given: Machine, judged: Judgement, tables: Mapping[str, DataFrame], folder: Path
) -> None:
    """Write ``index.html`` of the paper's robot; its figures are those of `reports.figures.run`."""
    study = judged.by.results
    first = judged.tables["conclusions"].filter(_FIRST, axis="index").to_dict("index")
    more = facts(given, tables) | {"whose": motors_text(given.motors, "the paper's")}
    write_page(
        "paper",
        folder,
        tables,
        title="What it costs to actuate the hexapod, and whether the model agrees with the paper",
        first=first,
        even=EVEN,
        answer=_first_lines(judged, tables),
        roles=ROLES,
        ends=_ENDS if study else [],
        shares=["prior_holds_share", "left_out_holds_share"] if study else [],
        study=study,
        no_load=(NOTABLE - 1, 1e3 * NO_LOAD_CURRENT),
        transfer_path=gait_table(given.robot.spec).transfer_path,
        remarks=(),
        **more,
    )


def _first_lines(judged: Judgement, tables: Mapping[str, DataFrame]) -> list[str]:
    """What comes out, that nothing is predicted, what is known without the fit, and its price."""
    rows, said = tables["reproduction"], tables["conclusions"]
    met = rows["verdict"] == REPRODUCED
    holds = said.groupby("sentence", sort=False)["holds"].all()
    return rendered(
        "paper_answer.j2",
        met=met.sum(),
        rows=len(rows),
        count=rows[met]["role"].value_counts().to_dict(),
        hold=holds.sum(),
        sentences=len(holds),
        study=judged.by.results,
        known=said.filter(_FIRST[:2], axis="index").to_dict("index"),
        price=judged.price,
        word=judged.by.word,
    )
