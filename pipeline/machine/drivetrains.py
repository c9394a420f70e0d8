"""The drivetrains of all joints, asked together: the one place where joints meet.

Motors may turn with other joints, too: with motor angles theta = C q at the joint side the power
that motors give is the power that joints take, for any motion, so that tau = C^T sigma: a motor
that also turns with another joint carries a part of that joint's torque (virtual work). Its
friction is its own: it acts between motor and frame, and does work on theta.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from actuators.arrays import Array, least_magnitude
from actuators.chain import Chain, ChainResult, HoldingResult, held
from actuators.shaft import BY_JOINT, ShaftSeries


@dataclass(frozen=True, eq=False)
class Drivetrains:
    """One drivetrain per joint; `inverse` and `holding` answer as a chain for all joints does."""

    name: str  #: Of the alternative.
    joints: tuple[Chain, ...]  #: In the order of the columns.

    @cached_property
    def coupling(self) -> Array:
        """C of theta = C q: turns of each motor at its joint's side per turn of each joint."""
        at = {joint.name: k for k, joint in enumerate(self.joints)}
        out = np.eye(len(self.joints))
        for k, joint in enumerate(self.joints):
            if joint.coupled_to:
                out[k, at[joint.coupled_to]] += joint.coupling
        return out

    @cached_property
    def _shares(self) -> Array:
        """C^-1: sigma = C^-T tau, in rows tau C^-1."""
        return np.asarray(np.linalg.inv(self.coupling), dtype=np.float64)

    @cached_property
    def coupled(self) -> bool:
        """Whether a motor turns with another joint, too."""
        return any(joint.coupled_to for joint in self.joints)

    def turned(self, joint: int, motion: Array) -> Array:
        """Motion of a joint's motor at the joint side, theta = C q, (...).

        `motion`: position, velocity or acceleration of all joints (..., J).
        """
        row = self.coupling[joint]
        return np.asarray(motion[..., row != 0.0] @ row[row != 0.0])

    def load(self, joint: int, demand: Callable[[int], Array]) -> Array:
        """What one drivetrain supplies at the joint side, sigma of tau = C^T sigma, (...) [N*m].

        `demand`: torque (...) [N*m] asked of a joint, by column.
        """
        column = self._shares[:, joint]
        return np.asarray(sum(column[k] * demand(k) for k in np.flatnonzero(column).tolist()))

    def carried(self, joint: int, motor: Array) -> Array:
        """What other joints' motors bring to a joint besides its own, (...) [N*m].

        `motor`: torque of all motors brought to their joint side (..., J) [N*m].
        """
        column = self.coupling[:, joint] - np.eye(len(self.joints))[joint]
        return np.asarray(motor[..., column != 0.0] @ column[column != 0.0])

    @cached_property
    def _groups(self) -> list[tuple[Chain, list[int]]]:
        """Chains with the joints that share them."""
        groups: dict[object, tuple[Chain, list[int]]] = {}
        for k, joint in enumerate(self.joints):
            key = (*map(id, joint.path), id(joint.motor))
            groups.setdefault(key, (joint, []))[1].append(k)
        return list(groups.values())

    def inverse(self, joint: ShaftSeries) -> ChainResult:
        """Return everything the drivetrains need; a loss that a joint does not have is zero there.

        `joint`: series at all joints, in their order; see `Chain.inverse`.
        """
        if len(self._groups) == 1 and not self.coupled:
            return self._groups[0][0].inverse(joint)
        motors, lost = joint, dict[str, Array]()
        if self.coupled:
            torque = np.array(joint.torque)
            for k, own in enumerate(self.joints):
                side = joint.of(joint.joints[k : k + 1])
                for element in own.apart:  # does not turn with the motor
                    loss = element.loss(side)
                    if loss is not None:
                        total = lost.setdefault(element.name, np.zeros_like(torque))
                        total[:, k] += loss[:, 0]
                    side = element.inverse(side)
                torque[:, k] = side.torque[:, 0]
            motion = (x @ self.coupling.T for x in (joint.position, joint.velocity))
            turned = (*motion, joint.acceleration @ self.coupling.T, torque @ self._shares)
            motors = ShaftSeries.at_joint(joint.joints, joint.time, *turned)
        parts = [
            (columns, chain.inverse(motors.of([joint.joints[k] for k in columns])))
            for chain, columns in self._groups
        ]
        merged = _merged(joint, parts)
        return replace(merged, losses={**lost, **merged.losses})

    def holding(self, torque: Array, position: Array | None = None) -> HoldingResult:
        """Return what holds joint torques at standstill; see `Chain.holding`.

        `torque`: (..., J) [N*m]. `position`: (..., J) [rad].
        """
        asked = np.array(torque, dtype=float)
        for k, own in enumerate(self.joints):
            if own.apart:  # its friction carries what it can
                at = None if position is None else position[..., k]
                asked[..., k] = least_magnitude(*held(own.apart, asked[..., k], asked[..., k], at))
        load = asked @ self._shares if self.coupled else asked
        at = position @ self.coupling.T if position is not None and self.coupled else position
        out = {one.name: np.empty_like(asked) for one in fields(HoldingResult)}
        for chain, columns in self._groups:
            result = chain.holding(load[..., columns], None if at is None else at[..., columns])
            for name, values in out.items():
                values[..., columns] = getattr(result, name)
        return HoldingResult(**out)


def drivetrains_of(chain: Chain, names: Sequence[str]) -> Drivetrains:
    """A drivetrain per joint, all alike."""
    joints = tuple(copy(chain) for _ in names)
    for joint, name in zip(joints, names, strict=True):
        vars(joint)["name"] = name  # the name alone: nothing to check again, thousands of times
    return Drivetrains(chain.name, joints)


def _merged(joint: ShaftSeries, parts: Sequence[tuple[list[int], ChainResult]]) -> ChainResult:
    """The results of some columns each as one result of all columns."""

    def whole(value: Callable[[ChainResult], Array | None]) -> Array:
        out = np.zeros(joint.torque.shape)
        for columns, result in parts:
            own = value(result)
            if own is not None:
                out[:, columns] = own
        return out

    def shaft(side: Callable[[ChainResult], ShaftSeries]) -> ShaftSeries:
        columns = {n: whole(lambda r, n=n: getattr(side(r), n)) for n in BY_JOINT}  # type: ignore[misc]
        return ShaftSeries(joints=joint.joints, time=joint.time, **columns)

    def by_element(rows: Callable[[ChainResult], Mapping[str, Array]]) -> dict[str, Array]:
        names = dict.fromkeys(name for _, result in parts for name in rows(result))
        return {n: whole(lambda r, n=n: rows(r).get(n)) for n in names}  # type: ignore[misc]

    first = parts[0][1]
    *inner, motor = first.shafts
    # Shafts that all of them have, and the motors' whatever they are called.
    shared = [stage for stage in inner if all(stage in result.shafts for _, result in parts)]
    losses, copper = by_element(lambda r: r.losses), [*first.losses][-1]
    motors = {k: m for columns, r in parts for k, m in zip(columns, r.motors, strict=True)}
    return ChainResult(
        {stage: shaft(lambda r, s=stage: r.shafts[s]) for stage in shared}  # type: ignore[misc]
        | {motor: shaft(lambda r: r.motor)},
        {**{n: loss for n, loss in losses.items() if n != copper}, copper: losses[copper]},
        by_element(lambda r: r.stored),
        whole(lambda r: r.current),
        whole(lambda r: r.voltage),
        whole(lambda r: r.electrical_power),
        motors=tuple(motors[k] for k in range(len(motors))),
    )
