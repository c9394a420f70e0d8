"""The page of `gap power`: what the supply gives, term by term and drive by drive."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipeline.identification.supply.account import (
    BASIS_FOUND,
    BASIS_MODEL,
    MEASURED,
    RECOGNISED,
    UNEXPLAINED,
    Account,
    Share,
)
from reports.page import (
    Block,
    FigureBlock,
    Number,
    Page,
    Section,
    files_of,
    table_block,
    write_page,
)
from reports.pages.gap_report import checks_block
from reports.table import Table
from reports.typeset import number, percent

_READINGS = {"mean": "the mean since the one before", "instant": "the value of its instant"}


def power_answer(balance: Account) -> tuple[str, ...]:
    """The answer in a few lines, which the page and the terminal show."""
    shares = {s.term: s for s in balance.shares}
    recognised = balance.wrong_sum == RECOGNISED
    terms = {  # of what is no power no term means anything
        basis: ", ".join(_watts(s) for s in balance.shares if s.basis and s.basis == basis)
        for basis in (BASIS_MODEL, *(() if recognised else (BASIS_FOUND,)))
    }
    lines = []
    if recognised:
        lines.append(
            "**The column is no power at the supply: it follows the motors' currents, summed and "
            "multiplied with the supply's voltage.** A driver passes a motor its current at the "
            "motor's own voltage, which is less. Measure the current between supply and drivers."
        )
    elif balance.wrong_sum:
        lines.append(
            "These samples do not tell whether the column is a power or the sum of the motors' "
            "currents times the supply's voltage."
        )
    lines.append(
        f"**Power:** {_watts(shares[MEASURED])}; {len(balance.drives)} drives by log and model: "
        f"{terms[BASIS_MODEL]}."
    )
    if recognised:
        return tuple(lines)
    left = shares[UNEXPLAINED]
    lines.append(
        f"**Found beside them:** {terms[BASIS_FOUND] or 'nothing that predicts better'}; "
        f"{_watts(left)}, {percent(abs(left.watts / shares[MEASURED].watts), 1)} of the power. A "
        f"held-out sample is missed by {number(balance.rms[0])} W root mean square by the drives "
        f"alone, by {number(balance.rms[1])} W with all terms."
    )
    if sag := balance.sag:
        falls = (
            f"falls by {number(sag.resistance)} V per ampere ({number(sag.low)} to "
            f"{number(sag.high)} Ω) from {number(sag.voltage)} V: {number(sag.lost)} W are lost "
            "inside it, before they are measured"
        )
        known = falls if sag.low > 0 else "does not measurably fall under its current"
        lines.append(f"**Supply:** its voltage {known}.")
    basis = f"A sample of the supply is taken as {_READINGS[balance.reading]}, which predicts best."
    if balance.by_model:
        every = len(balance.by_model) == len(balance.drives)
        joints = "any joint" if every else ", ".join(balance.by_model)
        basis += f" No effort is logged of {joints}: the model's torque stands in."
    return (*lines, basis)


def _watts(share: Share) -> str:
    known = f" ({number(share.watts_low)} to {number(share.watts_high)} W)"
    shown = known if share.watts_high > share.watts_low else ""
    rivals = f", indistinguishable from {', '.join(share.rivals)}" if share.rivals else ""
    return f"{share.term.replace('_', ' ')} {number(share.watts)} W{shown}{rivals}"


def write_power_page(
    balance: Account, robot: str, tables: Sequence[Table], warnings: Sequence[str], folder: Path
) -> None:
    """Write ``index.html``; its figures are those of `pipeline.api.gap.figures`."""
    by_name = {t.name: t for t in tables}
    shares = {s.term: s for s in balance.shares}
    measured, left = shares[MEASURED], shares[UNEXPLAINED]
    own = sum(s.watts for s in balance.shares if s.basis and s.basis != BASIS_FOUND)
    power: tuple[Block, ...] = (
        table_block(by_name["power"], digits=3),
        FigureBlock("power_in_time", "Power at the supply; shaded: held-out samples."),
    )
    worth = (*warnings, checks_block(by_name["quality"]))
    page = Page(
        title=f"What the supply of '{robot}' gives, by log '{', '.join(balance.logs)}'",
        numbers=(
            Number(f"{number(measured.watts)} W", "at the supply, mean of the held-out samples"),
            Number(f"{number(own)} W", "sum over the drives, by log and model"),
            Number(f"{number(left.watts)} W", "unexplained", "bad" if balance.negative else "good"),
        ),
        picture=FigureBlock("power_shares", "Each term begins where that above ends."),
        answer=power_answer(balance),
        sections=(
            Section("Term by term", power),
            Section("Drive by drive", (table_block(by_name["power_drives"], digits=3),)),
            Section("What the data are worth", worth),
        ),
        files=files_of(tables),
    )
    write_page(page, folder)
