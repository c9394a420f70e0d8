"""The tables of a choice; their columns are declared in `pipeline/columns.csv`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from actuators.units import from_si, known_units
from pipeline.choice.choose import Chosen
from pipeline.choice.designs import Designs
from pipeline.choice.evaluate import CAUSES, ModeSeries
from pipeline.choice.robots import Robot, worst
from pipeline.choice.shelf import Design, fit_of, listed_pairs
from pipeline.choice.standing import STANDING
from pipeline.choice.today import today_rows
from pipeline.columns import frame

if TYPE_CHECKING:
    from pandas import DataFrame

Row = dict[str, Any]
ROBOT = "robot"
_ALTERNATIVES: Final = 8  # of each group
_POINTS: Final = 40  # working points of a joint and mode


def tables_of(chosen: Chosen) -> dict[str, DataFrame]:
    """Every table of a choice."""
    rows: dict[str, Iterable[Any]] = {
        "answer": answer_rows(chosen),
        "answers": answers_rows(chosen),
        "front": front_rows(chosen),
        "alternatives": [*alternative_rows(chosen)],
        "limits": [*limit_rows(chosen)],
        "day": [*day_rows(chosen)],
        "standing_share": [*standing_rows(chosen)],
        "unknowns": unknown_rows(chosen),
        "working_points": [*point_rows(chosen)],
        "motor_outlines": [*outline_rows(chosen)],
    }
    return {name: frame(name, own) for name, own in rows.items() if own or name != "standing_share"}


def words(chosen: Chosen, robot: Robot) -> str:
    """A design for each group."""
    each = zip(chosen.problem.groups, robot, strict=True)
    return "; ".join(f"{group}: {design_words(design)}" for group, design in each)


def design_words(design: Design) -> str:
    """Motor, gear and brake."""
    return " + ".join(part for part in design if part)


def answer_rows(chosen: Chosen) -> list[Row]:
    """The recommended robot: what to buy for each group, and the whole."""
    rows: list[Row] = []
    pairs, best, shares = listed_pairs(chosen.wanted.parts), chosen.best, chosen.best.full.shares
    sheet = chosen.search.shelf.parts
    for g, (group, joints) in enumerate(chosen.problem.groups.items()):
        (motor, gear, brake), design = best.robot[g], best.full.parts[g]
        low, high = np.quantile(chosen.monte_carlo.groups[:, g], [0.05, 0.95]).tolist()
        power = float(best.full.groups[g].power[0] @ shares)
        last = sheet[gear or motor].printed
        backlash = last["backlash"].value if "backlash" in last else None
        rows.append(
            dict(
                group=group,
                joints=len(joints),
                motor=motor,
                gear=gear,
                ratio=float(design.ratio[0]),
                brake=brake,
                fit=fit_of(chosen.search.shelf, motor, gear, pairs) or "not checked",
                driver=chosen.search.shelf.driver,
                battery="",
                bus_V=float(design.bus[0]),
                power_W=power,
                power_low_W=low,
                power_high_W=high,
                battery_h=None,
                battery_kg=None,
                actuator_mass_kg=float(design.mass[0]) * len(joints),
                price_EUR=known(float(design.price[0]) * len(joints)),
                backlash_deg=None if backlash is None else float(np.degrees(backlash)),
                gear_life_h=known(gear_life(best.demand.groups[group], design)),
                not_printed=chosen.search.shelf.not_printed(best.robot[g]),
            )
        )
    low, high = chosen.monte_carlo.interval
    nothing = dict.fromkeys(("motor", "gear", "brake", "fit", "driver", "not_printed"), "")
    lives = [row["gear_life_h"] for row in rows if row["gear_life_h"] is not None]
    whole: Row = dict(
        group=ROBOT,
        ratio=None,
        battery=best.battery.name,
        bus_V=float(best.full.parts[0].bus[0]),
        power_W=best.power,
        power_low_W=low,
        power_high_W=high,
        battery_h=best.hours,
        battery_kg=best.battery.mass,
        backlash_deg=None,
        gear_life_h=min(lives, default=None),
        price_EUR=total([row["price_EUR"] for row in rows]),
        **{name: sum(row[name] for row in rows) for name in ("joints", "actuator_mass_kg")},
        **nothing,
    )
    return [*rows, whole]


def total(each: Sequence[float | None]) -> float | None:
    """Sum; None where one is not known."""
    return None if None in each else float(sum(x for x in each if x is not None))


def known(value: float) -> float | None:
    """None in place of what is not finite."""
    return value if np.isfinite(value) else None


def gear_life(tracks: Sequence[ModeSeries], design: Designs) -> float:
    """Of the worst joint's gear at the mission [h]; infinite without a rated life.

    L = L_n (n_r / n_av) (T_r / T_av)^3 with the speed's mean n_av and the cubic mean torque
    T_av^3 = mean(n T^3) / n_av, so that L = L_n n_r T_r^3 / mean(n T^3); standing wears nothing
    (Harmonic Drive, engineering data, life of the wave generator's bearing).
    """
    wear = np.zeros(tracks[0].torque.shape[1])
    for track in tracks:
        each = np.abs(track.velocity * design.ratio[0]) * np.abs(track.torque) ** 3
        wear += track.share * (track.weight @ each)
    if not np.isfinite(design.life_hours[0]):
        return float("inf")
    rated = design.life_hours[0] * design.life_speed[0] * design.life_torque[0] ** 3
    return float(rated / wear.max()) if wear.max() > 0.0 and rated > 0.0 else float("inf")


def answers_rows(chosen: Chosen) -> Iterator[Row]:
    """The robots to choose from, the recommended one first, and those of today's actuators."""
    counts, drawn = chosen.search.counts, {r: k for k, r in enumerate(chosen.monte_carlo.robots)}
    own_mass = chosen.problem.machine.edited.mass + chosen.problem.on_base
    own_mass -= chosen.problem.present * float(counts.sum())
    order = [chosen.name, *(name for name in chosen.answers if name != chosen.name)]
    for name in order:
        answer = chosen.answers[name]
        k = drawn[answer.robot]
        low, high = np.quantile(chosen.monte_carlo.power[:, k], [0.05, 0.95]).tolist()
        mass = float(answer.full.total("mass", counts)[0])
        limit = in_words(worst(chosen.search, answer.full))
        yield dict(
            answer=name,
            recommended=name == chosen.name,
            power_W=answer.power,
            power_low_W=low,
            power_high_W=high,
            battery_h=answer.hours,
            actuator_mass_kg=mass,
            robot_mass_kg=own_mass + mass,
            price_EUR=known(float(answer.full.total("price", counts)[0])),
            chance_within=float(chosen.monte_carlo.within[:, k].mean()),
            nearest_limit=limit[0],
            limit_use=limit[1],
            design=words(chosen, answer.robot),
        )
    yield from today_rows(chosen)


def in_words(found: tuple[str, str, str, float]) -> tuple[str, float]:
    """The limit of which most is used, its group and mode, and the share; see `worst`."""
    group, limit, mode, use = found
    return f"{limit} of {group}, {mode}", use


def front_rows(chosen: Chosen) -> list[Sequence[Any]]:
    """The Pareto front of power and mass."""
    rows: list[Sequence[Any]] = []
    names = {answer.robot: name for name, answer in [*chosen.answers.items()][::-1]}
    for k, robot in enumerate(chosen.front, start=1):
        own = chosen.search.known[robot]
        hours = chosen.best.battery.hours(np.array([own.power]), np.ones(1))
        row = (k, own.power, hours, own.mass, known(own.price))
        rows.append((*row, names.get(robot, ""), words(chosen, robot)))
    return rows


def alternatives(chosen: Chosen) -> dict[str, list[Robot]]:
    """Robots that differ from the recommended one in one group and take least, by group."""
    robot, out = chosen.best.robot, {}
    for g, group in enumerate(chosen.problem.groups):
        others = [*robot[:g], *robot[g + 1 :]]
        same = [r for r in chosen.search.within if [*r[:g], *r[g + 1 :]] == others and r != robot]
        out[group] = [robot, *same[:_ALTERNATIVES]]
    return out


def alternative_rows(chosen: Chosen) -> Iterator[Row]:
    """The recommended design of each group and others in its place, each in its own robot."""
    for g, (group, robots) in enumerate(alternatives(chosen).items()):
        found = chosen.search.evaluated(robots)
        for k, robot in enumerate(robots):
            motor, gear, brake = robot[g]
            limit = in_words(worst(chosen.search, found, k))
            yield dict(
                group=group,
                rank=k,
                motor=motor,
                gear=gear,
                ratio=float(found.parts[g].ratio[k]),
                brake=brake,
                power_W=float(found.power[k]),
                more_power_W=float(found.power[k] - found.power[0]),
                actuator_mass_kg=float(found.parts[g].mass[k]) * chosen.search.counts[g],
                price_EUR=known(float(found.parts[g].price[k]) * chosen.search.counts[g]),
                nearest_limit=limit[0],
                limit_use=limit[1],
            )


def limit_rows(chosen: Chosen) -> Iterator[Sequence[Any]]:
    """How much of each limit the recommended robot uses in each mode and load case."""
    for (group, tracks), own in zip(
        chosen.best.demand.groups.items(), chosen.best.full.groups, strict=True
    ):
        for limit, use in own.use.items():
            for track, share in zip(tracks, use[0].tolist(), strict=True):
                beside = track.share == 0.0 and track.mode.hours > 0.0
                if share > 0.0 and not beside:
                    kind = "mode" if track.mode.hours else "load case"
                    yield group, limit, track.mode.name, kind, share


def day_rows(chosen: Chosen) -> Iterator[Row]:
    """Every mode at every group, and the robot's."""
    best, shares = chosen.best, chosen.best.full.shares
    at = np.flatnonzero(shares).tolist()
    hours = shares[at] * chosen.hours
    energy = float(best.modes @ hours)
    machine = chosen.problem.machine
    gravity = machine.robot.spec.parameters["gravity"]
    mass = chosen.problem.masses(best.robot)
    weight = gravity * (machine.edited.mass + sum(chosen.problem.added(mass).values()))
    for m, time in zip(at, hours.tolist(), strict=True):
        mode = chosen.search.tracks[m].mode

        def row(group: str, power: float, causes: Mapping[str, float], **others: Any) -> Row:
            head = dict(mode=mode.name, group=group, hours=time, power_W=power)  # noqa: B023
            head |= dict(energy_Wh=power * time, share_of_day=power * time / energy)  # noqa: B023
            head |= {f"{name}_W": value for name, value in causes.items()}
            return {**head, "cost_of_transport": None, **others}

        sums = dict.fromkeys(CAUSES, 0.0)
        for group, own in zip(chosen.problem.groups, best.full.groups, strict=True):
            causes = {name: float(own.causes[name][0, m]) for name in CAUSES}
            sums = {name: sums[name] + causes[name] for name in CAUSES}
            yield row(group, float(own.power[0, m]), causes)
        sums["idle"] += best.full.hotel
        power = float(best.full.modes[0, m])
        moved = best.demand.speeds[mode.name]
        cost = power / (weight * moved) if moved else None
        yield row(ROBOT, power, sums, cost_of_transport=cost)


def standing_rows(chosen: Chosen) -> Iterator[Sequence[Any]]:
    """The best of each family at every share of standing."""
    if chosen.envelope is None:
        return
    for family, robots in chosen.envelope.robots.items():
        each = zip(STANDING, robots, chosen.envelope.power[family], strict=True)
        for share, robot, power in each:
            mass = chosen.search.known[robot].mass
            yield family, float(share), float(power), mass, words(chosen, robot)


def unknown_rows(chosen: Chosen) -> list[Sequence[Any]]:
    """Sensitivity of the answer's power and value of information, the most valuable first."""
    monte_carlo, rows = chosen.monte_carlo, []
    for (part, entry, number), value, change in zip(
        monte_carlo.unknowns,
        monte_carlo.value_of_information(),
        monte_carlo.sensitivity,
        strict=True,
    ):
        unit = number.unit if number.unit in known_units() else "1"  # a model file has SI
        low, high = (from_si(x, unit) for x in (number.low, number.high))
        rows.append((part, entry, low, high, number.unit, float(value), float(change)))
    return sorted(rows, key=lambda row: (-row[-2], -abs(row[-1])))


def point_rows(chosen: Chosen) -> Iterator[Sequence[Any]]:
    """Speed and torque of the joints in every mode and load case."""
    for group, tracks in chosen.best.demand.groups.items():
        for track in tracks:
            if track.share == 0.0 and track.mode.hours > 0.0:
                continue
            kind = (
                "load case" if not track.mode.hours else "stands" if track.mode.stands else "moves"
            )
            step = max(len(track.torque) // _POINTS, 1)
            for j in range(track.torque.shape[1]):
                pairs = {*zip(track.velocity[::step, j], track.torque[::step, j], strict=True)}
                for speed, torque in sorted(pairs):
                    yield group, track.mode.name, kind, float(speed), float(torque)


def outline_rows(chosen: Chosen) -> Iterator[Sequence[Any]]:
    """What the chosen actuator of each group can give, and its neighbours: margins included."""
    for g, (group, robots) in enumerate(alternatives(chosen).items()):
        for k, robot in enumerate(robots[:3]):
            design = chosen.search.shelf.designs([robot[g]])
            name = design_words(robot[g])
            for curve in CURVES if k == 0 else CURVES[:1]:
                for speed, torque in outline(design, curve):
                    yield group, name, k == 0, curve, speed, torque


#: What an actuator can give: again and again, all the time, and for a moment.
CURVES: Final = ("peak", "continuous", "momentary")


def outline(design: Designs, curve: str) -> Iterator[tuple[float, float]]:
    """Greatest torque at the joint over its speed, driving: (rad/s, N*m) of one design."""
    n, k = float(design.ratio[0]), float(design.torque_constant[0])
    volts, ohms = (
        float(design.voltage[0]),
        float(design.resistance[0] + design.driver_resistance[0]),
    )
    most = min(float(design.max_speed[0]), float(design.gear_speed[0]), volts / k) / n
    amperes = design.continuous_current if curve == "continuous" else design.peak_current
    gear = {"peak": design.gear_peak, "continuous": design.gear_continuous}
    held = float(gear.get(curve, design.gear_momentary)[0])
    for speed in np.linspace(0.0, most, 41).tolist():
        motor = k * min(float(amperes[0]), (volts - k * n * speed) / ohms)
        left = motor - float(design.coulomb[0]) - float(design.viscous[0]) * n * speed
        torque = max(left, 0.0) * n / (1.0 + float(design.load[0]))
        yield speed, min(torque, held)
