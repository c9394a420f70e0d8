"""What a regression found beside bodies, friction and couplings, in the catalogue's words."""

from __future__ import annotations

from typing import Final

import numpy as np

from pipeline.effects.base import CHANNEL_COLUMNS, Place
from pipeline.identification.results import Estimate, Member
from pipeline.identification.whole.told import Told, estimate, exact
from pipeline.machine.machine import MachineModel
from pipeline.regression import Result
from pipeline.regression.laws.extras import EVERY, MECHANICAL, Extra, Kind
from pipeline.regression.laws.friction import LAW
from pipeline.regression.result import Beside, Level

#: Effects of the catalogue by what a regression calls them.
EFFECTS: Final = {
    Kind.SPRING: "parallel_spring",
    Kind.RIPPLE: "torque_ripple",
    Kind.ZERO: "position_offset",
    Kind.GAIN: "effort_gain",
    Kind.LATE: "time_delay",
    Kind.WIND: "joint_elasticity",
    Kind.PLAY: "backlash",
}
#: Share of the largest torque within which play changes sides.
CROSSING: Final = 0.05
_COVER: Final = 1.96
_RIVALS: Final = "another effect predicts as well in some draws of the log's blocks"


def kinds_of(channel: str, *, at_motor: bool) -> frozenset[Kind]:
    """What a log can show beside bodies, friction and couplings.

    Args:
        channel: That is compared; a current's scale is that of a motor's torque constant.
        at_motor: Whether the encoders sit on the motors.
    """
    out = set(MECHANICAL)
    if channel == "torque":
        out.add(Kind.GAIN)
    if at_motor:
        out |= {Kind.WIND, Kind.PLAY}
    return frozenset(out)


def names_of(kinds: frozenset[Kind]) -> frozenset[str]:
    """Effects of the catalogue that these are."""
    return frozenset(EFFECTS[k] for k in kinds if k in EFFECTS)


def besides(result: Result, model: MachineModel, channel: str) -> list[Told]:
    """Extras that have a name."""
    out = []
    for one in result.extras:
        if not one.extra.named:
            continue
        place = place_of(one.extra, result, channel)
        level = str(one.level)
        member = Member(place, _parameters(one, result, model), level, one.share)
        rivals = tuple(
            (EFFECTS[r.kind], place_of(r, result, channel)) for r in one.rivals if r.named
        )
        out.append(Told(EFFECTS[one.extra.kind], "", _RIVALS, (member,), rivals))
    return out


def place_of(extra: Extra, result: Result, channel: str) -> Place:
    """Where an extra is, as the catalogue calls it."""
    names = [f.joint for f in result.friction]
    if extra.joint == EVERY or (extra.kind is Kind.LATE and len(names) == 1):
        return ("effort channels",)
    joint = names[extra.joint]
    if extra.kind is Kind.GAIN:
        return (f"{joint}__{CHANNEL_COLUMNS[channel]}",)
    return (joint,)


def unnamed(result: Result) -> list[str]:
    """What was found that no catalogue has a name for, in words."""
    names = [f.joint for f in result.friction]
    words = {
        Kind.CURVE: "a torque over its position that is no spring and no ripple",
        Kind.DRAG: "friction that changes with its position",
    }
    return [
        f"{names[one.extra.joint]} has {words[one.extra.kind]}; no law of the catalogue holds it, "
        "and it is not in the model"
        for one in result.extras
        if not one.extra.named and one.level is not Level.SUSPECTED
    ]


def preloads(result: Result) -> dict[str, float]:
    """Torque at angle zero of joints with a spring: the offset there is the spring's [N*m]."""
    offsets = {t.place: t.value for t in result.terms if t.term == "offset"}
    names = [f.joint for f in result.friction]
    return {
        names[one.extra.joint]: offsets.get(names[one.extra.joint], 0.0)
        for one in result.extras
        if one.extra.kind is Kind.SPRING
    }


def _parameters(one: Beside, result: Result, model: MachineModel) -> tuple[Estimate, ...]:
    kind, x, half = one.extra.kind, float(one.values[0]), float(one.halves[0])
    if kind is Kind.RIPPLE:
        return _ripple(one)
    if kind is Kind.SPRING:
        preload = preloads(result)[result.friction[one.extra.joint].joint]
        rest = -preload / x if x else 0.0
        spread = abs(rest) * half / max(abs(x), 1e-12)
        return (
            estimate("stiffness", x, half, "N*m/rad", low=-1e4, high=1e4),
            estimate("rest", float(np.clip(rest, -1e3, 1e3)), spread, "rad", low=-1e3, high=1e3),
        )
    if kind is Kind.GAIN:
        # That friction has the law it is told to have is a claim about the scale, too.
        half = float(np.hypot(half, _COVER * LAW * (1.0 + x)))
        return (estimate("gain", 1.0 + x, half, "1", low=0.01, high=100.0),)
    if kind is Kind.LATE:
        return (estimate("delay", x, half, "s", low=-0.5, high=0.5),)
    if kind is Kind.ZERO:
        return (estimate("angle", x, half, "rad", low=-1.6, high=1.6),)
    if kind is Kind.WIND:
        low, high = 1.0 / (x + half), 1.0 / max(x - half, 1e-12)
        return (Estimate("stiffness", min(1.0 / max(x, 1e-12), 1e12), low, high, "N*m/rad"),)
    crossing = CROSSING * _largest(model)
    return (
        estimate("width", x, half, "rad", low=0.0, high=1.0),
        exact("stiffness", 1e12, "N*m/rad"),
        exact("crossing", crossing, "N*m"),
    )


def _largest(model: MachineModel) -> float:
    """Torque of a machine's weight at a tenth of a metre, for want of the log's own [N*m]."""
    mass = sum(float(i.mass) for i in list(model.rigid.inertias)[1:])
    return max(9.81 * mass * 0.1, 1e-3)


def _ripple(one: Beside) -> tuple[Estimate, ...]:
    """Amplitude and phase of what the drive puts in: the actuator supplies so much less."""
    sine, cosine = -one.values
    amplitude = float(np.hypot(sine, cosine))
    phase = float(np.arctan2(cosine, sine))
    half = float(np.hypot(*(one.halves * one.values))) / max(amplitude, 1e-12)
    turn = min(half / max(amplitude, 1e-12), np.pi)
    return (
        estimate("amplitude", amplitude, half, "N*m", low=0.0, high=1e3),
        exact("order", one.extra.order, "1"),
        estimate("phase", phase, turn, "rad", low=-10.0, high=10.0),
    )
