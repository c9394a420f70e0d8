"""Step 1 of the workflow: logs as asked for, judged, brought to one grid and bandwidth.

The bandwidth is where the encoder's noise does not matter. Naming compares efforts with inertia
times an acceleration that comes from a filtered encoder. Its noise grows with the 2.5th power of
the cut-off, the effort's with the square root; where the first outweighs the second, columns built
from accelerations fit noise (an elasticity that is not there). The cut-off is lowered until the
encoder's noise in the prediction is at most half the effort's, and below the rate at which the
steps of a rounded position come: their error is no noise there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from actuators.arrays import Array, Mask
from actuators.errors import LegwattError
from pipeline.identification.compare.long import LongLogs
from pipeline.identification.compare.observe import observe_all
from pipeline.logs.errors import Finding
from pipeline.logs.log_format import Expected, column_name
from pipeline.logs.prepared.measurement import Contact, Measurement
from pipeline.logs.prepared.parts import period, with_repeated_noise
from pipeline.logs.prepared.prepare import Prepared, prepare
from pipeline.logs.prepared.read_off import signal_findings
from pipeline.logs.quality.checks import cannot_tell
from pipeline.logs.quality.quality import judge
from pipeline.logs.quality.sampling import new_values
from pipeline.logs.reading.log import Log
from pipeline.logs.signals.derivatives import (
    LONGEST_KERNEL,
    Settings,
    choose_settings,
    smoother_noise,
)
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Prediction, Simulator

#: A joint that moves by less is still and its encoder noisy: share of its range, or angle [rad]
#: where it has no range.
_STILL: Final = 0.01
#: Encoder noise in the prediction over effort noise.
LARGEST_RATIO: Final = 0.5
#: Never below this; a robot's own motion reaches further [Hz].
LEAST_CUTOFF: Final = 8.0
#: Nor above this: a robot's motion does not reach there, resonances of its structure do [Hz].
MOST_CUTOFF: Final = 30.0


@dataclass(frozen=True)
class LoadedLogs:
    """Logs that were accepted."""

    prepared: tuple[Prepared, ...]  #: One per log, in the order given.
    findings: tuple[Finding, ...]  #: Rows of `quality.csv`.
    settings: Settings  #: Common to all.
    kept: tuple[int, ...]  #: Which of the logs given they are.
    of_logs: tuple[Finding, ...] = ()  #: Of the findings those that no bandwidth changes.
    #: The logs chunk by chunk where `prepared` holds but stretches of them, else None.
    long: LongLogs | None = None

    def at(self, prepared: Sequence[Prepared]) -> LoadedLogs:
        """The same logs at another bandwidth, with what is found at it."""
        found = [f for one in prepared for f in filter_findings(one)]
        return replace(
            self,
            prepared=tuple(prepared),
            settings=prepared[0].settings,
            findings=(*self.of_logs, *found),
        )


def as_asked(log: Log, *, effort: str | None, base: str | None, supply: bool, motors: bool) -> Log:
    """A log, or a piece of one, as the options of a run want it.

    Args:
        log: As read.
        effort: Channel to compare, or None for the most direct one.
        base: How the base stands: ``measured``, ``level``, ``fixed``, or None for as it says.
        supply: Whether a log of the supply alone will do.
        motors: Whether the machine has motors, by which another channel than torque is compared.

    Raises:
        LegwattError: It does not hold what is asked for.
    """
    if effort:
        log = log.with_changes(chosen_effort=effort)
        _ = log.effort  # refuses a channel that is not there
    if base == "measured" and log.base_roll is None and log.base_pitch is None:
        raise LegwattError(
            f"{log.name}: --base measured needs base__roll_rad and base__pitch_rad; log them or "
            "use --base level"
        )
    if base in ("level", "fixed"):
        log = log.with_changes(base_roll=None, base_pitch=None)
    if log.supply_alone and not supply:
        raise LegwattError(
            f"{log.name}: no effort of any joint, only the supply: that is for `gap power`; log "
            "torque, current, voltage or power per joint, or give the servos' gains"
        )
    if not motors and log.effort.channel != "torque":
        raise LegwattError(
            f"{log.name}: measures {log.effort.channel} and a bare URDF has no motor; name "
            "the actuator with --alternative"
        )
    return log


def refuse_moved(mimics: Mapping[str, str], logs: Iterable[Log], expected: Expected) -> None:
    """Stop where a log moves a joint that mimics another, or the one that it mimics.

    Raises:
        LegwattError: Names log and joints.
    """
    for log in logs:
        for joint, other in mimics.items():
            moved = [name for name in (joint, other) if _moves(log, name, expected)]
            if moved:
                raise LegwattError(
                    f"{log.name}: '{moved[0]}' moves, and '{joint}' mimics '{other}': a drive that "
                    "moves several joints is not computed; make it fixed in the URDF, or remove "
                    "<mimic> if it has a drive of its own"
                )


def _moves(log: Log, joint: str, expected: Expected) -> bool:
    if joint not in log.joints:
        return False
    k = log.joints.index(joint)
    q = log.position[:, k]
    q = q[np.isfinite(q)]
    span = float(expected.upper[k] - expected.lower[k])
    return q.size > 0 and float(np.ptp(q)) > _STILL * (span if np.isfinite(span) else 1.0)


def prepare_logs(
    logs: Sequence[Log],
    expected: Expected,
    *,
    fitted: int | None = None,
    cutoff: float | None = None,
    largest: Mapping[str, Array] | None = None,
    contact: Callable[[Log], Contact | None] | None = None,
) -> LoadedLogs:
    """Judge and prepare logs that were read already; one of several that is of no use is left out.

    Args:
        logs: As read.
        expected: The robot's names, limits and ratios.
        fitted: How many of them, the first ones, may be fitted; all by default.
        cutoff: Of the low-pass, instead of the one the data ask for [Hz].
        largest: Channel to the largest magnitude the drive can give, shape (J,).
        contact: How to tell which feet stand.

    Raises:
        LegwattError: A log is unusable or does not fit the others.
    """
    judged = [judge(log, expected, largest=largest) for log in logs]
    useless: dict[int, str] = {}
    for k, quality in enumerate(judged):
        try:
            quality.refuse()
        except LegwattError as error:
            useless[k] = str(error)
    left_out = without_useless([log.name for log in logs], fitted, useless)
    kept = [k for k in range(len(logs)) if k not in useless]
    logs, qualities = [logs[k] for k in kept], [judged[k] for k in kept]
    prepared = _prepared(logs, [q.usable for q in qualities], cutoff, contact)
    found = (*left_out, *(finding for quality in qualities for finding in quality.findings))
    return LoadedLogs((), (), prepared[0].settings, tuple(kept), found).at(prepared)


def without_useless(
    names: Sequence[str], fitted: int | None, useless: Mapping[int, str]
) -> list[Finding]:
    """What is said of logs that are left out because they are of no use.

    Args:
        names: Of all logs.
        fitted: How many of them, the first ones, may be fitted; all by default.
        useless: Number of a log to why nothing can be taken from it.

    Raises:
        LegwattError: None would be left to fit, or none to test on where some are held out: the
            reason that took most of them.
    """
    count = len(names) if fitted is None else fitted
    for group in (range(count), range(count, len(names))):
        why = [useless[k] for k in group if k in useless]
        if not why or len(why) < len(group):
            continue
        if len(why) == 1:
            raise LegwattError(why[0])
        # Reasons are alike where they differ in names and numbers alone.
        kinds = [re.sub(r"[\d.]+", "0", text.partition(": ")[2]) for text in why]
        usual = max(kinds, key=kinds.count)
        raise LegwattError(
            f"none of {len(why)} logs can be used; {kinds.count(usual)} of them as "
            f"{why[kinds.index(usual)]}"
        )
    return [
        Finding(names[k], "", "left_out", 1.0, "1", "warning", f"this log is left out: {text}")
        for k, text in sorted(useless.items())
    ]


def _prepared(
    logs: Sequence[Log],
    usable: Sequence[tuple[Mask, Mask]],
    cutoff: float | None,
    contact: Callable[[Log], Contact | None] | None,
) -> list[Prepared]:
    """Logs at one grid and bandwidth."""
    channels = {log.effort.channel for log in logs}
    if len(channels) > 1:
        raise LegwattError(
            f"the logs are compared in different channels ({', '.join(sorted(channels))}); set "
            "effort in a mapping file"
        )
    settings = choose_settings(logs, usable, cutoff=cutoff)
    prepared = [
        prepare(log, settings, usable=good, contact=contact(log) if contact else None)
        for log, good in zip(logs, usable, strict=True)
    ]
    return with_repeated_noise(prepared)


def filter_findings(one: Prepared) -> list[Finding]:
    """Bandwidth, usable share and noise floor of one prepared log."""
    name = one.log.name
    out = [Finding(name, "", "cutoff", one.cutoff, "Hz", "ok", one.settings.reason)]
    cycle = period(one)
    if cycle is not None:
        out.append(Finding(name, "", "period", cycle, "s", "ok", "the motion repeats"))
    if one.contact is not None:
        stances = len(one.pieces) + one.events.size
        detail = f"contact from {one.contact.source}; {stances} stretches of one stance"
        out.append(Finding(name, "", "contact", stances, "1", "ok", detail))
    out += _resolution(one)
    for j, joint in enumerate(one.joints):
        column = column_name(joint, one.channel)
        usable = float(one.mask[:, j].mean())
        verdict = "ok" if usable > 0.98 else "masked"
        detail = f"{100 * usable:.1f} % of the rows can be compared"
        out.append(Finding(name, column, "usable_share", usable, "1", verdict, detail))
        floor = float(one.noise[j])
        if np.isfinite(floor):
            detail = f"within the bandwidth, from {one.noise_basis}"
            out.append(Finding(name, column, "noise_floor", floor, one.unit, "ok", detail))
    return [*out, *signal_findings(one), *cannot_tell(one.log, one.v, one.effort, one.mask)]


def _resolution(one: Prepared) -> list[Finding]:
    """Refuse positions rounded so that no cut-off at which a robot's motion shows would do."""
    j, rate = step_rate(one)
    if rate >= min(one.cutoff, LEAST_CUTOFF):
        return []
    quantity = "motor_position" if one.log.position_source == "motor" else "position"
    change = np.abs(np.diff(one.log.position[:, j]))
    step = float(change[change > 0].min())
    detail = (
        f"moves in steps of {step:.3g} rad, {rate:.3g} a second: a velocity and acceleration up to "
        f"{LEAST_CUTOFF:g} Hz, as a robot's motion needs, show the steps alone; log positions with "
        "more digits, or the velocity beside them"
    )
    column = column_name(one.joints[j], quantity)
    return [Finding(one.log.name, column, "resolution", step, "rad", "refused", detail)]


