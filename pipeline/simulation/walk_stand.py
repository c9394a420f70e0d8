"""How a machine stands and walks: options of `walk`, results, and their tables.

Columns of the tables are declared in `pipeline/columns.csv`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from actuators.arrays import Array
from actuators.chain import ChainResult, HoldingResult
from actuators.checked import Number, Table
from actuators.energy import (
    BUS,
    Supply,
    limit_rows,
    loss_energies,
    recovery,
    split_integral,
    stage_energies,
    standing_rows,
)
from actuators.parameters import from_si
from actuators.shaft import ShaftSeries, split_at_reversals
from pipeline.columns import frame, series
from pipeline.dynamics.contact_forces import ContactForces
from pipeline.dynamics.joint_demand import JointDemand, MotionDemand
from pipeline.motion.gait import gait_of
from pipeline.motion.motion import Motion, Segment, base_in_world
from pipeline.motion.walking import DEFAULT_SAMPLES
from pipeline.robot.robot_file import RobotSpec

if TYPE_CHECKING:
    from pandas import DataFrame

    from pipeline.simulation.machine import Machine

#: The drivetrain option that stays without losses.
IDEAL: Final = "ideal"


#: Every joint's energy is then within 0.7 % of the limit of fine sampling, on every transfer path.
LEAST_SAMPLES: Final = 51
#: A cycle of a robot of 18 joints then takes some 7 GB of memory.
MOST_SAMPLES: Final = 100_000


def _known(text: object) -> str:
    recovery(str(text))
    return str(text)


class WalkOptions(Table):
    """Options of standing and walking; names and defaults are the command line's.

    One more is a field here and its use in `pipeline.simulation.machine`.
    """

    noun = "option"
    samples: int = Field(
        default=DEFAULT_SAMPLES,
        ge=LEAST_SAMPLES,
        le=MOST_SAMPLES,
        description="per half period of the gait",
    )
    regeneration: Annotated[str, BeforeValidator(_known)] = Field(
        default="none",
        description="what becomes of electrical energy that motors return: none (it is lost), bus "
        "(other motors use it at that instant), or the fraction that is used again, e.g. 0.5",
    )
    forces: Literal["least_tangential", "least_torque"] = Field(
        default="least_tangential",
        description="how the ground's forces are chosen: least_tangential (the paper's rule) or "
        "least_torque (joint torques squared)",
    )
    friction_coefficient: Annotated[Number, Field(gt=0)] | None = Field(
        default=None,
        description="greatest tangential over normal force of a foot; gait.friction_coefficient, "
        "else no limit, by default",
    )
    #: CSV file or DataFrame of time, joint positions and contacts; README.md has its columns.
    motion: Any = Field(
        default=None,
        description="CSV to move by instead of the gait: time_s, JOINT__position_rad and, unless "
        "the base is fixed, LEG__contact (0 or 1); base__x_m to base__yaw_rad where known",
    )


USUAL: Final = WalkOptions()


@dataclass(frozen=True)
class Standing:
    """The robot standing still."""

    segment: Segment  #: The posture.
    demand: JointDemand  #: Torques to hold, one sample.
    contacts: ContactForces  #: Ground forces, one sample.
    holding: Mapping[str, HoldingResult]  #: By drivetrain option; arrays of shape (J,).


@dataclass(frozen=True, eq=False)
class Demand(MotionDemand):
    """What a motion demands of the joints."""

    motion: Motion = field(repr=False)  #: Base and joints over time: a gait's, or the user's own.
    #: Names of the prismatic joints: metres and newtons, not radians.
    sliding: tuple[str, ...]

    @cached_property
    def series(self) -> ShaftSeries:
        """The joints' side of the actuators, with a sample at every zero of a velocity."""
        return joint_series(self)

    def frame(self) -> DataFrame:
        """Position, velocity, acceleration and torque over time, units in the column names."""
        units = {"position": ("rad", "m"), "velocity": ("rad_s", "m_s")}
        units |= {"acceleration": ("rad_s2", "m_s2"), "torque": ("Nm", "N")}
        values = {
            tuple(f"{name}_{pair[joint in self.sliding]}" for joint in self.joints): np.concatenate(
                [getattr(part, name) for part in self.segments]
            )
            for name, pair in units.items()
        }
        return series(*_support(self.segments), self.joints, values)

    def __str__(self) -> str:
        """What moves, for how long, and the largest torque of every joint."""
        frame = self.frame().filter(like="__torque_").abs().max()
        most = frame.nlargest(7).to_string(float_format="{:.4g}".format)
        return f"demand of {len(self.joints)} joints over {self.duration:.4g} s; largest:\n{most}"


