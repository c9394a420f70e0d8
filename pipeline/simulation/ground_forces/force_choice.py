"""Which rule chooses the ground's forces, and what each rule costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from actuators.energy.regeneration import BUS, supply
from actuators.errors import closest
from actuators.shaft import ShaftSeries
from pipeline.dynamics.force_rules import LEAST_TANGENTIAL, ForceRule, GroundForces, LeastTorque
from pipeline.dynamics.joint_demand import MotionDemand
from pipeline.errors import GaitError
from pipeline.machine.drivetrains import Actuators
from pipeline.simulation.ground_forces.least_power import Adjust, LeastPower

LEAST_TORQUE, LEAST_POWER = "least_torque", "least_power"
RULES = (LEAST_TANGENTIAL, LEAST_TORQUE, LEAST_POWER)


@dataclass(frozen=True)
class ForceChoice:
    """What options say of the ground's forces.

    Attributes:
        rule: One of `RULES`.
        power_of: Alternative whose power is the least; of ``least_power`` only.
        friction_coefficient: Greatest tangential over normal force [1]; None for no limit.
    """

    rule: str = LEAST_TANGENTIAL
    power_of: str | None = None
    friction_coefficient: float | None = None

    def on(self, ground: float | None) -> ForceChoice:
        """The same on a ground whose coefficient of friction holds where no option names one.

        Args:
            ground: Of ``[gait]`` [1]; None for no limit.
        """
        own = self.friction_coefficient
        return replace(self, friction_coefficient=ground if own is None else own)

    def checked(self, alternatives: Mapping[str, object]) -> ForceChoice:
        """The same, refused where it asks for what there is not.

        Raises:
            GaitError: Unknown rule or alternative, or an impossible coefficient.
        """
        if self.rule not in RULES:
            raise GaitError(f"--forces {self.rule}: no such rule; {closest(self.rule, RULES)}")
        if (self.rule == LEAST_POWER) != (self.power_of is not None):
            raise GaitError(
                f"--forces {self.rule} "
                + (
                    f"takes no --power-of {self.power_of}: its forces are the same for all "
                    f"actuators; use --forces {LEAST_POWER}"
                    if self.power_of is not None
                    else "needs an actuator: --power-of with one of " + ", ".join(alternatives)
                )
            )
        if self.power_of is not None and self.power_of not in alternatives:
            raise GaitError(
                f"--power-of {self.power_of}: no such alternative; "
                f"{closest(self.power_of, list(alternatives))}"
            )
        GroundForces(None, self.friction_coefficient)
        return self

    def ground(
        self, chains: Mapping[str, Actuators], recovered: float, adjust: Adjust | None
    ) -> GroundForces:
        """What dynamics takes.

        Args:
            chains: By alternative.
            recovered: Share of returned power that is used again; see `recovered_share`.
            adjust: Changes the demand on the actuators; see `pipeline.simulation.edited`.
        """
        rule: ForceRule | None = None
        if self.rule == LEAST_TORQUE:
            rule = LeastTorque()
        elif self.power_of is not None:
            rule = LeastPower(chains[self.power_of], recovered, adjust)
        return GroundForces(rule, self.friction_coefficient)


def recovered_share(policy: str, fraction: float) -> float:
    """Share of returned power that counts as gained at an instant, by policy of regeneration."""
    return 1.0 if policy == BUS else fraction


@dataclass(frozen=True)
class RuleCost:
    """What one rule costs with one alternative over a cycle.

    Attributes:
        alternative: Name.
        rule: One of `RULES`.
        energy: Out of the supply [J].
        root_mean_square_torque: Over joints and samples [N*m].
        friction_needed: Greatest tangential over normal force [1].
    """

    alternative: str
    rule: str
    energy: float
    root_mean_square_torque: float
    friction_needed: float


def rule_costs(
    chains: Mapping[str, Actuators],
    demanded: Callable[[GroundForces], tuple[MotionDemand, ShaftSeries]],
    *,
    friction_coefficient: float | None,
    policy: str,
    fraction: float,
    adjust: Adjust | None,
) -> Iterator[RuleCost]:
    """Walk under every rule with every alternative; one cost after the other.

    Args:
        chains: By alternative.
        demanded: Demand along the gait, and the series at the actuators, for a choice of forces.
        friction_coefficient: For all rules.
        policy: Of regeneration.
        fraction: Its fraction.
        adjust: Changes the demand on the actuators.
    """
    share = recovered_share(policy, fraction)
    for rule in RULES:
        same = None
        for name, chain in chains.items():
            own = name if rule == LEAST_POWER else None
            if own or same is None:
                choice = ForceChoice(rule, own, friction_coefficient)
                same = demanded(choice.ground(chains, share, adjust))
            demand, series = same
            yield RuleCost(
                name,
                rule,
                float(supply(chain.moving(series), policy, fraction).supplied_energy.sum()),
                float(np.sqrt(np.mean(np.concatenate([p.torque for p in demand.segments]) ** 2))),
                max(float(np.nanmax(c.friction_needed)) for c in demand.contacts if c is not None),
            )
