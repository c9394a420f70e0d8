"""Wrong columns in words, with the lines of a mapping file that mend them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from pipeline.identification.wrong_columns import DEG, Gate, Reading, Step, changed
from pipeline.logs.log import EFFORTS, Finding, Log, Recording, column_name
from pipeline.logs.read import AS_NAMED
from pipeline.machine.machine import MachineModel

#: Check under which a suspicion stands that no fit may explain away.
SUSPECTED: Final = "columns"
#: ... and under which a factor that is no unit does: bodies may be it, which a fit can show.
SIZE: Final = "size"
_ROUNDED: Final = 1e-9
_OF_EFFORTS: Final = ("sign", "exchanged", "scale", "late")


def wrong_columns(model: MachineModel, logs: Sequence[Log], recording: Recording) -> list[Finding]:
    """Columns that are not what they say, one finding each, with the line that mends it.

    Args:
        model: As its files say.
        logs: All logs of it.
        recording: The first of them as read, for the names in its file and ratios of gears.
    """
    gate = Gate(model, logs, recording.ratio, by_law=recording.effort in recording.derived)
    steps, last = gate.steps(), gate.named
    for step in steps:
        last = changed(last, step)
    judged = int(np.isfinite(gate.shares(gate.named)).sum())
    return [_finding(recording, step, last, judged) for step in steps]


def _finding(log: Recording, step: Step, last: Reading, judged: int) -> Finding:
    """One step; `last`: the reading that all steps make; `judged`: joints that were."""
    channel, joints = log.effort, log.joints
    names = " and ".join(joints[j] for j in step.joints[:2])
    size, left = step.size, f"{100.0 * step.before:.0f} %"
    words = {
        "sign": f"the sign of the {channel} is turned",
        "exchanged": f"the {channel}s of {names} are exchanged",
        "scale": f"the {channel} is {size:.3g} times what it should be",
        "late": f"the {channel} is {1e3 * size:.3g} ms late",
        "both_exchanged": f"{names} are exchanged, positions and {channel}s",
        "position_sign": "the sign of the position is turned",
        "position_scale": f"the position is {size:.3g} times what it should be",
        "position_zero": f"the zero of the position is {size:.2g} rad off",
        "servo": f"the {channel} by the servos' law is {size:.3g} times what the motion asks for "
        "at all joints: the servos' gains are suspected before nine effects are; in a mapping "
        f"file, kp and kd times {1.0 / size:.3g}",
        "pushed": f"the {channel}s follow where the ends of the machine are pushed up, as by the "
        "ground: contact forces are missing in a machine on a fixed base; write a robot file with "
        'legs and base = "level"',
        "lost": f"no reading of the columns explains the {channel}s, {left} of them is left with "
        "everything that bodies, friction and drag may do: the log of another robot, efforts of "
        "another log, or times that are none",
    }[step.cause]
    if step.cause in ("servo", "pushed", "lost"):
        return Finding(log.name, "", SUSPECTED, step.before, "1", "suspected", words)
    if step.what:
        words += f", {step.what}"
    if np.isfinite(step.after):
        words += f": the motion leaves {left} of the {channel} unexplained as logged, "
        words += f"{100.0 * step.after:.0f} % so"
    elif step.cause == "scale":
        words += ": else bodies are as many times heavier or lighter than the robot's file says"
        words += "" if step.what else ", or it is on the other side of a gear"
    of = channel if step.cause in _OF_EFFORTS else _position(log)
    every = len(step.joints) >= judged > 1
    column = "" if every else column_name(joints[step.joints[0]], of)
    detail = f"{words}; in a mapping file: {'; '.join(_lines(log, last, step))}"
    check = SIZE if step.cause == "scale" and not step.what else SUSPECTED
    return Finding(log.name, column, check, size, "1", "suspected", detail)


def _position(log: Recording) -> str:
    return "motor_position" if log.at_motor else "position"


def _lines(log: Recording, reading: Reading, step: Step) -> list[str]:
    """Rules of a mapping file for the columns that one step is about."""
    joints, efforts, rows = log.joints, step.cause in _OF_EFFORTS, reading[sorted(step.joints)]
    both, out = step.cause == "both_exchanged", list[tuple[str, str]]()
    for j, row in zip(sorted(step.joints), rows.tolist(), strict=True):
        effort, factor, late, position, scale, zero = row
        if efforts or both:
            out.append(_line(log, log.effort, joints[effort], joints[j], (factor, 0.0, late)))
        if not efforts:
            source, change = joints[position], (scale, zero, 0.0)
            out.append(_line(log, _position(log), source, joints[j], change))
    name = log.effort if efforts else _position(log)
    ending, alike = column_name("", name), {keys for _, keys in out}
    if len(alike) == 1 and 1 < len(out) == len(joints) and all(c.endswith(ending) for c, _ in out):
        out = [(column_name("*", name), alike.pop())]
    return [f'columns."{column}" = {{{keys}}}' for column, keys in out]


def _line(
    log: Recording, quantity: str, source: str, target: str, change: tuple[float, float, float]
) -> tuple[str, str]:
    """Column of the file and the keys of its rule, after a further factor, zero and delay."""
    factor, zero, late = change
    wanted, as_read = (column_name(joint, quantity) for joint in (target, source))
    column, rule = log.rules.get(column_name(source, quantity), (as_read, AS_NAMED))
    slope = rule.affine("rad" if quantity.endswith("position") else EFFORTS[quantity])[0]
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
