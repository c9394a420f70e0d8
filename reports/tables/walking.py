"""Tables of one walking cycle: demand, ground forces, stage energies, losses, limits."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from actuators.chain import ChainResult
from actuators.energy.energy import loss_energies, stage_energies
from actuators.energy.limits import LimitRow
from actuators.energy.regeneration import BUS, Supply
from pipeline.dynamics.force_rules import LEAST_TANGENTIAL
from pipeline.dynamics.joint_demand import MotionDemand
from pipeline.simulation.walk_stand import RuleCost
from reports.table import Table, table_from_rows
from reports.wide import Quantity, wide_series

Array = NDArray[np.float64]
#: Rules of the ground's forces in words.
_FORCES = {
    "least_tangential": "Least tangential",
    "least_torque": "Least joint torque squared:",
    "least_power": "Least electrical power:",
}
ALTERNATIVE = ("actuator alternative", "")
#: What tables by leg call the joints outside the legs, which are held.
HELD = "held joints"


def walking_joint_demand(demand: MotionDemand, sliding: Collection[str] = ()) -> Table:
    """Motion and torque of every joint over the cycle.

    Args:
        demand: Of all joints.
        sliding: Joints that slide: metres and newtons, not radians and newton metres.
    """
    parts = demand.segments

    def units(turns: str, slides: str) -> tuple[str, ...]:
        return tuple(slides if joint in sliding else turns for joint in demand.joints)

    def joined(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    labels = np.concatenate([[part.segment] * part.time.size for part in parts]).tolist()
    return wide_series(
        "walking_joint_demand",
        joined("time"),
        demand.joints,
        [
            Quantity("position", units("rad", "m"), "position", joined("position")),
            Quantity("velocity", units("rad/s", "m/s"), "velocity", joined("velocity")),
            Quantity(
                "acceleration", units("rad/s^2", "m/s^2"), "acceleration", joined("acceleration")
            ),
            Quantity(
                "torque",
                units("N*m", "N"),
                "torque the actuator applies to the joint"
                + (", a force where it slides" if sliding else ""),
                joined("torque"),
            ),
        ],
        labels={"segment": (labels, "which feet support")},
        description="One gait cycle; torque and velocity positive in the joint's direction.",
    )


def walking_contact_forces(demand: MotionDemand) -> Table:
    """Ground forces of every foot over the cycle."""
    parts = [contacts for contacts in demand.contacts if contacts is not None]
    force = np.concatenate([part.force_world for part in parts])
    needed = np.concatenate([part.friction_needed for part in parts])
    stance = np.concatenate(
        [
            np.repeat([[float(leg in part.stance) for leg in part.legs]], part.time.size, axis=0)
            for part in parts
        ]
    )
    labels = [s.segment for s in demand.segments for _ in range(s.time.size)]
    meaning = "force of the ground on the robot, world "
    return wide_series(
        "walking_contact_forces",
        np.concatenate([part.time for part in parts]),
        parts[0].legs,
        [
            Quantity("force_x", "N", meaning + "x", force[..., 0]),
            Quantity("force_y", "N", meaning + "y", force[..., 1]),
            Quantity("force_z", "N", meaning + "z", force[..., 2]),
            Quantity("contact", "1", "1 on the ground, 0 in the air", stance),
            Quantity("friction_needed", "1", "tangential over normal force", needed),
        ],
        labels={"segment": (labels, "which feet support")},
        description=f"{_FORCES[demand.forces.name]} foot forces; world frame, z up.",
    )


def walking_stability(demand: MotionDemand, margins: Sequence[Array]) -> Table:
    """Static margin, lightest foot and friction needed, per segment."""
    rows = []
    for part, contacts, margin in zip(demand.segments, demand.contacts, margins, strict=True):
        assert contacts is not None
        normal = contacts.normal_force[:, [leg in contacts.stance for leg in contacts.legs]]
        at = int(margin.argmin())
        needed = contacts.friction_needed
        rows.append(
            {
                "segment": part.segment,
                "least_margin_m": float(margin[at]),
                "at_time_s": float(part.time[at]),
                "least_normal_force_N": float(normal.min()),
                "greatest_friction_needed": float(np.nanmax(needed)),
                "foot_of_greatest_friction": contacts.legs[
                    int(np.nanargmax(needed)) % needed.shape[1]
                ],
            }
        )
    return table_from_rows(
        "walking_stability",
        rows,
        {
            "segment": ("which feet support", ""),
            "least_margin_m": ("centre of mass to nearest edge of the support polygon", "m"),
            "at_time_s": ("instant of the least margin", "s"),
            "least_normal_force_N": ("lightest load on a supporting foot", "N"),
            "greatest_friction_needed": ("largest tangential over normal force", "1"),
            "foot_of_greatest_friction": ("leg that needs it", ""),
        },
    )


def walking_stage_energy(
    results: Mapping[str, ChainResult], stage_names: Mapping[str, Mapping[str, str]]
) -> Table:
    """E(+) and E(-) at every stage (Fig. 14, 16, 18 and 20).

    Args:
        results: By alternative.
        stage_names: By alternative, every stage in words.
    """
    rows = [
        {
            "alternative": name,
            "joint": joint,
            "stage": stage.stage,
            "stage_name": stage_names[name][stage.stage],
            "forward_J": stage.forward[j],
            "reverse_J": stage.reverse[j],
        }
        for name, result in results.items()
        for stage in stage_energies(result)
        for j, joint in enumerate(stage.joints)
    ]
    return table_from_rows(
        "walking_stage_energy",
        rows,
        {
            "alternative": ALTERNATIVE,
            "joint": ("joint", ""),
            "stage": ("shaft, from the joint (out) to the motor (m) and the supply (el)", ""),
            "stage_name": ("where that is, in words", ""),
            "forward_J": ("E(+): energy per cycle from the supply towards the joint", "J"),
            "reverse_J": ("E(-): energy per cycle the other way, as a positive number", "J"),
        },
    )


def walking_losses(results: Mapping[str, ChainResult], supplies: Mapping[str, Supply]) -> Table:
    """What every element turns into heat per cycle, and what is dumped at the supply."""
    rows: list[dict[str, object]] = []
    for name, result in results.items():
        for element, loss in loss_energies(result).items():
            rows.extend(
                {"alternative": name, "joint": joint, "element": element, "loss_J": loss[j]}
                for j, joint in enumerate(result.joint.joints)
            )
        supply = supplies[name]
        rows.extend(
            {"alternative": name, "joint": account, "element": "dumped_return", "loss_J": energy}
            for account, energy in zip(supply.accounts, supply.dumped_energy, strict=True)
        )
    return table_from_rows(
        "walking_losses",
        rows,
        {
            "alternative": ALTERNATIVE,
            "joint": ("joint; 'bus' where all joints share the supply", ""),
            "element": (
                "element of the chain; dumped_return: returned electrical energy that is lost",
                "",
            ),
            "loss_J": ("energy dissipated per cycle", "J"),
        },
    )


def leg_energies(supply: Supply, legs: Mapping[str, Sequence[str]]) -> dict[str, float]:
    """Electrical energy per cycle of each leg and of the robot [J].

    On a shared bus one leg's return feeds another, so only the robot has an energy of its own.
    """
    energy = dict(zip(supply.accounts, supply.supplied_energy.tolist(), strict=True))
    total = {"robot": float(sum(energy.values()))}
    if BUS in energy:
        return total
    return {leg: sum(energy[j] for j in joints) for leg, joints in legs.items()} | total


def walking_energy(
    supplies: Mapping[str, Supply], legs: Mapping[str, Sequence[str]], ideal: str
) -> Table:
    """Electrical energy per cycle, and its ratio to the ideal actuator's where there is one."""
    base = leg_energies(supplies[ideal], legs) if ideal in supplies else {}
    rows = [
        {
            "alternative": name,
            "leg": leg,
            "electrical_J": energy,
            "ratio_to_ideal": energy / base[leg] if base.get(leg, 0.0) > 0 else None,
        }
        for name, supply in supplies.items()
        for leg, energy in leg_energies(supply, legs).items()
    ]
    return table_from_rows(
        "walking_energy",
        rows,
        {
            "alternative": ALTERNATIVE,
            "leg": ("leg, or the robot as a whole", ""),
            "electrical_J": ("energy drawn from the supply per cycle", "J", "electrical energy"),
            "ratio_to_ideal": ("over that of the ideal actuator", "1", "ratio to the ideal"),
        },
    )


