"""Rows of the tables that `choose` writes: answer, front, ten best, day, unknowns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pipeline.column import column


@dataclass(frozen=True)
class AnswerRow:
    """What to build at one group of joints; the last row is the robot."""

    table: ClassVar = "answer"
    about: ClassVar = "Least expected power over the day within every limit, group by group."
    group: str = column("joints that are built alike, or the robot")
    joints: int = column("how many", "1")
    motor: str = column("part")
    gear: str = column("part; empty for none or the motor's own")
    ratio: float | None = column("turns of the motor per turn of the joint", "1")
    brake: str = column("part; empty for none")
    spring: str = column("beside the actuators: joints, stiffness, angle without torque")
    driver: str = column("part")
    battery: str = column("part; robot only")
    power_W: float = column("mean over the day, recomputed in full", "W")
    energy_Wh_per_day: float = column("out of the supply in a day of the mission", "W*h")
    battery_h: float | None = column("hours on one charge in the modes; robot only", "h")
    battery_kg: float | None = column("mass of the battery; robot only", "kg")
    actuator_mass_kg: float = column("motors, gears, brakes and drivers of the group", "kg")
    chance_best: float = column("share of the draws in which nothing is better", "1")
    power_low_W: float = column("exceeded in 95 % of the draws", "W")
    power_high_W: float = column("exceeded in 5 % of the draws", "W")
    regret_W: float = column("expected power above the best of each draw", "W")
    searched_power_W: float = column("what the search took it for, before the recomputation", "W")
    not_printed: str = column("entries of its parts that no sheet prints")


@dataclass(frozen=True)
class FrontRow:
    """One robot that none beats in energy and mass together."""

    table: ClassVar = "front"
    point: int = column("from the least energy to the least mass", "1")
    power_W: float = column("mean over the day", "W")
    energy_Wh_per_day: float = column("out of the supply in a day", "W*h")
    battery_h: float = column("hours on one charge at the mean power", "h")
    actuator_mass_kg: float = column("all actuators", "kg")
    design: str = column("group: motor + gear + brake, by group")


@dataclass(frozen=True)
class BestRow:
    """One of the ten best of a group, with why it is not the first."""

    table: ClassVar = "ten_best"
    group: str = column("joints that are built alike")
    rank: int = column("by expected power over the day", "1")
    motor: str = column("part")
    gear: str = column("part; empty for none or the motor's own")
    ratio: float = column("turns of the motor per turn of the joint", "1")
    brake: str = column("part; empty for none")
    power_W: float = column("expected over the draws", "W")
    nominal_power_W: float = column("with every range at its middle", "W")
    more_than_best_W: float = column(
        "expected above the answer; below 0 by what its own mass, counted in full, adds", "W"
    )
    actuator_mass_kg: float = column("of the group", "kg")
    chance_best: float = column("share of the draws in which nothing is better", "1")
    chance_within: float = column("share of the draws in which it keeps every limit", "1")
    nearest_limit: str = column("the limit that is nearest")
    limit_use: float = column("share of it that is used", "1")
    lost_by: str = column("where most of what it takes above the first goes")
    not_printed: str = column("entries of its parts that no sheet prints")


@dataclass(frozen=True)
class ExcludedRow:
    """How many designs of a group a limit forbids."""

    table: ClassVar = "excluded"
    group: str = column("joints that are built alike")
    limit: str = column("what is exceeded")
    removed: int = column("designs that exceed it", "1")
    by_it_alone: int = column("designs that exceed nothing else", "1")
    designs: int = column("all", "1")
    left: int = column("within every limit", "1")


@dataclass(frozen=True)
class DayRow:
    """One mode of the day at one group of joints, with the answer's actuators."""

    table: ClassVar = "day"
    mode: str = column("of the mission")
    group: str = column("joints that are built alike, or the robot")
    hours: float = column("in a day", "h")
    power_W: float = column("mean in the mode, out of the supply", "W")
    energy_Wh: float = column("in a day", "W*h")
    share_of_day: float = column("of the day's energy", "1")
    mechanical_W: float = column("to the joints, net", "W")
    winding_W: float = column("heat of the windings", "W")
    friction_W: float = column("heat of gears and rotors", "W")
    brakes_W: float = column("coils of the brakes", "W")
    driver_W: float = column("conduction and switching of the drivers", "W")
    returned_W: float = column("flows back and is lost", "W")
    idle_W: float = column("idle power of drivers, and for the robot the hotel load", "W")
    warming_W: float | None = column(
        "more heat of the windings by their temperature; not in power_W", "W"
    )
    cost_of_transport: float | None = column("power over weight times speed; robot only", "1")
    winding_degC: float | None = column("mean in the mode, of the warmest joint", "degC")
    winding_peak_degC: float | None = column("over the day, of the warmest joint", "degC")
    winding_limit_degC: float | None = column("limit of it", "degC")
    rms_current_A: float | None = column("of the worst joint", "A")
    continuous_current_A: float | None = column("limit of it", "A")
    peak_current_A: float | None = column("of the worst joint", "A")
    most_current_A: float | None = column("limit of it", "A")
    speed_rad_s: float | None = column("of the motor", "rad/s")
    most_speed_rad_s: float | None = column("limit of it", "rad/s")
    voltage_V: float | None = column("at the motor", "V")
    most_voltage_V: float | None = column("limit of it", "V")
    gear_rms_Nm: float | None = column("at the gear's output, of the worst joint", "N*m")
    gear_continuous_Nm: float | None = column("limit of it", "N*m")
    gear_peak_Nm: float | None = column("at the gear's output", "N*m")
    gear_most_Nm: float | None = column("limit of it", "N*m")


@dataclass(frozen=True)
class SideRow:
    """The best robot that can be driven back, and the best that locks, with their own masses."""

    table: ClassVar = "reversible_or_not"
    about: ClassVar = "Locks: by a gear or a brake, at every joint where one is within limits."
    candidate: str = column("reversible, or irreversible: that locks")
    moving_W: float = column("mean over the modes in which the robot moves", "W")
    standing_W: float = column("mean over those in which it stands", "W")
    power_W: float = column("mean over the day", "W")
    actuator_mass_kg: float = column("all actuators", "kg")
    limit_use: float = column("share of the nearest limit, with its own mass; above 1 exceeds", "1")
    standing_share: float = column("of the mission's time", "1")
    break_even: float | None = column("share of standing at which both take the same", "1")
    design: str = column("group: motor + gear + brake, by group")


@dataclass(frozen=True)
class UnknownRow:
    """One number that no sheet prints, and what knowing it would be worth."""

    table: ClassVar = "unknowns"
    about: ClassVar = "Ranked by the expected regret that knowing the one number removes."
    group: str = column("joints that are built alike")
    part: str = column("whose sheet does not print it")
    entry: str = column("the number")
    low: float = column("lower end of its range", "see unit")
    high: float = column("upper end", "see unit")
    unit: str = column("of the range")
    worth_W: float = column("expected regret that knowing it removes", "W")
    moves_W: float = column("power of the best design from one end to the other", "W")
