"""Wrong columns in words, with the lines of a mapping file that mend them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from pipeline.logs.checks import DEG, WRONG
from pipeline.logs.columns.explaining import Hypothesis, Reading, as_named
from pipeline.logs.columns.search import Mended
from pipeline.logs.errors import Finding
from pipeline.logs.log_format import column_name
from pipeline.logs.plan import AS_NAMED
from pipeline.logs.read import Recording

#: Check under which a suspicion stands that no fit may explain away.
SUSPECTED: Final = "columns"
#: Relative distance from a factor that has a name, within which a factor is taken for it.
_NEAR: Final = 1.4
_ROUNDED: Final = 1e-9
_OF_EFFORTS: Final = ("sign", "exchanged", "scale", "late")


def column_findings(log: Recording, mended: Mended, ratio: Array | None) -> list[Finding]:
    """What the search found, one finding per step, with the line of a mapping file that mends it.

    From motion alone torques that are all too large by a factor, and bodies that are all too light
    by it, look the same.

    Args:
        log: Of the logs that were searched together, the first.
        mended: From `search`.
        ratio: Gear ratios, shape (J,), or None.
    """
    channel, joints = log.effort, log.joints
    if mended.pushed:
        detail = (
            f"the {channel}s follow where the ends of the machine are pushed up, as by the ground: "
            "contact forces are missing in a machine on a fixed base; write a robot file with legs "
            'and base = "level"'
        )
        return [Finding(log.name, "", SUSPECTED, mended.pushed, "1", "suspected", detail)]
    named = [(h, *_named(h, channel, ratio)) for h, _ in mended.steps]
    last = as_named(len(joints))  # the reading that all steps with their named sizes make
    for h, size, _ in named:
        last = h.resized(size, last).reading
    out = []
    for (h, size, what), (_, gain) in zip(named, mended.steps, strict=True):
        live = int(np.isfinite(mended.before).sum())
        common = h.cause == "scale" and len(h.joints) == live and not what
        own = (x[list(h.joints)] for x in (mended.before, mended.after))
        before, after = (f"{100.0 * float(np.sqrt(np.mean(x**2))):.0f} %" for x in own)
        of = channel if h.cause in _OF_EFFORTS else log.position_quantity
        lines = "; ".join(_lines(log, last, h, joints))
        seen = (
            f"else every body is {size:.3g} times as heavy as the robot's file says"
            if common
            else f"the motion leaves {before} of the {channel} unexplained as logged, {after} so"
        )
        detail = f"{_words(h, size, joints, channel)}{what}: {seen}; in a mapping file: {lines}"
        column = "" if len(h.joints) == live > 1 else column_name(joints[h.joints[0]], of)
        out.append(Finding(log.name, column, SUSPECTED, gain, "1", "suspected", detail))
    return out


def explained(beyond: Sequence[Finding], named: Sequence[Finding]) -> list[Finding]:
    """Positions beyond their limits, with what the motion says of their columns, each once.

    Findings of `column_findings` are of all joints together where they name no column.
    """
    out: dict[str, Finding] = {}
    for k, f in enumerate(beyond):
        said = [n for n in named if n.column in ("", f.column) and "position" in n.detail]
        detail = f"{f.detail.split(': ')[0]}: {said[0].detail}" if said else f.detail
        out.setdefault(said[0].detail if said else f"{k}", replace(f, detail=detail))
    return list(out.values())


def copy_findings(log: Recording, copied: Mapping[int, float]) -> list[Finding]:
    """Efforts that are velocities under a wrong name: joint's column to its factor."""
    out = []
    for j, factor in copied.items():
        joint, column = log.joints[j], column_name(log.joints[j], log.effort)
        detail = (
            f"is {factor:.4g} times the velocity and nothing else, though its bodies ask for a "
            f"{log.effort}: a velocity under a wrong name; in a mapping file: "
            f'columns."{_file_column(log, joint, log.effort)}" = '
            f'{{as = "{column_name(joint, "velocity")}"}}, or leave it out'
        )
        out.append(Finding(log.name, column, SUSPECTED, factor, "1", "suspected", detail))
    return out


