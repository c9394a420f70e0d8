"""Logs of one machine from files to parts: read, judged, at one grid and bandwidth, `split`.

The bandwidth is where the encoder's noise does not matter. Efforts are compared with inertia times
an acceleration that comes from a filtered encoder. Its noise grows with the 2.5th power of the
cut-off, the effort's with the square root; where the first outweighs the second, columns built from
accelerations fit noise. The cut-off is lowered until the encoder's noise in the prediction is at
most half the effort's, and below the rate at which the steps of a rounded position come: their
error is no noise there.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import cycle
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError, known
from pipeline.logs.checks import judge, refuse_repeats
from pipeline.logs.filters import LARGEST_SHARE, LowPass
from pipeline.logs.log import (
    TEST,
    TIME,
    TRAIN,
    UNUSED,
    VALIDATION,
    Expected,
    Finding,
    Findings,
    Log,
    Recording,
    column_name,
    refuse,
)
from pipeline.logs.mapping import Mapping as MappingFile
from pipeline.logs.read import read_log
from pipeline.logs.reduce import AT_REST, LONGEST_KERNEL, STANCE, Settings, choose_settings, reduced
from pipeline.logs.speeds import MOST_TAKEN, changes, narrowed, near_rest
from pipeline.robot.robot import Robot

#: A joint that moves by less is still and its encoder noisy: share of its range, or angle [rad]
#: where it has no range.
_STILL: Final = 0.01
#: Encoder noise in the prediction over effort noise.
LARGEST_RATIO: Final = 0.5
#: Never below this; a robot's own motion reaches further [Hz].
LEAST_CUTOFF: Final = 8.0
#: Nor above this: a robot's motion does not reach there, resonances of its structure do [Hz].
MOST_CUTOFF: Final = 30.0
#: Speed over which friction changes sign, as a share of the joint's fast speed.
REST_SHARE: Final = 0.003
#: ... and at least this many standard deviations of the velocity's noise.
REST_SIGMAS: Final = 3.0
#: Standard deviation of the sense of friction from which on a row tells nothing of it: friction is
#: tenths of a torque of which noise is hundredths.
UNSURE: Final = 0.1

NAMES: Final = ("training", "validation", "test")
#: Blocks are at least this many guards long, so that little is lost between them.
BLOCK_GUARDS: Final = 5.0
#: Blocks a log is cut into where it is long enough.
MOST_BLOCKS: Final = 48
FEWEST_BLOCKS: Final = 6
#: Rows that a part needs.
_LEAST_ROWS: Final = 20
#: Logs from which on every fourth is held out, not the last alone.
_MANY_LOGS: Final = 8
#: The order in which blocks go to the parts: half to training, a quarter each to the others.
PATTERN: Final = (TRAIN, VALIDATION, TRAIN, TEST)
PATTERN_WITHOUT_TEST: Final = (TRAIN, VALIDATION, TRAIN)
#: Logs beyond which they are compared as one of many pieces: to simulate a log takes as long as
#: some hundred of its rows, thousands of times.
MANY: Final = 24
#: How a lone log is tested, and what that cannot show.
_BLOCKS: Final = "tested on every fourth block of the log"
_SAME: Final = (
    "tested on parts of the same log: they show nothing about other motions; give a log of another "
    "motion, speed or load to test on"
)
#: Time between such logs, beyond what any filter bridges [s].
_APART: Final = 1000.0
#: Rows of all logs together that estimation works on, and of one stretch of a longer log.
MOST_ROWS: Final = 60_000
_STRETCH_ROWS: Final = 1000
#: Spectra and what noise matters are told by at most this many stretches of this many rows.
_SHORT: Final = (8, 16_384)


@dataclass(frozen=True)
class Asked:
    """What a run wants of its logs, and what is known of the machine beforehand."""

    expected: Expected  #: The robot's names, limits and ratios.
    mapping: MappingFile | None = None  #: For foreign columns.
    effort: str | None = None  #: Channel to compare, or None for the most direct one.
    #: Whether a log of the supply alone will do, and no row is dropped.
    supply: bool = False
    motors: bool = True  #: Whether the machine has motors, by which other channels are compared.
    cutoff: float | None = None  #: Of the low-pass, instead of the one the data ask for [Hz].
    prove_last: float | None = None  #: Share at the end of every log for the test.
    #: Whether many logs stay apart, and long ones whole: each is told for itself.
    apart: bool = False
    mimics: Mapping[str, str] | None = None  #: Joint to the one that it follows.
    robot: Robot | None = None  #: With legs on the ground, else None.
    #: Standard deviation of the prediction from the sensors' noise in the motion, shape (J, C).
    felt: Callable[[Log], Array] | None = None


@dataclass(frozen=True)
class Logs:
    """Logs that were accepted."""

    logs: tuple[Log, ...]  #: One per log, in the order given.
    fitted: int  #: How many of them may be fitted, the first ones.
    findings: tuple[Finding, ...]  #: Rows of `quality.csv`.
    settings: Settings  #: Common to all.
    guard: float  #: Between parts [s].
    rule: str  #: How the parts were cut, in words.
    warning: str  #: What the test cannot show, or empty.


def load(paths: Sequence[Path], fitted: int, asked: Asked) -> Logs:
    """Read, check, reduce and split logs; one of several that is of no use is left out, and said.

    Args:
        paths: Of all logs.
        fitted: How many of them, the first ones, may be fitted.
        asked: How, and of which machine.

    Raises:
        LegwattError: Unusable input; one line.
    """
    useless, found = dict[int, str](), list[Finding]()
    good = dict[int, Recording]()
    for k, path in enumerate(paths):
        try:
            log = _as_asked(read_log(path, asked.expected, asked.mapping), asked)
            judged, log = judge(log, asked.expected)
            refuse(judged)
        except LegwattError as error:
            useless[k] = str(error)
            continue
        good[k] = log
        found += judged
    found = [*without_useless([path.stem for path in paths], fitted, useless), *found]
    fitted = sum(k < fitted for k in good)
    read = [*good.values()]
    refuse_repeats(read)
    _refuse_moved(read, asked)
    if len(channels := {log.effort for log in read}) > 1:
        raise LegwattError(
            f"the logs are compared in different channels ({', '.join(sorted(channels))}); set "
            "effort in a mapping file"
        )
    short = [shortened(log, *_SHORT) for log in read]
    settings = choose_settings(short, cutoff=asked.cutoff, thinned=not asked.supply)
    if asked.cutoff is None and asked.felt is not None:
        looked = [reduced(log, settings, asked.robot) for log in short]
        settings = _naming(settings, looked, asked.felt)
    tested, rule = _tested(read, fitted, asked.prove_last)
    if not asked.apart and len(read) > MANY:
        halves = [
            _together([log for k, log in enumerate(read) if (k in tested) == held])
            for held in (False, True)
        ]
        read, fitted = halves[0] + halves[1], len(halves[0])
        tested = {*range(fitted, len(read))}
    if not asked.apart:
        rows = _STRETCH_ROWS * settings.step
        share = MOST_ROWS * settings.step / sum(map(len, read))
        if share < 1.0:
            read = [shortened(log, max(1, int(share * len(log) / rows)), rows) for log in read]
    logs = with_rest([reduced(log, settings, asked.robot) for log in read])
    found += [finding for log in logs for finding in _seen(log)]
    refuse(found)
    logs, guard = split(logs, tested, prove_last=asked.prove_last or 0.0)
    if asked.felt is not None:
        logs = [replace(m, noise=np.hypot(m.noise, asked.felt(m))) for m in logs]
    same = _SAME * (rule == _BLOCKS)
    return Logs(tuple(logs), fitted, tuple(found), settings, guard, rule, same)


def _together(logs: Sequence[Recording]) -> list[Recording]:
    """Logs of the same columns as one, in which each begins long after the one before.

    What a log costs beside its rows is paid once.
    """
    kinds, out = dict[tuple[object, ...], list[Recording]](), []
    for log in logs:
        kinds.setdefault((*log.left_out, *log.frame.columns), []).append(log)
    for own in kinds.values():
        frames, begin = [], 0.0
        for log in own:
            frames.append(log.frame.assign(**{TIME: log.time - log.time[0] + begin}))
            begin = float(frames[-1][TIME].iloc[-1]) + _APART
        one = replace(own[0], frame=pd.concat(frames, ignore_index=True))
        sha256 = hashlib.sha256("".join(log.sha256 for log in own).encode()).hexdigest()
        name = f"{own[0].name} to {own[-1].name}" if len(own) > 1 else own[0].name
        out.append(replace(one, name=name, sha256=sha256))
    return out


def _as_asked(log: Recording, asked: Asked) -> Recording:
    """A log as the options of a run want it; a LegwattError where it does not hold that."""
    if asked.effort:
        known("no such channel in the log:", asked.effort, log.channels, log.name)
        log = replace(log, effort=asked.effort)
    if log.supply_alone and not asked.supply:
        raise LegwattError(
            f"{log.name}: no effort of any joint, only the supply: that is for `gap power`; log "
            "torque, current, voltage or power per joint, or give the servos' gains"
        )
    if not asked.motors and log.effort != "torque":
        raise LegwattError(
            f"{log.name}: measures {log.effort} and a bare URDF has no motor; name "
            "the drivetrain option as alternative"
        )
    return log


def _refuse_moved(logs: Sequence[Recording], asked: Asked) -> None:
    """Stop where a log moves a joint that mimics another, or the one that it mimics."""
    span = asked.expected.upper - asked.expected.lower
    least = _STILL * np.where(np.isfinite(span), span, 1.0)
    for log in logs if asked.mimics else ():
        travel = np.fmax.reduce(log.position) - np.fmin.reduce(log.position)
        moved = dict(zip(log.joints, travel > least, strict=True))
        for joint, other in (asked.mimics or {}).items():
            if moved.get(joint) or moved.get(other):
                raise LegwattError(
                    f"{log.name}: '{joint}' mimics '{other}', and they move: a drive that moves "
                    "several joints is not computed; make it fixed in the URDF, or remove <mimic> "
                    "if it has a drive of its own"
                )


def without_useless(names: Sequence[str], fitted: int, useless: Mapping[int, str]) -> list[Finding]:
    """What is said of logs that are left out because they are of no use.

    Args:
        names: Of all logs.
        fitted: How many of them, the first ones, may be fitted.
        useless: Number of a log to why nothing can be taken from it.

    Raises:
        LegwattError: None would be left to fit, or none to test on where some are held out: the
            reason that took most of them.
    """
    for group in (range(fitted), range(fitted, len(names))):
        why = [useless[k] for k in group if k in useless]
        if not why or len(why) < len(group):
            continue
        # Reasons are alike where they differ in names and numbers alone.
        kinds = [re.sub(r"[\d.]+", "0", text.partition(": ")[2]) for text in why]
        usual = kinds.index(max(kinds, key=kinds.count))
        many = f"none of {len(why)} logs can be used; {kinds.count(kinds[usual])} of them as "
        raise LegwattError(many * (len(why) > 1) + why[usual])
    return [
        Finding(names[k], "", "left_out", 1.0, "1", "warning", f"this log is left out: {text}")
        for k, text in sorted(useless.items())
    ]


def shortened(log: Recording, count: int, rows: int) -> Recording:
    """At most `count` stretches of so many rows: those that tell most, half of them spread evenly.

    What a stretch tells is how much every joint moves and works in it: the variances of positions,
    efforts, and their steps. A joint that moves in one minute of an hour is thus seen.
    """
    if len(log) <= count * rows:
        return log
    names = [column_name(joint, q) for joint in log.joints for q in ("position", log.effort)]
    table = log.frame[[name for name in names if name in log.frame]]
    spans = [slice(at, at + rows) for at in range(0, len(log), rows)]
    own = (table.iloc[span] for span in spans)
    tells = np.nan_to_num([np.concatenate([x.var(), x.diff().var()]) for x in own])
    score = (tells / np.maximum(tells.mean(axis=0), 1e-300)).sum(axis=1)
    alive = np.flatnonzero(score > 0)
    best = alive[np.argsort(-score[alive], kind="stable")[: count // 2]]
    others = np.setdiff1d(alive, best)
    places = np.linspace(0, max(others.size - 1, 0), count - best.size).astype(int)
    kept = sorted({*best.tolist(), *others[places[: others.size]].tolist()})
    frame = pd.concat([log.frame.iloc[spans[k]] for k in kept], ignore_index=True)
    return replace(log, frame=frame)


def _naming(settings: Settings, logs: Sequence[Log], felt: Callable[[Log], Array]) -> Settings:
    """The cut-off at which the encoder's noise in the prediction does not matter."""
    now = min(settings.cutoff, *(max(step_rate(log)[1], LEAST_CUTOFF) for log in logs))
    share = 1.0
    for log in with_rest(logs):
        own = felt(log)[:, 0]
        good = (own > 0) & np.isfinite(log.noise[:, 0])
        if good.any():
            ratio = float(np.median(own[good] / log.noise[good, 0]))
            share = min(share, float(np.sqrt(LARGEST_RATIO / max(ratio, 1e-12))))
    longest = max(float(log.time[-1] - log.time[0]) for log in logs)
    least = max(LEAST_CUTOFF, 4.0 / (LONGEST_KERNEL * longest), settings.least)
    cutoff = float(min(now, max(min(share * now, MOST_CUTOFF), least)))
    if cutoff >= settings.cutoff * (1 - 1e-9):
        return settings
    reason = (
        f"lowered from {settings.cutoff:.3g} Hz ({settings.reason}): above it the encoder's noise "
        "in the prediction outweighs the effort's"
    )
    return replace(settings, cutoff=min(cutoff, LARGEST_SHARE / settings.dt), reason=reason)