def naming_cutoff(model: MachineModel, prepared: Sequence[Prepared]) -> float:
    """The cut-off for naming [Hz], at most that of the prepared logs."""
    now = min(prepared[0].cutoff, *(max(step_rate(one)[1], LEAST_CUTOFF) for one in prepared))
    share = 1.0
    for one, m in zip(prepared, observe_all(model, prepared), strict=True):
        felt = encoder_noise(model, one, m)[:, 0]
        good = (felt > 0) & np.isfinite(m.noise[:, 0])
        if good.any():
            ratio = float(np.median(felt[good] / m.noise[good, 0]))
            share = min(share, float(np.sqrt(LARGEST_RATIO / max(ratio, 1e-12))))
    longest = max(float(one.time[-1] - one.time[0]) for one in prepared)
    least = max(LEAST_CUTOFF, 4.0 / (LONGEST_KERNEL * longest), prepared[0].settings.least)
    return float(min(now, max(min(share * now, MOST_CUTOFF), least)))


def step_rate(one: Prepared) -> tuple[int, float]:
    """The joint that moves furthest, and how often its position takes a new value [Hz].

    A filter that passes this frequency shows the steps of a rounded position. Joints that hardly
    move may well stand between two steps, and a joint with a velocity column that has the say
    needs none: infinite.
    """
    j = int(np.nanargmax(np.ptp(one.q, axis=0)))
    if (one.fusion.weight[:, j] > 0.5).all():
        return j, np.inf
    good = one.usable[0][:, j]
    return j, new_values(one.log.time[good], one.log.position[good, j])


