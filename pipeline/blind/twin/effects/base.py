"""What can be hidden in a machine: the interface of an effect and the record of one hidden."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from pipeline.blind.twin.reference import Reference
from pipeline.blind.twin.setup import Setup

Units = Mapping[str, str]
#: RMS torque of a hidden effect over the noise in `pipeline.blind.twin.reference.BANDWIDTH`.
STRENGTH = (1.5, 60.0)


@dataclass(frozen=True)
class Hidden:
    """One effect with its place and size.

    Attributes:
        effect: Name.
        place: What it acts on: joints, a link, ``"ground"`` or ``"effort channels"``.
        parameters: Name to value in SI units.
        units: Name to unit.
        strength: RMS torque over noise that the size was drawn for [1].
        expected_torque: The RMS torque behind it [N*m].
    """

    effect: str
    place: tuple[str, ...]
    parameters: Mapping[str, float]
    units: Units
    strength: float = float("nan")
    expected_torque: float = float("nan")

    def as_dict(self, *, in_catalogue: bool) -> dict[str, Any]:
        """For the sealed file."""
        return {
            "effect": self.effect,
            "in_catalogue": in_catalogue,
            "place": list(self.place),
            "parameters": {
                name: {"value": value, "unit": self.units[name]}
                for name, value in self.parameters.items()
            },
            "strength": self.strength,
            "expected_torque_Nm": self.expected_torque,
        }


class Effect(ABC):
    """One kind of thing to hide.

    Attributes:
        name: As in the workflow's catalogue, or a name of its own where it is not in it.
        units: Parameters and their units.
        in_catalogue: Whether the workflow has a name for it.
        motions: Where it can act: ``"leg"``, ``"walk"``.
    """

    name: ClassVar[str]
    units: ClassVar[Units]
    in_catalogue: ClassVar[bool] = True
    motions: ClassVar[tuple[str, ...]] = ("leg", "walk")

    @abstractmethod
    def draw(self, rng: np.random.Generator, ref: Reference, torque: float) -> Hidden:
        """Draw place and size.

        Args:
            rng: Of this effect alone.
            ref: The nominal machine along the motion.
            torque: RMS torque that the effect shall have at the joint most affected [N*m].
        """

    @abstractmethod
    def apply(self, setup: Setup, hidden: Hidden) -> Setup:
        """The machine with the effect in it."""

    def hidden(self, place: tuple[str, ...], expected: float, /, **parameters: float) -> Hidden:
        """A record of this effect with the RMS torque it is expected to have [N*m]."""
        values = {name: float(parameters[name]) for name in self.units}
        return Hidden(self.name, place, values, self.units, expected_torque=expected)


def any_joint(rng: np.random.Generator, ref: Reference) -> int:
    """Column of a joint, all alike."""
    return int(rng.integers(len(ref.joints)))


def sized(torque: float, per_unit: float, low: float, high: float) -> tuple[float, float]:
    """Size for a torque inside its physical range, and the torque it then has.

    Args:
        torque: Wanted, RMS [N*m].
        per_unit: RMS torque per unit of size [N*m].
        low: Smallest size that makes sense.
        high: Largest.
    """
    size = float(np.clip(torque / max(per_unit, 1e-12), low, high))
    return size, size * per_unit


def column(setup: Setup, joint: str) -> int:
    """Column of a joint by name."""
    return setup.plant.joints.index(joint)


def raised(values: np.ndarray, index: int, by: float) -> np.ndarray:
    """A copy with one entry raised."""
    out = np.array(values, dtype=np.float64)
    out[index] += by
    return out