def robot_energy(
    demand: MotionDemand,
    supplies: Mapping[str, Supply],
    legs: Mapping[str, Sequence[str]],
    weight: float,
    speed: float,
) -> Table:
    """Average power, cost of transport, and how support and transfer share the energy.

    Args:
        demand: For the segments and their standing feet.
        supplies: By alternative.
        legs: Leg to its joints.
        weight: Of the robot [N].
        speed: Of walking [m/s].
    """
    assert demand.period is not None
    rows = []
    for name, supply in supplies.items():
        energy = float(supply.supplied_energy.sum())
        support = _support_energy(demand, supply, legs)
        held = leg_energies(supply, legs).get(HELD, 0.0)
        power = energy / demand.period
        rows.append(
            {
                "alternative": name,
                "energy_per_cycle_J": energy,
                "average_power_W": power,
                "cost_of_transport": power / (weight * speed) if speed else None,
                "support_share": None if support is None else support / energy,
                "transfer_share": None if support is None else 1 - support / energy - held / energy,
                "dumped_J": float(supply.dumped_energy.sum()),
            }
        )
    return table_from_rows(
        "robot_energy",
        rows,
        {
            "alternative": ALTERNATIVE,
            "energy_per_cycle_J": ("energy drawn from the supply per cycle", "J"),
            "average_power_W": ("over one cycle", "W"),
            "cost_of_transport": ("average power over weight times speed", "1"),
            "support_share": (
                "share of joints while their foot supports; empty on a bus",
                "1",
                "share of support",
            ),
            "transfer_share": (
                "share of joints while their foot is in the air",
                "1",
                "share of transfer",
            ),
            "dumped_J": (
                "electrical energy per cycle that flows back and is lost",
                "J",
                "returned and lost",
            ),
        },
    )


