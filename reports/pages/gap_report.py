"""The pages of `gap` and `gap power`: what they show, and the answer of the second in lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.identification.compare.circumstances import WHOLE, noise_floor
from pipeline.identification.results import ACCEPTED, REJECTED, UNEXPLAINED, named
from pipeline.identification.supply.account import (
    BASIS_FOUND,
    BASIS_MODEL,
    MEASURED,
    RECOGNISED,
    Account,
    Share,
)
from pipeline.identification.supply.account import UNEXPLAINED as LEFT_OVER
from pipeline.identification.workflow.constants import voltage_remarks
from pipeline.identification.workflow.outcome import Outcome
from pipeline.simulation.found_bodies import FoundBodies
from reports.page import write_page
from reports.pages.gap_words import MANY_EFFECTS, URDF_FILE, answer, low_confidence
from reports.typeset import number, percent

if TYPE_CHECKING:
    from pandas import DataFrame

#: Candidates that the page lists; `candidates.csv` has all.
_CANDIDATES = 15


def write_report(
    outcome: Outcome, bodies: FoundBodies, tables: Mapping[str, DataFrame], folder: Path
) -> None:
    """Write ``index.html``; its figures are those of `reports.figures.gap_run`."""
    naming, compared, model = outcome.naming, outcome.compared, outcome.given.model
    logs, files = ", ".join(m.name for m in compared.measurements), {}
    if outcome.validated.text:
        files["model.toml"] = "Model file with the effects found; give it to any command as --model"
    if bodies.urdf:
        files[URDF_FILE] = "The robot's URDF with the bodies found"
    before, after = outcome.gaps
    settings, parts = compared.loaded.settings, compared.loaded
    doubts = low_confidence(naming.found)
    write_page(
        "gap",
        folder,
        tables,
        title=f"What the model of '{model.name}' lacks, by log '{logs}'",
        answer=answer(outcome, bodies),
        files=files,
        gap_unit=naming.unit,
        before=before,
        after=after,
        noise=outcome.noise,
        unexplained=outcome.validated.unexplained,
        found=[named(f) for f in naming.found],
        whole=WHOLE,
        doubts=doubts if len(doubts) > MANY_EFFECTS else [],
        voltages=voltage_remarks(model.actuators, naming, compared.measurements),
        signatures={n.removesuffix(".svg"): text for n, text in outcome.signatures.items()},
        nearest=_nearest(outcome),
        tried=naming.tried,
        notes=naming.notes,
        elsewhere=bodies.elsewhere if bodies.urdf else (),
        gaps=_gaps(outcome),
        costs=_costs(outcome),
        remarks=outcome.remarks,
        limit=f"{UNEXPLAINED:g}",
        **_left(outcome),
        warnings=_warnings(outcome),
        bandwidth=f"{settings.cutoff:.3g} Hz ({settings.reason})",
        counted=float(np.mean([float(m.mask.mean()) for m in compared.measurements])),
        split=f"{parts.rule}, {parts.guard:.2g} s apart",
        test_time=sum(stop - start for _, start, stop in outcome.held_out),
        spans=[(start, stop, log) for log, start, stop in outcome.held_out],
    )


def _nearest(outcome: Outcome) -> list[bool]:
    """Which candidates are nearest to being named: accepted ones, then by what they gain."""
    every = outcome.naming.candidates

    def rank(k: int) -> tuple[bool, bool, float]:
        one = every[k]
        return one.verdict != ACCEPTED, one.verdict == REJECTED, -one.gain

    kept = {*sorted(range(len(every)), key=rank)[:_CANDIDATES]}
    return [k in kept for k in range(len(every))]


def _gaps(outcome: Outcome) -> DataFrame:
    """Joints by how much the gap shrinks."""
    import pandas

    first, last = (outcome.validated.stages[k].gap for k in (0, -1))
    columns: dict[str, Any] = {"joint": outcome.given.model.joints}
    columns |= {"as it was": first, "as written": last}
    columns |= {"noise floor": noise_floor(outcome.compared.measurements)}
    frame = pandas.DataFrame(columns).assign(unit=outcome.naming.unit)
    return frame.iloc[np.argsort(-np.nan_to_num(first - last), kind="stable")]


def _costs(outcome: Outcome) -> DataFrame | None:
    """Energy of a cycle and power of standing by drivetrain option, before and after."""
    if outcome.energy is None:
        return None
    names = ("cycle before [J]", "standing before [W]", "cycle after [J]", "standing after [W]")
    costs = outcome.energy.set_axis(names, axis=1)
    return costs.rename_axis("drivetrain option").reset_index()


def _left(outcome: Outcome) -> dict[str, Any]:
    """What is left by joint and channel, the significant ones or the first."""
    import pandas

    every = sorted(outcome.validated.left, key=lambda r: r.ratio, reverse=True)
    shown = [r for r in every if r.significant] or every[:5]
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
        for r in shown
    ]
    return {"left": pandas.DataFrame(rows), "more_left": len(every) - len(shown)}


def _warnings(outcome: Outcome) -> list[str]:
    """What makes the data worth less."""
    parts = outcome.compared.loaded
    return [
        *outcome.given.warnings,
        *(
            f"the test rows of {joint} turn in its {way} direction only; the other is fitted, not "
            "tested. A second log with `--holdout` tests both"
            for joint, way in outcome.one_way
        ),
        *([parts.warning] if parts.warning else []),
    ]


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
    left = shares[LEFT_OVER]
    lines.append(
        f"**Found beside them:** {terms[BASIS_FOUND] or 'nothing that predicts better'}; "
        f"{_watts(left)}, {percent(abs(left.watts / shares[MEASURED].watts), 1)} of the power. A "
        f"test sample is missed by {number(balance.rms[0])} W root mean square by the drives "
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
    balance: Account,
    robot: str,
    tables: Mapping[str, DataFrame],
    warnings: Sequence[str],
    folder: Path,
) -> None:
    """Write ``index.html``; its figures are those of `reports.figures.gap_run`."""
    shares = {s.term: s for s in balance.shares}
    write_page(
        "power",
        folder,
        tables,
        title=f"What the supply of '{robot}' gives, by log '{', '.join(balance.logs)}'",
        answer=power_answer(balance),
        measured=shares[MEASURED].watts,
        drives=sum(s.watts for s in balance.shares if s.basis and s.basis != BASIS_FOUND),
        left=shares[LEFT_OVER].watts,
        negative=balance.negative,
        warnings=warnings,
    )
