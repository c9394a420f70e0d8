"""The pages of gap and gap power: the answer first, then what it rests on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np

from pipeline.effects.base import place_text
from pipeline.identification.compare.circumstances import WHOLE, noise_floor
from pipeline.identification.results import ACCEPTED, REJECTED, named
from pipeline.identification.supply.account import (
    BASIS_FOUND,
    MEASURED,
    RECOGNISED,
    UNEXPLAINED,
    Account,
)
from pipeline.identification.workflow.constants import voltage_remarks
from pipeline.identification.workflow.outcome import Outcome
from pipeline.simulation.found_bodies import FoundBodies
from reports.forms import write_pages
from reports.page import FOOTER, FigureBlock, Number, Page, files_of
from reports.pages.gap_words import (
    URDF_FILE,
    WORDS,
    bodies_words,
    energy_words,
    left_words,
    low_confidence,
    priced,
    smaller_words,
    what_words,
    where_words,
    whole_joints,
)
from reports.pages.robot_words import legs_text, motors_text
from reports.table import Table
from reports.typeset import number
from reports.words import Shown, Words, percent, sections

#: Candidates that the page lists; `candidates.csv` has all.
SHOWN_CANDIDATES = 15


def write_report(
    outcome: Outcome, bodies: FoundBodies, tables: Sequence[Table], folder: Path
) -> None:
    """Write ``report.md`` and ``index.html``; the figures must be there already."""
    names = ", ".join(m.name for m in outcome.compared.measurements)
    files = files_of(tables)
    if outcome.validated.text:
        files["model.toml"] = "Model file with the effects found; give it to any command as --model"
    if bodies.urdf:
        files[URDF_FILE] = "The robot's URDF with the bodies found"
    run = Run(outcome, bodies, {t.name: t for t in tables})
    text = WORDS.text("page", run, answer(outcome, bodies), bodies)
    page = Page(
        title=f"What the model of '{outcome.given.model.name}' lacks, by log '{names}'",
        numbers=_numbers(outcome),
        picture=FigureBlock(folder / "waterfall.svg", alt="The gap, effect by effect."),
        answer=_first(outcome, bodies),
        sections=sections(text, run, folder),
        files=files,
        footer=f"legwatt {version('legwatt')}. {FOOTER}",
    )
    write_pages(page, folder, "report.md")


def _numbers(outcome: Outcome) -> tuple[Number, ...]:
    """The gap before and after, the noise, and how much was found."""
    before, after = outcome.gaps
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
    naming, (before, after) = outcome.naming, outcome.gaps
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
        smaller_words(found, joints, outcome.gaps, outcome.naming.unit, outcome.noise),
        energy_words(outcome.energy, outcome.given.alternative) if outcome.energy else "",
        WORDS("undecided", low_confidence(found), excitations, decides),
        left_words(outcome) if validated.unexplained or not outcome.suspected else "",
    )
    return tuple(filter(None, said))


class Run(Shown):
    """What the sections of the page are about: texts, and rows of its own tables."""

    def __init__(self, outcome: Outcome, bodies: FoundBodies, tables: dict[str, Table]) -> None:
        """Collect it."""
        super().__init__(tables)
        given, compared = outcome.given, outcome.compared
        self.outcome, self.given = outcome, given
        self.parts, self.settings = compared.parts, compared.loaded.settings
        legged = given.robot is not None and given.robot.floating
        self.legs = legs_text(given.robot) if given.robot is not None and legged else ""
        self.whole = [by == WHOLE for by in tables["where"].columns["by"]]
        self.odd = [verdict != "ok" for verdict in tables["quality"].columns["verdict"]]
        self.counted = float(np.mean([float(m.mask.mean()) for m in compared.measurements]))
        self.voltages = voltage_remarks(
            given.model.actuators, outcome.naming, compared.measurements
        )
        self.uncertain = low_confidence(outcome.naming.found)
        self.bodies = [
            (
                body.link,
                f"**{', '.join(body.differs_in)}**" if body.differs_in else "nothing",
                *(float(x[0]) for x in (body.urdf, body.found)),
                *(float(x[0]) if np.isfinite(x[0]) else None for x in (body.low, body.high)),
                *(
                    ", ".join(number(1e3 * x, 3) for x in point[1:])
                    for point in (body.urdf, body.found)
                ),
            )
            for body in bodies.bodies
        ]

    @property
    def candidates(self) -> list[tuple[object, ...]]:
        """Those nearest to being named."""
        every = sorted(
            self.outcome.naming.candidates,
            key=lambda c: (c.verdict != ACCEPTED, c.verdict == REJECTED, -c.gain),
        )
        return [
            (c.effect, place_text(c.place), c.before, c.after, c.unit, c.verdict, c.reason)
            for c in every[:SHOWN_CANDIDATES]
        ]

    @property
    def gaps(self) -> list[tuple[object, ...]]:
        """Joints by how much the gap shrinks."""
        first, last = (self.outcome.validated.stages[k].gap for k in (0, -1))
        floor, unit = noise_floor(self.outcome.compared.measurements), self.outcome.naming.unit
        joints = self.given.model.joints
        return [
            (joints[j], float(first[j]), float(last[j]), float(floor[j]), unit)
            for j in np.argsort(-np.nan_to_num(first - last)).tolist()
        ]

    @property
    def costs(self) -> list[tuple[object, ...]]:
        """Energy of a cycle and power of standing by alternative, before and after."""
        assert self.outcome.energy is not None
        before, after = self.outcome.energy.before, self.outcome.energy.after
        return [
            (
                *(name, old.cycle, after[name].cycle if name in after else None),
                *(old.standing, after[name].standing if name in after else None),
            )
            for name, old in before.items()
        ]

    @property
    def actuators(self) -> list[str]:
        """Priced alternatives with their titles."""
        every = self.given.catalog.alternatives
        names = [] if self.outcome.energy is None else self.outcome.energy.before
        return [f"`{n}`: {every[n].title.split(': ', 1)[-1]}" for n in names if n in every]

    @property
    def left(self) -> list[tuple[object, ...]]:
        """What is not noise; the largest five where all is."""
        every = sorted(self.outcome.validated.left, key=lambda r: r.ratio, reverse=True)
        return [
            (
                *(r.joint, r.channel, r.error, r.noise_floor, r.unit),
                "unexplained" if r.significant else "noise",
                r.description or None,
            )
            for r in [r for r in every if r.significant] or every[:5]
        ]


_POWER = Words("power")


def power_answer(balance: Account) -> tuple[str, ...]:
    """The answer in words, a paragraph each."""
    shares = {s.term: s for s in balance.shares}
    found = [s for s in balance.shares if s.basis == BASIS_FOUND]
    own = [s for s in balance.shares if s.basis and s.basis != BASIS_FOUND]
    measured, left = shares[MEASURED], shares[UNEXPLAINED]
    paragraphs = (
        _POWER("wrong_sum", balance.wrong_sum),
        _POWER("sums", measured, own, len(balance.drives), balance.wrong_sum),
        _POWER("found", found, shares.get("drivers")),
        _POWER("left", left, measured, balance.rms),
        _POWER("sag", balance.sag),
        _POWER("basis", balance.by_model, balance.reading, len(balance.drives)),
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
        picture=FigureBlock(folder / "power_shares.svg", alt="Shares of the power."),
        answer=answer[:3],
        sections=sections(_POWER.text("page", run, answer, warnings), run, folder),
        files=files_of(tables),
    )
    write_pages(page, folder, "report.md")