def _support_energy(
    demand: MotionDemand, supply: Supply, legs: Mapping[str, Sequence[str]]
) -> float | None:
    if BUS in supply.accounts:
        return None
    from actuators.energy.energy import split_integral

    total = 0.0
    for contacts in demand.contacts:
        assert contacts is not None
        start, end = contacts.time[0], contacts.time[-1]
        # The segment's own rows: of the doubled stamps at its ends, the ones inside it.
        first = int(np.searchsorted(supply.time, start, side="left"))
        last = int(np.searchsorted(supply.time, end, side="right"))
        columns = [supply.accounts.index(j) for leg in contacts.stance for j in legs[leg]]
        time, power = supply.time[first:last], supply.electrical[first:last][:, columns]
        forward, reverse = split_integral(time, power)
        total += float((forward - supply.recovered * reverse).sum())
    return total


def motor_limits(limits: Mapping[str, Sequence[LimitRow]], name: str = "motor_limits") -> Table:
    """Peaks over the cycle, or at standstill, against the motor's data sheet.

    Args:
        limits: By alternative.
        name: Of the table.
    """
    rows = [
        {
            "alternative": alternative,
            "joint": row.joint,
            "quantity": row.quantity,
            "unit": row.unit,
            "limit": row.limit,
            "peak": row.peak,
            "at_time_s": row.peak_time,
            "share_of_time_over": row.share_over,
            "breach": row.breach,
        }
        for alternative, own in limits.items()
        for row in own
    ]
    return table_from_rows(
        name,
        rows,
        {
            "alternative": ALTERNATIVE,
            "joint": ("joint", ""),
            "quantity": ("motor speed, voltage, current, or rms_current over the cycle", ""),
            "unit": ("unit of limit and peak", ""),
            "limit": ("what the data sheet allows, in the row's unit", "see unit"),
            "peak": ("largest magnitude over the cycle, in the row's unit", "see unit"),
            "at_time_s": ("instant of the peak", "s"),
            "share_of_time_over": ("share of the cycle above the limit", "1"),
            "breach": ("whether the peak is above the limit", ""),
        },
    )


