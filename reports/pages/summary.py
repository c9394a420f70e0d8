"""The page of the paper's robot: what was computed, what of it is predicted, and how sure it is."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.motion.gait import gait_table
from pipeline.paper.judgement import NO_LOAD_CURRENT, NOTABLE, REPRODUCED, Judgement
from pipeline.paper.published import EVEN, ROLES
from pipeline.simulation.machine import Machine
from reports.page import write_page
from reports.pages.robot_page import limits_text, motors_text, robot_facts, short_titles
from reports.typeset import MINUS, number, percent, unit_text

if TYPE_CHECKING:
    from pandas import DataFrame

#: Sentences of the paper whose numbers stand first, where the run has them.
_FIRST = ("walking_ratio_reversible", "walking_ratio_irreversible", EVEN)
_ENDS = ["prior_low", "prior_high", "left_out_low", "left_out_high"]


def write_summary(
    given: Machine, judged: Judgement, tables: Mapping[str, DataFrame], folder: Path
) -> None:
    """Write ``index.html`` of the paper's robot; its figures are those of `reports.figures.run`."""
    first = judged.tables["conclusions"].filter(_FIRST, axis="index")
    studied = judged.by.results is not None
    limits = limits_text(tables, short_titles(given.catalog), given.forces.friction_coefficient)
    write_page(
        "paper",
        folder,
        tables,
        title="What it costs to actuate the hexapod, and whether the model agrees with the paper",
        notices=limits,
        first=first.to_dict("index"),
        part="" if studied else "computed anew",
        even=EVEN,
        answer=(*first_lines(judged, tables), motors_text(given.motors, "the paper's")),
        roles=[f"**{role}**: {meaning}" for role, meaning in ROLES.items()],
        ends=_ENDS,
        conclusion_ends=["part", *_ENDS, "prior_holds_share", "left_out_holds_share"] * studied,
        transfer_path=gait_table(given.robot.spec).transfer_path,
        remarks=(),
        **robot_facts(given, tables),
    )


def first_lines(judged: Judgement, tables: Mapping[str, DataFrame]) -> tuple[str, ...]:
    """What is reproduced by which role, what is not, what is known without the fit, its price."""
    rows = tables["reproduction"]
    met = rows["verdict"] == REPRODUCED
    roles = rows["role"]
    count = [
        f"{role} {met[roles == role].sum()} of {(roles == role).sum()}"
        for role in ROLES
        if (roles == role).any()
    ]
    lines = [
        "A paper compares drives for the joints of a six-legged robot: an ideal one, one with a "
        "real motor's rotor, reversible gears, and irreversible gears, which lock when the motor "
        "is off. It prints energies, not the friction behind them.",
        f"**Reproduced** of the {len(rows)} numbers that it prints, by role: {', '.join(count)}. "
        "Inputs were put in and friction was fitted to the targets: that these come "
        "out is no evidence.",
    ]
    if not met.all():
        missed = [_beside(row) for row in rows[~met].to_dict("records")]
        lines.append(f"**Not reproduced:** {'; '.join(missed)}.")
    if judged.by.results is not None:
        said = tables["conclusions"]
        known = [
            f"{str(name).rpartition('_')[2]} gears {number(row['prior_low'])} to "
            f"{number(row['prior_high'])} (paper: {row['printed']}; so in "
            f"{percent(row['prior_holds_share'])} of all draws)"
            for name, row in said.filter(_FIRST[:2], axis="index").to_dict("index").items()
        ]
        results = judged.by.results
        lines += [
            "**Known without the fit:** by data sheets and literature alone, at 95 %, walking "
            f"takes times the ideal drive's energy: {', '.join(known)}.",
            _price(judged.price, results),
            f"**How sure:** the paper's figures cannot determine {results['unknowns']} numbers "
            "that it does not print; the values are the set nearest to data sheets and literature "
            "that fits, their intervals hold 95 % of the posterior (R-hat at most "
            f"{results['r_hat']:.2f}, at least {results['effective_sample_size']:.0f} independent "
            "draws). Each stands in pipeline/paper/study/calibration.csv.",
        ]
    return (*lines, f"**Not the paper's:** {judged.by.word}.") if judged.by.word else tuple(lines)


def _beside(row: Mapping[Hashable, object]) -> str:
    """Ours beside the paper's, to the digits that decide."""
    half, ours, published = (float(str(row[k])) for k in ("half_width", "computed", "published"))
    digits = max(0, -math.floor(math.log10(half))) if half > 0 else 3
    joint = f" of joint {row['joint']}" if row["joint"] else ""
    unit = "" if row["unit"] == "1" else f" {unit_text(str(row['unit']))}"
    return (
        f"{row['quantity']}{joint} ({row['where']}, {row['verdict']}) {ours:.{digits}f}, printed "
        f"{published:.{digits}f}{unit}"
    ).replace(" -", f" {MINUS}")


def _price(price: Mapping[str, float], study: Mapping[str, Any]) -> str:
    gear = study["gear"]
    return (
        f'**The price of the fit:** "almost 15" needs a planetary gear with '
        f"{price['friction_mNm']:.1f} mN·m of constant friction (95 % of the posterior: "
        f"{gear['low']:.1f} to {gear['high']:.1f}), where gear data suggest {gear['prior']:g}, at "
        f"most {gear['prior_high']:.0f} mN·m; it turns {price['heat_J']:.0f} of the "
        f"{price['leg_J']:.0f} J that a leg draws per cycle into heat. In "
        f"{percent(study['no_load_share'], 1)} of the posterior the motor draws over "
        f"{percent(NOTABLE - 1)} more current without load than the "
        f"{1e3 * NO_LOAD_CURRENT:.0f} mA of its data sheet."
    )
