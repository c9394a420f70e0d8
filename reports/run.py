"""A report: standing and walking, which figures it draws and from what, a page."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scipy.spatial.transform import Rotation

from pipeline.motion.gait import gait_table
from pipeline.paper.judgement import NO_LOAD_CURRENT, NOTABLE, REPRODUCED, Judgement, judged
from pipeline.paper.published import EVEN, ROLES
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import Standing, Walking
from reports.figures.demand import (
    Run,
    gait_figure,
    ground_forces_figure,
    joint_demand_figure,
)
from reports.figures.energy import (
    electrical_energy_figure,
    energy_per_minute_figure,
    stage_energy_figure,
)
from reports.figures.robot import robot_figure
from reports.figures.style import Drawings, save_figures
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
    from matplotlib.figure import Figure
    from pandas import DataFrame


def drawings(run: Run) -> Drawings:
    """Every figure of a run."""
    out: Drawings = {
        "robot": partial(_robot, run),
        "gait": partial(gait_figure, run),
        "joint_demand": partial(joint_demand_figure, run),
        "ground_forces": partial(ground_forces_figure, run),
        "electrical_energy": partial(electrical_energy_figure, run),
    }
    for option in run.walking.results:
        out[f"stage_energy_{option}"] = partial(stage_energy_figure, run, option)
    return out


def _robot(run: Run) -> Figure:
    """The standing robot; dimensions are true along the ground's axes."""
    robot, segment = run.machine.robot, run.standing.segment
    words = ["arrows: axes, positive rotation is right-handed about them"]
    table, posture = gait_table(robot.spec), segment.configuration[0].copy()
    if len(segment.stance) < len(robot.leg_names):
        words.append("the other feet are lifted to mid-transfer")
    if table.slope_forward or table.slope_left:
        back = Rotation.from_matrix(table.ground.T)
        posture[:3] = back.apply(posture[:3])
        posture[3:7] = (back * Rotation.from_quat(posture[3:7])).as_quat()
        words.append("drawn along the ground, which is inclined")
    title = f"{robot.spec.name}, {segment.name}"
    return robot_figure(robot, posture, title=title, subtitle="; ".join(words))


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
    judgement, word = judged(machine)
    said = [word] if word else []
    tables = {**tables, **(judgement.tables if judgement is not None else {})}
    about: dict[str, Any] = {}
    with staged(folder, "reports", inputs=machine.inputs, said=meta, about=about) as out:
        about |= write_tables(tables, out)
        logger.info("drawing figures")
        every = drawings(Run(machine, *results, tables))
        if judgement is None:
            write_robot_page(machine, tables, [*said, *machine.remarks], out)
        else:
            titles = short_titles(machine.catalog)
            every["energy_per_minute_middle_legs"] = partial(
                energy_per_minute_figure, tables, titles
            )
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
    """Write ``index.html`` of the paper's robot; its figures are those of `reports.run`."""
    study = judged.results
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
        study=judged.results,
        known=said.filter(_FIRST[:2], axis="index").to_dict("index"),
        price=judged.price,
        word=judged.word,
    )
