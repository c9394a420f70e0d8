"""The two-minute summary: what was computed, what of it is predicted, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from pipeline.motion.gait import gait_table
from pipeline.paper.calibration.store import AT_LEAST, FIXED, Calibrated, calibrated_numbers
from pipeline.paper.judgement.basis import Basis, Judged
from pipeline.paper.judgement.readings import readings, verdict
from pipeline.paper.judgement.sensitivity import ranking
from pipeline.simulation.settings import Settings
from reports.html import write_html
from reports.markdown import write_markdown
from reports.page import FigureBlock, Page, Points, Section, TableBlock, Text, table_block
from reports.pages.motor_words import limits_text, motors_text
from reports.pages.names import short_titles, shown_leg
from reports.pages.paper_sections import paper_sections
from reports.pages.robot_page import (
    FOOTER,
    actuators_section,
    energy_section,
    files_of,
    first_picture,
    gait_section,
)
from reports.pages.summary_words import (
    answer,
    first_sentences,
    index_words,
    measure_next,
    numbers_first,
    roles_text,
)
from reports.table import Table
from reports.words import percent

TONES = {
    "reproduced": "good",
    "not reproduced": "bad",
    "contradicted": "bad",
    "against the prior": "bad",
    "not determined": "quiet",
}

#: Every printed number beside ours; the first three columns are shown as one.
_BESIDE = {
    "quantity": "quantity",
    "joint": "joint",
    "unit": "unit",
    "published": "paper",
    "computed": "ours",
    "verdict": "verdict",
    "role": "role",
    "where": "where",
}


def write_summary(given: Settings, judged: Judged, tables: Sequence[Table], out: Path) -> int:
    """Write ``summary.md`` and ``index.html``.

    Args:
        given: The run.
        judged: Ours against the paper's.
        tables: All tables of the run.
        out: Folder; the figures must be there already.

    Returns:
        How many files.
    """
    page = summary(given, judged, {t.name: t for t in tables}, out)
    write_markdown(page, out / "summary.md")
    write_html(page, out / "index.html")
    return 2


def summary(given: Settings, judged: Judged, tables: Mapping[str, Table], out: Path) -> Page:
    """The page; see `write_summary`."""
    sections = [
        energy_section(given, tables, out),
        actuators_section(given, out),
        _reproduction(judged, tables),
    ]
    if judged.by.results is not None:
        sections.append(_reading(judged.by))
    sections += [
        _conclusions(judged, tables, out),
        *paper_sections(tables),
        _parameters(judged.by, tables, given),
        _robot(given, out),
    ]
    limits = limits_text(tables, short_titles(given.catalog), given.forces.friction_coefficient)
    return Page(
        title="What it costs to actuate the hexapod, and whether the model agrees with the paper",
        notices=limits,
        numbers=numbers_first(judged),
        picture=first_picture(out),
        answer=(*first_sentences(judged), motors_text(given.motors, "the paper's")),
        sections=(
            Section("The answer in full", tuple(map(Text, answer(judged, tables)))),
            *sections,
        ),
        files=files_of(tables),
        footer=FOOTER,
    )


def _reproduction(judged: Judged, tables: Mapping[str, Table]) -> Section:
    if judged.by.results is None:
        return Section(
            "Every number the paper prints",
            (
                Text(roles_text()),
                _one_name(table_block(tables["reproduction"], _BESIDE, tones=TONES)),
            ),
        )
    open_ = {
        "where": "where",
        "quantity": "quantity",
        "joint": "joint",
        "unit": "unit",
        "published": "paper",
        "prior_low": "prior low",
        "prior_high": "prior high",
        "left_out_low": "left out, low",
        "left_out_high": "left out, high",
    }
    columns = tables["reproduction"].columns
    known = [low == low for low in columns["prior_low"]]  # not NaN
    return Section(
        "Every number the paper prints",
        (
            Text(roles_text()),
            _one_name(table_block(tables["reproduction"], _BESIDE, tones=TONES)),
            Text(
                "What is known of them without the fit. *Prior*: 95 % of what data sheets and "
                "literature say before anything is fitted. *Left out*: 95 % of what everything "
                "else says when this figure is left out, the irreversible actuator's two figures "
                "together. Other rows were put in or follow from that."
            ),
            table_block(tables["reproduction"], open_, keep=known),
            Text(
                "Table V contradicts itself: no rotor friction gives all its entries at printed "
                "precision. The entries that each friction leaves unmet:"
            ),
            table_block(
                tables["rotor_friction"],
                {
                    "from_mNm": "from [mN·m]",
                    "to_mNm": "to [mN·m]",
                    "unmet": "unmet",
                    "which": "which",
                },
            ),
            Text(
                "What each target is worth as a test: everything else predicts it as follows when "
                "it is left out. A wide interval says that the paper's figure was needed to know "
                "it."
            ),
            table_block(
                tables["leave_one_out"],
                {
                    "id": "target",
                    "without": "left out",
                    "unit": "unit",
                    "published": "paper",
                    "predicted": "predicted",
                    "low": "low",
                    "high": "high",
                    "sets": "sets",
                    "by": "by",
                },
            ),
        ),
    )


def _one_name(block: TableBlock) -> TableBlock:
    """Quantity, joint and unit in one column: paper, ours and verdict fit on a narrow window."""
    rows = tuple(
        (f"{quantity}{f' {joint}' if joint else ''}{f' [{unit}]' if unit else ''}", *rest)
        for quantity, joint, unit, *rest in block.rows
    )
    hint = "what is printed, joint of the middle right leg, unit"
    return replace(
        block,
        headers=("quantity, joint", *block.headers[3:]),
        rows=rows,
        hints=(hint, *block.hints[3:]),
    )


def _reading(by: Basis) -> Section:
    assert by.results is not None
    found = readings(by.results)
    rows = tuple(
        (
            r.axis_deg,
            r.legs,
            "net" if r.net else "drawn",
            r.worst_error,
            r.worst_row,
            r.worst_limit,
            r.prior_distance,
            r.ideal_energy,
            r.ratio_joint_2,
            r.ratio_others,
            "meets all" if r.meets_all else "out of reach",
        )
        for r in found
    )
    block = TableBlock(
        (
            *("axis [deg]", "legs loaded", "consumption", "worst row [half widths]", "which"),
            *("worst limit, over less 1", "prior distance", "ideal leg [J]"),
            *("E_el/E_m joint 2", "E_el/E_m others", "verdict"),
        ),
        rows,
        "Each reading calibrated on its own.",
        "readings.csv",
        {"meets all": "good", "out of reach": "bad"},
        3,
    )
    words = verdict(found, by.results["nearest"])
    return Section("How the paper was read", (*(Text(text) for text in words), block))


def _conclusions(judged: Judged, tables: Mapping[str, Table], out: Path) -> Section:
    judgement, results = judged.judgement, judged.by.results
    words: tuple[Text | Points, ...] = ()
    if results is not None:
        ranks = {
            text: ranking(results, output)
            for output, text in (
                ("walking_ratio_reversible", "the reversible ratio"),
                ("walking_ratio_irreversible", "the irreversible ratio"),
                ("walking_extra_J", "the difference that sets the break-even"),
            )
        }
        words = (
            Text("Largest total sensitivities (share of variance with interactions, 95 %):"),
            Points(
                tuple(
                    f"{text}: " + ", ".join(index_words(row) for row in ranked[:3])
                    for text, ranked in ranks.items()
                )
            ),
            Text(measure_next(ranks["the difference that sets the break-even"])),
        )
    shown = {
        "sentence": "sentence",
        "unit": "unit",
        "printed": "paper",
        "computed": "ours",
        "holds": "holds",
    }
    if results is not None:
        shown |= {
            "part": "part",
            "prior_low": "prior low",
            "prior_high": "prior high",
            "prior_holds_share": "holds in prior",
            "left_out_low": "left out, low",
            "left_out_high": "left out, high",
            "left_out_holds_share": "holds left out",
        }
    of_v = [where == "Section V" for where in tables["conclusions"].columns["where"]]
    notes = [f"{row.id.replace('_', ' ')}: {row.remark}" for row in judgement.break_even]
    return Section(
        "What the conclusions hang on",
        (
            table_block(tables["conclusions"], shown, keep=of_v),
            *words,
            FigureBlock(
                out / "energy_per_minute_middle_legs.svg",
                "Fig. 21: both middle legs, one minute.",
            ),
            FigureBlock(
                out / "energy_per_minute_robot_on_3_feet.svg", "The whole robot on three feet."
            ),
            FigureBlock(
                out / "energy_per_minute_robot_on_6_feet.svg", "The whole robot on six feet."
            ),
            Points(tuple(notes)),
        ),
    )


def _parameters(by: Basis, tables: Mapping[str, Table], given: Settings) -> Section:
    shape = gait_table(given.robot.spec).transfer_path
    path = f"The foot's path through the air is `{shape}`; the paper does not give it."
    blocks: list[Text | Points | TableBlock] = []
    if by.results is None:
        blocks.append(Text(path))
    else:
        numbers = calibrated_numbers(by.results, by.prior)
        blocks += [
            Text(path),
            Points(tuple(_number_words(numbers))),
            table_block(tables["calibration"], tones=TONES),
        ]
    blocks.append(
        table_block(
            tables["parameters"],
            {
                "group": "file",
                "parameter": "parameter",
                "value": "value",
                "unit": "unit",
                "basis": "basis",
                "source": "source",
            },
            caption="Every number that went in.",
        )
    )
    return Section("What is assumed and what was fitted", tuple(blocks))


def _number_words(numbers: Sequence[Calibrated]) -> list[str]:
    """Numbers by what the targets did to them, and how often each lies at a bound."""
    against = [
        f"`{n.key}` ({n.shift:+.1f})"
        for n in numbers
        if n.verdict == "against the prior" and n.shift is not None
    ]
    free = [f"`{n.key}`" for n in numbers if n.verdict == "not determined"]
    fixed = [f"`{n.key}`" for n in numbers if n.verdict == FIXED]
    bound = [
        f"`{n.key}` ({n.bound}, {percent(n.at_bound)})"
        for n in sorted(numbers, key=lambda n: -n.at_bound)
        if n.at_bound >= AT_LEAST
    ]
    return [
        "Driven out of what data sheets and literature believe (mean of the posterior, in standard "
        f"deviations of that belief): {', '.join(against) or 'none'}.",
        f"At a bound, in such a share of the posterior: {', '.join(bound) or 'none'}.",
        f"Not determined by the paper: {', '.join(free) or 'none'}.",
        f"Without a prior, drawn from all that give Tables IV to VI: {', '.join(fixed) or 'none'}.",
    ]


def _robot(given: Settings, out: Path) -> Section:
    leg = shown_leg(given.robot)
    joints = next(entry.joints for entry in given.robot.spec.legs if entry.name == leg)
    more = [
        FigureBlock(out / "joint_torques.svg", "Torque of every joint, all legs."),
        FigureBlock(out / "ground_forces.svg", "Ground forces of all feet, margin of stability."),
        *(
            FigureBlock(out / f"joint_demand_{joint}.svg", f"Joint {k}, as in Fig. {k + 1}.")
            for k, joint in enumerate(joints, start=1)
        ),
    ]
    return gait_section(given.robot, out, more, "The hexapod standing on three feet.")
