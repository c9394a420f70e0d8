"""The two-minute summary: what was computed, what of it is predicted, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pipeline.motion.gait import gait_table
from pipeline.paper.judgement.judge import Judgement
from pipeline.simulation.settings import Settings
from reports.page import FOOTER, Page, TableBlock, files_of, table_block
from reports.pages.robot_page import (
    SECTIONS,
    Run,
    first_picture,
)
from reports.pages.robot_words import limits_text, motors_text, short_titles
from reports.pages.summary_words import (
    answer,
    first_sentences,
    numbers_first,
    roles_text,
)
from reports.table import Table
from reports.typeset import number, unit_text
from reports.words import sections

TONES = {
    "reproduced": "good",
    "not reproduced": "bad",
    "contradicted": "bad",
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


def summary(given: Settings, judged: Judgement, tables: Mapping[str, Table], out: Path) -> Page:
    """The page.

    Args:
        out: Folder; the figures must be there before it is written.
    """
    run = Run(given, tables)
    limits = limits_text(tables, short_titles(given.catalog), given.forces.friction_coefficient)
    return Page(
        title="What it costs to actuate the hexapod, and whether the model agrees with the paper",
        notices=limits,
        numbers=numbers_first(judged),
        picture=first_picture(out),
        answer=(*first_sentences(judged), motors_text(given.motors, "the paper's")),
        sections=sections(SECTIONS.text("paper", run, _facts(given, judged, tables)), run, out),
        files=files_of(tables.values()),
        footer=FOOTER,
    )


def _facts(given: Settings, judged: Judgement, tables: Mapping[str, Table]) -> dict[str, Any]:
    """What the sections of `templates/run.jinja` say of the paper."""
    results, conclusions = judged.by.results, dict.fromkeys(("sentence", "unit"), "")
    conclusions |= {"printed": "paper", "computed": "ours", "holds": ""}
    reproduction = table_block(tables["reproduction"], _BESIDE, tones=TONES)
    facts: dict[str, Any] = {
        "answer": answer(judged, tables),
        "roles": roles_text(),
        "beside": _one_name(reproduction),
        "calibrated": results is not None,
        "of_v": [where == "Section V" for where in tables["conclusions"].columns["where"]],
        "conclusions": conclusions,
        "notes": [f"{r.id.replace('_', ' ')}: {r.remark}" for r in judged.break_even],
        "sentences": sentences(tables["conclusions"]),
        "omissions": None,
        "path": gait_table(given.robot.spec).transfer_path,
        "tones": TONES,
    }
    if "omissions" in tables:
        facts["omissions"], facts["omitted"] = omissions(tables["omissions"])
    if results is None:
        return facts
    facts["conclusions"] = conclusions | {
        "part": "",
        "prior_low": "",
        "prior_high": "",
        "prior_holds_share": "holds in prior",
        "left_out_low": "left out, low",
        "left_out_high": "left out, high",
        "left_out_holds_share": "holds left out",
    }
    # NaN where nothing is known.
    known = [low == low for low in tables["reproduction"].columns["prior_low"]]
    return facts | {"known": known}


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


_TONES = {"yes": "good", "no": "bad", "in part": "bad"}


def sentences(table: Table) -> TableBlock:
    """A row for each sentence, its joints side by side."""
    every = table.frame()
    own = every[every["joint"] != ""]
    joints = sorted(own["joint"].unique())
    rows = []
    places = own.groupby(["where", "sentence", "quantity", "printed"], sort=False)
    for key, part in places:
        where, sentence, quantity, printed = map(str, key)
        computed = dict(zip(part["joint"], part["computed"], strict=True))
        said = f"**{where.removeprefix('Section ')}** {sentence}: {quantity}"
        verdict = "yes" if all(part["holds"]) else "in part" if any(part["holds"]) else "no"
        rows.append((said, *map(computed.get, joints), verdict, printed))
    headers = ("sentence: ratio", *(f"joint {joint}" for joint in joints), "holds", "paper")
    caption = "Energies of the middle right leg, one walking cycle."
    return TableBlock(headers, tuple(rows), caption, f"{table.name}.csv", _TONES, 3)


def omissions(table: Table) -> tuple[TableBlock, tuple[str, ...]]:
    """What the paper leaves out: a table, and each in words."""
    drives = ("rotor", "reversible", "irreversible")
    said = [table.columns[name] for name in ("left_out", "value", "unit", "assumption", "note")]
    numbers = ("break_even", "break_even_change", *(f"ratio_{name}" for name in drives))
    rows, words = [], []
    for name, value, unit, assumption, note, *own in zip(
        *said, *(table.columns[name] for name in numbers), strict=True
    ):
        if value is not None:
            name = f"{name}: {number(value)}{'' if unit == '1' else f' {unit_text(unit)}'}"
        rows.append((name, *own))
        words.append(f"**{name}**: {assumption}" + (f"; {note}" if note else ""))
    headers = ("left out", "break-even", "moved by", *(f"{name} / ideal" for name in drives))
    file = f"{table.name}.csv"
    return TableBlock(headers, tuple(rows), table.description, file, digits=3), tuple(words)
