"""The two-minute summary: what was computed, what of it is predicted, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pipeline.app.names import names_text
from pipeline.app.settings import Settings
from pipeline.calibration.judge import Judgement, headline
from pipeline.calibration.readings import readings, verdict
from pipeline.calibration.store import Calibrated
from reports.html import write_html
from reports.markdown import write_markdown
from reports.page import FigureBlock, Page, Points, Section, TableBlock, Text, table_block
from reports.table import Table

TONES = {"reproduced": "good", "not reproduced": "bad", "not determined": "quiet"}


def write_summary(
    given: Settings,
    judgement: Judgement,
    numbers: Sequence[Calibrated],
    tables: Sequence[Table],
    results: Mapping[str, Any],
    out: Path,
) -> int:
    """Write ``summary.md`` and ``index.html``.

    Args:
        given: The run.
        judgement: Ours against the paper's.
        numbers: Every free number after calibration.
        tables: All tables of the run, for links.
        results: The stored calibration.
        out: Folder; the figures must be there already.

    Returns:
        How many files.
    """
    page = summary(given, judgement, numbers, {t.name: t for t in tables}, results, out)
    write_markdown(page, out / "summary.md")
    write_html(page, out / "index.html")
    return 2


def summary(
    given: Settings,
    judgement: Judgement,
    numbers: Sequence[Calibrated],
    tables: Mapping[str, Table],
    results: Mapping[str, Any],
    out: Path,
) -> Page:
    """The page; see `write_summary`."""
    sections = (
        _energy(tables, out, names_text(given)),
        _reproduction(tables),
        _reading(results),
        _conclusions(judgement, results, tables, out),
        _parameters(numbers, tables, given),
        _robot(out),
    )
    return Page(
        title="What it costs to actuate the hexapod, and whether the model agrees with the paper",
        answer=_answer(judgement, tables, results),
        sections=sections,
        files={f"{t.name}.csv": t.description or _first_meanings(t) for t in tables.values()},
        footer="Every CSV has a .meta.json beside it: meanings, units, input hashes, versions.",
    )


def _answer(
    judgement: Judgement, tables: Mapping[str, Table], results: Mapping[str, Any]
) -> tuple[str, ...]:
    counts = headline(judgement.reproduction)
    energy = tables["walking_energy"].columns
    rows = dict(
        zip(
            zip(energy["alternative"], energy["leg"], strict=True),
            zip(energy["electrical_J"], energy["ratio_to_ideal"], strict=True),
            strict=True,
        )
    )
    legs = {name: rows[name, "rm"] for name in ("ideal", "rotor", "reversible", "irreversible")}
    spread = {row.published.id: row for row in judgement.reproduction}
    power = {
        name: spread[f"{name}_leg_energy_3s"].computed / 3.0
        for name in ("reversible", "irreversible")
    }
    even = spread["break_even_standing_fraction"]
    missed = [r.published.id for r in judgement.reproduction if r.verdict != "reproduced"]
    check, target, put_in = (counts[role] for role in ("check", "target", "input"))
    first = (
        f"Walking one 3 s cycle, the middle right leg draws **{legs['ideal'][0]:.1f} J** with "
        f"ideal actuators, {legs['rotor'][0]:.1f} J once the rotor has inertia and friction, "
        f"**{legs['reversible'][0]:.1f} J** with belt and Harmonic Drive and "
        f"**{legs['irreversible'][0]:.1f} J** with planetary and hypoid gears. Standing still, the "
        f"loaded leg draws {power['reversible']:.2f} W with the reversible actuator and "
        f"{power['irreversible']:.2g} W with the irreversible one, which "
        f"pays only above {even.computed:.1%} of the time standing "
        f"({even.low:.1%} to {even.high:.1%})."
    )
    second = (
        f"Of the 46 numbers the paper prints, **{check[0]} of {check[1]} were predicted** within "
        f"their printed precision, {target[0]} of {target[1]} were fitted and meet theirs, "
        f"{put_in[0]} of {put_in[1]} were put in."
        + (f" Not reproduced: {', '.join(missed)}." if missed else "")
    )
    members, draws = len(results["ensemble"]), results["draws"]
    third = (
        "The paper does not print friction, inertia, masses or gear angles. "
        f"{target[1]} fitted figures cannot determine {len(results['nearest']['z'])} numbers: the "
        "values here are the admissible set nearest to data sheets and literature, and every low "
        f"and high spans 95 % of {members} admissible sets (of {draws} draws from prior "
        "knowledge). What the walking ratios say was fitted, not found; see the columns "
        "`prior_low` and `prior_high` for what data sheets alone would say."
    )
    return first, second, third


def _energy(tables: Mapping[str, Table], out: Path, names: str) -> Section:
    walking = tables["walking_energy"]
    keep = [leg in ("rm", "robot") for leg in walking.columns["leg"]]
    return Section(
        "What it costs",
        (
            Text(names),
            FigureBlock(out / "electrical_energy.svg", "Electrical energy of one cycle by joint."),
            table_block(
                walking, keep=keep, caption="Energy drawn from the supply in one walking cycle."
            ),
            table_block(tables["robot_energy"], caption="The whole robot, walking."),
            FigureBlock(out / "stage_energy_reversible.svg", "Stages of the reversible actuator."),
            FigureBlock(
                out / "stage_energy_irreversible.svg", "Stages of the irreversible actuator."
            ),
        ),
    )


def _reproduction(tables: Mapping[str, Table]) -> Section:
    shown = {
        "where": "where",
        "quantity": "quantity",
        "joint": "joint",
        "unit": "unit",
        "published": "paper",
        "computed": "ours",
        "low": "low",
        "high": "high",
        "role": "role",
        "verdict": "verdict",
    }
    return Section(
        "Every number the paper prints",
        (
            Text(
                "*input*: put in. *target*: the calibration was fitted to it. *check*: predicted. "
                "Low and high span the admissible sets. The electrical checks of Tables IV to VI "
                "hold together only for a torque constant of 30.175 to 30.200 mN*m/A, a resistance "
                "of 0.3157 to 0.3161 ohm and a rotor friction of 3.600 to 3.617 mN*m; the prior "
                "was placed inside that sliver of the data sheet's rounding, so these checks show "
                "that the tables agree with each other and with one motor, not more."
            ),
            table_block(tables["reproduction"], shown, tones=TONES),
            Text(
                "How much each target is worth: the others predict it as follows when it is left "
                "out. A wide interval says that the paper's figure was needed to know it."
            ),
            table_block(tables["leave_one_out"]),
        ),
    )


def _reading(results: Mapping[str, Any]) -> Section:
    found = readings(results)
    rows = tuple(
        (
            r.axis_deg,
            r.legs,
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
            *("axis [deg]", "legs loaded", "worst row [half widths]", "which"),
            *("worst limit, over less 1", "prior distance", "ideal leg [J]"),
            *("E_el/E_m joint 2", "E_el/E_m others", "verdict"),
        ),
        rows,
        "Each reading calibrated on its own.",
        "readings.csv",
        {"meets all": "good", "out of reach": "bad"},
        3,
    )
    return Section("How the paper was read", (Text(verdict(found)), block))


def _conclusions(
    judgement: Judgement, results: Mapping[str, Any], tables: Mapping[str, Table], out: Path
) -> Section:
    table = results["sensitivity"]
    points = []
    for output, words in (
        ("walking_ratio_reversible", "the reversible ratio"),
        ("walking_ratio_irreversible", "the irreversible ratio"),
        ("walking_extra_J", "the difference that sets the break-even"),
    ):
        total = sorted(zip(table[output]["ST"], table["names"], strict=True), reverse=True)[:3]
        points.append(f"{words}: " + ", ".join(f"`{name}` ({share:.0%})" for share, name in total))
    extra = sorted(zip(table["walking_extra_J"]["ST"], table["names"], strict=True), reverse=True)[
        0
    ][1]
    notes = [f"{row.subject.replace('_', ' ')}: {row.note}" for row in judgement.break_even]
    return Section(
        "What the conclusions hang on",
        (
            table_block(tables["conclusions"], tones=TONES),
            Text("Largest total sensitivities (share of variance with interactions):"),
            Points(tuple(points)),
            Text(f"**Measure next:** `{extra}`, the number that moves the break-even most."),
            FigureBlock(
                out / "energy_per_minute_middle_legs.svg", "Fig. 21: both middle legs, one minute."
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


def _parameters(
    numbers: Sequence[Calibrated], tables: Mapping[str, Table], given: Settings
) -> Section:
    free = [f"`{n.key}`" for n in numbers if n.verdict == "not determined"]
    bound = [f"`{n.key}` ({n.at_bound})" for n in numbers if n.at_bound]
    return Section(
        "What is assumed and what was fitted",
        (
            Text(
                f"Not determined by the paper: {', '.join(free) or 'none'}. At a bound: "
                f"{', '.join(bound) or 'none'}. The foot's path through the air is "
                f"`{given.robot.spec.transfer_path}`; the paper does not give it."
            ),
            table_block(tables["calibration"], tones=TONES),
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
            ),
        ),
    )


def _robot(out: Path) -> Section:
    return Section(
        "The robot and its gait",
        tuple(
            FigureBlock(out / f"{name}.svg", caption)
            for name, caption in (
                ("robot", "The hexapod standing on three feet."),
                ("zero_pose", "Zero pose and positive directions."),
                ("gait", "Foot paths, support polygons, footfall."),
                ("joint_demand_rm_joint_1", "Joint 1, as in Fig. 2."),
                ("joint_demand_rm_joint_2", "Joint 2, as in Fig. 3."),
                ("joint_demand_rm_joint_3", "Joint 3, as in Fig. 4."),
            )
        ),
    )


def _first_meanings(table: Table) -> str:
    return ", ".join(list(table.columns)[:6])
