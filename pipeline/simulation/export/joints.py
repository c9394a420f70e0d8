"""A joint's drivetrain in the few numbers that other tools have for it, and what these leave out.

The laws of the drivetrain are asked along speeds from slow to fast, without load: of what it takes,

    f(v) = c sign(v) + d v + rest,

`c` (dry friction) and `d` (viscous friction) are carried over, in least squares; what `rest` comes
to is reported, as are load, elasticity and everything else that these tools have no number for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from actuators.arrays import Array
from actuators.shaft import ShaftSeries
from pipeline.machine.joint import JointModel
from pipeline.machine.machine import MachineModel

#: Speed to which friction is asked where a joint has no limit [rad/s].
USUAL_SPEED: Final = 10.0
#: Slowest speed that is asked, over the largest.
_SLOWEST: Final = 0.01
_SPEEDS: Final = 100
#: Share of a law, and a torque [N*m], below which a remainder is rounding.
_ROUNDING: Final = 1e-6


@dataclass(frozen=True)
class JointNumbers:
    """What a joint's drivetrain comes to at the joint's side."""

    joint: str  #: Its name.
    friction: float  #: Dry friction [N*m].
    damping: float  #: Viscous friction [N*m*s/rad].
    armature: float  #: Inertia of rotor and gears [kg*m^2].
    stiffness: float  #: Of a spring beside the drive [N*m/rad].
    rest: float  #: Where that spring gives no torque [rad].
    effort: float  #: The joint's limit [N*m]; infinite for none.
    left: tuple[str, ...]  #: What these numbers leave out, in words.


def joint_numbers(machine: MachineModel) -> tuple[JointNumbers, ...]:
    """The numbers of every joint."""
    return tuple(_numbers(machine, a) for a in machine.actuators)


def _numbers(machine: MachineModel, a: JointModel) -> JointNumbers:
    joint = machine.rigid.joints[machine.rigid.getJointId(a.name)]
    speed = float(machine.rigid.velocityLimit[joint.idx_v])
    speed = speed if 0.0 < speed < 1e3 else USUAL_SPEED
    v = np.linspace(_SLOWEST * speed, speed, _SPEEDS)
    forth, back = _torque(a, v), -_torque(a, -v)
    even = 0.5 * (forth + back)
    design = np.stack([np.ones_like(v), v], axis=1)
    c, d = np.linalg.lstsq(design, even, rcond=None)[0]
    if c < 0.0 or d < 0.0:  # the tools refuse them
        c, d = (0.0, max(float(v @ even / (v @ v)), 0.0)) if c < 0.0 else (float(even.mean()), 0.0)
    left = []
    missed = float(np.abs(even - c - d * v).max())
    if missed > _ROUNDING * max(1.0, float(np.abs(even).max())):
        left.append(
            f"friction bends with speed: up to {missed:.3g} N*m off below {speed:.3g} rad/s"
        )
    skew = float(np.abs(forth - back).max())
    if skew > _ROUNDING:
        left.append(f"friction differs by direction, by up to {skew:.3g} N*m")
    armature = float(_torque(a, v[-1:], acceleration=1.0)[0] - forth[-1])
    load = max(1.0, float(even.max()))
    rubbed = _torque(a, v[-1:], load=load)[0] - load - forth[-1]
    if abs(rubbed) > _ROUNDING:
        left.append(f"friction grows with load, by {rubbed / load:.3g} of it")
    stiffness, rest, odd = _spring(machine, a)
    limit = float(machine.rigid.effortLimit[joint.idx_v])
    left += odd
    if a.compliance:
        left.append(f"elasticity of the transmission, {1.0 / a.compliance:.4g} N*m/rad")
    if a.backlash:
        left.append(f"backlash of {a.backlash:.3g} rad")
    if a.coupled_to:
        left.append(f"its motor turns with {a.coupled_to}, too ({a.coupling:.4g} of it)")
    if a.heating is not None:
        left.append("warming of the motor")
    if a.warming is not None:
        left.append("friction that falls as it warms")
    if a.motor is not None:
        left.append("the motor's current, voltage and power")
    return JointNumbers(
        joint=a.name,
        friction=float(c),
        damping=float(d),
        armature=armature,
        stiffness=stiffness,
        rest=rest,
        effort=limit if 0.0 < limit < 1e6 else np.inf,
        left=tuple(left),
    )


def _torque(a: JointModel, v: Array, *, acceleration: float = 0.0, load: float = 0.0) -> Array:
    """What the motor gives at the joint side along steady speeds (N,) [rad/s], (N,) [N*m]."""
    side = ShaftSeries(
        joints=(a.name,),
        time=np.arange(v.size, dtype=np.float64),
        position=np.zeros((v.size, 1)),
        velocity=v[:, None],
        acceleration=np.full((v.size, 1), acceleration),
        torque=np.full((v.size, 1), load),
        direction=np.sign(v)[:, None],
    )
    whole = replace(a, coupled_to="")  # own bearings, too, where the motor turns with another joint
    return np.asarray(whole.at_motor(side).torque[:, 0] * a.ratio)


def _spring(machine: MachineModel, a: JointModel) -> tuple[float, float, tuple[str, ...]]:
    """Stiffness and rest of what depends on the position, and what that leaves out."""
    if not a.position_torques:
        return 0.0, 0.0, ()
    q = np.linspace(-np.pi, np.pi, 361)
    torque = a.drive_load(q, np.zeros_like(q))
    k, preload = np.polyfit(q, torque, 1)
    missed = float(np.abs(torque - k * q - preload).max())
    left = (f"ripple of up to {missed:.3g} N*m over the angle",) if missed > _ROUNDING else ()
    # Without a slope there is no spring, however far its rest would lie.
    if abs(k) < _ROUNDING:
        return 0.0, 0.0, (*left, f"a constant torque of {preload:.3g} N*m") if preload else left
    return float(k), float(-preload / k), left


def left_out(machine: MachineModel, numbers: Sequence[JointNumbers]) -> list[str]:
    """What the numbers of all joints leave out, joints with the same words together."""
    by: dict[str, list[str]] = {}
    for joint in numbers:
        for words in joint.left:
            by.setdefault(words, []).append(joint.joint)
    every = len(numbers)
    out = [
        f"{'all joints' if len(joints) == every > 1 else ', '.join(joints)}: {words}"
        for words, joints in by.items()
    ]
    sensors = [
        a.name
        for a in machine.actuators
        if a.encoder_offset or a.effort_offset or a.delay or a.gains
    ]
    if sensors:
        out.append(f"{', '.join(sensors)}: zeros, gains and delays are the sensors'")
    if machine.bodies.squeeze:
        out.append(f"feet that squeeze the ground, {machine.bodies.squeeze:.3g} N")
    return out
