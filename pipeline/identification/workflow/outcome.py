"""Steps 3 to 5 of a run: name, add, shrink, gathered for tables, figures and the page."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pandas import DataFrame

from actuators.errors import LegwattError, StanceError
from pipeline.columns import frame
from pipeline.effects.base import CHANNEL_UNITS, EFFECTS, effect_named
from pipeline.effects.model_file import Edit, ModelFile, apply_edits, model_text
from pipeline.identification.answer import identify
from pipeline.identification.general import unnamed
from pipeline.identification.residual import floor_of
from pipeline.identification.results import (
    APPROXIMATE,
    CONFIRMED,
    INDISTINGUISHABLE,
    Candidate,
    Found,
)
from pipeline.identification.two_positions import read_off_two
from pipeline.identification.workflow.compared import Compared, Order
from pipeline.identification.workflow.written import (
    Held,
    chosen,
    edits_of,
    held_against,
    overall,
    with_found,
)
from pipeline.identification.wrong_columns import SIZE
from pipeline.logs.log import TEST, Finding
from pipeline.machine.machine import MachineModel
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import energy_change

logger = logging.getLogger("legwatt")

#: Joints that the figure in time shows, and the share by which the gap shrinks there at least.
SHOWN, WORTH_SHOWING = 3, 0.25


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a run found, for tables, figures and the page."""

    given: Machine  #: Robot and actuators.
    compared: Compared  #: Steps 1 and 2.
    held: Held  #: The model as written against the logs, effect by effect.
    edits: tuple[Edit, ...]  #: Of the model as written, those that it had before first.
    candidates: tuple[Candidate, ...] = ()  #: Of naming; none where a model file was checked.
    text: str = ""  #: Of the model file; empty where there is none to write.
    #: With and without the effects; None for a robot that does not walk.
    energy: DataFrame | None = None
    remarks: tuple[str, ...] = ()  #: What else a reader should know.
    #: What has no name, by joint and kind; None where nothing was looked for.
    rest: DataFrame | None = None

    @property
    def unit(self) -> str:
        """Of the compared channel."""
        return CHANNEL_UNITS[self.compared.logs[0].channels[0]]

    @property
    def suspected(self) -> tuple[str, ...]:
        """Why columns may not be what their names say, in words."""
        found = self.compared.loaded.findings
        return tuple(f.detail for f in found if f.verdict == "suspected")

    @property
    def unexplained(self) -> bool:
        """Whether more than noise is left, or the log may not say what it seems to."""
        return any(r.significant for r in self.held.left) or bool(self.suspected)

    @property
    def shown(self) -> tuple[int, ...]:
        """Columns of joints for the figure in time: of effects, then where the gap shrinks."""
        before, after = self.held.stages[0].gap, self.held.stages[-1].gap
        gain = np.nan_to_num(before - after, nan=-np.inf)
        pairs = zip(self.held.found, self.held.joints, strict=True)
        rank = [j for f, j in pairs if f.written]
        rank += [k for k in np.argsort(-gain).tolist() if gain[k] > WORTH_SHOWING * before[k]]
        rank = rank or np.argsort(-np.nan_to_num(before, nan=-1.0)).tolist()[:1]
        return tuple(dict.fromkeys(k for k in rank if np.isfinite(before[k])))[:SHOWN]

    @property
    def noise(self) -> float:
        """Noise floor of all joints in the compared channel, of the test logs."""
        return overall(floor_of(self.compared.logs, TEST)[:, 0])

    @property
    def gaps(self) -> tuple[float, float]:
        """Gap of all joints of the model as it was and as written."""
        return overall(self.held.stages[0].gap), overall(self.held.stages[-1].gap)


def cost(
    given: Machine, old: tuple[Edit, ...], new: tuple[Edit, ...]
) -> tuple[DataFrame | None, tuple[str, ...]]:
    """Energy without and with new edits beside old ones, and remarks; None where nothing walks."""
    if not given.robot.floating or not new:
        return None, ()
    try:
        before, after = (
            given.with_model(given.stated_file.model_copy(update={"edits": edits}))
            for edits in (old, (*old, *new))
        )
        return energy_change(before, after), after.remarks
    except StanceError as error:
        return None, (f"With these effects {error}",)
    except LegwattError as error:
        return None, (f"No energy of a gait cycle: {error}",)


