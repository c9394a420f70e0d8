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
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.shaft import ShaftSeries
from pipeline.dynamics.demand import JointDemand
from pipeline.dynamics.force_rules import Descent, Stance
from pipeline.machine.joint import Actuators
from pipeline.motion.motion import Segment
from pipeline.simulation.ground_forces.power_law import NOTHING, PowerLaw, power_law

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