def _named(h: Hypothesis, channel: str, ratio: Array | None) -> tuple[float, str]:
    """Size, and what it is: a unit or a gear ratio where it is near one."""
    known: dict[float, str] = {}
    if h.cause == "scale":
        known = {f: f", it is in {unit}" for f, unit in WRONG[channel].items()}
    elif h.cause == "position_scale":
        known = {DEG: ", it is in degrees"}
    of = {abs(float(ratio[j])) for j in h.joints} if ratio is not None else set()
    if len(of) == 1 and h.cause in ("scale", "position_scale"):
        one = of.pop()
        known[1.0 / one if h.cause == "scale" else one] = ", it is that of the motor"
    for factor, what in known.items():
        if factor / _NEAR < h.size < factor * _NEAR:
            return factor, what
    return float(f"{h.size:.2g}"), ""


def _words(h: Hypothesis, size: float, joints: Sequence[str], channel: str) -> str:
    names = " and ".join(joints[j] for j in h.joints[:2])
    return {
        "sign": f"the sign of the {channel} is turned",
        "exchanged": f"the {channel}s of {names} are exchanged",
        "scale": f"the {channel} is {size:.3g} times what it should be",
        "late": f"the {channel} is {1e3 * size:.3g} ms late",
        "both_exchanged": f"{names} are exchanged, positions and {channel}s",
        "position_sign": "the sign of the position is turned",
        "position_scale": f"the position is {size:.3g} times what it should be",
        "position_zero": f"the zero of the position is {size:.2g} rad off",
    }[h.cause]


def _lines(log: Recording, r: Reading, h: Hypothesis, joints: Sequence[str]) -> list[str]:
    """Rules of a mapping file for the columns that one step is about."""
    position = log.position_quantity
    efforts = h.cause in _OF_EFFORTS or h.cause == "both_exchanged"
    own = all(
        _file_column(log, joints[j], position) == column_name(joints[j], position) for j in h.joints
    )
    if h.cause == "both_exchanged" and own:
        pairs = (f'{joints[r.position_of[j]]} = "{joints[j]}"' for j in h.joints)
        return [f"joints = {{{', '.join(pairs)}}}"]
    out = []
    for j in sorted(h.joints):
        if efforts:
            change = (float(r.effort_factor[j]), 0.0, float(r.late[j]))
            out.append(_line(log, log.effort, joints[r.effort_of[j]], joints[j], change))
        if h.cause not in _OF_EFFORTS:
            change = (float(r.position_factor[j]), float(r.zero[j]), 0.0)
            out.append(_line(log, position, joints[r.position_of[j]], joints[j], change))
    quantity = log.effort if efforts else position
    ending = column_name("", quantity)
    alike = {keys for _, keys in out}
    if len(alike) == 1 and 1 < len(out) == len(joints) and all(c.endswith(ending) for c, _ in out):
        out = [(column_name("*", quantity), alike.pop())]
    return [f'columns."{column}" = {{{keys}}}' for column, keys in out]


def _file_column(log: Recording, joint: str, quantity: str) -> str:
    return log.rules[joint, quantity][0] if log.rules else column_name(joint, quantity)


def _line(
    log: Recording, quantity: str, source: str, target: str, change: tuple[float, float, float]
) -> tuple[str, str]:
    """Column of the file and the keys of its rule, after a further factor, zero and delay."""
    factor, zero, late = change
    column, wanted = _file_column(log, source, quantity), column_name(target, quantity)
    rule = log.rules[source, quantity][1] if log.rules else AS_NAMED
    slope = rule.affine("rad" if quantity.endswith("position") else log.unit)[0]
    zero, unit = rule.zero - zero / (factor * slope), rule.unit
    scale = factor * (-rule.scale if rule.flip else rule.scale)
    if unit is None and abs(abs(factor) * DEG - 1.0) < _ROUNDED and quantity.endswith("position"):
        scale, unit = scale * DEG, "deg"
    keys = {
        f'as = "{wanted}"': column != wanted,
        f'unit = "{unit}"': unit is not None,
        f"zero = {zero:.4g}": zero != 0.0,
        f"scale = {abs(scale):.4g}": abs(abs(scale) - 1.0) > _ROUNDED,
        "flip = true": scale < 0.0,
        f"late = {rule.late + late:.3g}": rule.late + late != 0.0,
    }
    return column, ", ".join(key for key, needed in keys.items() if needed)
