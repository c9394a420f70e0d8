"""The tables of a choice; their columns are declared in `pipeline/columns.csv`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from actuators.arrays import Array
from actuators.chain import ChainResult
from actuators.energy import HOUR, driver_of, duration, supply_of
from actuators.energy import limit_rows as chain_limits
from actuators.loading.parts import listed_pairs
from actuators.parameters import from_si
from pipeline.choice.choose import Chosen
from pipeline.choice.evaluate import CAUSES, ModeSeries
from pipeline.choice.loads import Load, cases_of, loads_of
from pipeline.choice.robots import Robot, worst
from pipeline.choice.shelf import Designs, design_words, fit_of
from pipeline.choice.standing import STANDING
from pipeline.columns import declared, frame
from pipeline.machine.machine import Drivetrains
from pipeline.simulation.machine import IDEAL

if TYPE_CHECKING:
    from pandas import DataFrame

Row = dict[str, Any]
ROBOT = "robot"
_ALTERNATIVES: Final = 8  # of each group
_POINTS: Final = 40  # working points of a joint and mode
_ANY_TORQUE: Final = 1e6  # that a joint which locks holds, too [N*m]
#: What an actuator can give: again and again, all the time, and for a moment.
CURVES: Final = ("peak", "continuous", "momentary")


def tables_of(chosen: Chosen) -> dict[str, DataFrame]:
    """Every table of a choice."""
    rows: dict[str, Iterable[Any]] = {
        "answer": answer_rows(chosen),
        "answers": answers_rows(chosen),
        "front": front_rows(chosen),
        "alternatives": alternative_rows(chosen),
        "limits": limit_rows(chosen),
        "day": day_rows(chosen),
        "unknowns": unknown_rows(chosen),
        "working_points": point_rows(chosen),
        "motor_outlines": outline_rows(chosen),
    }
    if chosen.envelope is not None:
        rows["standing_share"] = standing_rows(chosen)
    return {name: frame(name, own) for name, own in rows.items()}


def words(chosen: Chosen, robot: Robot) -> str:
    """A design for each group."""
    each = zip(chosen.problem.groups, robot, strict=True)
    return "; ".join(f"{group}: {design_words(design)}" for group, design in each)


def known(value: float) -> float | None:
    """None in place of what is not finite."""
    return value if np.isfinite(value) else None


def answer_rows(chosen: Chosen) -> list[Row]:
    """The recommended robot: what to buy for each group, and the whole."""
    pairs, best, shelf = listed_pairs(chosen.wanted.parts), chosen.best, chosen.search.shelf
    texts = dict.fromkeys(("motor", "gear", "brake", "fit", "driver", "battery"), "")
    rows, blank = list[Row](), dict.fromkeys(declared("answer")) | texts
    for g, (group, joints) in enumerate(chosen.problem.groups.items()):
        (motor, gear, brake), design = best.robot[g], best.full.parts[g]
        sheet = shelf.values(gear or motor)
        own = dict(
            group=group,
            joints=len(joints),
            motor=motor,
            gear=gear,
            ratio=float(design.ratio[0]),
            brake=brake,
            fit=fit_of(shelf, motor, gear, pairs) or "not checked",
            driver=shelf.driver,
            bus_V=shelf.voltage,
            power_W=float(best.full.groups[g].power[0] @ best.full.shares),
            actuator_mass_kg=float(design.mass[0]) * len(joints),
            price_EUR=known(float(design.price[0]) * len(joints)),
            backlash_deg=np.degrees(sheet["backlash"]) if "backlash" in sheet else None,
            radial_load_N=sheet.get("radial_load"),
            stiffness_Nm_rad=sheet.get("stiffness"),
            gear_life_h=known(gear_life(best.demand.groups[group], sheet)),
        )
        rows.append(blank | own)
    low, high = chosen.monte_carlo.interval
    sums = {k: sum(row[k] for row in rows) for k in ("joints", "actuator_mass_kg")}
    lives = [row["gear_life_h"] for row in rows if row["gear_life_h"] is not None]
    price = known(float(best.full.total("price", chosen.search.counts)[0]))
    whole: Row = blank | dict(group=ROBOT, bus_V=shelf.voltage, power_W=best.power, **sums)
    whole |= dict(power_low_W=low, power_high_W=high, gear_life_h=min(lives, default=None))
    whole |= dict(battery_h=best.hours, battery=best.battery.name, battery_kg=best.battery.mass)
    return [*rows, whole | dict(price_EUR=price, driver=shelf.driver)]


def gear_life(tracks: Sequence[ModeSeries], sheet: Mapping[str, float]) -> float:
    """Of the worst joint's gear, by its entries, at the mission [h]; infinite without a rated life.

    L = L_n (n_r / n_av) (T_r / T_av)^3 with the speed's mean n_av and the cubic mean torque
    T_av^3 = mean(n T^3) / n_av, so that L = L_n n_r T_r^3 / mean(n T^3); standing wears nothing
    (Harmonic Drive, engineering data, life of the wave generator's bearing).
    """
    wear = np.zeros(tracks[0].torque.shape[1])
    for track in tracks:
        each = np.abs(track.velocity) * np.abs(track.torque) ** 3
        wear += track.share * (track.weight @ each)
    if "gear_life" not in sheet or not wear.any():
        return float("inf")
    rated = sheet["gear_life_speed"] / sheet["gear_ratio"] * sheet["gear_life_torque"] ** 3
    return float(sheet["gear_life"] / HOUR * rated / wear.max())


def answers_rows(chosen: Chosen) -> Iterator[Row]:
    """The robots to choose from, the recommended one first, and those of today's actuators."""
    draws, counts, problem = chosen.monte_carlo, chosen.search.counts, chosen.problem
    among = dict.fromkeys([*chosen.front, *(own.robot for own in chosen.answers.values())])
    least = draws.chance_least([*among])
    own_mass = problem.machine.edited.mass + problem.on_base - problem.present * float(counts.sum())
    for name in sorted(chosen.answers, key=lambda name: name != chosen.name):
        answer = chosen.answers[name]
        k = draws.robots.index(answer.robot)
        low, high = np.quantile(draws.power[:, k], [0.05, 0.95]).tolist()
        mass, price = (float(answer.full.total(q, counts)[0]) for q in ("mass", "price"))
        yield dict(
            answer=name,
            recommended=name == chosen.name,
            power_W=answer.power,
            power_low_W=low,
            power_high_W=high,
            more_power_W=answer.power - chosen.best.power,
            chance_least=least[answer.robot],
            battery_h=answer.hours,
            actuator_mass_kg=mass,
            robot_mass_kg=own_mass + mass,
            price_EUR=known(price),
            chance_within=float(draws.within[:, k].mean()),
            **nearest(worst(chosen.search, answer.full)),
            design=words(chosen, answer.robot),
        )
    yield from today_rows(chosen)


def today_rows(chosen: Chosen) -> Iterator[Row]:
    """A row of table ``answers`` for each drivetrain of the robot's file with a motor.

    Its bodies hold these actuators as they are. Every joint has a driver of the choice, and none a
    brake; limits of gears, which the file does not state, are not judged.
    """
    problem, shelf = chosen.problem, chosen.search.shelf
    if not problem.machine.motors.stated:
        return  # they are some robot's, not this one's
    common, joints = (problem.machine, problem.modes), problem.machine.robot.joints
    loads = [*loads_of(*common)[0], *(load for (load,) in cases_of(*common, [{}]))]
    share = np.array([load.mode.hours for load in loads]) / sum(m.hours for m in problem.modes)
    driver = driver_of(shelf.driver, shelf.values(shelf.driver))
    margins, bus = shelf.margins, driver.voltage_share * shelf.voltage
    most = {"speed": np.inf, "voltage": bus, "current": driver.peak_current}
    most["rms_current"] = driver.continuous_current
    margin = {"speed": margins.speed, "voltage": margins.speed, "rms_current": margins.torque}
    for name, chain in problem.machine.chains().items():
        if name == IDEAL:
            continue
        power, limits = np.full(len(loads), problem.wanted.value("hotel", 0.0)), []
        for m, load in enumerate(loads):
            result, locked = as_held(chain, load, chosen.search.held.place)
            flow = result.electrical_power + driver.loss(result.current, shelf.voltage)
            out = supply_of(flow - driver.idle, load.series.time, joints, problem.wanted.recovered)
            power[m] += out.supplied_energy.sum() / duration(load.series.time)
            power[m] += driver.idle * (len(joints) - locked * (not load.mode.drivers))
            for row in chain_limits(result):
                if load.mode.hours or row.quantity != "rms_current":
                    used = row.peak / min(row.limit, most[row.quantity])
                    where = f"motor's {row.quantity} of {row.joint}, {load.mode.name}"
                    limits.append((used * margin.get(row.quantity, 1.0), where))
        use, where = max(limits)
        yield dict.fromkeys(declared("answers")) | dict(
            answer=f"today: {name}",
            recommended=False,
            power_W=float(power @ share),
            more_power_W=float(power @ share) - chosen.best.power,
            battery_h=problem.battery.hours(power[share > 0.0], share[share > 0.0]),
            actuator_mass_kg=problem.present * len(joints),
            robot_mass_kg=problem.machine.edited.mass,
            nearest_limit=where.replace("_", " "),
            limit_use=use,
            design="as the robot's file has them",
        )


def as_held(chain: Drivetrains, load: Load, place: float | Array) -> tuple[ChainResult, int]:
    """What a mode takes, at rest at a place in the band of friction, and how many joints lock."""
    result, asked = chain.inverse(load.series), load.series.torque
    if not load.mode.stands:
        return result, 0
    at = load.series.position
    held, sign = chain.holding(asked, at), np.sign(asked)
    locks = chain.holding(np.full_like(asked, _ANY_TORQUE), at).motor_torque == 0.0
    least, most = np.abs(held.motor_torque), np.where(sign > 0.0, held.high, -held.low)
    place = place if load.mode.hours else 1.0  # in a load case motors have to be able to lift
    torque = sign * ~locks * (least + place * (most - least))
    current = torque / np.array([motor.torque_constant for motor in result.motors])
    volts = current * np.array([motor.resistance for motor in result.motors])
    still = replace(result, current=current, voltage=volts, electrical_power=volts * current)
    return still, int(locks[0].sum())


def nearest(found: tuple[str, str, str, float]) -> Row:
    """The limit of which most is used, its group and mode, and the share; see `worst`."""
    group, limit, mode, use = found
    return {"nearest_limit": f"{limit} of {group}, {mode}", "limit_use": use}


def front_rows(chosen: Chosen) -> Iterator[Sequence[Any]]:
    """The Pareto front of power and mass."""
    names = {answer.robot: name for name, answer in [*chosen.answers.items()][::-1]}
    for k, robot in enumerate(chosen.front, start=1):
        own = chosen.search.known[robot]
        hours = chosen.best.battery.hours(np.array([own.power]), np.ones(1))
        row = (k, own.power, hours, own.mass, known(own.price))
        yield (*row, names.get(robot, ""), words(chosen, robot))


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
        found, count = chosen.search.evaluated(robots), chosen.search.counts[g]
        for k, robot in enumerate(robots):
            motor, gear, brake = robot[g]
            yield dict(
                group=group,
                rank=k,
                motor=motor,
                gear=gear,
                ratio=float(found.parts[g].ratio[k]),
                brake=brake,
                power_W=float(found.power[k]),
                more_power_W=float(found.power[k] - found.power[0]),
                actuator_mass_kg=float(found.parts[g].mass[k]) * count,
                price_EUR=known(float(found.parts[g].price[k]) * count),
                **nearest(worst(chosen.search, found, k)),
            )


def counted(tracks: Sequence[ModeSeries]) -> Iterator[tuple[int, ModeSeries, str]]:
    """The modes of the mission and the load cases, with what they are."""
    for m, track in enumerate(tracks):
        if track.share > 0.0:
            yield m, track, "stands" if track.mode.stands else "moves"
        elif not track.mode.hours:
            yield m, track, "load case"


def limit_rows(chosen: Chosen) -> Iterator[Sequence[Any]]:
    """How much of each limit the recommended robot uses in each mode and load case."""
    every = zip(chosen.best.demand.groups.items(), chosen.best.full.groups, strict=True)
    for (group, tracks), own in every:
        for limit, use in own.use.items():
            for m, track, kind in counted(tracks):
                if use[0, m] > 0.0:
                    case = kind if kind == "load case" else "mode"
                    yield group, limit, track.mode.name, case, float(use[0, m])


def day_rows(chosen: Chosen) -> Iterator[Row]:
    """Every mode at every group, and the robot's."""
    best = chosen.best
    at = np.flatnonzero(best.full.shares)
    hours = np.array([chosen.search.tracks[m].mode.hours for m in at.tolist()])
    energy = float(best.full.modes[0][at] @ hours)
    for m, time in zip(at.tolist(), hours.tolist(), strict=True):
        rows = {
            group: {name: float(own.causes[name][0, m]) for name in CAUSES}
            for group, own in zip(chosen.problem.groups, best.full.groups, strict=True)
        }
        rows[ROBOT] = {name: sum(own[name] for own in rows.values()) for name in CAUSES}
        rows[ROBOT]["idle"] += best.full.hotel
        for group, causes in rows.items():
            power = sum(causes.values())
            yield dict(
                mode=chosen.search.tracks[m].mode.name,
                group=group,
                hours=time,
                power_W=power,
                energy_Wh=power * time,
                share_of_day=power * time / energy,
                **{f"{name}_W": value for name, value in causes.items()},
            )


def standing_rows(chosen: Chosen) -> Iterator[Sequence[Any]]:
    """The best of each family at every share of standing."""
    assert chosen.envelope is not None
    for family, robots in chosen.envelope.robots.items():
        each = zip(STANDING, robots, chosen.envelope.power[family], strict=True)
        for share, robot, power in each:
            mass = chosen.search.known[robot].mass
            yield family, float(share), float(power), mass, words(chosen, robot)


def unknown_rows(chosen: Chosen) -> list[Sequence[Any]]:
    """What the answer's power depends on, what moves it most first."""
    draws, rows = chosen.monte_carlo, []
    moved = zip(draws.sensitivity.tolist(), draws.variance_share.tolist(), strict=True)
    for (part, entry, number), own in zip(draws.unknowns, moved, strict=True):
        low, high = (from_si(x, number.unit) for x in (number.low, number.high))
        rows.append((part, entry, low, high, number.unit, *own))
    return sorted(rows, key=lambda row: -row[-1])


def point_rows(chosen: Chosen) -> Iterator[Sequence[Any]]:
    """Speed and torque of the joints in every mode and load case."""
    for group, tracks in chosen.best.demand.groups.items():
        for _, track, kind in counted(tracks):
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
            for curve in CURVES if k == 0 else CURVES[:1]:
                for speed, torque in outline(design, curve):
                    yield group, design_words(robot[g]), k == 0, curve, speed, torque


def outline(design: Designs, curve: str) -> Iterator[tuple[float, float]]:
    """Greatest torque at the joint over its speed, driving: (rad/s, N*m) of one design."""
    d = {name: float(v[0]) for name, v in vars(design).items() if name != "parts"}
    n, k, ohms = d["ratio"], d["torque_constant"], d["resistance"] + d["driver_resistance"]
    most = min(d["max_speed"], d["gear_speed"], d["voltage"] / k) / n
    amperes = d["continuous_current" if curve == "continuous" else "peak_current"]
    for speed in np.linspace(0.0, most, 41).tolist():
        motor = k * min(amperes, (d["voltage"] - k * n * speed) / ohms)
        left = motor - d["coulomb"] - d["viscous"] * n * speed
        torque = max(left, 0.0) * n / (1.0 + d["load"])
        yield speed, min(torque, d[f"gear_{curve}"])
