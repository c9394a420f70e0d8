"""Steps 3 to 5 of a run: name, add, shrink, gathered for tables, figures and the page."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path

import numpy as np
from pandas import DataFrame

from actuators.errors import LegwattError, StanceError
from pipeline.effects.base import CHANNEL_UNITS, effect_named
from pipeline.effects.model_file import Edit, edits_in, model_text
from pipeline.identification.answer import identify
from pipeline.identification.compare.circumstances import Stage, noise_floor, overall
from pipeline.identification.floor import floor_of, with_noise
from pipeline.identification.results import (
    APPROXIMATE,
    CONFIRMED,
    Estimate,
    Found,
    Member,
    Naming,
)
from pipeline.identification.two_positions import read_off_two
from pipeline.identification.workflow.compared import Compared
from pipeline.identification.workflow.options import Order
from pipeline.identification.workflow.unnamed import Unnamed, unnamed
from pipeline.identification.workflow.written import (
    Validated,
    edits_of,
    held_against,
    validate_found,
    with_found,
)
from pipeline.logs.grid import runs_of
from pipeline.logs.log import TEST
from pipeline.machine.machine import MachineModel
from pipeline.simulation.cycle_energy import energy_change
from pipeline.simulation.machine import Machine

logger = logging.getLogger("legwatt")

#: Joints that the figure in time shows.
SHOWN = 3
#: ... where the gap shrinks by this share at least.
WORTH_SHOWING = 0.25
#: Held-out rows turn one way where less than this share turns the other way.
ONE_WAY = 0.05


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a run found, for tables, figures and the page."""

    given: Machine  #: Robot and actuators.
    compared: Compared  #: Steps 1 and 2.
    naming: Naming  #: Step 3; without candidates where a model file was checked.
    validated: Validated  #: The model as written against the logs, effect by effect.
    #: With and without the effects; None for a robot that does not walk.
    energy: DataFrame | None
    remarks: tuple[str, ...]  #: What else a reader should know.
    #: What has no name, by joint and kind; None where nothing was looked for.
    rest: DataFrame | None = None

    @property
    def suspected(self) -> tuple[str, ...]:
        """Why columns may not be what their names say, in words."""
        found = self.compared.loaded.findings
        return tuple(f.detail for f in found if f.verdict == "suspected")

    @property
    def unexplained(self) -> bool:
        """Whether more than noise is left, or the log may not say what it seems to."""
        return self.validated.unexplained or bool(self.suspected)

    @property
    def shown(self) -> tuple[int, ...]:
        """Columns of the joints that the figure in time shows."""
        stages = self.validated.stages
        pairs = zip(self.naming.found, self.validated.joints, strict=True)
        return most_improved(stages[0], stages[-1], [j for f, j in pairs if f.written])

    @property
    def noise(self) -> float:
        """Noise floor of all joints in the compared channel, of the test logs."""
        return overall(noise_floor(self.compared.logs))

    @property
    def gaps(self) -> tuple[float, float]:
        """Gap of all joints of the model as it was and as written."""
        stages = self.validated.stages
        return overall(stages[0].gap), overall(stages[-1].gap)

    @property
    def held_out(self) -> list[tuple[str, float, float]]:
        """Log, start and end [s] of every stretch that is held out."""
        return [
            (m.name, float(m.time[start]), float(m.time[stop - 1]))
            for m in self.compared.logs
            for start, stop in np.column_stack(runs_of(m.part == TEST)).tolist()
        ]

    @property
    def one_way(self) -> list[tuple[str, str]]:
        """Joints with an effect whose held-out rows all turn one way, and which."""
        out, logs = [], self.compared.logs
        for j in dict.fromkeys(self.validated.joints):
            speeds = np.concatenate([m.v[(m.part == TEST) & m.mask[:, j], j] for m in logs])
            ahead = float((speeds > 0).mean()) if speeds.size else 0.5
            if min(ahead, 1.0 - ahead) < ONE_WAY:
                out.append((logs[0].joints[j], "positive" if ahead > 0.5 else "negative"))
        return out


def cost(
    given: Machine, found: Sequence[Found], *, known: bool = True
) -> tuple[DataFrame | None, tuple[str, ...]]:
    """Energy with and without found effects, and remarks; None for a robot that does not walk.

    Args:
        given: Robot, actuators and the effects known before.
        found: Effects.
        known: Whether those of the model file stand on both sides of the comparison.
    """
    if not given.legged or not found:
        return None, ()
    start = given.stated_file if known else given.stated_file.model_copy(update={"edits": ()})
    try:
        before = given.with_model(start)
        after = given.with_model(start.with_edits(edits_of(found, "a log")))
        return energy_change(before, after), after.remarks
    except StanceError as error:
        return None, (f"With these effects {error}",)
    except LegwattError as error:
        return None, (f"No energy of a gait cycle: {error}",)


