"""Ground forces that cost the least electrical power of one actuator.

At every instant, over all forces that carry the robot, what is minimised is the power that the
supply gives: with P_j the electrical power of joint j that the actuator's chain gives for the known
motion and the joint's torque, the sum over joints of

    max(P_j, 0) + r min(P_j, 0),

r being the share of returned power that is used again: 0 under ``none``, the fraction, 1 on a bus,
where returns beyond what the other joints draw count as gain, too. Torque is where the forces come
in, through friction that grows with load and through R I^2; P_j is convex in it but for a motor
that brakes harder than gives most power back. The kinks of `power_law` (load that changes its
direction, P_j = 0) are rounded, and the rounded cost goes down by Newton's steps, each the minimum
of a convex quadratic model within the feet's bounds; then kinks are rounded less, until nothing is
left of it. What is found is taken where the chain itself draws less.

Electrical power of a joint as a function of its torque, read off an actuator's chain.

For a known motion every law of a chain is piecewise linear in torque: friction that grows with load
changes its slope where load changes its direction, and at rest a motor need not hold what friction
holds. So the motor's torque is

    m(torque) = m_0 + s torque + sum_i d_i max(torque - b_i, 0),

and a DC motor's power is a m^2 + b m. The chain is asked at torques that lie densest about zero;
where slopes differ on both sides of a cell, the lines beyond it are continued until they meet.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.shaft import ShaftSeries
from pipeline.dynamics.force_rules import Descent, JointDemand, Stance
from pipeline.machine.joint import Actuators
from pipeline.motion.motion import Segment

#: From torques to the motor's torque and electrical power, all shaped (n, Q).
Asked = Callable[[Array], tuple[Array, Array]]
_NODES = np.sinh(np.linspace(-7.0, 7.0, 33)) / np.sinh(7.0)
NOTHING = 1e-30  # in place of a width of zero
_SAME_SLOPE = 1e-6  # share of the steepest
Rows = NDArray[np.intp]
#: From the demand of bodies and ground to that on the actuators.
Adjust = Callable[[Segment, JointDemand], JointDemand]
#: Widths of rounded kinks, as shares of the largest torque of the standing legs at that instant.
_WIDTHS = (0.1, 0.01, 1e-3, 1e-4, 1e-5)
_REACH = 4.0  # the same share of it within which kinks are looked for
_ROUNDS = 12  # at each width
_HALVINGS = 8
_GAIN = 1e-6  # of the power: less is no progress


@dataclass(frozen=True)
class LeastPower:
    """The least electrical power that one actuator draws from its supply.

    Note:
        Joints whose motors are coupled count as if each drew power for its own torque alone; what
        is found is then lower than the start, not the least.
    """

    chain: Actuators  #: The actuator of every joint.
    recovered: float = 0.0  #: Share of returned power that is used again.
    #: Changes the demand on the actuators; see `pipeline.simulation.edited`.
    adjust: Adjust | None = None
    name: str = "least_power"  #: Of the rule.

    def forces(self, stance: Stance) -> Array:
        """Forces on the standing feet in the ground's frame [N], shape (N, K, 3)."""
        descent, power = Descent(stance), PowerOfJoints(self, stance)
        force, free = np.array(stance.force), descent.free
        largest = np.abs(stance.loaded_torque(force[free], free)).max(axis=1, initial=0.0)
        largest = np.maximum(largest, NOTHING)[:, None]
        law = power.law(free, _REACH * largest)
        for width in _WIDTHS:
            left = np.arange(free.size)
            for _ in range(_ROUNDS):
                rows = free[left]
                moved, better = _improved(
                    descent, stance, law.of(left), rows, force[rows], width * largest[left]
                )
                force[rows] = moved
                left = left[better]
                if not left.size:
                    break
        worse = power.total(free, force[free]) > power.total(free, stance.force[free])
        force[free[worse]] = stance.force[free[worse]]
        return force


