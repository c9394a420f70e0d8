"""Every quantity the paper prints, computed, by the id of `published_values.csv`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pipeline.paper.hexapod import MIDDLE_LEGS, PUBLISHED_LEG, Outcome, RobotPart, printed_leg
from pipeline.paper.published import ALTERNATIVES, CYCLE, EVEN, EXTRA, PAIR
from pipeline.simulation.cycle_energy import break_even

#: Id to the number of the robot file.
_INPUTS = {
    "body_length": "body_length",
    "robot_width": "robot_width",
    "femur_length": "femur_length",
    "tibia_length": "tibia_length",
    "robot_mass": "total_mass",
    "foot_stroke_longitudinal": "foot_stroke",
    "foot_stroke_vertical": "foot_lift",
    "walking_speed": "walking_speed",
    "gait_period": "gait_period",
}
_KINDS = ("motor_torque", "current", "voltage", "power")
_JOINTS = (1, 2, 3)


def pair_break_even(
    energy: Mapping[str, Mapping[str, float]], standing_power: float, legs: int
) -> float:
    """Fraction of time standing above which the irreversible actuator uses less energy.

    Fig. 21 adds up both middle legs: walking, both take their energy per cycle; standing, `legs` of
    them take the holding power of the reversible actuator, the irreversible one takes nothing.

    Args:
        energy: Electrical energy per cycle [J], alternative to leg.
        standing_power: Of one loaded leg with the reversible actuator [W].
        legs: How many of the two middle legs stand loaded.
    """
    extra = sum(energy["irreversible"].values()) - sum(energy["reversible"].values())
    return break_even(extra, legs * standing_power * CYCLE)


def computed(
    part: RobotPart, outcomes: Mapping[str, Outcome], standing_legs: int = 1, *, net: bool = False
) -> dict[str, float]:
    """Every published quantity that these actuators have, and their energy difference `EXTRA`, SI.

    Args:
        part: The robot.
        outcomes: The paper's alternatives or some of them.
        standing_legs: How many middle legs Fig. 21 counts as loaded, 1 or 2.
        net: Whether consumption is E_el(+) - E_el(-) instead of E_el(+).
    """
    parameters = part.robot.spec.parameters
    out = {name: parameters[key] for name, key in _INPUTS.items()}
    out["standing_reaction_rm"] = part.reaction
    (torques,) = printed_leg(part.demand.standing)
    out |= {f"standing_torque_{j}": float(torques[j - 1]) for j in _JOINTS}
    own = {name: outcomes[name] for name in ALTERNATIVES if name in outcomes}
    energy = {
        name: {leg: o.consumed(leg, net=net) for leg in MIDDLE_LEGS} for name, o in own.items()
    }
    for name, o in own.items():
        if name != "irreversible":
            out |= {f"{name}_{w}_{j}": float(o.held[w][j - 1]) for w in _KINDS for j in (2, 3)}
        out[f"{name}_leg_energy_3s"] = float(o.held["power"].sum()) * CYCLE
        if name != "ideal" and "ideal" in own:
            ratio = energy[name][PUBLISHED_LEG] / energy["ideal"][PUBLISHED_LEG]
            out[f"walking_ratio_{name}"] = ratio
    if "reversible" in own:
        out["transmission_ratio"] = float(np.asarray(own["reversible"].chain.ratio))
    if all(name in own for name in PAIR):
        reversible, irreversible = (sum(energy[name].values()) for name in PAIR)
        out[EXTRA] = (irreversible - reversible) / len(MIDDLE_LEGS)
        out[EVEN] = pair_break_even(
            energy, float(own["reversible"].held["power"].sum()), standing_legs
        )
    return out
