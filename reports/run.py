"""A report: standing and walking, which figures it draws and from what, a page."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.motion.gait import gait_of, gait_table
from pipeline.paper.judgement import NO_LOAD_CURRENT, NOTABLE, REPRODUCED, Judgement, judged
from pipeline.paper.published import EVEN, ROLES
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import IDEAL, Standing, Walking
from reports.figures.demand import (
    gait_figure,
    ground_forces_figure,
    joint_demand_figure,
    motor_limits_figure,
)
from reports.figures.energy import (
    electrical_energy_figure,
    energy_per_minute_figure,
    stage_energy_figure,
)
from reports.figures.robot import robot_figure
from reports.figures.style import Drawings
from reports.folder import staged, write_tables
from reports.page import plain, rendered, write_page
from reports.pages.robot_page import (
    conditions,
    facts,
    gait_and_conditions,
    limits_text,
    motors_text,
    short_titles,
    shown_leg,
    write_robot_page,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


def drawings(
    given: Machine, standing: Standing, walking: Walking, tables: Mapping[str, DataFrame]
) -> Drawings:
    """Every figure of a run, of its results and the tables of both."""
    spec, gait = given.robot.spec, gait_of(given.robot.spec)
    demand, contacts = tables["walking_joint_demand"], tables["walking_contact_forces"]
    legs = {leg.name: leg.joints for leg in spec.legs}
    places = [part.position for part in walking.demand.contacts if part is not None]
    feet = dict(zip(legs, np.moveaxis(np.concatenate(places), 1, 0), strict=True))
    subtitle = f"{_name(given)}; a line is thin while its leg is in the air"
    path = "; ".join((f"transfer path '{gait.table.transfer_path}'", *conditions(spec)))
    title = "Velocity and torque of every joint over one cycle"
    return {
        "robot": partial(_robot, given, standing),
        "gait": partial(
            gait_figure, contacts, feet, title=f"{spec.name}: {gait.title}", subtitle=path
        ),
        "joint_demand": partial(
            joint_demand_figure, demand, contacts, legs, title=title, subtitle=subtitle
        ),
        "ground_forces": partial(
            ground_forces_figure, contacts, [*legs], title="Ground forces", subtitle=subtitle
        ),
        **_energy(given, walking, tables["walking_stage_energy"]),
    }


def _name(given: Machine) -> str:
    """Robot and gait, which every figure names."""
    return f"{given.robot.spec.name}, {gait_and_conditions(given.robot.spec)}"


def _robot(given: Machine, standing: Standing) -> Figure:
    """The standing robot; dimensions are true along the ground's axes."""
    robot, words = given.robot, ["arrows: axes, positive rotation is right-handed about them"]
    table, posture = gait_table(robot.spec), standing.segment.configuration[0].copy()
    if len(standing.segment.stance) < len(robot.leg_names):
        words.append("the other feet are lifted to mid-transfer")
    if table.slope_forward or table.slope_left:
        back = Rotation.from_matrix(table.ground.T)
        posture[:3] = back.apply(posture[:3])
        posture[3:7] = (back * Rotation.from_quat(posture[3:7])).as_quat()
        words.append("drawn along the ground, which is inclined")
    return robot_figure(
        robot,
        posture,
        title=f"{robot.spec.name}, {standing.segment.name}",
        subtitle="; ".join(words),
    )


def _energy(given: Machine, walking: Walking, stages: DataFrame) -> Drawings:
    """What one leg takes, stage by stage, and its motors within their limits."""
    leg, titles = shown_leg(given.robot), short_titles(given.catalog)
    joints = next(entry.joints for entry in given.robot.spec.legs if entry.name == leg)
    labels = {joint: f"joint {number}" for number, joint in enumerate(joints, start=1)}
    out: Drawings = {}
    electrical = {}
    for name, own in stages.groupby("alternative", sort=False):
        title, result = titles[str(name)], walking.results[str(name)]
        last = own[own["stage"] == own["stage"].iloc[-1]].set_index("joint")
        electrical[titles[str(name)]] = last.loc[[*joints], "forward_J"].to_numpy()
        words: dict[str, Any] = {"title": f"{title}: its motors, leg {leg}"}
        words["subtitle"] = f"{_name(given)}: one cycle; rms over it and its limit above [N·m]"
        motors = result.motor, result.motors, labels
        out[f"motor_limits_{name}"] = partial(motor_limits_figure, *motors, **words)
        words = {"title": title}
        words["subtitle"] = f"{_name(given)}: energy per cycle at each stage, leg {leg}"
        out[f"stage_energy_{name}"] = partial(stage_energy_figure, own, labels, **words)
    lost = given.options.regeneration == "none"
    kept = "what the motors draw; robot_energy.csv has what their return saves"
    subtitle = f"{_name(given)}: one cycle; {'returned energy is lost' if lost else kept}"
    out["electrical_energy"] = partial(
        electrical_energy_figure,
        list(labels.values()),
        electrical,
        reference=titles.get(IDEAL),
        title=f"Electrical energy, leg {leg}",
        subtitle=subtitle,
    )
    return out


def fig_21(tables: Mapping[str, DataFrame], titles: dict[str, str]) -> Drawings:
    """Energy per minute of both middle legs against the fraction of time standing.

    Args:
        tables: Of the judgement, with its lines and their crossing.
        titles: Drivetrain option to its title.
    """
    lines, crossing = tables["energy_per_minute"], tables["break_even"].iloc[0].to_dict()
    known = bool(np.isfinite(crossing["standing_fraction"]))
    bands = (
        "computed anew with changed numbers"
        if lines["prior_low_J"].isna().any()
        else "line: fitted; thin bar: 95 % of what data sheets and literature say; thick bar: "
        "fitted without the drive's own walking figure"
    )
    draw = partial(
        energy_per_minute_figure,
        lines,
        titles,
        title="Energy in one minute: both middle legs, as in Fig. 21",
        subtitle=bands if known else str(crossing["note"]).split(";")[0],
        crossing=crossing if known else None,
    )
    return {"energy_per_minute_middle_legs": draw}


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
    from reports.figures.style import save_figures
    from reports.run import drawings, fig_21

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
    """Write ``index.html`` of the paper's robot; its figures are those of `reports.run`."""
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