def _improved(
    descent: Descent, stance: Stance, law: PowerLaw, rows: Rows, force: Array, width: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """One step at each of some samples: forces, and where the rounded cost went down."""
    cost, slope, curvature = law.smoothed(stance.loaded_torque(force, rows), width)
    change = descent.step(rows, force, slope, np.maximum(curvature, 0.0)) - force
    least, enough = cost.sum(axis=1), _GAIN * np.abs(cost).sum(axis=1)
    moved, better = np.array(force), np.zeros(rows.size, dtype=bool)
    for halving in range(_HALVINGS):
        left = np.flatnonzero(~better)
        if not left.size:
            break
        tried = force[left] + 0.5**halving * change[left]
        own = law if left.size == rows.size else law.of(left)
        lower = own.smoothed(stance.loaded_torque(tried, rows[left]), width[left])[0].sum(axis=1)
        taken = lower < least[left] - enough[left]
        moved[left[taken]] = tried[taken]
        better[left[taken]] = True
    return moved, better


class PowerOfJoints:
    """What the supply gives to every joint at some samples of a segment, for any torque."""

    def __init__(self, rule: LeastPower, stance: Stance) -> None:
        self._rule, self._stance, self._loaded = rule, stance, stance.loaded
        d = stance.demand
        self._series = ShaftSeries.at_joint(
            d.joints, d.time, d.position, d.velocity, d.acceleration, d.torque
        )
        self._torque, self._beside = d.torque, np.zeros_like(d.torque)
        if rule.adjust is not None:  # springs and ripples in parallel with the motors
            self._beside = rule.adjust(stance.segment, d).torque - d.torque

    def at(self, rows: Rows, torque: Array) -> Array:
        """Power out of the supply for torques of the standing legs' joints, shape (n, Q) [W]."""
        _, electrical = self._asked(rows, torque)
        share = self._rule.recovered
        return np.maximum(electrical, 0.0) + share * np.minimum(electrical, 0.0)

    def total(self, rows: Rows, force: Array) -> Array:
        """Power out of the supply for foot forces, shape (n,) [W]."""
        return np.asarray(self.at(rows, self._stance.loaded_torque(force, rows)).sum(axis=1))

    def law(self, rows: Rows, reach: Array) -> PowerLaw:
        """Of the standing legs' joints."""
        shape = (rows.size, self._loaded.size)
        return power_law(lambda legs: self._asked(rows, legs), reach, shape, self._rule.recovered)

    def _asked(self, rows: Rows, legs: Array) -> tuple[Array, Array]:
        """The motors' torque and electrical power at the standing legs' joints."""
        s = self._series
        torque = self._torque[rows] + self._beside[rows]
        torque[:, self._loaded] = legs + self._beside[rows][:, self._loaded]
        side = ShaftSeries(
            s.joints,
            s.time[rows],
            s.position[rows],
            s.velocity[rows],
            s.acceleration[rows],
            torque,
            s.direction[rows],
        )
        result = self._rule.chain.inverse(side)
        return (
            result.motor.torque[:, self._loaded],
            result.electrical_power[:, self._loaded],
        )


@dataclass(frozen=True)
class PowerLaw:
    """Power of many joints and instants, each with its own numbers, shape (n, Q)."""

    start: Array  #: m_0 [N*m].
    slope: Array  #: s, left of all kinks [1].
    kink: Array  #: b_i [N*m], shape (n, Q, I).
    bend: Array  #: d_i [1], shape (n, Q, I).
    quadratic: Array  #: a [W/(N*m)^2].
    linear: Array  #: b [W/(N*m)].
    recovered: float  #: Share of returned power that is used again.

    def of(self, rows: NDArray[np.intp]) -> PowerLaw:
        """Some of the instants."""
        return PowerLaw(
            self.start[rows],
            self.slope[rows],
            self.kink[rows],
            self.bend[rows],
            self.quadratic[rows],
            self.linear[rows],
            self.recovered,
        )

    def smoothed(
        self, torque: Array, width: Array, width_of_power: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """Power out of the supply with kinks rounded, and its two derivatives.

        Each max(x, 0) becomes (x + sqrt(x^2 + w^2)) / 2, which is convex and lies above it by at
        most w / 2. `torque`: (n, Q) [N*m]. `width`: w of the kinks, (n, 1) [N*m]. `width_of_power`:
        w where power changes its sign, (n, 1) [W]; what `width` makes of it by default.
        """
        ramp, step, peak = _rounded(torque[..., None] - self.kink, width[..., None])
        motor = self.start + self.slope * torque + (self.bend * ramp).sum(axis=-1)
        motor_1 = self.slope + (self.bend * step).sum(axis=-1)
        motor_2 = (self.bend * peak).sum(axis=-1)
        power = (self.quadratic * motor + self.linear) * motor  # [W]
        by_motor = 2 * self.quadratic * motor + self.linear
        power_1 = by_motor * motor_1
        power_2 = 2 * self.quadratic * motor_1**2 + by_motor * motor_2
        lost = 1.0 - self.recovered
        if not lost:
            return power, power_1, power_2
        if width_of_power is None:
            steepest = np.abs(power_1).max(axis=1, keepdims=True)
            width_of_power = np.maximum(width * steepest, NOTHING)
        ramp, step, peak = _rounded(power, width_of_power)
        share = self.recovered + lost * step
        return (
            self.recovered * power + lost * ramp,
            share * power_1,
            share * power_2 + lost * peak * power_1**2,
        )


def power_law(asked: Asked, reach: Array, shape: tuple[int, ...], recovered: float) -> PowerLaw:
    """Read the law of torques shaped (n, Q) off a chain.

    `reach`: largest torque of interest at each instant, (n, 1) [N*m]. `recovered`: share of
    returned power that is used again.
    """
    torque = [np.broadcast_to(node * reach, shape) for node in _NODES]
    answers = [asked(node) for node in torque]
    x = np.stack(torque, axis=-1)
    motor, power = (np.stack(parts, axis=-1) for parts in zip(*answers, strict=True))
    slopes = np.diff(motor, axis=-1) / np.diff(x, axis=-1)
    bend = np.diff(slopes, axis=-1)
    bend[np.abs(bend) <= _SAME_SLOPE * np.abs(slopes).max(axis=-1, keepdims=True)] = 0.0
    kink = np.array(x[..., 1:-1])
    for i in range(bend.shape[-1] - 1):  # a kink within a cell shows at both its ends
        one, two = bend[..., i], bend[..., i + 1]
        both = one * two > 0
        total = np.where(both, one + two, 1.0)
        meet = (one * kink[..., i] + two * kink[..., i + 1]) / total
        kink[..., i + 1] = np.where(both, meet, kink[..., i + 1])
        bend[..., i + 1] = np.where(both, one + two, two)
        bend[..., i] = np.where(both, 0.0, one)
    most = max(1, int((bend != 0).sum(axis=-1).max()))
    order = np.argsort(-np.abs(bend), axis=-1)[..., :most]
    quadratic, linear = _of_motor(motor, power)
    return PowerLaw(
        motor[..., 0] - slopes[..., 0] * x[..., 0],
        slopes[..., 0],
        np.take_along_axis(kink, order, axis=-1),
        np.take_along_axis(bend, order, axis=-1),
        quadratic,
        linear,
        recovered,
    )


def _of_motor(motor: Array, power: Array) -> tuple[Array, Array]:
    """Coefficients of power = a m^2 + b m, from two torques that are neither zero nor equal."""

    def at(values: Array, pick: NDArray[np.intp]) -> Array:
        return np.asarray(np.take_along_axis(values, pick[..., None], axis=-1)[..., 0])

    first = np.abs(motor).argmax(axis=-1)
    m = at(motor, first)
    second = np.abs(motor * (motor - m[..., None])).argmax(axis=-1)
    other = at(motor, second)
    one, two = at(power, first), at(power, second)
    apart = m * other * (m - other)
    usable = apart != 0
    quadratic = np.where(usable, (one * other - two * m) / np.where(usable, apart, 1.0), 0.0)
    linear = np.where(m != 0, one / np.where(m != 0, m, 1.0) - quadratic * m, 0.0)
    return quadratic, linear


def _rounded(x: Array, width: Array) -> tuple[Array, Array, Array]:
    """A ramp with its corner rounded, and two derivatives."""
    root = np.sqrt(x * x + width * width)
    return 0.5 * (x + root), 0.5 * (1.0 + x / root), 0.5 * (width / root) ** 2 / root
