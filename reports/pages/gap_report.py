"""The pages of `gap` and `gap power`: the answer, then what it rests on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

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
from reports.page import (
    Block,
    FigureBlock,
    Number,
    Page,
    Section,
    TableBlock,
    files_of,
    table_block,
    write_page,
)
from reports.pages.gap_words import MANY_EFFECTS, URDF_FILE, answer, low_confidence
from reports.typeset import number, percent

if TYPE_CHECKING:
    from pandas import DataFrame

#: Candidates that the page lists; `candidates.csv` has all.
_CANDIDATES = 15
#: Verdicts to how they look.
_TONES = {
    **dict.fromkeys(("accepted", "confirmed", "noise", "ok"), "good"),
    **dict.fromkeys(("unexplained", "warning", "refused", "suspected"), "bad"),
    **dict.fromkeys(("rejected", "not identifiable on this motion", "masked"), "quiet"),
}


def write_report(
    outcome: Outcome, bodies: FoundBodies, tables: Mapping[str, DataFrame], folder: Path
) -> None:
    """Write ``index.html``; its figures are those of `pipeline.api.gap.figures`."""
    logs = ", ".join(m.name for m in outcome.compared.measurements)
    files = files_of(tables)
    if outcome.validated.text:
        files["model.toml"] = "Model file with the effects found; give it to any command as --model"
    if bodies.urdf:
        files[URDF_FILE] = "The robot's URDF with the bodies found"
    every = sorted(outcome.validated.left, key=lambda r: r.ratio, reverse=True)
    shown = [r for r in every if r.significant] or every[:5]
    rows = tuple(
        (
            *(r.joint, r.channel, r.error, r.noise_floor, r.unit),
            "unexplained" if r.significant else "noise",
            r.description or None,
        )
        for r in shown
    )
    headers = ("joint", "channel", "left", "noise floor", "unit", "verdict", "what it looks like")
    caption = (
        f"What the model as written leaves on held-out data; {len(every) - len(shown)} pairs of "
        f"joint and channel are not listed. Up to {UNEXPLAINED:g} times the noise floor counts as "
        "noise."
    )
    sections = [
        Section("Where model and machine disagree", _where(tables)),
        Section("What is missing", _missing(outcome, tables)),
        *([Section("The bodies", _bodies(bodies, tables))] if bodies.bodies else []),
        Section("How much smaller the gap is", _smaller(outcome)),
        *([Section("What it costs", _costs(outcome))] if outcome.energy else []),
        Section("What is left", (TableBlock(headers, rows, caption, "", _TONES, 3),)),
        Section("What the data are worth", _data(outcome, tables)),
    ]
    (before, after), unit = outcome.gaps, outcome.naming.unit
    found = outcome.naming.found
    listed = f": {named(found[0])}{' and others' * (len(found) > 1)}" if found else ""
    ended = "bad" if outcome.validated.unexplained else "good"
    page = Page(
        title=f"What the model of '{outcome.given.model.name}' lacks, by log '{logs}'",
        numbers=(
            Number(f"{number(before)} {unit}", "gap of all joints, model as it was, held-out data"),
            Number(f"{number(after)} {unit}", "the same with what was found", ended),
            Number(f"{number(outcome.noise)} {unit}", "noise floor of the logs"),
            Number(str(len(found)), f"effect{'s' * (len(found) != 1)} found{listed}"),
        ),
        picture=FigureBlock("waterfall", "The gap of all joints, effect by effect."),
        answer=answer(outcome, bodies),
        sections=tuple(sections),
        files=files,
    )
    write_page(page, folder)


def _where(tables: Mapping[str, DataFrame]) -> tuple[Block, ...]:
    columns = ("joint", "gap", "mean", "noise_floor", "unit", "share_of_total", "share_above_noise")
    return (
        FigureBlock(
            "where_map",
            "Gap of the model as it was, by joint and circumstance, over the noise floor; blank: "
            "too few rows.",
        ),
        table_block(
            tables,
            "where",
            columns,
            keep=tables["where"]["by"].eq(WHOLE),
            digits=3,
            caption="Measured minus predicted before anything is added, all compared rows, the "
            "largest part of the gap above the noise first.",
        ),
    )


def _missing(outcome: Outcome, tables: Mapping[str, DataFrame]) -> tuple[Block, ...]:
    """What was found, how sure it is, what else was tried, and notes of the search."""
    naming, blocks = outcome.naming, list[Block]()
    if naming.found:
        columns = (
            *("order", "effect", "joint", "parameter", "value", "ci_low", "ci_high", "unit"),
            *("gap_before", "gap_after", "gap_unit", "noise_floor", "level", "written"),
        )
        caption = (
            "What the model lacked; torques and frictions at the joint. The interval holds what "
            "the log's scatter, the stated tolerances and one per cent for the law leave open."
        )
        block = table_block(tables, "found", columns, digits=3, tones=_TONES, caption=caption)
        blocks.append(block)
    remarks = low_confidence(naming.found)
    if len(remarks) > MANY_EFFECTS:
        blocks += ["Names that are not certain:", tuple(remarks)]
    blocks += voltage_remarks(outcome.given.model.actuators, naming, outcome.compared.measurements)
    blocks += [
        FigureBlock(name.removesuffix(".svg"), caption)
        for name, caption in outcome.signatures.items()
    ]
    if naming.candidates:
        order = sorted(
            range(len(naming.candidates)),
            key=lambda k: (
                naming.candidates[k].verdict != ACCEPTED,
                naming.candidates[k].verdict == REJECTED,
                -naming.candidates[k].gain,
            ),
        )
        nearest = set(order[:_CANDIDATES])
        tried = ("effect", "place", "validation_before", "validation_after", "unit", "verdict")
        caption = (
            f"The {len(nearest)} candidates nearest to being named, of {naming.tried} tried. Gap "
            "on validation rows, by estimates from others for either; a dash: it is not in the set "
            "of names that explains the log best."
        )
        block = table_block(
            tables,
            "candidates",
            (*tried, "reason"),
            keep=[k in nearest for k in range(len(naming.candidates))],
            tones=_TONES,
            digits=3,
            caption=caption,
        )
        blocks.append(block)
    return (*blocks, *([naming.notes] if naming.notes else []))


def _bodies(found: FoundBodies, tables: Mapping[str, DataFrame]) -> tuple[Block, ...]:
    caption = (
        "Links with all that is fixed to them, largest change first; centre of mass in the link's "
        "frame. A link differs where the URDF's value lies outside the 95 % interval, that of the "
        "centre of mass as wide as those of mass and first moment allow. One motion tells "
        "combinations of the parameters of a chain of links, so that single masses may be open "
        "where the torque is not."
    )
    blocks: tuple[Block, ...] = (table_block(tables, "bodies", digits=3, caption=caption),)
    if found.urdf and found.elsewhere:
        said = f"A URDF cannot carry what stands in model.toml alone: {'; '.join(found.elsewhere)}."
        blocks += (said,)
    return blocks


def _smaller(outcome: Outcome) -> tuple[Block, ...]:
    """Joints by how much the gap shrinks."""
    first, last = (outcome.validated.stages[k].gap for k in (0, -1))
    floor, joints = noise_floor(outcome.compared.measurements), outcome.given.model.joints
    rows = tuple(
        (joints[j], float(first[j]), float(last[j]), float(floor[j]), outcome.naming.unit)
        for j in np.argsort(-np.nan_to_num(first - last)).tolist()
    )
    caption = (
        "Gap, root mean square, on held-out data. As written: with the effects of the model file, "
        "read back, nothing estimated anew."
    )
    headers = ("joint", "as it was", "as written", "noise floor", "unit")
    return (
        FigureBlock("in_time", "Measured and predicted, and what is left, without and with it."),
        TableBlock(headers, rows, caption, digits=3),
    )


def _costs(outcome: Outcome) -> tuple[Block, ...]:
    """Energy of a cycle and power of standing by alternative, before and after."""
    assert outcome.energy is not None
    before, after = outcome.energy.before, outcome.energy.after
    rows = tuple(
        (
            *(name, old.cycle, after[name].cycle if name in after else None),
            *(old.standing, after[name].standing if name in after else None),
        )
        for name, old in before.items()
    )
    headers = ("alternative", "cycle before [J]", "after [J]", "standing before [W]", "after [W]")
    caption = (
        "Electrical energy of one gait cycle of the robot file's own gait, whole robot, returned "
        "energy lost, and power to stand, without and with what the model file holds; a dash: it "
        "is not known. Bodies, ground, springs, ripples and motors that were found count in every "
        "alternative; friction, inertia and coupling of a drivetrain in the one they were found "
        "against."
    )
    return (TableBlock(headers, rows, caption), *outcome.remarks)


def _data(outcome: Outcome, tables: Mapping[str, DataFrame]) -> tuple[Block, ...]:
    """Warnings, which rows count, which are held out, and checks with a remark."""
    compared = outcome.compared
    settings, parts = compared.loaded.settings, compared.parts
    counted = float(np.mean([float(m.mask.mean()) for m in compared.measurements]))
    spans = outcome.held_out
    listed = "; ".join(f"{start:.2f} to {stop:.2f} s of '{log}'" for log, start, stop in spans[:3])
    notes = [
        *outcome.given.warnings,
        *(
            f"the held-out rows of {joint} turn in its {way} direction only; the other is fitted, "
            "not tested. A second log with `--holdout` tests both"
            for joint, way in outcome.one_way
        ),
        *([parts.warning] if parts.warning else []),
    ]
    return (
        *(f"**Note:** {note}." for note in notes),
        f"Bandwidth {settings.cutoff:.3g} Hz ({settings.reason}). {percent(counted)} of the rows "
        "count, by joint: not those whose filter sees the joint stop or turn back, where friction "
        "takes any value, nor the ends of the log.",
        f"Training, validation and test: {parts.rule}, {parts.guard:.2g} s apart. Held out: "
        f"{number(sum(stop - start for _, start, stop in spans))} s in {len(spans)} stretches"
        f"{f' ({listed})' if len(spans) <= MANY_EFFECTS else ''}.",
        checks_block(tables),
    )


def checks_block(tables: Mapping[str, DataFrame]) -> Block:
    """The checks of the logs that have a remark."""
    odd = tables["quality"]["verdict"].ne("ok")
    if not odd.any():
        return f"Every one of the {len(odd)} checks passed; `quality.csv` lists them."
    caption = f"Checks with a remark; {len(odd)} in all."
    return table_block(tables, "quality", keep=odd, tones=_TONES, digits=3, caption=caption)


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
    balance: Account,
    robot: str,
    tables: Mapping[str, DataFrame],
    warnings: Sequence[str],
    folder: Path,
) -> None:
    """Write ``index.html``; its figures are those of `pipeline.api.gap.figures`."""
    shares = {s.term: s for s in balance.shares}
    measured, left = shares[MEASURED], shares[LEFT_OVER]
    own = sum(s.watts for s in balance.shares if s.basis and s.basis != BASIS_FOUND)
    power: tuple[Block, ...] = (
        table_block(tables, "power", digits=3),
        FigureBlock("power_in_time", "Power at the supply; shaded: held-out samples."),
    )
    worth = (*warnings, checks_block(tables))
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
            Section("Drive by drive", (table_block(tables, "power_drives", digits=3),)),
            Section("What the data are worth", worth),
        ),
        files=files_of(tables),
    )
    write_page(page, folder)