def force_rules(costs: Sequence[RuleCost], friction_coefficient: float | None) -> Table:
    """What the paper's rule of the ground's forces costs against others."""
    paper = {cost.alternative: cost.energy for cost in costs if cost.rule == LEAST_TANGENTIAL}
    rows = [
        {
            "alternative": cost.alternative,
            "rule": cost.rule,
            "electrical_J": cost.energy,
            "relative_difference": cost.energy / paper[cost.alternative] - 1
            if paper[cost.alternative]
            else None,
            "rms_joint_torque_Nm": cost.root_mean_square_torque,
            "greatest_friction_needed": cost.friction_needed,
        }
        for cost in costs
    ]
    limit = "no limit" if friction_coefficient is None else f"{friction_coefficient:g}"
    return table_from_rows(
        "walking_force_rules",
        rows,
        {
            "alternative": ALTERNATIVE,
            "rule": (
                "least_tangential: sum of squared tangential forces (the paper's); least_torque: "
                "sum of squared joint torques; least_power: power this alternative draws, at "
                "every instant",
                "",
            ),
            "electrical_J": ("electrical energy of the whole robot in one cycle", "J"),
            "relative_difference": ("energy over that of least_tangential, less one", "1"),
            "rms_joint_torque_Nm": ("root mean square over all joints and samples", "N*m"),
            "greatest_friction_needed": ("largest tangential over normal force", "1"),
        },
        description="The ground's forces chosen by other rules, motion being the same; friction "
        f"coefficient: {limit}.",
    )


def quasi_static_difference(
    full: MotionDemand,
    static: MotionDemand,
    full_supplies: Mapping[str, Supply],
    static_supplies: Mapping[str, Supply],
    legs: Mapping[str, Sequence[str]],
) -> tuple[Table, Table]:
    """What the links' inertial terms change: in torque by joint, in energy by leg."""
    torque = [np.concatenate([part.torque for part in d.segments]) for d in (full, static)]
    joints = Table(
        "quasi_static_torque",
        {
            "joint": list(full.joints),
            "peak_torque_full_Nm": np.abs(torque[0]).max(axis=0),
            "peak_torque_quasi_static_Nm": np.abs(torque[1]).max(axis=0),
            "largest_difference_Nm": np.abs(torque[0] - torque[1]).max(axis=0),
        },
        {
            "joint": ("joint", ""),
            "peak_torque_full_Nm": ("largest magnitude with all inertial terms", "N*m"),
            "peak_torque_quasi_static_Nm": ("without the links' inertial terms", "N*m"),
            "largest_difference_Nm": ("largest difference at one instant", "N*m"),
        },
        "Full inverse dynamics against gravity and contact alone.",
    )
    rows = []
    for name, supply in full_supplies.items():
        other = leg_energies(static_supplies[name], legs)
        for leg, energy in leg_energies(supply, legs).items():
            rows.append(
                {
                    "alternative": name,
                    "leg": leg,
                    "full_J": energy,
                    "quasi_static_J": other[leg],
                    "relative_difference": (other[leg] - energy) / energy if energy else None,
                }
            )
    energies = table_from_rows(
        "quasi_static_energy",
        rows,
        {
            "alternative": ALTERNATIVE,
            "leg": ("leg, or the robot as a whole", ""),
            "full_J": ("electrical energy per cycle with all inertial terms", "J"),
            "quasi_static_J": ("without the links' inertial terms", "J"),
            "relative_difference": ("quasi-static over full, less one", "1"),
        },
        "Reflected rotor inertia stays in the actuator chain in both.",
    )
    return joints, energies
