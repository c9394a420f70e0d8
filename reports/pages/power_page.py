"""The answer of `gap power` in a few sentences, and its page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.identification.supply.account import MEASURED, UNEXPLAINED, Account
from reports.figures.gap import power_time_figure
from reports.figures.style import save_figure
from reports.page import rendered, write_page

if TYPE_CHECKING:
    from pandas import DataFrame


def power_answer(balance: Account) -> list[str]:
    """What the supply gives, term by term, and what stays unexplained."""
    rows = balance.power.set_index("term", drop=False).to_dict("index")
    model, found = (
        [row for row in rows.values() if row["basis"] == basis] for basis in ("model", "found")
    )
    return rendered(
        "power_answer.j2",
        measured=rows[MEASURED],
        left=rows[UNEXPLAINED],
        model=model,
        found=found,
        samples=len(balance.samples),
        drives=len(balance.drives),
        test=balance.samples.loc[balance.samples["test"], "measured_W"],
        wrong_sum=balance.wrong_sum,
        rms=balance.rms,
        reading=balance.reading,
        by_model=balance.by_model,
    )


def write_power_page(
    balance: Account,
    robot: str,
    warnings: Sequence[str],
    tables: Mapping[str, DataFrame],
    folder: Path,
) -> None:
    """Draw the figures, and write ``index.html`` that shows them."""
    title = f"{robot}: power at the supply"
    save_figure(power_time_figure(balance.samples, title=title), folder, "power_in_time")
    rows = balance.power.set_index("term")["mean_W"]
    write_page(
        "power",
        folder,
        tables,
        title=f"What the supply of '{robot}' gives, by log '{', '.join(balance.logs)}'",
        answer=power_answer(balance),
        measured=rows[MEASURED],
        drives=balance.power.loc[balance.power["basis"] == "model", "mean_W"].sum(),
        left=rows[UNEXPLAINED],
        negative=balance.negative,
        warnings=warnings,
    )
