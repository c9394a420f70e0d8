"""What becomes of electrical power that flows back: dumped, partly used, or shared on a bus."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult
from actuators.energy.energy import split_integral
from actuators.errors import EnergyError, closest

POLICIES: Final = ("none", "fraction", "bus")
BUS: Final = "bus"  # the row under which a shared bus is accounted


@dataclass(frozen=True, eq=False)
class Supply:
    """Power drawn from the supply and power dumped in the braking resistor."""

    policy: str  #: One of `POLICIES`.
    accounts: tuple[str, ...]  #: What each column stands for: the joints, or the one bus.
    time: Array  #: (N,) [s].
    electrical: Array  #: Power into the motors, per account (N, K) [W].
    recovered: float  #: Share of the returned power that goes back into the supply.

    @property
    def supplied(self) -> Array:
        """Power out of the supply, negative where it takes power back, (N, K) [W]."""
        return np.maximum(self.electrical, 0.0) + self.recovered * np.minimum(self.electrical, 0.0)

    @property
    def dumped(self) -> Array:
        """Power turned into heat in the braking resistor, (N, K) [W], not negative."""
        return -(1.0 - self.recovered) * np.minimum(self.electrical, 0.0)

    @property
    def supplied_energy(self) -> Array:
        """Energy out of the supply, (K,) [J]."""
        forward, reverse = split_integral(self.time, self.electrical)
        return forward - self.recovered * reverse

    @property
    def dumped_energy(self) -> Array:
        """Energy dumped, (K,) [J]."""
        return (1.0 - self.recovered) * split_integral(self.time, self.electrical)[1]


def supply(result: ChainResult, policy: str = "none", fraction: float = 0.0) -> Supply:
    """Return the supply's account of a chain's motors under a policy; see `supply_of`."""
    joint = result.joint
    return supply_of(result.electrical_power, joint.time, joint.joints, policy, fraction)


def supply_of(
    power: Array,
    time: Array,
    joints: tuple[str, ...],
    policy: str = "none",
    fraction: float = 0.0,
) -> Supply:
    """Return the supply's account under a policy.

    Args:
        power: Into each motor, its driver's loss included where there is one, (N, J) [W].
        time: (N,) [s].
        joints: J names.
        policy: `none`: each joint's returned power is dumped (the paper). `fraction`: that share
            of it goes back into the supply. `bus`: the joints share a bus, one's return feeds
            another's demand, and what is left over is dumped.
        fraction: Share for `fraction`, in [0, 1]; zero otherwise.

    Raises:
        EnergyError: Unknown policy, or a fraction out of place.
    """
    if policy not in POLICIES:
        raise EnergyError(f"unknown regeneration '{policy}': {closest(policy, POLICIES)}")
    if not 0.0 <= fraction <= 1.0:
        raise EnergyError(f"regeneration fraction {fraction} must lie between 0 and 1")
    if fraction != 0.0 and policy != "fraction":
        raise EnergyError(f"regeneration '{policy}' takes no fraction: use policy 'fraction'")
    accounts = joints
    if policy == BUS:
        power, accounts = power.sum(axis=1, keepdims=True), (BUS,)
    return Supply(policy, accounts, time, power, fraction)
