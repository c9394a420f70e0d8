"""Steps 3 to 5 of a run: name, add, shrink, gathered for tables, figures and the page."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path

import numpy as np

from pipeline.app.effects import Effects, effects
from pipeline.app.gap_deciding import decide, motion_table
from pipeline.app.gap_energy import EnergyChange, energy_change
from pipeline.app.gap_report import Story
from pipeline.app.gap_run import Progress, Whereabouts
from pipeline.app.gap_setup import Setup
from pipeline.app.gap_stages import Stage, noise_floor, stages
from pipeline.app.gap_words import place_text
from pipeline.errors import TippingError
from pipeline.gap.deciding import Deciding
from pipeline.gap.effects.registry import effect_named
from pipeline.gap.identify import Identified, identify
from pipeline.gap.model import MachineModel
from pipeline.gap.model_file import apply_edits
from pipeline.gap.model_writer import edits_of, model_text
from pipeline.gap.verdict import IDLE_NAME, Found, Naming
from reports.table import Table

AS_IT_WAS = "model as it was"
TOLERANCES = "tolerances of its parts"
#: Joints that the figure in time shows.
SHOWN = 3
#: ... where the gap shrinks by this share at least.
WORTH_SHOWING = 0.25


@dataclass(frozen=True, eq=False)
class Told:
    """What a run writes.

    Attributes:
        story: For the page.
        tables: Besides those of the steps.
        model_file: Text of the model file; empty where there is nothing to add.
        shown: Columns of the joints that the figure in time shows.
        effect_joints: Column per found effect whose signature is drawn.
    """

    story: Story
    tables: tuple[Table, ...]
    model_file: str
    shown: tuple[int, ...]
    effect_joints: tuple[int, ...]


def with_found(model: MachineModel, found: Sequence[Found]) -> MachineModel:
    """The model with effects, in order."""
    return reduce(lambda m, f: effect_named(f.effect).apply(m, f.place, f.values), found, model)


def gap_stages(model: MachineModel, where: Whereabouts, named: Identified) -> tuple[Stage, ...]:
    """The gap of the model as it was, with tolerances, and with one effect after another.

    Tolerances are estimated anew beside every effect: what they would take up without it is no
    merit of the effect.
    """
    labels = [f"{f.effect} at {place_text(f.place)}" for f in named.naming.found]
    models = [(AS_IT_WAS, model), *zip([TOLERANCES, *labels], named.stages, strict=True)]
    return stages(models, where.measurements, where.intake.long)


def found_effects(given: Setup, found: Sequence[Found], *, known: bool = True) -> Effects:
    """Found effects on top of the model file's, ready for standing and walking."""
    assert given.robot is not None
    names = tuple(f.effect for f in found)
    chain = given.catalog.chain(given.alternative)
    edits = given.file.edits if known else ()

    def apply(model: MachineModel) -> MachineModel:
        return with_found(apply_edits(model, edits), found)

    return effects(given.robot, chain, apply, names, "model.toml")


def cost(
    given: Setup, found: Sequence[Found], *, known: bool = True
) -> tuple[EnergyChange | None, tuple[str, ...]]:
    """Energy with and without found effects, and remarks; None for a robot that does not walk.

    Args:
        given: Robot, actuators and the effects known before.
        found: Effects.
        known: Whether those of the model file stand on both sides of the comparison.
    """
    if not given.legged or not found or given.robot is None or not given.robot.spec.tripods:
        return None, ()
    edits = found_effects(given, found, known=known)
    start = found_effects(given, ()) if known and given.file.edits else None
    try:
        return energy_change(given.robot, given.catalog.chains(), edits, start), edits.remarks
    except TippingError as error:
        return None, (f"With these effects {error}",)


def most_improved(before: Stage, after: Stage, found: Sequence[int]) -> tuple[int, ...]:
    """Columns of the joints to show: those of effects first, then those with the largest gap."""
    gain = np.nan_to_num(before.gap - after.gap, nan=-np.inf)
    better = [k for k in np.argsort(-gain).tolist() if gain[k] > WORTH_SHOWING * before.gap[k]]
    rank = [*found, *better] or np.argsort(-np.nan_to_num(before.gap, nan=-1.0)).tolist()[:1]
    return tuple(dict.fromkeys(k for k in rank if np.isfinite(before.gap[k])))[:SHOWN]


