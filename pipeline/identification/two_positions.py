"""Elasticity and backlash of joints whose log holds motor and joint position, read off the two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from pipeline.effects.model_file import Edit
from pipeline.identification.results import Found
from pipeline.logs.log import TEST, Log
from pipeline.logs.windup import TwoSides, two_sides
from pipeline.machine.machine import MachineModel
from pipeline.simulation.predict import Simulator

#: Why the gap in torque has no say: the torque hardly shows it.
READ_OFF: Final = "read off two positions"
#: Standard errors in half of a 95 % interval.
_COVER: Final = 1.96
#: Stiffness of what does not bend [N*m/rad].
_RIGID: Final = 1e12
#: Torque over which a joint passes from one flank to the other, of the largest seen [1].
_CROSSING: Final = 0.05


def read_off_two(
    model: MachineModel,
    measurements: Sequence[Log],
    first: int,
) -> tuple[Found, ...]:
    """Findings of the logs that may be learnt from; test rows are not looked at.

    Args:
        model: With all that was named: friction does not deflect what lies behind it.
        measurements: Logs.
        first: Number of the first finding.
    """
    out: dict[str, Found] = {}
    for one in measurements:
        known = (one.part >= 0) & (one.part != TEST)
        if one.channels[0] != "torque" or not known.any() or one.windup is None:
            continue
        learnt = replace(one, mask=one.mask & known[:, None])
        plain, behind = two_sides(learnt), two_sides(_behind_friction(learnt, model))
        for joint, seen in behind.items():
            largest = float(np.nanmax(np.abs(one.effort[known, one.joints.index(joint), 0])))
            found = _found(joint, _wider(seen, plain.get(joint, seen)), largest)
            if found is not None and joint not in out:
                out[joint] = found
    return tuple(replace(f, order=first + k) for k, f in enumerate(out.values()))


def _behind_friction(one: Log, model: MachineModel) -> Log:
    """A log whose torques are those behind the friction in them."""
    prediction = Simulator(one).predict(model)
    friction = prediction.effort[..., 0] - prediction.torque
    return replace(one, effort=one.effort - one.smooth(friction)[..., None])


def _wider(seen: TwoSides, plain: TwoSides) -> TwoSides:
    """With half of what friction changes as an error, too: its law is none that holds exactly."""
    (c, c_error), (w, w_error) = seen.compliance, seen.width
    c_error = float(np.hypot(c_error, 0.5 * abs(c - plain.compliance[0]) / _COVER))
    if np.isfinite(plain.width[0]):
        w_error = float(np.hypot(w_error, 0.5 * abs(w - plain.width[0]) / _COVER))
    return replace(seen, compliance=(c, c_error), width=(w, w_error))


def _found(joint: str, seen: TwoSides, largest: float) -> Found | None:
    if not (seen.plays or seen.elastic):
        return None
    rigid = (_RIGID,) * 3
    value, *ends = np.clip(seen.stiffness, 1.0, _RIGID).tolist() if seen.elastic else rigid
    parameters = {"stiffness": {"value": value, "unit": "N*m/rad", "interval": tuple(ends)}}
    if seen.plays:
        width, error = (float(x) for x in seen.width)
        ends = [max(width - _COVER * error, 0.0), width + _COVER * error]
        parameters["width"] = {"value": width, "unit": "rad", "interval": tuple(ends)}
        parameters["crossing"] = {"value": _CROSSING * largest, "unit": "N*m"}
    name = "backlash" if seen.plays else "joint_elasticity"
    edit = Edit.model_validate({"effect": name, "place": (joint,), "parameters": parameters})
    return Found(order=0, edits=(edit,), law=READ_OFF)
