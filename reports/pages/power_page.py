"""The page of `gap power`: what the supply gives, term by term."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipeline.identification.supply.account import (
    BASIS_FOUND,
    MEASURED,
    RECOGNISED,
    UNEXPLAINED,
    Account,
)
from reports.markdown import write_pages
from reports.page import FigureBlock, Number, Page
from reports.table import Table
from reports.typeset import number
from reports.words import Shown, Words, percent, sections

WORDS = Words("power")


def power_answer(balance: Account) -> tuple[str, ...]:
    """The answer in words, a paragraph each."""
    shares = {s.term: s for s in balance.shares}
    found = [s for s in balance.shares if s.basis == BASIS_FOUND]
    own = [s for s in balance.shares if s.basis and s.basis != BASIS_FOUND]
    measured, left = shares[MEASURED], shares[UNEXPLAINED]
    paragraphs = (
        WORDS("wrong_sum", balance.wrong_sum),
        WORDS("sums", measured, own, len(balance.drives), balance.wrong_sum),
        WORDS("found", found, shares.get("drivers")),
        WORDS("left", left, measured, balance.rms),
        WORDS("sag", balance.sag),
        WORDS("basis", balance.by_model, balance.reading, len(balance.drives)),
    )
    # Of what is no power no term means anything.
    return tuple(filter(None, paragraphs[:2] if balance.wrong_sum == RECOGNISED else paragraphs))


def write_power_page(
    balance: Account, robot: str, tables: Sequence[Table], warnings: Sequence[str], folder: Path
) -> None:
    """Write ``report.md`` and ``index.html``; the figures must be there already."""
    run = Shown({t.name: t for t in tables})
    shares = {s.term: s for s in balance.shares}
    measured, left = shares[MEASURED], shares[UNEXPLAINED]
    answer = power_answer(balance)
    own = float(sum(s.watts for s in balance.shares if s.basis and s.basis != BASIS_FOUND))
    page = Page(
        title=f"What the supply of '{robot}' gives, by log '{', '.join(balance.logs)}'",
        numbers=(
            Number(f"{number(measured.watts)} W", "at the supply, mean of the held-out samples"),
            Number(f"{number(own)} W", "sum over the drives, by log and model"),
            Number(
                f"{number(left.watts)} W",
                f"unexplained, {percent(abs(left.watts) / abs(measured.watts), 1)} of it",
                "bad" if balance.negative else "good",
            ),
        ),
        picture=FigureBlock(folder / "power_shares_narrow.svg", alt="Shares of the power."),
        answer=answer[:3],
        sections=sections(WORDS.text("page", run, answer, warnings), run, folder),
        files={f"{t.name}.csv": t.description for t in tables},
    )
    write_pages(page, folder, "report.md")
