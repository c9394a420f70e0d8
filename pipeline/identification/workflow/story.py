"""Steps 3 to 5 of a run: name, add, shrink, gathered for tables, figures and the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path

import numpy as np

from pipeline.effects.model_file import Edit, apply_edits, edits_in
from pipeline.errors import GaitError, StanceError
from pipeline.identification.compare.stages import Stage, noise_floor, overall
from pipeline.identification.regression.floor import floor_of
from pipeline.identification.results import Found, Naming, named
from pipeline.identification.selection.deciding_motion import Deciding
from pipeline.identification.workflow.deciding import decide
from pipeline.identification.workflow.explain import explain
from pipeline.identification.workflow.locate import Whereabouts
from pipeline.identification.workflow.model_writer import edits_of, model_text
from pipeline.identification.workflow.options import Options
from pipeline.identification.workflow.setup import Setup
from pipeline.identification.workflow.written import Weighed, weigh_found, with_found
from pipeline.logs.columns.findings import SUSPECTED
from pipeline.machine.machine import MachineModel
from pipeline.progress import Progress
from pipeline.simulation.edited import Effects, effects
from pipeline.simulation.energy_change import EnergyChange, energy_change

#: Joints that the figure in time shows.
SHOWN = 3
#: ... where the gap shrinks by this share at least.
WORTH_SHOWING = 0.25


@dataclass(frozen=True, eq=False)
class Story:
    """Everything a page tells."""

    given: Setup  #: Robot and actuators.
    where: Whereabouts  #: Steps 1 and 2.
    naming: Naming  #: Step 3; without candidates where a model file was checked.
    weighed: Weighed  #: The model as written against the logs, effect by effect.
    #: With and without the effects; None for a robot that does not walk.
    energy: EnergyChange | None
    #: File name to caption, one per effect that shows at a joint with rows.
    signatures: dict[str, str]
    decides: str  #: What the deciding motion is, in words; empty without one.
    remarks: tuple[str, ...]  #: What else a reader should know.

    @property
    def suspected(self) -> tuple[str, ...]:
        """Why columns may not be what their names say, in words."""
        found = self.where.intake.findings
        return tuple(f.detail for f in found if f.check == SUSPECTED and f.verdict == "warning")

    @property
    def unexplained(self) -> bool:
        """Whether more than noise is left, or the log may not say what it seems to."""
        return self.weighed.unexplained or bool(self.suspected)

    @property
    def noise(self) -> float:
        """Noise floor of all joints in the compared channel, of the test logs."""
        return overall(noise_floor(self.where.measurements))


@dataclass(frozen=True, eq=False)
class Told:
    """What a run writes."""

    story: Story  #: For the page.
    #: Motion that decides between a found effect and its rivals; None without one.
    deciding: Deciding | None
    model_file: str  #: Text of the model file; empty where there is nothing to add.
    shown: tuple[int, ...]  #: Columns of the joints that the figure in time shows.


def with_every(model: MachineModel, found: Sequence[Found]) -> MachineModel:
    """The model with effects, in order."""
    return reduce(with_found, found, model)


def found_effects(given: Setup, found: Sequence[Found], *, known: bool = True) -> Effects:
    """Found effects on top of the model file's, ready for standing and walking."""
    assert given.robot is not None
    edits = given.file.edits if known else ()
    names = (*(edit.effect for edit in edits), *(f.effect for f in found))
    # A log that was compared without an actuator: what bodies and ground change needs none.
    name = given.alternative or next(iter(given.catalog.alternatives))
    actuators = given.own.actuators(given.catalog, name)

    def apply(model: MachineModel) -> MachineModel:
        return with_every(apply_edits(model, edits), found)

    return effects(given.robot, actuators, apply, names, "model.toml", found_with=given.alternative)


def cost(
    given: Setup, found: Sequence[Found], *, known: bool = True
) -> tuple[EnergyChange | None, tuple[str, ...]]:
    """Energy with and without found effects, and remarks; None for a robot that does not walk.

    Args:
        given: Robot, actuators and the effects known before.
        found: Effects.
        known: Whether those of the model file stand on both sides of the comparison.
    """
    if not given.legged or not found or given.robot is None:
        return None, ()
    edits = found_effects(given, found, known=known)
    start = found_effects(given, ()) if known and given.file.edits else None
    try:
        every = given.own.every(given.catalog)
        return energy_change(given.robot, every, edits, start), edits.remarks
    except StanceError as error:
        return None, (f"With these effects {error}",)
    except GaitError as error:
        return None, (f"No energy of a gait cycle: {error}",)


