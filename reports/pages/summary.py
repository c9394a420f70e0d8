"""The page of the paper's robot: what was computed, what of it is predicted, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.motion.gait import gait_table
from pipeline.paper.judgement import NO_LOAD_CURRENT, NOTABLE, REPRODUCED, Judgement
from pipeline.paper.published import EVEN, ROLES
from pipeline.simulation.machine import Machine
from reports.page import rendered, write_page
from reports.pages.robot_page import facts, motors_text

if TYPE_CHECKING:
    from pandas import DataFrame

#: Sentences of the paper whose numbers stand first, where the run has them.
_FIRST = ("walking_ratio_reversible", "walking_ratio_irreversible", EVEN)
_ENDS = ["prior_low", "prior_high", "left_out_low", "left_out_high"]


def write_summary(
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
        answer=first_lines(judged, tables),
        roles=ROLES,
        ends=_ENDS if study else [],
        shares=["prior_holds_share", "left_out_holds_share"] if study else [],
        study=study,
        no_load=(NOTABLE - 1, 1e3 * NO_LOAD_CURRENT),
        transfer_path=gait_table(given.robot.spec).transfer_path,
        remarks=(),
        **more,
    )


def first_lines(judged: Judgement, tables: Mapping[str, DataFrame]) -> list[str]:
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
