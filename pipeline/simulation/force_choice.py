"""Which rule chooses the ground's forces, as options say it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from actuators.errors import closest
from pipeline.dynamics.force_rules import LEAST_TANGENTIAL, ForceRule, GroundForces, LeastTorque
from pipeline.errors import GaitError
from pipeline.machine.joint import Actuators
from pipeline.simulation.least_power import Adjust, LeastPower

LEAST_TORQUE, LEAST_POWER = "least_torque", "least_power"
RULES = (LEAST_TANGENTIAL, LEAST_TORQUE, LEAST_POWER)


@dataclass(frozen=True)
class ForceChoice:
    """What options say of the ground's forces."""

    rule: str = LEAST_TANGENTIAL  #: One of `RULES`.
    power_of: str | None = None  #: Alternative whose power is the least; of ``least_power`` only.
    #: Greatest tangential over normal force [1]; None for no limit.
    friction_coefficient: float | None = None

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
        """What dynamics takes; see `LeastPower`."""
        rule: ForceRule | None = None
        if self.rule == LEAST_TORQUE:
            rule = LeastTorque()
        elif self.power_of is not None:
            rule = LeastPower(chains[self.power_of], recovered, adjust)
        return GroundForces(rule, self.friction_coefficient)
