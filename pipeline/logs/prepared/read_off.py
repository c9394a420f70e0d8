"""What a prepared log shows by itself: velocity columns, stamps, two positions, ripple."""

from __future__ import annotations

from typing import Final

import numpy as np

from pipeline.logs.prepared.prepare import Prepared
from pipeline.logs.quality.finding import Finding, Findings
from pipeline.logs.reading.log_format import column_name
from pipeline.logs.signals.derivatives import LowPass
from pipeline.logs.signals.orders import Ripple, strongest_order
from pipeline.logs.signals.two_sides import TwoSides, read_off

#: Ripple is looked for above this frequency, or above the cut-off where that is lower [Hz].
_ABOVE: Final = 30.0
#: Share of what a filter sees that must have the torque's sign.
_ONE_SIDE: Final = 0.98


def signal_findings(one: Prepared) -> list[Finding]:
    """One line for everything a log shows without a model."""
    found = Findings(one.log.name)
    if one.stamp_error > 0:
        detail = (
            f"time stamps are off by {1e3 * one.stamp_error:.2g} ms: at speed v a position is off "
            "by v times that"
        )
        verdict = "warning" if one.stamp_error > 0.05 * one.settings.dt else "ok"
        found.note("time_s", "stamp_error", one.stamp_error, "s", verdict, detail)
    for j, joint in enumerate(one.joints):
        speed, rate = one.fusion.weight[:, j]
        if speed > 0 or rate > 0:
            detail = f"has {100 * speed:.0f} % of the say in speed, {100 * rate:.0f} % in "
            detail += "acceleration; the position's rate has the rest, by their noises"
            found.note(column_name(joint, "velocity"), "fused", speed, "1", "ok", detail)
    for joint, seen in two_sides(one).items():
        _say_sides(found, joint, seen, one.unit)
    for joint, ripple in ripples(one).items():
        detail = (
            f"repeats {ripple.order:.4g} times per turn with {ripple.amplitude:.3g} {one.unit}, "
            "above the cut-off; seen over the angle at the log's full bandwidth"
        )
        column = column_name(joint, one.channel)
        found.note(column, "ripple", ripple.amplitude, one.unit, "ok", detail)
    return found


def two_sides(one: Prepared) -> dict[str, TwoSides]:
    """Joint to what its two positions tell, where it has two and a torque shows it."""
    motor = one.other.get("motor_position")
    if motor is None or one.log.position_source != "joint":
        return {}
    out = {}
    for j, joint in enumerate(one.joints):
        good = np.isfinite(motor[:, j])
        if good.mean() < 0.5 or not np.isfinite(one.noise[j]):
            continue
        filled = np.interp(one.time, one.time[good], motor[good, j])
        ahead = one.lowpass(filled[:, None])[:, 0] - one.q[:, j]
        rest = 3.0 * float(one.fusion.noise[0, j])
        # While the filter sees the torque change sides, a step is no step yet.
        side = one.lowpass(np.sign(one.effort[:, [j]]))[:, 0]
        good = one.mask[:, j] & (np.abs(side) > _ONE_SIDE)
        seen = read_off(ahead, one.effort[:, j], one.v[:, j], good, float(one.noise[j]), rest)
        if seen is not None:
            out[joint] = seen
    return out


def ripples(one: Prepared) -> dict[str, Ripple]:
    """Joint to the ripple that stands out above the cut-off, where one does."""
    cutoff = min(one.cutoff, _ABOVE)
    lowpass = LowPass(one.rate, cutoff)
    raw = one.unfiltered_effort()
    rest = raw - lowpass.smooth(raw, one.pieces)
    rest[~one.mask] = np.nan
    found = {
        joint: strongest_order(rest[:, j], one.q[:, j], one.v[:, j], one.rate)
        for j, joint in enumerate(one.joints)
    }
    return {joint: ripple for joint, ripple in found.items() if ripple is not None}


def _say_sides(found: Findings, joint: str, seen: TwoSides, unit: str) -> None:
    column = column_name(joint, "motor_position")
    if seen.elastic:
        k, low, high = seen.stiffness
        detail = f"winds up with the effort: {k:.4g} {unit}/rad ({low:.4g} to {high:.4g})"
        found.note(column, "elasticity", k, f"{unit}/rad", "ok", detail)
    if seen.plays:
        w, e = seen.width
        detail = f"plays {1e3 * w:.3g} mrad ({1e3 * (w - 1.96 * e):.3g} to "
        detail += f"{1e3 * (w + 1.96 * e):.3g}) as the effort changes sides"
        found.note(column, "play", w, "rad", "ok", detail)
    if not (seen.elastic or seen.plays):
        detail = f"motor and joint agree to {1e3 * seen.scatter:.2g} mrad under load"
        found.note(column, "rigid", seen.scatter, "rad", "ok", detail)
