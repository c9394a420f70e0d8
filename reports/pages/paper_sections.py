"""Sections of the paper's page: section IV.A by sentences, and what the paper leaves out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from reports.page import Points, Section, TableBlock, Text
from reports.table import Table
from reports.typeset import number_text, unit_text

_TONES = {"yes": "good", "no": "bad", "in part": "bad"}


def paper_sections(tables: Mapping[str, Table]) -> tuple[Section, ...]:
    """Both sections, the second where there is something to show.

    Args:
        tables: Of a run that was held against the paper.
    """
    out = [_sentences(tables["conclusions"])]
    if "omissions" in tables:
        out.append(_omissions(tables["omissions"]))
    return tuple(out)


def _sentences(table: Table) -> Section:
    """A row for each sentence, its joints side by side."""
    c = table.columns
    own = [i for i in range(table.rows) if c["joint"][i]]
    joints = sorted({str(c["joint"][i]) for i in own})
    places: dict[tuple[str, ...], dict[str, int]] = {}
    for i in own:
        key = tuple(str(c[name][i]) for name in ("where", "sentence", "quantity", "printed"))
        places.setdefault(key, {})[str(c["joint"][i])] = i
    rows = tuple(
        (
            f"**{where.removeprefix('Section ')}** {sentence}: {quantity}",
            *(c["computed"][at[joint]] if joint in at else None for joint in joints),
            _verdict([bool(c["holds"][i]) for i in at.values()]),
            printed,
        )
        for (where, sentence, quantity, printed), at in places.items()
    )
    headers = ("sentence: ratio", *(f"joint {joint}" for joint in joints), "holds", "paper")
    block = TableBlock(
        headers,
        rows,
        "Energies of the middle right leg, one walking cycle.",
        f"{table.name}.csv",
        _TONES,
        3,
    )
    return Section(
        "Section IV.A, sentence by sentence",
        (
            Text(
                "What section IV.A says of the energy through each stage of the actuators, as "
                "ratios of the energies computed here. The paper gives no number to *much higher*; "
                "here it is at least twice as high, at every joint that the sentence speaks of. "
                "Friction that depends on speed alone (Eq. 4) takes the same from a rotor of any "
                "inertia: what the inertia adds to E_m(+) comes back as E_m(−)."
            ),
            block,
        ),
    )


def _with_value(name: str, value: float | None, unit: str) -> str:
    if value is None:
        return name
    return f"{name}: {number_text(value)}{'' if unit == '1' else f' {unit_text(unit)}'}"


def _verdict(holds: Sequence[bool]) -> str:
    return "yes" if all(holds) else "in part" if any(holds) else "no"


def _omissions(table: Table) -> Section:
    c = table.columns
    named = [f"ratio_{name}" for name in ("rotor", "reversible", "irreversible")]
    rows = tuple(
        (
            _with_value(c["left_out"][i], c["value"][i], c["unit"][i]),
            c["break_even"][i],
            c["break_even_change"][i],
            *(c[name][i] for name in named),
        )
        for i in range(table.rows)
    )
    headers = (
        *("left out", "break-even", "moved by"),
        *(f"{name.removeprefix('ratio_')} / ideal" for name in named),
    )
    said = tuple(
        f"**{name}**: {assumption}" + (f"; {note}" if note else "")
        for name, assumption, note in zip(
            (row[0] for row in rows), c["assumption"], c["note"], strict=True
        )
    )
    block = TableBlock(headers, rows, table.description, f"{table.name}.csv", digits=3)
    return Section(
        "What the paper leaves out",
        (
            Text(
                "Effects that the paper does not count, each put in alone with the value stated; "
                "sources and the changes of all ratios stand in the file. The break-even is the "
                "share of time standing above which irreversible gears use less energy, the "
                "ratios are those of walking."
            ),
            block,
            Points(said),
        ),
    )
