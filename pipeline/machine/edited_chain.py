"""A chain whose joints differ: what effects put into single joints' actuators."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from actuators.chain import Chain, ChainResult, HoldingResult
from actuators.shaft import ShaftSeries
from pipeline.machine.machine import JointModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EditedChain(Chain):
    """A chain that some joints have with more elements or another motor.

    It answers as a chain for all joints does; a loss that a joint does not have is zero there.

    Attributes:
        own: One chain per joint, in the order of the columns.
        coupling: Joint to (other joint, turns of this one's motor per turn of the other).
    """

    own: tuple[Chain, ...] = ()
    coupling: Mapping[int, tuple[int, float]] | None = None

    @cached_property
    def _groups(self) -> list[tuple[Chain, list[int]]]:
        """Chains with the joints that share them."""
        groups: dict[int, tuple[Chain, list[int]]] = {}
        for k, chain in enumerate(self.own):
            groups.setdefault(id(chain), (chain, []))[1].append(k)
        # Coupled motors first: what they supply to the other joint must be known.
        coupled = set(self.coupling or {})
        return sorted(groups.values(), key=lambda g: not coupled & set(g[1]))

    def moving(self, joint: ShaftSeries) -> ChainResult:
        """Return everything the chains need; see `Chain.moving`."""
        parts: list[tuple[list[int], ChainResult]] = []
        load = np.array(joint.torque)
        for chain, columns in self._groups:
            result = chain.moving(self._side(joint, columns, load))
            parts.append((columns, result))
            for k in columns:
                if self.coupling and k in self.coupling:
                    other, turns = self.coupling[k]
                    motor = result.motor.torque[:, columns.index(k)]
                    load[:, other] -= turns * motor * float(np.asarray(chain.ratio))
        return _merged(self.name, joint, parts)

    def _side(self, joint: ShaftSeries, columns: list[int], load: Array) -> ShaftSeries:
        """The joints' side of one group; a coupled motor turns with another joint, too."""
        position, velocity = joint.position[:, columns], joint.velocity[:, columns]
        acceleration = joint.acceleration[:, columns]
        names = tuple(joint.joints[k] for k in columns)
        coupled = [k for k in columns if self.coupling and k in self.coupling]
        if not coupled:
            return ShaftSeries(
                names,
                joint.time,
                position,
                velocity,
                acceleration,
                load[:, columns],
                joint.direction[:, columns],
            )
        assert self.coupling is not None
        for k in coupled:
            other, turns = self.coupling[k]
            c = columns.index(k)
            position[:, c] += turns * joint.position[:, other]
            velocity[:, c] += turns * joint.velocity[:, other]
            acceleration[:, c] += turns * joint.acceleration[:, other]
        return ShaftSeries.at_joint(
            names, joint.time, position, velocity, acceleration, load[:, columns]
        )

    def holding(self, torque: Array) -> HoldingResult:
        """Return what holds joint torques at standstill; see `Chain.holding`."""
        held = np.array(torque, dtype=float)
        out: dict[str, Array] = {}
        for chain, columns in self._groups:
            result = chain.holding(held[..., columns])
            for name in ("low", "high", "motor_torque", "current", "voltage", "power"):
                out.setdefault(name, np.empty_like(held))[..., columns] = getattr(result, name)
            for k in columns:
                if self.coupling and k in self.coupling:
                    other, turns = self.coupling[k]
                    motor = result.motor_torque[..., columns.index(k)]
                    held[..., other] -= turns * motor * float(np.asarray(chain.ratio))
        return HoldingResult(**out)


def edited_chain(chain: Chain, actuators: Sequence[JointModel]) -> Chain:
    """The chain with what effects changed in single joints.

    Args:
        chain: From which the actuators were made.
        actuators: One per joint.

    Returns:
        The chain itself where no joint differs from it.
    """
    names = {a.name: k for k, a in enumerate(actuators)}
    coupling = {
        k: (names[a.coupled_to], a.coupling) for k, a in enumerate(actuators) if a.coupled_to
    }
    own = tuple(_own(chain, actuator) for actuator in actuators)
    if not coupling and all(one is chain for one in own):
        return chain
    if coupling:  # a coupled joint is computed apart from those it shares a chain with
        own = tuple(replace(one) if k in coupling else one for k, one in enumerate(own))
    return EditedChain(chain.name, chain.elements, chain.motor, chain.stages, own, coupling)


def _own(chain: Chain, actuator: JointModel) -> Chain:
    same = len(actuator.elements) == len(chain.elements) and all(
        a is b for a, b in zip(actuator.elements, chain.elements, strict=True)
    )
    motor = actuator.motor or chain.motor
    if same and motor is chain.motor:
        return chain
    *inner, last = chain.stages
    # The motor's stage stays at the motor: behind an element that was added there.
    stages = {stage: chain.stages[stage] for stage in inner}
    stages[last] = actuator.elements[-1].name
    return Chain(chain.name, actuator.elements, motor, stages)


def _merged(
    name: str, joint: ShaftSeries, parts: Sequence[tuple[list[int], ChainResult]]
) -> ChainResult:
    first = parts[0][1]

    def gathered(values: Sequence[Array | None]) -> Array:
        out = np.zeros(joint.torque.shape)
        for (columns, _), value in zip(parts, values, strict=True):
            if value is not None:
                out[:, columns] = value
        return out

    def of_shaft(stage: str, field: str) -> Array:
        return gathered([getattr(result.shafts[stage], field) for _, result in parts])

    def of_result(attribute: str) -> Array:
        return gathered([getattr(result, attribute) for _, result in parts])

    def union(attribute: str, last: str = "") -> dict[str, Array]:
        keys: dict[str, None] = {}
        for _, result in parts:
            keys |= dict.fromkeys(getattr(result, attribute))
        ordered = [k for k in keys if k != last] + [k for k in keys if k == last]
        return {k: gathered([getattr(r, attribute).get(k) for _, r in parts]) for k in ordered}

    shafts = {
        stage: ShaftSeries(
            joints=joint.joints,
            time=joint.time,
            position=of_shaft(stage, "position"),
            velocity=of_shaft(stage, "velocity"),
            acceleration=of_shaft(stage, "acceleration"),
            torque=of_shaft(stage, "torque"),
            direction=of_shaft(stage, "direction"),
        )
        for stage in first.shafts
    }
    return ChainResult(
        chain=name,
        shafts=shafts,
        losses=union("losses", last=tuple(first.losses)[-1]),
        stored=union("stored"),
        current=of_result("current"),
        voltage=of_result("voltage"),
        electrical_power=of_result("electrical_power"),
    )