@dataclass(frozen=True)
class Walking:
    """The robot over one gait cycle, or another motion."""

    demand: Demand  #: At the joints.
    margins: tuple[Array, ...]  #: Static stability by segment [m]; none on a fixed base.
    results: Mapping[str, ChainResult]  #: By drivetrain option.
    supplies: Mapping[str, Supply]  #: What each drivetrain option takes from the supply.


def joint_series(demand: MotionDemand, joints: Sequence[str] | None = None) -> ShaftSeries:
    """The joints' side of the actuators: segments in a row, split at velocity zeros."""
    names = tuple(joints or demand.joints)
    columns = [demand.joints.index(joint) for joint in names]
    time = np.concatenate([part.time for part in demand.segments])
    quantities = (
        np.concatenate([getattr(part, name)[:, columns] for part in demand.segments])
        for name in ("position", "velocity", "acceleration", "torque")
    )
    return split_at_reversals(ShaftSeries.at_joint(names, time, *quantities))


Legs = Mapping[str, Sequence[str]]
#: Account of the joints outside the legs, which are held.
HELD: Final = "held joints"
#: Account of the joints of a robot without legs.
JOINTS: Final = "joints"
#: Time over which the paper adds up standing energy: that of one gait cycle [s].
STANDING_TIME: Final = 3.0
#: Samples per half period of the gait: energies within 1 % and a fraction of a second.
COST_SAMPLES: Final = 151


def energy_change(before: Machine, after: Machine) -> DataFrame:
    """Electrical energy of a gait cycle [J] and power standing [W], without and with effects.

    A row per drivetrain option; not a number after where not all of the effects count.
    """
    import pandas

    out = pandas.DataFrame(index=[*before.catalog.alternatives])
    for machine, after_it in ((before, ""), (after, "_after")):
        every = machine.chains().items()
        chains = {n: c for n, c in every if machine.counts_in(n) or not after_it}
        walking, standing = (
            machine.walking(samples=COST_SAMPLES).walk(chains),
            machine.stand(chains),
        )
        drawn = {n: s.supplied_energy.sum() for n, s in walking.supplies.items()}
        out[f"cycle_J{after_it}"] = pandas.Series(drawn, dtype=float)
        held = {n: h.power.sum() for n, h in standing.holding.items()}
        out[f"standing_W{after_it}"] = pandas.Series(held, dtype=float)
    return out


def break_even(extra: float, saved: float) -> float:
    """Fraction of time standing at which two actuators cost the same; above it the second pays.

    (1 - f) extra = f saved (Fig. 21 of the paper), with what the second one costs more walking and
    less standing for as long [J, or W]; NaN where it does not do both.
    """
    return extra / (extra + saved) if extra > 0 and saved > 0 else math.nan


def leg_joints(spec: RobotSpec) -> dict[str, tuple[str, ...]]:
    """Each leg's joints, and those outside the legs together."""
    legs = {leg.name: leg.joints for leg in spec.legs}
    held = tuple(spec.held)
    return legs | {HELD if legs else JOINTS: held} if held else legs


def leg_energies(supply: Supply, legs: Legs) -> dict[str, float]:
    """Electrical energy per cycle of each leg and of the robot [J]; on a bus of that alone."""
    energy = dict(zip(supply.accounts, supply.supplied_energy.tolist(), strict=True))
    total = {"robot": float(sum(energy.values()))}
    if BUS in energy:
        return total
    return {leg: sum(energy[j] for j in joints) for leg, joints in legs.items()} | total


def support_energy(demand: MotionDemand, supply: Supply, legs: Legs) -> float | None:
    """Electrical energy of the legs' joints while their feet stand [J]; None on a shared bus."""
    if BUS in supply.accounts or None in demand.contacts:
        return None
    stood = 0.0
    for contacts in filter(None, demand.contacts):
        # The segment's own rows: of the doubled stamps at its ends, the ones inside it.
        first = int(np.searchsorted(supply.time, contacts.time[0], side="left"))
        last = int(np.searchsorted(supply.time, contacts.time[-1], side="right"))
        columns = [supply.accounts.index(j) for leg in contacts.stance for j in legs[leg]]
        drawn = supply.electrical[first:last][:, columns]
        forward, reverse = split_integral(supply.time[first:last], drawn)
        stood += float((forward - supply.recovered * reverse).sum())
    return stood


