"""Step 3 in one call: name what is missing, with values, intervals, rivals and doubts.

All of it rests on *fit* and *choose*. What only proves (*prove*) has no say in any of it and is not
looked at here: `weigh` holds the model that came of it against those rows.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.effects.base import CHANNEL_UNITS, Place
from pipeline.identification import results as limits
from pipeline.identification.regression.design_matrix import make_benches
from pipeline.identification.regression.intervals import estimates
from pipeline.identification.regression.normal_equations import BlockSums
from pipeline.identification.regression.problem import Problem
from pipeline.identification.regression.refit import refit, tolerances_of
from pipeline.identification.results import Candidate, Found, Naming
from pipeline.identification.selection.residual import errors
from pipeline.identification.selection.screen import Score
from pipeline.identification.selection.select import Selection, select
from pipeline.identification.selection.weigh import floor_of
from pipeline.logs.prepared.measurement import CHOOSE, FIT, Measurement
from pipeline.machine.machine import MachineModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Identified:
    """Naming with the model it leads to.

    Attributes:
        naming: Results.
        model: With the accepted effects, tolerances as the files state them.
        problem: The least-squares problem at the end.
        enough: Whether no more effects than were allowed are needed.
    """

    naming: Naming
    model: MachineModel
    problem: Problem
    enough: bool = True

    @property
    def excess(self) -> Array:
        """What is left on *choose*, by joint and channel, in noise floors, (J, C)."""
        squares, rows = errors(self.problem, (CHOOSE,))
        excess = np.sqrt(squares) / self.problem.floor
        return np.where(rows[:, None] > 0, excess, 0.0)


def identify(
    model: MachineModel,
    measurements: Sequence[Measurement],
    *,
    most: int | None = None,
    without: Collection[str] = (),
) -> Identified:
    """Name what the model lacks.

    Args:
        model: What the engineer has.
        measurements: Logs with parts, from `observe`.
        most: Effects at most; where more are needed the answer says so and is not worked out.
        without: Names of effects that do not compete.

    Raises:
        NamingError: A part of the data has no usable row.
        ModelError: Model and logs do not fit.
    """
    start = Problem(model, make_benches(measurements), floor_of(measurements))
    selection = select(start, most=most, without=without)
    channel = measurements[0].channels[0]
    if not selection.enough:
        naming = Naming((), (), {}, selection.tried, channel, CHANNEL_UNITS[channel])
        return Identified(naming, model, selection.problem, enough=False)
    found = _found(selection, channel)
    if selection.nearest and found[-1].valid_after > limits.IDLE * found[-1].valid_before:
        selection, found = selection.without_nearest(), found[:-1]
    problem = selection.problem
    naming = Naming(
        found=found,
        candidates=_candidates(start, selection),
        tolerances=tolerances_of(problem),
        tried=selection.tried,
        channel=channel,
        unit=CHANNEL_UNITS[channel],
    )
    plain = model
    for a in problem.accepted:
        plain = a.apply(plain)
    return Identified(naming, plain, problem)


def estimated_alone(named: Identified, found: Sequence[Found]) -> tuple[Found, ...]:
    """Effects with values and intervals as they are without the others that were found.

    What is left out of a model takes its part of the log with it: beside a friction that is not
    there, what was named with it has other values.

    Args:
        named: From `identify`.
        found: Some of what was found, in its order.
    """
    keys = [(f.effect, f.place) for f in found]
    kept = [a for a in named.problem.accepted if (a.effect.name, a.place) in keys]
    if len(kept) == len(named.problem.accepted):
        return tuple(found)
    sized = estimates(refit(named.problem.with_accepted(kept)), named.naming.channel)
    return tuple(replace(f, parameters=s.parameters) for f, s in zip(found, sized, strict=True))


def _found(selection: Selection, channel: str) -> tuple[Found, ...]:
    """Accepted effects in order, each with what it closes on *choose* by estimates from *fit*."""
    problem = selection.problem
    intervals = estimates(problem, channel)
    rivals = {r.winner: r.rivals for r in selection.rounds}
    out = []
    bare = Problem(
        problem.model,
        problem.benches,
        problem.sigma,
        tolerances=problem.tolerances,
        floor=problem.floor,
    )
    before = refit(bare)
    for number, a in enumerate(problem.accepted):
        after = refit(bare.with_accepted(problem.accepted[: number + 1]))
        touched = _touched(problem, number)
        old, rows = errors(before, (CHOOSE,), by=(FIT,))
        new, _ = errors(after, (CHOOSE,), by=(FIT,))
        judged = [j for j in touched if rows[j]]
        gain = ((old - new) / problem.sigma**2)[judged].sum(axis=0)
        c = int(np.argmax(gain))
        # What a tolerance would have taken up is its own merit: the gap alone does not show it.
        idle = bool(judged) and gain.sum() <= 0.0 and not a.effect.is_tolerance
        unit = CHANNEL_UNITS[problem.benches[0].measurement.channels[c]]
        key = (a.effect.name, a.place)
        out.append(
            Found(
                order=number + 1,
                effect=a.effect.name,
                place=a.place,
                parameters=intervals[number].parameters,
                rivals=tuple(rivals.get(key, ())) + _unseen(problem, number),
                valid_before=_rms(old, judged, c),
                valid_after=_rms(new, judged, c),
                unit=unit,
                noise_floor=_rms(problem.floor**2, touched, c),
                excitation=a.effect.excitation,
                reason=(
                    limits.NEAREST
                    if key == selection.nearest
                    else _doubt(problem, number, intervals[number].certain)
                    or (limits.IDLE_NAME if idle else "")
                ),
            )
        )
        before = after
    return _second_thoughts(problem, out)


def _rms(squares: Array, joints: Sequence[int], channel: int) -> float:
    """Over those of some joints that are known; NaN without any."""
    known = squares[list(joints), channel]
    known = known[np.isfinite(known)]
    return float(np.sqrt(known.mean())) if known.size else float("nan")


def _touched(problem: Problem, number: int) -> list[int]:
    """Joints that an accepted effect changes."""
    a, without = problem.accepted[number], problem.without(number)
    out: set[int] = set()
    for bench, prediction in zip(problem.benches, problem.predictions(), strict=True):
        out |= set(bench.simulator.difference(prediction, without).joints)
    named = [problem.model.index(p) for p in a.place if p in problem.model.joints]
    return named or sorted(out)


def _unseen(problem: Problem, number: int) -> tuple[tuple[str, Place], ...]:
    """More general effects whose own part this motion cannot show: the name may be theirs."""
    from pipeline.effects.registry import EFFECTS

    a = problem.accepted[number]
    out = []
    for effect in EFFECTS.values():
        if a.effect.name not in effect.contains or effect.name not in limits.WORTH_NAMING:
            continue
        worth = limits.WORTH_NAMING[effect.name]
        coordinate = next(c for c in effect.coordinates if c.name == worth[0])
        information = 0.0
        shapes = effect.shapes(problem.model, problem.benches[0].measurement, a.place)
        for k in range(len(problem.benches)):
            columns = problem.columns(k, effect, a.place, shapes[0])
            column = columns[effect.coordinates.index(coordinate)]
            head = problem.head(k)
            information += sum(float(np.sum(x[head] ** 2)) for x in column.values())
        if information * worth[1] ** 2 < limits.LEAST_GAIN:
            out.append((effect.name, a.place))
    return tuple(out)


def _doubt(problem: Problem, number: int, certain: bool) -> str:
    """Whether the blocks contradict each other about an effect's size: a wrong law.

    The scatter of the gradient over blocks is compared with what noise of the final misfit gives.
    """
    a = problem.accepted[number]
    further = {name: 1.1 * value for name, value in a.x.items()}
    if not a.effect.plausible(problem.model, a.place, further, a.shape):
        return limits.BOUND
    if not certain:
        return limits.NOTHING
    ratio, excess = fit_quality(problem, number)
    contradicts = ratio > limits.LARGEST_SCATTER and excess > limits.LARGEST_EXCESS
    suspect = ratio > limits.SUSPECT_SCATTER and excess > limits.UNEXPLAINED
    if (contradicts or suspect) and not _dwarfs(problem, number):
        return (
            f"parts of the log contradict one another about its size {ratio:.0f} times more than "
            f"noise allows, and {excess:.1f} times the noise is left: its law is not that of the "
            "machine"
        )
    return ""


def _second_thoughts(problem: Problem, found: list[Found]) -> tuple[Found, ...]:
    """Doubt names that share a joint with what is doubtful or has closed nothing."""
    out = []
    for number, f in enumerate(found):
        effect = problem.accepted[number].effect
        idle = f.valid_after > limits.IDLE * f.valid_before and not effect.is_tolerance
        _, excess = fit_quality(problem, number)
        if not f.reason and idle and excess > limits.UNEXPLAINED:
            f = replace(f, reason=limits.IDLE_NAME)
        out.append(f)
    doubted = [k for k, f in enumerate(out) if f.reason not in ("", limits.IDLE_NAME)]
    shaken = {j for k in doubted for j in _touched(problem, k)}
    for k, f in enumerate(out):
        _, excess = fit_quality(problem, k)
        near = shaken & set(_touched(problem, k))
        small = excess > limits.UNEXPLAINED and not _dwarfs(problem, k)
        if near and not f.reason and small:
            joints = ", ".join(problem.model.joints[j] for j in sorted(near))
            out[k] = replace(f, reason=f"what else was found in {joints} is doubtful itself")
    return tuple(replace(f, level=_level(f)) for f in out)


def _level(f: Found) -> str:
    """How far a finding is to be trusted, by why it is not sure and what it closes.

    What may be nothing, stands at a bound or closes nothing is no part of a model.
    """
    if not f.reason:
        return limits.CONFIRMED
    if f.reason in (limits.NOTHING, limits.BOUND, limits.IDLE_NAME):
        return limits.SUSPECTED
    closes = 1.0 - (f.valid_after / f.valid_before) ** 2 if f.valid_before > 0 else 0.0
    return limits.APPROXIMATE if closes > limits.NEAREST_SHARE else limits.SUSPECTED


def _dwarfs(problem: Problem, number: int) -> bool:
    """Whether an effect is so much larger than what is left that its law holds well enough.

    No law is the machine's to within a quiet sensor's noise: what is left is held against what the
    effect itself does to the joints it touches, both in noise floors.
    """
    without, touched = problem.without(number), _touched(problem, number)
    own, rows = 0.0, 0.0
    for bench, prediction in zip(problem.benches, problem.predictions(), strict=True):
        change = bench.simulator.difference(prediction, without)
        columns = bench.whitened(change.effort, change.joints, problem.floor)
        said = slice(bench.parts[FIT].start, bench.parts[CHOOSE].stop)
        own += sum(float(np.sum(x[said] ** 2)) for j, x in columns.items() if j in touched)
        rows += float(bench.measurement.mask[bench.rows[said]][:, touched].sum()) * bench.weight**2
    squares, _ = errors(problem, (FIT, CHOOSE))
    left = float((squares / problem.floor**2)[touched].sum(axis=1).mean())
    return left < limits.DWARFED**2 * own / max(rows, 1.0)


def fit_quality(problem: Problem, number: int) -> tuple[float, float]:
    """Scatter of an effect's size over blocks over that of noise, and error over noise floor."""
    sums: BlockSums = problem.sums()
    blocks = sums.blocks(FIT, CHOOSE)
    theta = sums.solve(blocks)
    span = problem.span(number)
    index = np.arange(span.start, span.stop)
    gradient = (sums.h[blocks] - np.einsum("bij,j->bi", sums.H[blocks], theta))[:, index]
    own = np.array([np.diag(sums.H[b])[index] for b in blocks])
    scatter = (gradient**2).sum(axis=0) / np.maximum(own.sum(axis=0), 1e-300)
    squares, _ = errors(problem, (FIT, CHOOSE))
    excess = np.sqrt((squares / problem.floor**2)[_touched(problem, number)].mean(axis=0)).max()
    return float(scatter.max()), float(excess)


