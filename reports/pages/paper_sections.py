"""Tables of the paper's page: section IV.A by sentences, and what the paper leaves out."""

from __future__ import annotations

from collections.abc import Sequence

from reports.page import TableBlock
from reports.table import Table
from reports.typeset import number, unit_text

_TONES = {"yes": "good", "no": "bad", "in part": "bad"}


def sentences(table: Table) -> TableBlock:
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
    return TableBlock(
        headers,
        rows,
        "Energies of the middle right leg, one walking cycle.",
        f"{table.name}.csv",
        _TONES,
        3,
    )


def _with_value(name: str, value: float | None, unit: str) -> str:
    if value is None:
        return name
    return f"{name}: {number(value)}{'' if unit == '1' else f' {unit_text(unit)}'}"


def _verdict(holds: Sequence[bool]) -> str:
    return "yes" if all(holds) else "in part" if any(holds) else "no"


def omissions(table: Table) -> tuple[TableBlock, tuple[str, ...]]:
    """What the paper leaves out: a table, and each in words."""
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
    return block, said