def step_rate(log: Log) -> tuple[int, float]:
    """The joint that moves furthest, and how often its position takes a new value [Hz].

    A rounded channel of speed v and step d does v / d times a second, and its error is a sawtooth
    of that frequency: a filter that lets it pass shows the steps, and no speed between them. Joints
    that hardly move may well stand between two steps.
    """
    assert log.recording is not None
    j = int(np.nanargmax(np.ptp(log.q, axis=0)))
    own = log.recording.frame[[TIME, column_name(log.joints[j], "position")]].dropna().to_numpy()
    new = own[1:][np.diff(own[:, 1]) != 0, 0]
    return j, 1.0 / float(np.median(np.diff(new))) if new.size > 1 else np.inf


def with_rest(logs: Sequence[Log]) -> list[Log]:
    """Logs with the speed at which friction turns, and without rows near that or a new stance."""
    fast = np.max([np.quantile(np.abs(one.v), 0.95, axis=0) for one in logs], axis=0)
    noise = np.max([one.rate_noise[0] for one in logs if one.rate_noise is not None], axis=0)
    rest = np.maximum(np.maximum(REST_SHARE * fast, REST_SIGMAS * noise), 1e-6)
    out = []
    for one in logs:
        near = near_rest(one.v, rest, one.pieces, one.rate, one.bandwidth)
        if one.unsure is not None:  # the filter sees a little further than it reaches with weight
            unsure = one.unsure > UNSURE
            few = (unsure & ~near).sum(axis=0) <= MOST_TAKEN * (~near).sum(axis=0)
            near |= unsure & few
        takers = {AT_REST: near}
        if one.standing is not None:
            event = np.asarray(changes(one.standing, one.pieces).any(axis=1))[:, None]
            reach = 0 if one.filter is None else one.filter.half - 1
            takers[STANCE] = narrowed(event, np.ones_like(event), one.pieces, reach)
        out.append(replace(one, rest_speed=rest).without(takers))
    return out


