"""Every quantity the paper prints or compares, computed, by its id."""

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
#: What the loaded leg draws in 3 s, in the order of `ALTERNATIVES`.
STANDING = tuple(f"{name}_leg_energy_3s" for name in ALTERNATIVES)
#: Where the lines of Fig. 21 cross, with what both middle legs draw standing.
CROSSING = "middle_legs"


def pair_break_even(energy: Mapping[str, Mapping[str, float]], standing_power: float) -> float:
    """Fraction of time standing above which the irreversible actuator uses less energy.

    Fig. 21 adds up both middle legs: walking, both take their energy per cycle; standing, one of
    them takes the holding power of the reversible actuator, the irreversible one takes nothing.

    Args:
        energy: Electrical energy per cycle [J], alternative to leg.
        standing_power: Of the loaded leg with the reversible actuator [W].
    """
    extra = sum(energy["irreversible"].values()) - sum(energy["reversible"].values())
    return break_even(extra, standing_power * CYCLE)


def computed(part: RobotPart, outcomes: Mapping[str, Outcome]) -> dict[str, float]:
    """Every printed quantity that these actuators have, `EXTRA` and how far energies are apart, SI.

    ``ideal_most`` is by how much the ideal actuator draws more than any other to stand,
    ``ordered`` the least step from one actuator to the next with more friction [J in 3 s].

    Args:
        part: The robot.
        outcomes: The paper's alternatives or some of them.
    """
    parameters = part.robot.spec.parameters
    out = {name: parameters[key] for name, key in _INPUTS.items()}
    out["standing_reaction_rm"] = part.reaction
    (torques,) = printed_leg(part.demand.standing)
    out |= {f"standing_torque_{j}": float(torques[j - 1]) for j in _JOINTS}
    own = {name: outcomes[name] for name in ALTERNATIVES if name in outcomes}
    energy = {name: {leg: o.consumed(leg) for leg in MIDDLE_LEGS} for name, o in own.items()}
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
        out[EVEN] = pair_break_even(energy, float(own["reversible"].held["power"].sum()))
    return out | steps(out)


def steps(values: Mapping[str, float]) -> dict[str, float]:
    """How far standing energies are apart; empty without all of the paper's alternatives."""
    if any(name not in values for name in STANDING):
        return {}
    energies = np.array([values[name] for name in STANDING])
    return {
        "ideal_most": float(energies[0] - energies[1:].max()),
        "ordered": float(-np.diff(energies).max()),
    }


def pair_costs(outcomes: Mapping[str, Outcome]) -> dict[str, float]:
    """What both middle legs take, by ``<alternative> cycle_J`` and ``<alternative> stand_W``.

    Energy per cycle [J], and power standing on three feet, in which the lifted leg holds its own
    weight [W]. With both actuators of the break-even also `CROSSING`: the fraction of time standing
    at which they cost the same.
    """
    out = {}
    for name, o in outcomes.items():
        out[f"{name} cycle_J"] = sum(o.consumed(leg) for leg in MIDDLE_LEGS)
        out[f"{name} stand_W"] = float(o.holding.power.sum())
    if all(name in outcomes for name in PAIR):
        (cycle, stand), (more, less) = ((out[f"{a} cycle_J"], out[f"{a} stand_W"]) for a in PAIR)
        out[CROSSING] = break_even(more - cycle, (stand - less) * CYCLE)
    return out