def effect_column(model: MachineModel, f: Found, before: Stage, after: Stage) -> int:
    """Column at which an effect shows: its joint, the one that carries its link, or the largest."""
    for name in f.place:
        joint = name if name in model.joints else model.links.get(name, "")
        if joint in model.joints:
            return model.index(joint)
    return int(np.argmax(np.nan_to_num(before.gap - after.gap, nan=-np.inf)))


def added(
    given: Setup, where: Whereabouts, naming: Naming, out: Path, *, keep_doubtful: bool = False
) -> str:
    """Step 4: the model file with what was found; empty where there is nothing to write."""
    logs = "; ".join(f"{m.name}, SHA-256 {m.sha256}" for m in where.measurements)
    edits = edits_of(naming.found, logs, keep_doubtful=keep_doubtful)
    if not edits and not given.file.edits:
        return ""
    return model_text(given.file.with_edits(edits), out)


def tell(given: Setup, where: Whereabouts, options: argparse.Namespace, progress: Progress) -> Told:
    """Name what is missing and gather everything that a run tells.

    Raises:
        GapError: Nothing can be compared.
    """
    named = identify(given.model, where.measurements)
    progress.step("weighing what was found")
    steps = gap_stages(given.model, where, named)
    naming = named.naming
    naming = replace(naming, found=_proved(given.model, where, naming, steps))
    energy, remarks = cost(given, naming.found)
    decided = decide(given, given.model, where.measurements, naming.found)
    return gathered(given, where, naming, steps, (energy, remarks), decided, options)


def _proved(
    model: MachineModel, where: Whereabouts, naming: Naming, steps: Sequence[Stage]
) -> tuple[Found, ...]:
    """Effects with the gap of the models with and without them, simulated anew.

    Naming judges by a linear step; a name whose simulation makes the gap larger is doubted.
    """
    first = len(steps) - len(naming.found)
    floor = noise_floor(where.measurements)
    out = []
    for k, f in enumerate(naming.found):
        before, after = steps[first + k - 1], steps[first + k]
        j = effect_column(model, f, before, after)
        worse = bool(after.gap[j] > before.gap[j])
        out.append(
            replace(
                f,
                gap_before=float(before.gap[j]),
                gap_after=float(after.gap[j]),
                unit=naming.unit,
                noise_floor=float(floor[j]),
                doubtful=f.doubtful or (IDLE_NAME if worse else ""),
            )
        )
    return tuple(out)


def gathered(
    given: Setup,
    where: Whereabouts,
    naming: Naming,
    steps: tuple[Stage, ...],
    energy: tuple[EnergyChange | None, tuple[str, ...]],
    decided: tuple[Deciding, str] | None,
    options: argparse.Namespace,
) -> Told:
    """What a run writes, from what it found.

    Args:
        given: Robot and actuators.
        where: Steps 1 and 2.
        naming: Effects, each with a stage of its own at the end of `steps`.
        steps: The gap stage by stage.
        energy: With and without the effects, and remarks.
        decided: Deciding motion, and it in words.
        options: Of the command.
    """
    first = len(steps) - len(naming.found)
    joints = tuple(
        effect_column(given.model, f, steps[first + k - 1], steps[first + k])
        for k, f in enumerate(naming.found)
    )
    signatures = {
        f"effect_{f.order}_{f.effect}.svg": (
            f"{f.effect} at {place_text(f.place)}: the gap of {given.model.joints[j]} against the "
            f"variable on which the effect depends, without it and with it."
        )
        for f, j in zip(naming.found, joints, strict=True)
    }
    file = ""
    if options.step != "shrink":
        file = added(given, where, naming, options.out, keep_doubtful=options.keep_doubtful)
    story = Story(
        given=given,
        where=where,
        naming=naming,
        stages=steps,
        energy=energy[0],
        signatures=signatures,
        decides=decided[1] if decided else "",
        remarks=energy[1],
        joints=joints,
        writes_model=bool(file),
    )
    return Told(
        story=story,
        tables=(motion_table(decided[0], given.model.joints),) if decided else (),
        model_file=file,
        shown=most_improved(steps[first - 1], steps[-1], joints),
        effect_joints=joints,
    )
