"""The page of the paper's robot: what was computed, what of it is predicted, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.motion.gait import gait_table
from pipeline.paper.judgement import NO_LOAD_CURRENT, NOTABLE, REPRODUCED, Judgement
from pipeline.paper.published import EVEN, ROLES
from pipeline.simulation.machine import Machine
from reports.page import write_page
from reports.pages.robot_page import facts, motors_text
from reports.typeset import number, percent

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


def first_lines(judged: Judgement, tables: Mapping[str, DataFrame]) -> tuple[str, ...]:
    """What comes out, that nothing is predicted, what is known without the fit, and its price."""
    rows, said, study = tables["reproduction"], tables["conclusions"], judged.by.results
    met = rows["verdict"] == REPRODUCED
    count = rows[met]["role"].value_counts()
    holds = said.groupby("sentence", sort=False)["holds"].all()
    lines = [
        "A paper compares four drives for the joints of a six-legged robot: an ideal one, one with "
        "a real motor's rotor, reversible gears, and irreversible gears, which lock when the motor "
        "is off. It prints what they draw, not the friction behind it.",
        f"**Does the model agree?** {met.sum()} of the {len(rows)} printed numbers come out. That "
        f"is no evidence: {count['input']} were put in, friction was fitted to {count['target']}, "
        f"{count['consequence']} follow from those by arithmetic, the others are zeros or stand "
        "for one that contradicts them. **Nothing that the paper prints and that is not zero is "
        f"predicted.** {holds.sum()} of {len(holds)} of its conclusions hold for these numbers.",
    ]
    if study is not None:
        known = [
            f"{str(name).rpartition('_')[2]} gears {number(row['prior_low'])} to "
            f"{number(row['prior_high'])} (paper: {row['printed']}; so in "
            f"{percent(row['prior_holds_share'])} of all draws)"
            for name, row in said.filter(_FIRST[:2], axis="index").to_dict("index").items()
        ]
        gear, price = study["gear"], judged.price
        lines += [
            "**Known without the fit:** by data sheets and literature alone, at 95 %, walking "
            f"takes times the ideal drive's energy: {', '.join(known)}.",
            f'**What the fit asks:** "almost 15" needs a planetary gear with '
            f"{price['friction_mNm']:.1f} mN·m of constant friction, where gear data suggest "
            f"{gear['prior']:g}, at most {gear['prior_high']:.0f} mN·m: {price['heat_J']:.0f} of "
            f"the {price['leg_J']:.0f} J that a leg draws per cycle.",
        ]
    return (*lines, f"**Not the paper's:** {judged.by.word}.") if judged.by.word else tuple(lines)