def with_encoder_noise(
    model: MachineModel, prepared: Sequence[Prepared], measurements: Sequence[Measurement]
) -> tuple[Measurement, ...]:
    """Measurements whose noise floor includes what the encoder's noise does to the prediction."""
    return tuple(
        replace(m, noise=np.hypot(m.noise, encoder_noise(model, one, m)))
        for one, m in zip(prepared, measurements, strict=True)
    )


def encoder_noise(model: MachineModel, one: Prepared, m: Measurement) -> Array:
    """Standard deviation of the prediction from the encoder's noise, shape (J, C).

    Velocity and acceleration noise are taken as independent of one another (an odd and an even
    kernel) and of other joints.
    """
    base = Simulator(m).predict(model)
    total = np.zeros(base.effort.shape[1:])
    for order, jolt in ((1, replace(m, v=m.v + 0.1)), (2, replace(m, a=m.a + 1.0))):
        size = 0.1 if order == 1 else 1.0
        # In motion alone: the step of friction at a reversal is no noise.
        change = np.abs(Simulator(jolt).predict(model).effort - base.effort) / size
        slope = np.median(change, axis=0)
        total += (slope * one.fusion.noise[order - 1][:, None]) ** 2
    total += _force_noise(model, one, m, base) ** 2
    return np.asarray(np.sqrt(total))


