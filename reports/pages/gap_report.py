"""The page of a run of `gap`: the answer first, then what it rests on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.effects.base import place_text
from pipeline.identification.compare.circumstances import WHOLE
from pipeline.identification.compare.stages import noise_floor, overall
from pipeline.identification.results import (
    ACCEPTED,
    REJECTED,
    UNEXPLAINED,
    Residual,
    named,
)
from pipeline.identification.workflow.constants import voltage_remarks
from pipeline.identification.workflow.outcome import Outcome
from pipeline.simulation.found_bodies import FoundBodies
from reports.html import write_html
from reports.markdown import write_markdown
from reports.page import (
    Block,
    FigureBlock,
    Number,
    Page,
    Points,
    Section,
    TableBlock,
    Text,
    table_block,
)
from reports.pages.gap_words import (
    MANY_EFFECTS,
    URDF_FILE,
    WORDS,
    bodies_blocks,
    bodies_words,
    energy_words,
    held_out_words,
    left_words,
    low_confidence,
    one_way_words,
    priced,
    smaller_words,
    what_words,
    where_words,
    whole_joints,
)
from reports.pages.motor_words import motors_text
from reports.pages.names import legs_text
from reports.table import Table
from reports.words import number, percent

TONES = {
    "accepted": "good",
    "rejected": "quiet",
    "not identifiable on this motion": "quiet",
    "noise": "good",
    "unexplained": "bad",
    "ok": "good",
    "warning": "bad",
    "refused": "bad",
    "masked": "quiet",
}
#: Candidates that the page lists; `candidates.csv` has all.
SHOWN_CANDIDATES = 15


def write_report(
    outcome: Outcome, bodies: FoundBodies, tables: Sequence[Table], folder: Path, footer: str
) -> None:
    """Write ``report.md`` and ``index.html``; the figures must be there already."""
    page = report(outcome, bodies, {t.name: t for t in tables}, folder, footer)
    write_markdown(page, folder / "report.md")
    write_html(page, folder / "index.html")


def report(
    outcome: Outcome, bodies: FoundBodies, tables: dict[str, Table], folder: Path, footer: str
) -> Page:
    """The page; see `write_report`."""
    names = ", ".join(m.name for m in outcome.compared.measurements)
    files = {f"{t.name}.csv": t.description for t in tables.values()}
    if outcome.validated.text:
        files["model.toml"] = "Model file with the effects found; give it to any command as --model"
    if bodies.urdf:
        files[URDF_FILE] = "The robot's URDF with the bodies found"
    own = bodies_blocks(bodies)
    return Page(
        title=f"What the model of '{outcome.given.model.name}' lacks, by log '{names}'",
        numbers=_numbers(outcome),
        picture=FigureBlock(folder / "waterfall_narrow.svg", alt="The gap, effect by effect."),
        answer=_first(outcome, bodies),
        sections=(
            Section("The answer in full", tuple(map(Text, answer(outcome, bodies)))),
            _where(outcome, tables, folder),
            _what(outcome, tables, folder),
            *([Section("The bodies", own)] if own else []),
            _smaller(outcome, folder),
            *_energy(outcome),
            _left(outcome),
            _data(outcome, tables),
        ),
        files=files,
        footer=footer,
    )


def _numbers(outcome: Outcome) -> tuple[Number, ...]:
    """The gap before and after, the noise, and how much was found."""
    before, after = _whole(outcome)
    unit, found = outcome.naming.unit, outcome.naming.found
    ended = "bad" if outcome.validated.unexplained else "good"
    listed = f": {named(found[0])}{' and others' * (len(found) > 1)}" if found else ""
    effects = f"effect{'s' * (len(found) != 1)} found"
    return (
        Number(
            f"{number(before)} {unit}",
            "gap, root mean square: measured minus predicted, model as it was",
        ),
        Number(f"{number(after)} {unit}", "the same with what was found, on held-out data", ended),
        Number(f"{number(outcome.noise)} {unit}", "noise floor of the logs"),
        Number(str(len(found)), effects + listed),
    )


def _first(outcome: Outcome, bodies: FoundBodies) -> tuple[str, ...]:
    """One sentence each: where, what is fitted, what it predicts, what it costs, whose motors."""
    naming, (before, after) = outcome.naming, _whole(outcome)
    levels = Counter(f.level for f in naming.found)
    said = (
        WORDS("where_short", whole_joints(outcome.compared.rows)),
        WORDS("fitted", naming.found, [f"{count} {level}" for level, count in levels.items()]),
        bodies_words(bodies),
        WORDS("predicted", before, after, naming.unit),
        WORDS("cost_short", outcome.energy, priced(outcome.energy, outcome.given.alternative))
        if outcome.energy
        else "",
        left_words(outcome),
        whose_motors(outcome),
    )
    return tuple(filter(None, said))


def whose_motors(outcome: Outcome) -> str:
    """Which motors turn the log's currents into torque."""
    motors = outcome.given.motors
    if motors is None:
        laws = (one.log.derived.get("torque") for one in outcome.compared.loaded.prepared)
        law = next(filter(None, laws), "")
        torque = f"torque by the servos' law ({law}), not measured," if law else "the log's torque"
        return f"**Whose motors:** none; {torque} is compared at the joints."
    return motors_text(motors)