#: Tables by the name of their file, computed when they are asked for.
Computed = Mapping[str, Callable[[], "DataFrame"]]
Rows = Iterator[Sequence[Any]]
#: Idle power of one driver that is on, least and most of those that were measured [W]
#: (`actuators/components`); `choose` counts it, walking and standing end at the motors' terminals.
DRIVER_IDLE = (0.67, 8.8)
_AXES = "xyz"


def tables_of_standing(machine: Machine, standing: Standing) -> Computed:
    """The tables of standing still, by name."""
    demand, contacts, held = standing.demand, standing.contacts, standing.holding.items()
    names, legs = demand.joints, leg_joints(machine.robot.spec)

    def limits() -> Rows:
        for name, h in held:
            drives = machine.chains(name)[name].joints
            for row in standing_rows(h, names, [drive.driven for drive in drives]):
                yield name, *row

    def energy() -> Rows:
        for name, h in held:
            power = dict(zip(names, h.power.tolist(), strict=True))
            for leg, joints in legs.items():
                yield name, leg, STANDING_TIME * sum(power[j] for j in joints)

    def joints() -> Rows:
        for name, h in held:
            own = (h.motor_torque, h.current, h.voltage, h.power, h.low, h.high)
            for row in zip(names, demand.torque[0], *own, strict=True):
                yield name, *row

    def feet() -> Rows:
        own = contacts.position[0], contacts.force_world[0], contacts.friction_needed[0]
        for leg, numbers in zip(contacts.legs, np.column_stack(own), strict=True):
            yield leg, *numbers

    rows: dict[str, Callable[[], Rows]] = {
        "standing_limits": limits,
        "standing": joints,
        "standing_energy": energy,
        "standing_posture": lambda: zip(names, demand.position[0], strict=True),
        "standing_contacts": feet,
        "parameters": partial(_parameters, machine),
    }
    return {name: partial(_framed, name, each) for name, each in rows.items()}


def _framed(name: str, rows: Callable[[], Rows]) -> DataFrame:
    return frame(name, rows())


def tables_of_walking(machine: Machine, walking: Walking) -> Computed:
    """The tables of one walking cycle, by name."""
    demand = walking.demand
    rows: dict[str, Callable[[], Rows]] = {
        "walking_stability": partial(_stability, walking),
        "walking_stage_energy": partial(_stages, machine, walking),
        "walking_losses": partial(_losses, walking),
        "walking_energy": partial(_legs, machine, walking),
        "robot_energy": partial(_robot, machine, walking),
        "motor_limits": lambda: (
            (name, *row) for name, r in walking.results.items() for row in limit_rows(r)
        ),
        "parameters": partial(_parameters, machine),
    }
    tables: Computed = {
        "walking_joint_demand": demand.frame,
        "walking_contact_forces": lambda: _contact_forces(demand),
        "walking_base": lambda: _base(demand.motion),
        **{name: partial(_framed, name, each) for name, each in rows.items()},
    }
    grounded = ("walking_contact_forces", "walking_base", "walking_stability")
    floating = machine.robot.spec.floating
    return {name: table for name, table in tables.items() if floating or name not in grounded}


def _support(segments: Sequence[Any]) -> tuple[Any, dict[str, list[str]]]:
    """Time, and the column that says which feet support."""
    names = [s.name for s in segments for _ in s.time]
    return np.concatenate([s.time for s in segments]), {"segment": names}


def _contact_forces(demand: Demand) -> DataFrame:
    parts = [contacts for contacts in demand.contacts if contacts is not None]
    force = np.concatenate([part.force_world for part in parts])
    stands = [[[float(leg in part.stance) for leg in part.legs]] * part.time.size for part in parts]
    values = {f"force_{axis}_N": force[..., k] for k, axis in enumerate(_AXES)} | {
        "contact": np.concatenate(stands),
        "friction_needed": np.concatenate([part.friction_needed for part in parts]),
    }
    return series(*_support(demand.segments), parts[0].legs, values)