def _seen(log: Log) -> list[Finding]:
    """What is told of one reduced log."""
    found, read = Findings(log.name), log.recording
    assert read is not None
    found += log.findings
    j, rate = step_rate(log)
    if rate < min(log.bandwidth, LEAST_CUTOFF) and read.column(log.joints[j], "velocity") is None:
        detail = (
            f"takes {rate:.3g} new values a second: velocity and acceleration up to "
            f"{LEAST_CUTOFF:g} Hz would show the steps alone; log positions with more digits, or "
            "the velocity beside them"
        )
        column = column_name(log.joints[j], read.position_quantity(log.joints[j]))
        found.note(column, "resolution", "refused", detail, rate, "Hz")
    return found


def _tested(
    logs: Sequence[Recording], fitted: int, prove_last: float | None
) -> tuple[set[int], str]:
    """Numbers of the logs for the test, and that rule in words.

    Those after the first `fitted`, which are held out; else a share of every log, at its end,
    blocks of the only one, every fourth log, or the last one.
    """
    if prove_last is not None and not 0.05 <= prove_last <= 0.8:
        raise LegwattError(f"share to test on is {prove_last:g}; expected 0.05 to 0.8")
    if fitted < len(logs):
        return {*range(fitted, len(logs))}, "tested on the held-out logs"
    if prove_last is not None:
        return set(), f"tested on the last {100 * prove_last:g} % of every log"
    if len(logs) == 1:
        return set(), _BLOCKS
    if len(logs) >= _MANY_LOGS:
        return set(range(3, len(logs), len(PATTERN))), "tested on every fourth log"
    return {len(logs) - 1}, f"tested on the log {logs[-1].name}"