def _candidates(start: Problem, selection: Selection) -> tuple[Candidate, ...]:
    """Every candidate once, accepted ones first."""
    accepted = {(a.effect.name, a.place) for a in selection.problem.accepted}
    rivals: dict[tuple[str, Place], list[str]] = {}
    for r in selection.rounds:
        for key in r.rivals:
            rivals.setdefault(key, []).append(f"{r.winner[0]} at {', '.join(r.winner[1])}")
    base = refit(start)
    last = {(s.effect.name, s.place): s for s in selection.last}
    old, rows = errors(base, (CHOOSE,), by=(FIT,))
    new, _ = errors(selection.problem, (CHOOSE,), by=(FIT,))
    old[rows == 0], new[rows == 0] = np.nan, np.nan
    best: dict[tuple[str, Place], Score] = {}
    for s in selection.first:  # an effect may compete in several forms
        best.setdefault((s.effect.name, s.place), s)
    out = [
        _candidate(start, s, accepted, rivals, last, selection, (old, new)) for s in best.values()
    ]
    return tuple(sorted(out, key=lambda c: c.verdict != limits.ACCEPTED))


def _candidate(
    problem: Problem,
    s: Score,
    accepted: set[tuple[str, Place]],
    rivals: dict[tuple[str, Place], list[str]],
    last: dict[tuple[str, Place], Score],
    selection: Selection,
    gaps: tuple[Array, Array],
) -> Candidate:
    key = (s.effect.name, s.place)
    m = problem.benches[0].measurement
    joints = [problem.model.index(p) for p in s.place if p in problem.model.joints]
    joints = joints or list(range(len(problem.model.joints)))
    before = _rms(gaps[0], joints, 0)
    trial = selection.trials.get(key)
    # What was not tried in earnest has no estimate to judge by.
    after = before * np.sqrt(max(1.0 - trial.held_share, 0.0)) if trial else float("nan")
    identifiable = s.alone > limits.LEAST_ALONE
    if key in accepted:
        after = _rms(gaps[1], joints, 0)
        verdict, reason = limits.ACCEPTED, "explains the log with the fewest parameters"
    elif key in rivals:
        verdict = limits.INDISTINGUISHABLE + "; ".join(rivals[key])
        reason = f"explains the log as well; a motion that {s.effect.excitation} would decide"
    elif not identifiable:
        verdict = limits.NOT_IDENTIFIABLE
        reason = f"tolerances explain its signature; a motion that {s.effect.excitation} is needed"
    else:
        verdict = limits.REJECTED
        now = last.get(key)
        left = now.gain if now else 0.0
        if s.gain < limits.LEAST_GAIN and trial is None:
            reason = (
                f"explains no more than noise ({s.gain:.2g} noise variances; "
                f"{limits.LEAST_GAIN:.0f} are asked)"
            )
        elif after > before:
            reason = "makes validation data worse"
        elif left < limits.LEAST_GAIN:
            reason = "the accepted effects explain what it would have explained"
        else:
            reason = "what it explains does not hold over all blocks, or not on those that choose"
    return Candidate(
        effect=s.effect.name,
        place=s.place,
        before=before,
        after=after,
        unit=CHANNEL_UNITS[m.channels[0]],
        identifiable=identifiable,
        verdict=verdict,
        reason=reason,
        gain=s.gain,
    )