def _base(motion: Motion) -> DataFrame:
    """Place, attitude and motion of the base link in the world."""
    parts = [base_in_world(segment) for segment in motion.segments]
    values: dict[str, Any] = {}
    for name, unit, part, axes in (
        ("", "m", "position", _AXES),
        ("", "rad", "angles", ("roll", "pitch", "yaw")),
        ("velocity_", "m_s", "velocity", _AXES),
        ("acceleration_", "m_s2", "acceleration", _AXES),
        ("angular_velocity_", "rad_s", "angular_velocity", _AXES),
    ):
        own = np.concatenate([each[part] for each in parts])
        values |= {f"{name}{axis}_{unit}": own[:, [k]] for k, axis in enumerate(axes)}
    return series(*_support(motion.segments), ["base"], values)


def _stability(walking: Walking) -> Rows:
    """Static margin, lightest foot and friction needed, per segment."""
    demand = walking.demand
    parts = zip(demand.segments, demand.contacts, walking.margins, strict=True)
    for part, contacts, margin in parts:
        assert contacts is not None
        normal = contacts.normal_force[:, [leg in contacts.stance for leg in contacts.legs]]
        at, needed = int(margin.argmin()), contacts.friction_needed
        foot = contacts.legs[int(np.nanargmax(needed)) % needed.shape[1]]
        least = (float(margin[at]), float(part.time[at]), float(normal.min()))
        yield part.name, *least, float(np.nanmax(needed)), foot


def _stages(machine: Machine, walking: Walking) -> Rows:
    """E(+) and E(-) at every stage (Fig. 14, 16, 18 and 20 of the paper)."""
    for name, result in walking.results.items():
        words = machine.catalog.alternatives[name].stage_names
        for stage, energies in stage_energies(result).items():
            for joint, *own in zip(result.joint.joints, *energies, strict=True):
                yield name, joint, stage, words[stage], *own


def _losses(walking: Walking) -> Rows:
    """What every element turns into heat per cycle, and what is dissipated at the supply."""
    for name, result in walking.results.items():
        for element, loss in loss_energies(result).items():
            for joint, energy in zip(result.joint.joints, loss, strict=True):
                yield name, joint, element, energy
        supply = walking.supplies[name]
        for account, energy in zip(supply.accounts, supply.dissipated_energy, strict=True):
            yield name, account, "dissipated_return", energy


def _legs(machine: Machine, walking: Walking) -> Rows:
    """Electrical energy of a cycle by leg, and over that of the ideal drivetrain."""
    supplies, legs = walking.supplies, leg_joints(machine.robot.spec)
    base = leg_energies(supplies[IDEAL], legs) if IDEAL in supplies else {}
    for name, supply in supplies.items():
        for leg, energy in leg_energies(supply, legs).items():
            yield name, leg, energy, energy / base[leg] if base.get(leg, 0.0) > 0 else None


def _robot(machine: Machine, walking: Walking) -> Rows:
    """Average power, cost of transport, and how support and transfer share the energy."""
    spec, demand, legs = machine.robot.spec, walking.demand, leg_joints(machine.robot.spec)
    weight = machine.edited.mass * spec.parameters["gravity"]  # that the forces rest on [N]
    speed = 0.0  # of a robot on a stand
    if spec.floating:
        first, last = (demand.motion.segments[k].configuration[k, :3] for k in (0, -1))
        straight = float(np.linalg.norm(last - first) / demand.duration)  # [m/s]
        speed = straight if machine.motion else gait_of(spec).speed
    idle = [watts * len(demand.joints) for watts in DRIVER_IDLE]
    for name, supply in walking.supplies.items():
        energy = float(supply.supplied_energy.sum())
        power = energy / demand.duration  # [W]
        support = transfer = None
        stood = support_energy(demand, supply, legs)
        if stood is not None:
            support = stood / energy
            transfer = 1 - support - leg_energies(supply, legs).get(HELD, 0.0) / energy
        transport = power / (weight * speed) if speed else None
        dissipated = float(supply.dissipated_energy.sum())
        yield name, energy, power, transport, support, transfer, dissipated, *idle


def _parameters(machine: Machine) -> Rows:
    """Every number that went in, in the unit of its file."""
    groups = [(machine.robot.spec.name, machine.robot.spec.parameters.rows())]
    groups += [(c.name, c.parameters.rows()) for c in machine.catalog.components.values()]
    for owner, numbers in (*groups, *machine.own.groups):
        for p in numbers:
            ends = (from_si(x, p.unit) for x in p.interval) if p.interval else (None, None)
            said = (p.name, p.value_as_written, p.unit, p.basis, p.source, *ends, p.reason)
            yield owner, *said
