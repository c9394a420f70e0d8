"""Sections of the paper's page: section IV.A by sentences, and what the paper leaves out."""

from __future__ import annotations

from collections.abc import Mapping

from reports.page import Section, TableBlock, Text, table_block
from reports.table import Table

_HOLDS = {(True,): "yes", (False,): "no"}
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
            where.removeprefix("Section "),
            sentence,
            quantity,
            printed,
            *(c["computed"][at[joint]] if joint in at else None for joint in joints),
            _HOLDS.get(tuple({bool(c["holds"][i]) for i in at.values()}), "in part"),
        )
        for (where, sentence, quantity, printed), at in places.items()
    )
    headers = ("in", "sentence", "ratio", "paper", *(f"joint {joint}" for joint in joints), "holds")
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


def _omissions(table: Table) -> Section:
    shown = {
        "left_out": "left out",
        "assumption": "put in as",
        "value": "value",
        "unit": "unit",
        "break_even": "break-even",
        "break_even_change": "moved by",
        "ratio_rotor": "rotor / ideal",
        "ratio_reversible": "reversible / ideal",
        "ratio_irreversible": "irreversible / ideal",
        "note": "note",
    }
    return Section(
        "What the paper leaves out",
        (
            Text(
                "Effects that the paper does not count, each put in alone with the value stated; "
                "sources and the changes of all ratios stand in the file. The break-even is the "
                "share of time standing above which irreversible gears use less energy, the "
                "ratios are those of walking."
            ),
            table_block(table, shown, digits=3),
        ),
    )