def split(
    logs: Sequence[Log], tested: Collection[int] = (), *, prove_last: float = 0.0
) -> tuple[list[Log], float]:
    """Cut logs into training, validation and test.

    Args:
        logs: At one bandwidth.
        tested: Numbers of those that are for the test.
        prove_last: Share of every other log, at its end, for the test.

    Returns:
        Logs with their parts, and the guard between these [s].

    Raises:
        LegwattError: Too little data for three parts.
    """
    guard, rate = LowPass(logs[0].rate, logs[0].bandwidth).noise_memory, logs[0].rate
    pattern = PATTERN_WITHOUT_TEST if tested or prove_last else PATTERN
    # Pieces of which guards between the fewest blocks would take much are dealt out as they are, in
    # the pattern's order over all logs.
    least = (1 + BLOCK_GUARDS) * FEWEST_BLOCKS * guard * rate
    short = [
        [p for p in log.pieces if p.stop - p.start < least and k not in tested]
        for k, log in enumerate(logs)
    ]
    turns = cycle(pattern) if sum(map(len, short)) >= len(pattern) else None
    out = []
    for k, (log, whole) in enumerate(zip(logs, short, strict=True)):
        part = np.full(len(log), TEST if k in tested else UNUSED, dtype=np.int8)
        proving = whole[len(whole) - round(prove_last * len(whole)) :]
        for piece in log.pieces if k not in tested else ():
            if turns is not None and piece in whole:
                part[piece] = TEST if piece in proving else next(turns)
            else:
                margin = int(np.ceil(guard * rate))
                part[piece] = _blocks(piece.stop - piece.start, margin, pattern, prove_last)
        out.append(replace(log, part=part))
    rows = [sum(int((log.part == k).sum()) for log in out) for k in range(len(NAMES))]
    if min(rows) < _LEAST_ROWS:
        duration = sum(float(log.time[-1] - log.time[0]) for log in logs)
        raise LegwattError(
            f"{logs[0].name}: {duration:.3g} s in {sum(len(log.pieces) for log in logs)} "
            f"pieces without a gap, at a cut-off of {logs[0].bandwidth:.3g} Hz with guards of "
            f"{guard:.2g} s between parts, leave {min(rows)} rows to "
            f"{NAMES[int(np.argmin(rows))]}; log longer, or raise the cut-off"
        )
    return out, guard


def _blocks(size: int, margin: int, pattern: Sequence[int], last: float) -> NDArray[np.int8]:
    """Parts of the rows of one piece, (size,): blocks by turns, the last share for the test.

    A guard of `margin` rows stands wherever neighbours belong to different parts, taken from the
    one that is not the test.
    """
    fitted = size - round(last * size)
    count = int(np.clip(fitted / ((1 + BLOCK_GUARDS) * margin), FEWEST_BLOCKS, MOST_BLOCKS))
    edges = np.round(np.linspace(0, fitted, count + 1)).astype(int)
    lengths = [*np.diff(edges), size - fitted]
    part = np.repeat([*np.resize(pattern, count), TEST], lengths).astype(np.int8)
    out = part.copy()
    for k in (np.flatnonzero(np.diff(part)) + 1).tolist():
        own = slice(k, k + margin) if part[k - 1] == TEST else slice(max(k - margin, 0), k)
        out[own] = UNUSED
    return out
