"""Electrical energy of the whole robot: walking, standing on three feet and on all of them."""

from __future__ import annotations

import numpy as np

from actuators.energy.energy import stage_energy
from actuators.loading.build import Catalog
from actuators.reversals import split_at_reversals
from actuators.shaft import ShaftSeries
from pipeline.dynamics.joint_demand import motion_demand, segment_demand
from pipeline.motion.gait import standing_posture, tripod_gait
from pipeline.paper.calibration.machine import MIDDLE_LEGS, SAMPLES, leg_joints
from pipeline.robot.robot import Robot

#: Per alternative: energy per cycle [J] and standing power [W] of the robot and its middle legs.
Totals = dict[str, dict[str, float]]


def totals(robot: Robot, catalog: Catalog, samples: int = SAMPLES) -> Totals:
    """What Fig. 21 needs, for the paper's pair of middle legs and for the whole robot.

    Standing on three feet is section II.C; the other legs are lifted and hold their own weight.

    Args:
        robot: With a floating base.
        catalog: Actuator alternatives.
        samples: Per segment of the gait.

    Returns:
        Alternative to ``cycle_J``, ``stand_3_W``, ``stand_6_W``, ``pair_cycle_J`` and
        ``pair_stand_W`` (standing on three feet).

    Raises:
        TippingError: A foot would have to pull.
    """
    demand = motion_demand(robot, tripod_gait(robot, samples=samples))

    def joined(name: str) -> np.ndarray:
        return np.concatenate([getattr(part, name) for part in demand.segments])

    series = split_at_reversals(
        ShaftSeries.at_joint(
            demand.joints,
            *(joined(n) for n in ("time", "position", "velocity", "acceleration", "torque")),
        )
    )
    pair = [demand.joints.index(j) for leg in MIDDLE_LEGS for j in leg_joints(robot.spec, leg)]
    torque = {
        name: segment_demand(robot, standing_posture(robot, feet))[0].torque[0]
        for name, feet in (("3", robot.spec.standing_feet), ("6", robot.leg_names))
    }
    out: Totals = {}
    for name, chain in catalog.chains().items():
        forward = stage_energy(chain.moving(series), "el").forward
        held = {feet: chain.holding(t).power for feet, t in torque.items()}
        out[name] = {
            "cycle_J": float(forward.sum()),
            "pair_cycle_J": float(forward[pair].sum()),
            "stand_3_W": float(held["3"].sum()),
            "stand_6_W": float(held["6"].sum()),
            "pair_stand_W": float(held["3"][pair].sum()),
        }
    return out
