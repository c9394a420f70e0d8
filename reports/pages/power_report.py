"""The page of `gap power`: what the supply gives, term by term and drive by drive."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipeline.identification.supply.account import (
    BASIS_FOUND,
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
from reports.table import Table
from reports.typeset import number, percent, unit_text

_READINGS = {"mean": "the mean since the one before", "instant": "the value of its instant"}


def power_answer(balance: Account) -> tuple[str, ...]:
    """The answer in a few lines, which the page and the terminal show."""
    shares = {s.term: s for s in balance.shares}
    found = [s for s in balance.shares if s.basis == BASIS_FOUND]
    own = [s for s in balance.shares if s.basis and s.basis != BASIS_FOUND]
    measured, left = shares[MEASURED], shares[UNEXPLAINED]
    recognised = balance.wrong_sum == RECOGNISED
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
    terms = ", ".join(f"{s.term} {number(s.watts)} W" for s in own)
    lines.append(
        f"**Measured:** {number(measured.watts)} W on average; the {len(balance.drives)} drives, "
        f"by log and model, {number(sum(s.watts for s in own))} W: {terms}."
    )
    if recognised:  # of what is no power no term means anything
        return tuple(lines)
    said = "; ".join(f"**{s.term.replace('_', ' ')}** {_term(s)}" for s in found)
    lines.append(f"**Found beside it:** {said or 'nothing that makes the prediction better'}.")
    if drivers := shares.get("drivers"):
        passed = 1 / (1 + (drivers.coefficient or 0.0))
        lines.append(f"**Drivers** pass {percent(passed, 1)} of what they draw on to the motors.")
    lines.append(
        f"**Unexplained:** {_watts(left)}, {percent(abs(left.watts / measured.watts), 1)} of the "
        f"power. A held-out sample is missed by {number(balance.rms[0])} W root mean square by the "
        f"model's sum, by {number(balance.rms[1])} W with all terms."
    )
    if (sag := balance.sag) and sag.low > 0:
        lines.append(
            f"**Supply:** its voltage falls by {number(sag.resistance)} V per ampere "
            f"({number(sag.low)} to {number(sag.high)} Ω) from {number(sag.voltage)} V: "
            f"{number(sag.lost)} W are lost inside it, before they are measured."
        )
    elif sag:
        lines.append("**Supply:** its voltage does not measurably fall under its current.")
    basis = f"A sample of the supply is taken as {_READINGS[balance.reading]}, which predicts best."
    if balance.by_model:
        every = len(balance.by_model) == len(balance.drives)
        joints = "any joint" if every else ", ".join(balance.by_model)
        basis += f" No effort is logged of {joints}: the model's torque stands in."
    return (*lines, basis)


def _watts(share: Share) -> str:
    known = f" ({number(share.watts_low)} to {number(share.watts_high)} W)"
    return f"{number(share.watts)} W{known if share.watts_high > share.watts_low else ''}"


def _term(share: Share) -> str:
    text = f"{_watts(share)}, {share.words}"
    if share.unit != "W" and share.coefficient is not None:
        unit = "" if share.unit == "1" else f" {unit_text(share.unit)}"
        text += f": {number(share.coefficient)}{unit}"
    if share.rivals:
        rivals = ", ".join(share.rivals).replace("_", " ")
        text += f" (indistinguishable from {rivals})"
    return text


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
    worth: tuple[Block, ...] = (*warnings, table_block(by_name["quality"], digits=3))
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
