"""All drivetrains of a machine, asked together: the one place where joints meet.

Motors may turn with other joints, too: with motor angles theta = C q at the joint side the power
that motors give is the power that joints take, for any motion, so that tau = C^T sigma: a motor
that also turns with another joint carries a part of that joint's torque (virtual work). Its
friction is its own: it acts between motor and frame, and does work on theta.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from actuators.arrays import Array, least_magnitude
from actuators.chain import Chain, ChainResult, HoldingResult, held
from actuators.shaft import ShaftSeries
from pipeline.machine.joint import JointModel, joints_of


@dataclass(frozen=True, eq=False)
class Drivetrains:
    """One drivetrain per joint; `inverse` and `holding` answer as a chain for all joints does."""

    name: str  #: Of the alternative.
    joints: tuple[JointModel, ...]  #: In the order of the columns.

    @cached_property
    def coupled(self) -> dict[int, tuple[int, float]]:
        """Joint to (other joint, turns of this one's motor per turn of the other)."""
        at = {joint.name: k for k, joint in enumerate(self.joints)}
        return {
            k: (at[joint.coupled_to], joint.coupling)
            for k, joint in enumerate(self.joints)
            if joint.coupled_to
        }

    def turned(self, joint: int, motion: Array) -> Array:
        """Motion of a joint's motor at the joint side, theta = C q, (...).

        `motion`: position, velocity or acceleration of all joints (..., J).
        """
        own: Array = motion[..., joint]
        if joint in self.coupled:
            other, turns = self.coupled[joint]
            own = own + turns * motion[..., other]
        return own

    def load(self, joint: int, demand: Callable[[int], Array]) -> Array:
        """What one drivetrain supplies at the joint side, sigma of tau = C^T sigma, (...) [N*m].

        `demand`: torque (...) [N*m] asked of a joint, by column.
        """
        own = demand(joint)
        for k, (other, turns) in self.coupled.items():
            if other == joint:
                own = own - turns * self.load(k, demand)
        return own

    def carried(self, joint: int, motor: Array) -> Array:
        """What other joints' motors bring to a joint besides its own, (...) [N*m].

        `motor`: torque of all motors brought to their joint side (..., J) [N*m].
        """
        out = np.zeros(motor.shape[:-1])
        for k, (other, turns) in self.coupled.items():
            if other == joint:
                out = out + turns * motor[..., k]
        return out

    @cached_property
    def _groups(self) -> list[tuple[Chain, list[int]]]:
        """Chains with the joints that share them; a coupled joint is computed apart."""
        groups: dict[object, tuple[Chain, list[int]]] = {}
        for k, joint in enumerate(self.joints):
            key = (*map(id, joint.path), id(joint.motor), k if k in self.coupled else -1)
            if key not in groups:
                groups[key] = (joint.chain, [])
            groups[key][1].append(k)
        return list(groups.values())

    def inverse(self, joint: ShaftSeries) -> ChainResult:
        """Return everything the drivetrains need; a loss that a joint does not have is zero there.

        `joint`: series at all joints, in their order; see `Chain.inverse`.
        """
        if len(self._groups) == 1 and not self.coupled:
            return replace(self._groups[0][0].inverse(joint), chain=self.name)
        joint, lost = self._behind(joint)
        parts = [
            (columns, chain.inverse(self._side(joint, columns))) for chain, columns in self._groups
        ]
        merged = _merged(self.name, joint, parts)
        return replace(merged, losses={**lost, **merged.losses}) if lost else merged

    def _behind(self, joint: ShaftSeries) -> tuple[ShaftSeries, dict[str, Array]]:
        """The joints behind what does not turn with their motors, and what that loses, by name."""
        lost: dict[str, Array] = {}
        torque = np.array(joint.torque)
        for k, own in enumerate(self.joints):
            side = joint.at(k)
            for element in own.apart:
                behind = element.inverse(side)
                loss = element.loss(side)
                if loss is not None:
                    total = lost.setdefault(element.name, np.zeros_like(torque))
                    total[:, k] += loss[:, 0]
                side = behind
            torque[:, k] = side.torque[:, 0]
        return (joint.with_torque(torque), lost) if lost else (joint, lost)

    def _side(self, joint: ShaftSeries, columns: list[int]) -> ShaftSeries:
        """The joints' side of one group; a coupled motor turns with another joint, too."""
        names = tuple(joint.joints[k] for k in columns)
        torque = np.stack([self.load(k, lambda i: joint.torque[:, i]) for k in columns], axis=1)
        position, velocity, acceleration = (
            np.stack([self.turned(k, x) for k in columns], axis=1)
            for x in (joint.position, joint.velocity, joint.acceleration)
        )
        if not self.coupled.keys() & set(columns):
            direction = joint.direction[:, columns]
            return ShaftSeries(
                names, joint.time, position, velocity, acceleration, torque, direction
            )
        return ShaftSeries.at_joint(names, joint.time, position, velocity, acceleration, torque)

    def holding(self, torque: Array, position: Array | None = None) -> HoldingResult:
        """Return what holds joint torques at standstill; see `Chain.holding`.

        `torque`: (..., J) [N*m]. `position`: (..., J) [rad].
        """
        asked = np.array(torque, dtype=float)
        for k, own in enumerate(self.joints):
            if own.apart:  # its friction carries what it can
                at = None if position is None else position[..., k]
                asked[..., k] = least_magnitude(*held(own.apart, asked[..., k], asked[..., k], at))
        out: dict[str, Array] = {}
        for chain, columns in self._groups:
            load = [self.load(k, lambda i: asked[..., i]) for k in columns]
            at = None
            if position is not None:
                at = np.stack([self.turned(k, position) for k in columns], axis=-1)
            result = chain.holding(np.stack(load, axis=-1), at)
            for name in ("low", "high", "motor_torque", "current", "voltage", "power"):
                out.setdefault(name, np.empty_like(asked))[..., columns] = getattr(result, name)
        return HoldingResult(**out)


#: Who answers for all joints of a machine: one chain that they share, or a drivetrain for each.
Actuators = Chain | Drivetrains


def drivetrains_of(actuators: Actuators, names: Sequence[str]) -> Drivetrains:
    """A drivetrain per joint."""
    if isinstance(actuators, Drivetrains):
        return actuators
    return Drivetrains(actuators.name, joints_of(actuators, tuple(names)))


def _merged(
    name: str, joint: ShaftSeries, parts: Sequence[tuple[list[int], ChainResult]]
) -> ChainResult:
    """The results of some columns each as one result of all columns."""
    results = [result for _, result in parts]

    def gathered(values: Sequence[Array | None]) -> Array:
        out = np.zeros(joint.torque.shape)
        for (columns, _), value in zip(parts, values, strict=True):
            if value is not None:
                out[:, columns] = value
        return out

    def of_shaft(sides: Sequence[ShaftSeries]) -> ShaftSeries:
        fields = ("position", "velocity", "acceleration", "torque", "direction")
        columns = {field: gathered([getattr(side, field) for side in sides]) for field in fields}
        return ShaftSeries(joints=joint.joints, time=joint.time, **columns)

    def by_element(rows: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
        return {
            k: gathered([r.get(k) for r in rows]) for k in dict.fromkeys(itertools.chain(*rows))
        }

    *inner, motor = results[0].shafts
    # Shafts that all of them have, and the motors' whatever they are called.
    shared = [stage for stage in inner if all(stage in r.shafts for r in results)]
    shafts = {stage: of_shaft([r.shafts[stage] for r in results]) for stage in shared}
    shafts[motor] = of_shaft([r.motor for r in results])
    losses = by_element([r.losses for r in results])
    last = tuple(results[0].losses)[-1]  # copper
    losses[last] = losses.pop(last)
    motors = {k: m for columns, r in parts for k, m in zip(columns, r.motors, strict=True)}
    return ChainResult(
        chain=name,
        shafts=shafts,
        losses=losses,
        stored=by_element([r.stored for r in results]),
        current=gathered([r.current for r in results]),
        voltage=gathered([r.voltage for r in results]),
        electrical_power=gathered([r.electrical_power for r in results]),
        motors=tuple(motors[k] for k in range(len(motors))),
    )
