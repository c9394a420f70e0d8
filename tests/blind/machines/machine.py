"""A machine by its files, and what it is to do.

Fixed-base machines are drawn anew for every trial, each a bare URDF: a pendulum, a leg of three
joints, and an arm of six or seven whose axes, offsets, lengths and masses are all drawn, so that no
machine comes twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
import pinocchio as pin

from pipeline.robot.robot import Robot
from tests.blind.machines.plant import Array

FIXED: Final = ("pendulum", "leg", "arm")
#: Link lengths [m] and masses [kg] before they are drawn; an arm draws its number of joints.
_SIZES: Final = {
    "pendulum": ((0.4,), (1.2,)),
    "leg": ((0.1, 0.35, 0.35), (1.5, 1.2, 0.5)),
    "arm": ((0.2, 0.4, 0.3, 0.15, 0.12, 0.1, 0.08), (6.0, 5.0, 3.0, 2.0, 1.5, 1.0, 0.5)),
}
_AXES: Final = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}


@dataclass(frozen=True)
class Machine:
    """A machine as its files say."""

    name: str  #: One of `FIXED`, or ``"walk"`` for the hexapod.
    urdf: str  #: Text of the file; empty where `robot` has files of its own.
    model: pin.Model  #: Bodies.
    joints: tuple[str, ...]  #: Names of the columns.
    ratio: Array  #: Motor turns per joint turn, shape (J,).
    lengths: Array  #: Of the links [m], shape (J,).
    robot: Robot | None = None  #: The walking robot; None for a fixed base.


@dataclass(frozen=True)
class Course:
    """What links do, at uniform times, and what motors did for it."""

    time: Array  #: Shape (N,) [s].
    q: Array  #: Shape (N, J) [rad].
    v: Array  #: [rad/s].
    a: Array  #: [rad/s^2].
    motor: Array | None = None  #: Angle of the motors at the joint's side, shape (N, J) [rad].
    torque: Array | None = None  #: Of the motors at the joint's side, shape (N, J) [N*m].
    feet: Array | None = None  #: Normal forces, shape (N, L) [N]; None for a fixed base.
    #: Place, velocity and acceleration of a base that does not turn, each (N, 3).
    body: tuple[Array, Array, Array] | None = None
    stances: tuple[tuple[str, ...], ...] = ()  #: Legs that stand in every row.

    @property
    def dt(self) -> float:
        """Step [s]."""
        return float(self.time[1] - self.time[0])


def draw_chain(rng: np.random.Generator, name: str) -> Machine:
    """A fixed-base machine with axes, lengths, offsets, masses and gear ratios of its own."""
    lengths, masses = _SIZES[name]
    n = int(rng.integers(6, 8)) if name == "arm" else len(lengths)
    length = np.array(lengths[:n]) * rng.uniform(0.7, 1.35, n)
    mass = np.array(masses[:n]) * rng.uniform(0.6, 1.6, n)
    parts = ['<robot name="machine">', '  <link name="base"/>']
    parent, axis = "base", ""
    for k in range(n):
        # Upright axes are not followed by their like, which no log could tell apart.
        free = [other for other in "xyyz" if other != "z" or axis != "z"]
        axis = {"pendulum": "y", "leg": "xyy"[k % 3]}.get(name) or str(rng.choice(free))
        # A first upright axis leans, so that gravity acts on it.
        lean = rng.uniform(0.2, 0.6) if k == 0 and axis == "z" else 0.0
        reach, side = (length[k - 1], rng.uniform(-0.05, 0.05)) if k else (0.0, 0.0)
        radius, r = rng.uniform(0.02, 0.05), length[k]
        swing, spin = mass[k] * (r**2 / 12 + radius**2 / 4), mass[k] * radius**2 / 2
        x, y, z = rng.uniform(-0.02, 0.02), rng.uniform(-0.02, 0.02), -r * rng.uniform(0.35, 0.6)
        parts += [
            f'  <joint name="joint_{k + 1}" type="revolute">',
            f'    <parent link="{parent}"/><child link="link_{k + 1}"/>',
            f'    <origin xyz="0 {side:.6g} {-reach:.6g}" rpy="{lean:.6g} 0 0"/>',
            f'    <axis xyz="{_AXES[axis]}"/>',
            '    <limit lower="-2.9" upper="2.9" effort="1000" velocity="30"/>',
            "  </joint>",
            f'  <link name="link_{k + 1}"><inertial>',
            f'    <origin xyz="{x:.6g} {y:.6g} {z:.6g}"/><mass value="{mass[k]:.6g}"/>',
            f'    <inertia ixx="{swing:.6g}" iyy="{swing:.6g}" izz="{spin:.6g}"'
            ' ixy="0" ixz="0" iyz="0"/>',
            "  </inertial></link>",
        ]
        parent = f"link_{k + 1}"
    text = "\n".join([*parts, "</robot>", ""])
    model = pin.buildModelFromXML(text)
    joints = tuple(str(joint) for joint in list(model.names)[1:])
    return Machine(name, text, model, joints, rng.choice([30.0, 50.0, 100.0], n), length)


def true_bodies(machine: Machine, rng: np.random.Generator, off: float) -> pin.Model:
    """Bodies whose masses, centres, inertias are off the URDF's by half of `off` to `off` [1]."""
    model = machine.model.copy()
    for joint, length in zip(machine.joints, machine.lengths, strict=True):
        index = model.getJointId(joint)
        body = model.inertias[index]
        factor = 1.0 + rng.choice([-1.0, 1.0]) * rng.uniform(0.5 * off, off)
        way = rng.standard_normal(3)
        shift = way / np.linalg.norm(way) * rng.uniform(0.5 * off, off) * 0.5 * length
        spread = factor * rng.uniform(1.0 - off, 1.0 + off)
        model.inertias[index] = pin.Inertia(
            factor * body.mass, body.lever + shift, spread * body.inertia
        )
    return model