def most_improved(before: Stage, after: Stage, found: Sequence[int]) -> tuple[int, ...]:
    """Columns of the joints to show: those of effects first, then those with the largest gap."""
    gain = np.nan_to_num(before.gap - after.gap, nan=-np.inf)
    better = [k for k in np.argsort(-gain).tolist() if gain[k] > WORTH_SHOWING * before.gap[k]]
    rank = [*found, *better] or np.argsort(-np.nan_to_num(before.gap, nan=-1.0)).tolist()[:1]
    return tuple(dict.fromkeys(k for k in rank if np.isfinite(before.gap[k])))[:SHOWN]


def identified(given: Machine, compared: Compared, options: Order) -> Outcome:
    """Name what is missing and gather everything that a run found.

    Raises:
        LegwattError: Nothing can be compared.
    """
    result = identify(given.model, compared.logs)
    first = result.naming.found
    kept = reduce(with_found, [f for f in first if f.kept], given.model)
    seen = read_off_two(kept, compared.logs, len(first) + 1)
    found = (*(f for f in first if f.key not in {s.key for s in seen}), *seen)
    logs = [replace(m, noise=np.maximum(m.noise, result.noise)) for m in compared.logs]
    compared = compared.with_logs(logs)
    source = "; ".join(f"{m.name}, SHA-256 {m.sha256}" for m in logs)
    logger.info("validating what was found")

    def written(
        names: Sequence[Found], tables: Sequence[Edit]
    ) -> tuple[Sequence[Found], str, list[Edit]]:
        """The values that names have without those that are left out, the file, its new edits."""
        alone = {f.key: f for f in result.alone([f for f in names if f.kept and not f.law])}
        own = [f if f.law else alone.get(f.key, f) for f in names]
        text = _file(given, compared, (*edits_of(own, source), *tables), options.out)
        return own, text, list(edits_in(text)[len(given.stated_file.edits) :]) if text else []

    nameless = Unnamed()

    def tables(model: MachineModel) -> tuple[Edit, ...]:
        nonlocal nameless
        nameless = unnamed(model, logs[: compared.fitted], source)
        return nameless.edits

    validated = validate_found(given.model, compared, found, written, tables)
    naming = replace(result.naming, found=validated.found)
    energy = cost(given, [f for f in naming.found if f.written])
    return Outcome(given, compared, naming, validated, *energy, rest=nameless.rest)


def _file(given: Machine, compared: Compared, edits: Sequence[Edit], out: Path) -> str:
    """Text of the model file with further edits; empty where there is nothing to write."""
    if not edits and not given.stated_file.edits:
        return ""
    first, floor = compared.logs[0], floor_of(compared.logs)
    noise = {
        channel: dict(zip(first.joints, floor[:, c].tolist(), strict=True))
        for c, channel in enumerate(first.channels)
    }
    file = given.stated_file.with_edits(edits).model_copy(update={"noise": noise})
    return model_text(file, out)


def check(given: Machine, compared: Compared) -> Outcome:
    """Gap with and without the model file's effects, by the noise that the file states."""
    compared = compared.with_logs(with_noise(compared.logs, given.stated_file.noise))
    channel = compared.logs[0].channels[0]
    unit = CHANNEL_UNITS[channel]
    every = given.stated_file.edits
    groups = together([edit for edit in every if not edit.table])
    steps = [(_found(k, group, unit), group) for k, group in enumerate(groups, start=1)]
    tables = [edit for edit in every if edit.table]
    validated = held_against(given.bare_model, compared, steps, tables=tables)
    naming = Naming(validated.found, (), {}, channel, unit)
    return Outcome(given, compared, naming, validated, *cost(given, validated.found, known=False))


def together(edits: Sequence[Edit]) -> list[list[Edit]]:
    """Edits in order, like ones that follow each other and were fitted together in one group."""
    out: list[list[Edit]] = []
    for edit in edits:
        like = bool(out) and out[-1][0].effect == edit.effect
        if like and not effect_named(edit.effect).competes:
            out[-1].append(edit)
        else:
            out.append([edit])
    return out


def _found(number: int, group: Sequence[Edit], unit: str) -> Found:
    """Edits of the model file as something found."""
    members = tuple(
        Member(
            edit.place,
            tuple(Estimate(p.name, p.value, *p.interval, unit=p.unit) for p in edit.parameters),
            edit.level,
        )
        for edit in group
    )
    several, nan = len(group) > 1, float("nan")
    return Found(
        order=number,
        effect=group[0].effect,
        place=tuple(name for edit in group for name in edit.place),
        parameters=() if several else members[0].parameters,
        rivals=(),
        valid_before=nan,
        valid_after=nan,
        unit=unit,
        noise_floor=nan,
        level=CONFIRMED if {edit.level for edit in group} == {CONFIRMED} else APPROXIMATE,
        members=members if several else (),
    )
