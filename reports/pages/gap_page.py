"""The pages of `gap` and `gap power`: figures, tables, and a template each that shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline.effects.bodies import RigidBodyParameters
from pipeline.identification.residual import floor_of
from pipeline.identification.results import INDISTINGUISHABLE, UNEXPLAINED
from pipeline.identification.supply import account
from pipeline.identification.where import WHOLE
from pipeline.identification.workflow.outcome import Outcome
from pipeline.logs.log import TEST
from reports.figures.gap import by_joint_figure, in_time_figure, power_time_figure
from reports.figures.style import save_figure
from reports.page import rendered, write_page
from reports.pages.gap_answer import Tables, answer, law_words
from reports.typeset import number, unit_text

if TYPE_CHECKING:
    from pandas import DataFrame


def write_gap_page(outcome: Outcome, tables: Tables, folder: Path) -> None:
    """Draw the figures, and write ``index.html`` that shows them."""
    compared, model, stages = outcome.compared, outcome.given.model, outcome.held.stages
    first, last, unit = stages[0], stages[-1], outcome.unit
    floor = floor_of(compared.logs, TEST)[:, 0]
    figure = by_joint_figure(
        model.joints, (first.gap, last.gap), floor, unit, title=f"{model.name}: the gap by joint"
    )
    save_figure(figure, folder, "by_joint")
    predictions = first.predictions, last.predictions
    title = "Measured and predicted, without and with what was found"
    figure = in_time_figure(compared.logs, predictions, outcome.shown, unit, title=title)
    save_figure(figure, folder, "in_time")
    files = {}
    if outcome.text:
        files["model.toml"] = "Model file with the effects found; give it to any command as --model"
    settings, parts = compared.loaded.settings, compared.loaded
    found = tables["found"][tables["found"]["effect"] != RigidBodyParameters.name]
    at_joint = found[(found["place"] == found["joint"]) & found["joint"].isin(model.joints)]
    joints = at_joint.groupby("effect")["joint"].nunique()
    several = at_joint[at_joint["effect"].isin(joints.index[joints > 1])]
    write_page(
        "gap",
        folder,
        tables,
        title=f"What the model of '{model.name}' lacks, by log "
        f"'{', '.join(m.name for m in compared.logs)}'",
        answer=answer(outcome, tables),
        files=files,
        gap_unit=unit,
        gaps=outcome.gaps,
        noise=outcome.noise,
        unexplained=any(r.significant for r in outcome.held.left),
        names=found["effect"].nunique(),
        laws=law_table(several, model.joints) if len(several) else None,
        single=tables["found"].index.isin(found.index.difference(several.index)),
        nearest=tables["candidates"]["verdict"].str.startswith(INDISTINGUISHABLE).tolist(),
        whole=WHOLE,
        costs=_costs(outcome.energy),
        remarks=outcome.remarks,
        left=_left_table(outcome),
        limit=f"{UNEXPLAINED:g}",
        warnings=[*outcome.given.warnings, *filter(None, [parts.warning])],
        bandwidth=f"{settings.cutoff:.3g} Hz ({settings.reason})",
        counted=float(np.mean([float(m.mask.mean()) for m in compared.logs])),
        split=f"{parts.rule}, {parts.guard:.2g} s apart",
    )


def law_table(rows: DataFrame, joints: Sequence[str]) -> DataFrame:
    """All joints by the numbers of some laws, each with its 95 % interval."""
    interval = [
        f"{number(v)} ({number(a)} to {number(b)})"
        for v, a, b in rows[["value", "ci_low", "ci_high"]].itertuples(index=False)
    ]
    units = [f" [{unit_text(u)}]" if u not in ("", "1") else "" for u in rows["unit"]]
    pairs = zip(rows["effect"], rows["parameter"], units, strict=True)
    head = [f"{law_words(effect)}, {name}{unit}" for effect, name, unit in pairs]
    table = rows.assign(head=head, cell=interval).pivot_table(
        index="joint", columns="head", values="cell", aggfunc="first", sort=False
    )
    return table.reindex([*joints]).reset_index().rename_axis(columns=None)


def _costs(change: DataFrame | None) -> DataFrame | None:
    """Energy of a cycle and power of standing by drivetrain option, before and after."""
    if change is None:
        return None
    names = ("cycle before [J]", "standing before [W]", "cycle after [J]", "standing after [W]")
    return change.set_axis(names, axis=1).rename_axis("drivetrain option").reset_index()


def _left_table(outcome: Outcome) -> DataFrame:
    """What the model as written leaves, by joint and channel."""
    import pandas

    rows = [
        {
            "joint": r.joint,
            "channel": r.channel,
            "left": r.error,
            "noise floor": r.noise_floor,
            "unit": r.unit,
            "verdict": "unexplained" if r.significant else "noise",
            "what it looks like": r.description or None,
        }
        for r in sorted(outcome.held.left, key=lambda r: -r.ratio)
    ]
    return pandas.DataFrame(rows)


def power_answer(balance: account.Account) -> list[str]:
    """What the supply gives, term by term, and what stays unexplained."""
    rows = balance.power.set_index("term", drop=False).to_dict("index")
    model, found = (
        [row for row in rows.values() if row["basis"] == basis] for basis in ("model", "found")
    )
    return rendered(
        "power_answer.j2",
        measured=rows[account.MEASURED],
        left=rows[account.UNEXPLAINED],
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
    balance: account.Account,
    robot: str,
    warnings: Sequence[str],
    tables: Mapping[str, DataFrame],
    folder: Path,
) -> None:
    """Draw the figures, and write ``index.html`` that shows them."""
    title = f"{robot}: power at the supply"
    save_figure(power_time_figure(balance.samples, title=title), folder, "power_in_time")
    rows = balance.power.set_index("term")["mean_W"]
    logs = ", ".join(balance.samples["log"].unique())
    write_page(
        "power",
        folder,
        tables,
        title=f"What the supply of '{robot}' gives, by log '{logs}'",
        answer=power_answer(balance),
        measured=rows[account.MEASURED],
        drives=balance.power.loc[balance.power["basis"] == "model", "mean_W"].sum(),
        left=rows[account.UNEXPLAINED],
        negative=balance.negative,
        warnings=warnings,
    )