def tilted(model: pin.Model, roll: float, pitch: float) -> pin.Model:
    """The same machine on tilted ground [rad]; its frames stay with the ground."""
    out = model.copy()
    out.gravity.linear = pin.rpy.rpyToMatrix(roll, pitch, 0.0).T @ model.gravity.linear
    return out


def sines(rng: np.random.Generator, joints: int, duration: float, dt: float) -> Course:
    """Five sines per joint from 0.1 to 2 Hz about a drawn middle, from rest."""
    t = np.arange(round(duration / dt)) * dt
    q, v, a = (np.empty((t.size, joints)) for _ in range(3))
    for j in range(joints):
        w = 2 * np.pi * np.array([0.12, 0.3, 0.65, 1.1, 1.7]) * rng.uniform(0.85, 1.15, 5)
        size = np.array([1.0, 0.6, 0.3, 0.15, 0.07]) * rng.uniform(0.7, 1.3, 5)
        phase = rng.uniform(0, 2 * np.pi, 5)
        wave = np.sin(np.outer(t, w) + phase)
        scale = rng.uniform(0.5, 1.1) / np.abs(wave @ size).max()
        q[:, j] = rng.uniform(-0.5, 0.5) + scale * (wave @ size)
        v[:, j] = scale * (np.cos(np.outer(t, w) + phase) @ (size * w))
        a[:, j] = -scale * (wave @ (size * w**2))
    return Course(t, q, v, a)


def moves(
    rng: np.random.Generator,
    joints: int,
    duration: float,
    dt: float,
    *,
    speeds: tuple[float, float],
    rest: float,
    far: tuple[float, float],
) -> Course:
    """Polynomials of fifth order from place to place, each at a pace of its own.

    Bounds are those of a stroke's largest speed [rad/s] and length [rad], `rest` the longest pause
    between two [s].
    """
    t = np.arange(round(duration / dt)) * dt
    q, v, a = (np.zeros((t.size, joints)) for _ in range(3))
    for j in range(joints):
        here, start = float(rng.uniform(-0.5, 0.5)), 0
        while start < t.size:
            there = float(np.clip(here + rng.choice([-1, 1]) * rng.uniform(*far), -1.2, 1.2))
            speed, way = float(np.exp(rng.uniform(*np.log(speeds)))), there - here
            # A whole number of steps, so that every stroke ends at rest where the next begins.
            steps = max(int(np.ceil(max(1.875 * abs(way) / speed, 0.25) / dt)), 2)
            stop, length = min(start + steps, t.size), steps * dt
            s = np.arange(stop - start) / steps
            q[start:stop, j] = here + way * s**3 * (10 - 15 * s + 6 * s**2)
            v[start:stop, j] = way / length * 30 * s**2 * (1 - s) ** 2
            a[start:stop, j] = way / length**2 * 60 * s * (1 - s) * (1 - 2 * s)
            here, start = there, stop
            stop = min(start + round(rng.uniform(0, rest) / dt), t.size) if rest else start
            q[start:stop, j] = here
            start = stop
    return Course(t, q, v, a)


#: Strokes at many speeds one after the other, random via points with rests, and short quick moves
#: as steps through a reference filter.
MOTIONS: Final = {
    "sines": sines,
    "strokes": partial(moves, speeds=(0.15, 1.8), rest=0.0, far=(0.3, 1.3)),
    "rests": partial(moves, speeds=(0.3, 2.5), rest=0.6, far=(0.2, 1.3)),
    "steps": partial(moves, speeds=(1.0, 3.0), rest=0.4, far=(0.1, 0.6)),
}
