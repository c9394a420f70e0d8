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
from pipeline.effects.model_file import Edit, edits_in, model_text
from pipeline.identification.answer import Identified, identify
from pipeline.identification.compare.circumstances import Stage, noise_floor, overall
from pipeline.identification.floor import floor_of
from pipeline.identification.results import Found, Naming
from pipeline.identification.two_positions import READ_OFF, read_off_two
from pipeline.identification.workflow.compared import Compared
from pipeline.identification.workflow.options import Order
from pipeline.identification.workflow.written import (
    Validated,
    edits_of,
    validate_found,
    with_found,
)
from pipeline.logs.grid import runs_of
from pipeline.logs.log import TEST
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
        return overall(noise_floor(self.compared.measurements))

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
            for m in self.compared.measurements
            for start, stop in np.column_stack(runs_of(m.part == TEST)).tolist()
        ]

    @property
    def one_way(self) -> list[tuple[str, str]]:
        """Joints with an effect whose held-out rows all turn one way, and which."""
        out, logs = [], self.compared.measurements
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


def added(
    given: Machine, compared: Compared, found: Sequence[Found], out: Path
) -> tuple[str, tuple[Edit, ...]]:
    """Step 4: the model file with what was found, and what of it is new, read back from its text.

    The text is empty where there is nothing to write.
    """
    logs = "; ".join(f"{m.name}, SHA-256 {m.sha256}" for m in compared.measurements)
    edits = edits_of(found, logs)
    if not edits and not given.stated_file.edits:
        return "", ()
    first = compared.measurements[0]
    floor = floor_of(compared.measurements)
    noise = {
        channel: dict(zip(first.joints, floor[:, c].tolist(), strict=True))
        for c, channel in enumerate(first.channels)
    }
    file = given.stated_file.with_edits(edits).model_copy(update={"noise": noise})
    text = model_text(file, out)
    return text, edits_in(text)[len(given.stated_file.edits) :]


def identified(given: Machine, compared: Compared, options: Order) -> Outcome:
    """Name what is missing and gather everything that a run found.

    Raises:
        LegwattError: Nothing can be compared.
    """
    explanation = explain(given, compared)
    compared = explanation.compared
    logger.info("validating what was found")

    def written(found: Sequence[Found]) -> tuple[tuple[Found, ...], str, tuple[Edit, ...]]:
        own = explanation.estimated(tuple(found))
        return own, *added(given, compared, own, options.out)

    validated = validate_found(given.model, compared, explanation.naming.found, written)
    naming = replace(explanation.naming, found=validated.found)
    energy = cost(given, [f for f in naming.found if f.written])
    outcome = gathered(given, compared, naming, validated, energy)
    # Without it the squared residual rises by this share of what is left with it.
    rest = explanation.named.rest
    return replace(outcome, rest=rest.assign(share=rest["share"] / (1.0 + rest["share"])))


def gathered(
    given: Machine,
    compared: Compared,
    naming: Naming,
    validated: Validated,
    energy: tuple[DataFrame | None, tuple[str, ...]],
) -> Outcome:
    """What a run found, for tables, figures and the page.

    Args:
        given: Robot and actuators.
        compared: Steps 1 and 2.
        naming: Effects.
        validated: The model as written against the logs.
        energy: With and without the effects, and remarks.
    """
    return Outcome(
        given=given,
        compared=compared,
        naming=naming,
        validated=validated,
        energy=energy[0],
        remarks=energy[1],
    )


@dataclass(frozen=True, eq=False)
class Explanation:
    """What the model lacks."""

    named: Identified  #: The names and what they rest on.
    compared: Compared  #: Logs with the noise floor that the explanation found.

    @property
    def naming(self) -> Naming:
        """All findings."""
        return self.named.naming

    def estimated(self, found: tuple[Found, ...]) -> tuple[Found, ...]:
        """Findings, those that are kept with the values they have without the others."""
        own = self.named.alone([f for f in found if f.kept and f.law != READ_OFF])
        alone = {f.key: f for f in own}
        return tuple(alone.get(f.key, f) for f in found)


def explain(given: Machine, compared: Compared) -> Explanation:
    """Find what the model lacks.

    Raises:
        LegwattError: Nothing can be compared.
    """
    named = identify(given.model, compared.measurements)
    found = named.naming.found
    seen = read_off_two(
        reduce(with_found, [f for f in found if f.kept], given.model),
        compared.measurements,
        len(found) + 1,
    )
    names = {f.key for f in seen}
    own = tuple(f for f in found if f.key not in names)
    named = replace(named, naming=replace(named.naming, found=(*own, *seen)))
    noise = named.noise
    logs = tuple(replace(m, noise=np.maximum(m.noise, noise)) for m in compared.measurements)
    return Explanation(named, compared.with_logs(logs))
