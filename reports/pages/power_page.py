"""The answer of `gap power` in a few sentences, and its page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.identification.supply.account import MEASURED, UNEXPLAINED, Account
from reports.figures.gap import power_time_figure
from reports.figures.style import save_figure
from reports.page import write_page
from reports.typeset import number

if TYPE_CHECKING:
    from pandas import DataFrame


def power_answer(balance: Account) -> list[str]:
    """What the supply gives, term by term, and what stays unexplained."""
    rows = balance.power.set_index("term", drop=False).to_dict("index")
    model, found = (
        [row for row in rows.values() if row["basis"] == basis] for basis in ("model", "found")
    )
    measured, left = rows[MEASURED], rows[UNEXPLAINED]
    test = balance.samples.loc[balance.samples["test"], "measured_W"]
    lines = [
        f"**Power:** {number(measured['mean_W'])} W, mean of all {len(balance.samples)} samples; "
        f"{len(balance.drives)} drives by log and model: {_terms(model)}."
    ]
    if balance.wrong_sum:
        told = (
            "**The column is no power at the supply: it follows the motors' currents, summed and "
            "multiplied with the supply's voltage.** A driver passes a motor its current at the "
            "motor's own voltage, which is less. Measure the current between supply and drivers."
        )
        return [told, *lines]
    lines += [
        f"**Found beside them:** {_terms(found) or 'nothing that predicts better'}.",
        f"**Unexplained** on the {len(test)} test samples (mean {number(test.mean())} W"
        f"): {number(left['mean_W'])} W, 95 % {number(left['mean_low_W'])} to "
        f"{number(left['mean_high_W'])} W; a sample is missed by {number(balance.rms[0])} W root "
        f"mean square by the drives alone, by {number(balance.rms[1])} W with all terms.",
    ]
    of = {"mean": "the mean since the one before", "instant": "the value of its instant"}
    lines.append(f"A sample is taken as {of[balance.reading]}, which predicts best.")
    if balance.by_model:
        every = len(balance.by_model) == len(balance.drives)
        joints = "any joint" if every else ", ".join(balance.by_model)
        lines[-1] += f" No effort is logged of {joints}: the model's torque stands in."
    return lines


def _terms(rows: Sequence[Mapping[Any, Any]]) -> str:
    parts = []
    for row in rows:
        ends = f" ({number(row['mean_low_W'])} to {number(row['mean_high_W'])} W)"
        known = ends if row["mean_high_W"] > row["mean_low_W"] else ""
        like = row["indistinguishable_from"].replace("+", ", ").replace("_", " ")
        other = f", or {like} in its place" if like else ""
        parts.append(f"{row['term'].replace('_', ' ')} {number(row['mean_W'])} W{known}{other}")
    return ", ".join(parts)


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