def answer(outcome: Outcome, bodies: FoundBodies) -> tuple[str, ...]:
    """The first lines: where, what, bodies, how much smaller, what it costs, what is left."""
    validated, found, decides = outcome.validated, outcome.naming.found, outcome.decided is not None
    excitations = list(dict.fromkeys(f.excitation for f in found if f.rivals))
    joints = [outcome.given.model.joints[j] for j in validated.joints]
    said = (
        *(
            f"**Nothing below is an explanation while this stands:** {text}."
            for text in outcome.suspected
        ),
        where_words(outcome.compared.rows),
        what_words(outcome),
        bodies_words(bodies),
        smaller_words(found, joints, _whole(outcome), outcome.naming.unit, outcome.noise),
        energy_words(outcome.energy, outcome.given.alternative) if outcome.energy else "",
        WORDS("undecided", low_confidence(found), excitations, decides),
        left_words(outcome) if validated.unexplained or not outcome.suspected else "",
    )
    return tuple(filter(None, said))


def _whole(outcome: Outcome) -> tuple[float, float]:
    """Gap of all joints of the model as it was and as written."""
    stages = outcome.validated.stages
    return overall(stages[0].gap), overall(stages[-1].gap)


def _where(outcome: Outcome, tables: dict[str, Table], folder: Path) -> Section:
    by = tables["where"].columns["by"]
    whole = [value == WHOLE for value in by]
    shown = ("joint", "gap", "mean", "noise_floor", "unit", "share_of_total", "share_above_noise")
    robot = outcome.given.robot
    named = () if robot is None or not robot.floating else (Text(legs_text(robot)),)
    return Section(
        "Where model and machine disagree",
        (
            *named,
            FigureBlock(
                folder / "where_map.svg",
                "Gap of the model as it was, by joint and circumstance, over the noise floor. A "
                "dark row points to a joint, a dark band in it to a circumstance; blank: too few "
                "rows.",
            ),
            table_block(
                tables["where"],
                shown,
                keep=whole,
                caption="Measured minus predicted before anything is added, all compared rows, the "
                "largest part of the gap above the noise first.",
                digits=3,
            ),
        ),
    )


def _what(outcome: Outcome, tables: dict[str, Table], folder: Path) -> Section:
    blocks: list[Block] = []
    if outcome.naming.found:
        blocks.append(
            table_block(
                tables["found"],
                ("order", "effect", "joint", "parameter", "value", "ci_low", "ci_high", "unit"),
                caption="What the model lacked; torques and frictions at the joint. The interval "
                "holds what the log's scatter, the stated tolerances and one per cent for the law "
                "leave open.",
                digits=3,
            )
        )
    told = voltage_remarks(
        outcome.given.model.actuators, outcome.naming, outcome.compared.measurements
    )
    blocks += [Text(sentence) for sentence in told]
    blocks += [FigureBlock(folder / name, caption) for name, caption in outcome.signatures.items()]
    if outcome.naming.candidates:
        blocks.append(_candidates(outcome))
    return Section("What is missing", tuple(blocks))


def _candidates(outcome: Outcome) -> TableBlock:
    every = sorted(
        outcome.naming.candidates,
        key=lambda c: (c.verdict != ACCEPTED, c.verdict == REJECTED, -c.gain),
    )
    rows = tuple(
        (c.effect, place_text(c.place), c.before, c.after, c.unit, c.verdict, c.reason)
        for c in every[:SHOWN_CANDIDATES]
    )
    return TableBlock(
        ("effect", "place", "validation without", "with", "unit", "verdict", "why"),
        rows,
        f"The {len(rows)} candidates nearest to being named, of {outcome.naming.tried} tried. "
        "Without and with: gap on validation rows, by estimates from others "
        "for either; a dash: it is not in the set of names that explains the log best.",
        "candidates.csv",
        TONES,
        3,
    )