def identified(given: Machine, compared: Compared, options: Order) -> Outcome:
    """Name what is missing and gather everything that a run found.

    Raises:
        LegwattError: Nothing can be compared.
    """
    model = given.model
    result = identify(model, compared.logs)
    first = result.found
    kept = with_found(model, [f for f in first if f.kept])
    seen = read_off_two(kept, compared.logs, len(first) + 1)
    found = [*(f for f in first if f.key not in {s.key for s in seen}), *seen]
    compared = compared.with_noise(result.noise)
    logs = compared.logs
    source = "; ".join(f"{m.name}, SHA-256 {m.sha256}" for m in logs)
    logger.info("validating what was found")
    found = chosen(model, logs, found, result.alone)
    edits = edits_of(found, source)
    rows = result.answer.fit.design.data_sets
    tables, rest = unnamed(apply_edits(model, edits), rows, floor_of(logs), source)
    held = held_against(model, logs, found, tables)
    compared = compared.with_findings(without_factors(compared.loaded.findings, held))
    file = given.stated_file.with_edits((*edits, *tables))
    text = _text(file, compared, options.out) if file.edits else ""
    energy, remarks = cost(given, given.stated_file.edits, edits)
    candidates = result.candidates
    return Outcome(given, compared, held, file.edits, candidates, text, energy, remarks, rest)


def without_factors(findings: Sequence[Finding], held: Held) -> tuple[Finding, ...]:
    """Without suspicion of a factor where columns as they are named leave noise.

    A payload multiplies the torque of a wrist that carried little; that it is no column's factor
    shows at all joints that carry it, where nothing is left and no gain is written.
    """
    odd = {r.joint for r in held.left if r.significant}
    odd |= {p.partition("__")[0] for f in held.found if f.written for p in f.place if "__" in p}
    return tuple(
        replace(f, verdict="ok", detail=f"{f.detail}; no longer: what is found leaves noise so")
        if f.check == SIZE and not (f.column.partition("__")[0] in odd if f.column else odd)
        else f
        for f in findings
    )


def _text(file: ModelFile, compared: Compared, out: Path) -> str:
    """A model file with the noise of the logs, as text."""
    first, floor = compared.logs[0], floor_of(compared.logs)
    noise = {
        channel: dict(zip(first.joints, floor[:, c].tolist(), strict=True))
        for c, channel in enumerate(first.channels)
    }
    return model_text(file.model_copy(update={"noise": noise}), out)


def check(given: Machine, compared: Compared) -> Outcome:
    """Gap with and without the model file's effects, by the noise that the file states."""
    file, first = given.stated_file, compared.logs[0]
    noise = [[file.noise.get(c, {}).get(j, 0.0) for c in first.channels] for j in first.joints]
    compared = compared.with_noise(np.array(noise))
    tables = [edit for edit in file.edits if edit.table]
    edits = tuple(edit for edit in file.edits if not edit.table)
    found = [
        Found(k, tuple(group), level=CONFIRMED if levels == {CONFIRMED} else APPROXIMATE)
        for k, group in enumerate(together(edits), start=1)
        for levels in [{edit.level for edit in group}]
    ]
    held = held_against(given.bare_model, compared.logs, found, tables)
    energy, remarks = cost(given, (), edits)
    return Outcome(given, compared, held, file.edits, energy=energy, remarks=remarks)


def together(edits: Sequence[Edit]) -> list[list[Edit]]:
    """Edits in order, like ones that follow each other and were fitted together in one group."""
    out: list[list[Edit]] = []
    for edit in edits:
        alone = not out or out[-1][0].effect != edit.effect or effect_named(edit.effect).competes
        out += [[]] if alone else []
        out[-1].append(edit)
    return out


def candidates_table(outcome: Outcome) -> DataFrame:
    """Every effect at every place that was tried; what was found and has rivals says so, too."""
    rivals = {f.key: f.rivals for f in outcome.held.found}
    model, rows = outcome.given.model, []
    for c in outcome.candidates:
        others = rivals.get((c.effect, c.place))
        verdict = c.verdict
        if others:
            names = "; ".join(f"{name} at {', '.join(place)}" for name, place in others)
            verdict = INDISTINGUISHABLE + names
        where = (joint_of(model, c.effect, c.place), "+".join(c.place))
        rows.append((c.effect, *where, c.identifiable, verdict, c.reason))
    return frame("candidates", rows)


def found_table(outcome: Outcome) -> DataFrame:
    """What the model lacked, one row per parameter."""
    model, unit, rows = outcome.given.model, outcome.unit, []
    for f in outcome.held.found:
        gaps = (_known(f.gap_before), _known(f.gap_after), unit, f.noise_floor)
        for edit in f.edits:
            where = (joint_of(model, f.effect, edit.place), "+".join(edit.place))
            for p in edit.parameters:
                value = (p.name, p.value, *p.interval, p.unit)
                head = (f.order, f.effect, f.law, *where)
                rows.append((*head, *value, *gaps, f.level, f.reason, f.written))
    return frame("found", rows)


def _known(value: float) -> float | None:
    """A number, or an empty cell where there is none."""
    return value if math.isfinite(value) else None


def joint_of(model: MachineModel, effect: str, place: Sequence[str]) -> str:
    """The joint at which an effect acts: that carries its link; empty where it acts on all."""
    kind = EFFECTS[effect].place_kind if effect in EFFECTS else "joint"
    if kind == "link" and place:
        return model.robot.links.get(place[0], "")
    owners = [name.partition("__")[0] for name in place]
    return "+".join(name for name in owners if name in model.joints)
