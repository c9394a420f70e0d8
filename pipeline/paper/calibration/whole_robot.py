"""Electrical energy of the whole robot: walking, standing on three feet and on all of them."""

from __future__ import annotations

from actuators.energy.energy import stage_energy
from actuators.loading.build import Catalog
from pipeline.paper.calibration.machine import MIDDLE_LEGS, SAMPLES, leg_joints
from pipeline.robot.robot import Robot
from pipeline.simulation.walk_stand import stand, walk

#: Per alternative: energy per cycle [J] and standing power [W] of the robot and its middle legs.
Totals = dict[str, dict[str, float]]


def totals(robot: Robot, catalog: Catalog, samples: int = SAMPLES) -> Totals:
    """What Fig. 21 needs, for the paper's pair of middle legs and for the whole robot.

    Standing on three feet is section II.C; the other legs are lifted and hold their own weight.

    Args:
        robot: With a floating base.
        catalog: Actuator alternatives.
        samples: Per half period of the gait.

    Returns:
        Alternative to ``cycle_J``, ``stand_3_W``, ``stand_6_W``, ``pair_cycle_J`` and
        ``pair_stand_W`` (standing on three feet).

    Raises:
        TippingError: A foot would have to pull.
    """
    chains = catalog.chains()
    walking = walk(robot, chains, samples=samples)
    pair = [robot.joints.index(j) for leg in MIDDLE_LEGS for j in leg_joints(robot.spec, leg)]
    standing = {
        name: stand(robot, chains, feet).holding
        for name, feet in (("3", robot.spec.standing_feet), ("6", robot.leg_names))
    }
    out: Totals = {}
    for name, result in walking.results.items():
        forward = stage_energy(result, "el").forward
        held = {feet: holding[name].power for feet, holding in standing.items()}
        out[name] = {
            "cycle_J": float(forward.sum()),
            "pair_cycle_J": float(forward[pair].sum()),
            "stand_3_W": float(held["3"].sum()),
            "stand_6_W": float(held["6"].sum()),
            "pair_stand_W": float(held["3"][pair].sum()),
        }
    return out