def _smaller(outcome: Outcome, folder: Path) -> Section:
    first, last = outcome.validated.stages[0], outcome.validated.stages[-1]
    floor = noise_floor(outcome.compared.measurements)
    joints = outcome.given.model.joints
    unit = outcome.naming.unit
    order = np.argsort(-np.nan_to_num(first.gap - last.gap))
    rows = tuple(
        (
            joints[j],
            float(first.gap[j]),
            float(last.gap[j]),
            float(floor[j]),
            unit,
        )
        for j in order.tolist()
    )
    blocks: list[Block] = [
        FigureBlock(folder / "waterfall.svg", "The gap of all joints, effect by effect."),
        FigureBlock(
            folder / "in_time.svg",
            "Measured and predicted, and what is left, without and with what the model file holds.",
        ),
        TableBlock(
            ("joint", "as it was", "as written", "noise floor", "unit"),
            rows,
            "Gap, root mean square, on held-out data. As written: with the effects of the model "
            "file, read back, nothing estimated anew.",
            digits=3,
        ),
    ]
    return Section("How much smaller the gap is", tuple(blocks))


def _energy(outcome: Outcome) -> tuple[Section, ...]:
    change = outcome.energy
    if change is None:
        return ()
    rows = tuple(
        (
            name,
            change.before[name].cycle,
            change.after[name].cycle if name in change.after else None,
            change.before[name].standing,
            change.after[name].standing if name in change.after else None,
        )
        for name in change.before
    )
    block = TableBlock(
        ("alternative", "cycle before [J]", "after [J]", "standing before [W]", "after [W]"),
        rows,
        "Electrical energy of one gait cycle of the robot file's own gait, whole robot, returned "
        "energy lost, and power to stand as the robot file says, without and with what the model "
        "file holds; a dash: it is not known.",
    )
    catalog = outcome.given.catalog
    titles = [
        f"`{name}`: {catalog.alternatives[name].title.split(': ', 1)[-1]}"
        for name in change.before
        if name in catalog.alternatives
    ]
    own = outcome.given.alternative
    against = f"`{own}`" if own else "no actuator: its torque is the joint's"
    told = Text(
        f"The log was compared with {against}. The actuators: "
        f"{'; '.join(titles)}. Bodies, ground, springs, ripples and motors that were found count "
        "in all of them; friction, inertia and coupling of a drivetrain in the one they were found "
        "against."
    )
    return (Section("What it costs", (block, told, *map(Text, outcome.remarks))),)


def _left(outcome: Outcome) -> Section:
    every = sorted(outcome.validated.left, key=_ratio, reverse=True)
    shown = [r for r in every if r.significant] or every[:5]
    rows = tuple(
        (
            r.joint,
            r.channel,
            r.error,
            r.noise_floor,
            r.unit,
            "unexplained" if r.significant else "noise",
            r.description or None,
        )
        for r in shown
    )
    block = TableBlock(
        ("joint", "channel", "left", "noise floor", "unit", "verdict", "what it looks like"),
        rows,
        f"What the model as written leaves on held-out data; {len(every) - len(shown)} pairs of "
        f"joint and channel are not listed. Up to {UNEXPLAINED:g} times the noise floor counts as "
        "noise.",
        "",
        TONES,
        3,
    )
    blocks: list[Block] = [block]
    if outcome.decided:
        blocks.append(Text(f"The motion that decides: {outcome.decided[1]}."))
    uncertain = low_confidence(outcome.naming.found)
    if len(uncertain) > MANY_EFFECTS:
        blocks += [Text("Names that are not certain:"), Points(tuple(uncertain))]
    if outcome.naming.notes:
        blocks.append(Points(outcome.naming.notes))
    return Section("What is left", tuple(blocks))


def _ratio(r: Residual) -> float:
    return r.error / r.noise_floor if r.noise_floor > 0 else 0.0


def _data(outcome: Outcome, tables: dict[str, Table]) -> Section:
    parts = outcome.compared.parts
    settings = outcome.compared.loaded.settings
    shares = [float(m.mask.mean()) for m in outcome.compared.measurements]
    texts = [f"**Note:** {warning}." for warning in outcome.given.warnings]
    texts += [
        f"Compared at a bandwidth of {settings.cutoff:.3g} Hz ({settings.reason}). "
        f"{percent(float(np.mean(shares)))} of the rows count, by joint: not those whose "
        "filter sees the joint stop or turn back, where friction takes any value, nor the ends of "
        "the log.",
        "Blocks of the log are for training, for validation between candidates or held out for the "
        f"test: {parts.rule}, "
        f"{parts.guard:.2g} s apart, so that none holds a trace of another. "
        + held_out_words(outcome.compared.measurements),
    ]
    texts += one_way_words(outcome.compared.measurements, outcome.validated.joints)
    if parts.warning:
        texts.append(f"**Note:** {parts.warning}.")
    odd = [value != "ok" for value in tables["quality"].columns["verdict"]]
    block: Block = Text(
        f"Every one of the {len(odd)} checks passed; [quality.csv](quality.csv) lists them."
    )
    if any(odd):
        caption = "Checks with a remark; `quality.csv` lists all."
        block = table_block(tables["quality"], keep=odd, tones=TONES, caption=caption)
    return Section("What the data are worth", (*map(Text, texts), block))