def most_improved(before: Stage, after: Stage, found: Sequence[int]) -> tuple[int, ...]:
    """Columns of the joints to show: those of effects first, then those with the largest gap."""
    gain = np.nan_to_num(before.gap - after.gap, nan=-np.inf)
    better = [k for k in np.argsort(-gain).tolist() if gain[k] > WORTH_SHOWING * before.gap[k]]
    rank = [*found, *better] or np.argsort(-np.nan_to_num(before.gap, nan=-1.0)).tolist()[:1]
    return tuple(dict.fromkeys(k for k in rank if np.isfinite(before.gap[k])))[:SHOWN]


def added(
    given: Setup, where: Whereabouts, found: Sequence[Found], out: Path
) -> tuple[str, tuple[Edit, ...]]:
    """Step 4: the model file with what was found, and what of it is new, read back from its text.

    The text is empty where there is nothing to write.
    """
    logs = "; ".join(f"{m.name}, SHA-256 {m.sha256}" for m in where.measurements)
    edits = edits_of(found, logs)
    if not edits and not given.file.edits:
        return "", ()
    first = where.measurements[0]
    floor = floor_of(where.measurements)
    noise = {
        channel: dict(zip(first.joints, floor[:, c].tolist(), strict=True))
        for c, channel in enumerate(first.channels)
    }
    text = model_text(replace(given.file.with_edits(edits), noise=noise), out)
    return text, edits_in(text)[len(given.file.edits) :]


def tell(given: Setup, where: Whereabouts, options: Options, progress: Progress) -> Told:
    """Name what is missing and gather everything that a run tells.

    Raises:
        GapError: Nothing can be compared.
    """
    explanation = explain(given, where, progress)
    where = explanation.where
    progress.step("weighing what was found")

    def written(found: Sequence[Found]) -> tuple[tuple[Found, ...], str, tuple[Edit, ...]]:
        told = explanation.estimated(tuple(found))
        return told, *added(given, where, told, options.out)

    weighed = weigh_found(given.model, where, explanation.naming.found, written)
    naming = replace(explanation.naming, found=weighed.found)
    energy = cost(given, [f for f in naming.found if f.written])
    decided = decide(given, given.model, where.measurements, naming.found)
    return gathered(given, where, naming, weighed, energy, decided)


def signature_name(f: Found) -> str:
    """File of the figure that shows an effect's gap against what it depends on."""
    return f"effect_{f.order}_{f.effect}.svg"


def gathered(
    given: Setup,
    where: Whereabouts,
    naming: Naming,
    weighed: Weighed,
    energy: tuple[EnergyChange | None, tuple[str, ...]],
    decided: tuple[Deciding, str] | None,
) -> Told:
    """What a run writes, from what it found.

    Args:
        given: Robot and actuators.
        where: Steps 1 and 2.
        naming: Effects.
        weighed: The model as written against the logs.
        energy: With and without the effects, and remarks.
        decided: Deciding motion, and it in words.
    """
    signatures = {
        signature_name(f): (
            f"{named(f)}: the gap of {given.model.joints[j]} against the "
            f"variable on which the effect depends, without it and with it."
            + ("" if f.written else " The model file written leaves it out.")
        )
        for f, j in zip(naming.found, weighed.joints, strict=True)
        if any(m.mask[:, j].any() for m in where.measurements)
    }
    story = Story(
        given=given,
        where=where,
        naming=naming,
        weighed=weighed,
        energy=energy[0],
        signatures=signatures,
        decides=decided[1] if decided else "",
        remarks=energy[1],
    )
    columns = [j for f, j in zip(naming.found, weighed.joints, strict=True) if f.written]
    return Told(
        story=story,
        deciding=decided[0] if decided else None,
        model_file=weighed.text,
        shown=most_improved(weighed.stages[0], weighed.stages[-1], columns),
    )