def _force_noise(model: MachineModel, one: Prepared, m: Measurement, base: Prediction) -> Array:
    """Standard deviation of the prediction from the noise of measured foot forces, (J, C)."""
    total = np.zeros(base.effort.shape[1:])
    raw = one.log.foot_force
    if m.foot_force is None or raw is None or m.standing is None:
        return total
    # At the log's own rate, where the noise is white.
    flat = np.nan_to_num(raw[one.row]).reshape(len(one), -1)
    lowpass = one.settings.lowpass
    sigma = smoother_noise(
        flat, np.ones(flat.shape, dtype=np.bool_), one.pieces, lowpass, in_band=True
    )
    for axis in range(3):
        known = np.nan_to_num(sigma.reshape(raw.shape[1:])[:, axis])
        push = np.zeros_like(m.foot_force)
        push[..., axis] = m.standing * float(np.median(known))
        pushed = Simulator(replace(m, foot_force=m.foot_force + push)).predict(model)
        total += np.mean((pushed.effort - base.effort) ** 2, axis=0)
    return np.asarray(np.sqrt(total))


def lowered(prepared: Sequence[Prepared], cutoff: float) -> tuple[Prepared, ...]:
    """The same logs at a lower cut-off, masks and noise rebuilt for it from what was read.

    Args:
        prepared: At one cut-off.
        cutoff: At most that one [Hz].
    """
    old = prepared[0].settings
    if cutoff >= old.cutoff * (1 - 1e-9):
        return tuple(prepared)
    reason = (
        f"lowered from {old.cutoff:.3g} Hz ({old.reason}): above it the encoder's noise in the "
        "prediction outweighs the effort's"
    )
    settings = replace(old, cutoff=cutoff, reason=reason)
    return tuple(with_repeated_noise([one.at(settings) for one in prepared]))
