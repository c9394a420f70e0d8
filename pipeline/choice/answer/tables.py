"""The tables of a choice; their columns are declared in `pipeline/columns.csv`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

import numpy as np

from actuators.arrays import Array
from actuators.energy.energy import integral
from actuators.loading.build import WINDING
from actuators.units import from_si, known_units
from pipeline.choice.choose import Chosen
from pipeline.choice.full import Full, lasting
from pipeline.choice.loads import Load
from pipeline.choice.parts.shelf import fit_of, listed_pairs
from pipeline.choice.search import Demanded
from pipeline.columns import frame

if TYPE_CHECKING:
    from pandas import DataFrame

Row = dict[str, Any]
ROBOT = "robot"
ZERO_CELSIUS = 273.15  # [K]
_WARM = ("warming_W", "winding_degC", "winding_peak_degC", "winding_limit_degC")


def tables_of(chosen: Chosen) -> dict[str, DataFrame]:
    """Every table of a choice."""
    day = list(day_rows(chosen))
    rows: dict[str, Iterable[Any]] = {
        "answer": answer_rows(chosen, day),
        "front": front_rows(chosen),
        "ten_best": best_rows(chosen),
        "excluded": excluded_rows(chosen),
        "day": day,
        "unknowns": unknown_rows(chosen),
    }
    return {name: frame(name, own) for name, own in rows.items()}


def answer_rows(chosen: Chosen, day: list[Row]) -> list[Row]:
    """A row for each group, and the robot's."""
    rows, pairs = [], listed_pairs(chosen.wanted.parts)
    for group, found in chosen.found.items():
        doubt = chosen.doubts[group]
        joints = len(found.demanded.joints)
        power = sum(row["energy_Wh"] for row in day if row["group"] == group) / chosen.hours
        motor, gear, brake = chosen.answer[group]
        design = chosen.designs(group)
        low, high = np.quantile(doubt.power[:, 0], [0.05, 0.95])
        rows.append(
            dict(
                group=group,
                joints=joints,
                motor=motor,
                gear=gear,
                ratio=float(design.ratio[0]),
                brake=brake,
                spring=_springs(chosen, found.demanded.joints),
                fit=fit_of(chosen.shelf, motor, gear, pairs) or "not checked",
                driver=chosen.shelf.driver,
                battery="",
                power_W=power,
                energy_Wh_per_day=power * chosen.hours,
                battery_h=None,
                battery_kg=None,
                actuator_mass_kg=float(design.mass[0]) * joints,
                chance_best=float(doubt.chance[0]),
                power_low_W=float(low),
                power_high_W=float(high),
                regret_W=doubt.regret,
                searched_power_W=chosen.first[group],
                not_printed=chosen.shelf.not_printed(chosen.answer[group]),
            )
        )
    return [*rows, _robot_row(chosen, rows, day)]


def _robot_row(chosen: Chosen, rows: Sequence[Row], day: Sequence[Row]) -> Row:
    def total(name: str) -> Any:
        return sum(row[name] for row in rows)

    # A bus dumps what all joints return at once; by itself a group's counts as used.
    whole = sum(row["energy_Wh"] for row in day if row["group"] == ROBOT) / chosen.hours
    more = whole - total("power_W")
    doubts = list(chosen.doubts.values())
    own = np.sum([doubt.power[:, 0] for doubt in doubts], axis=0)  # the same draw of each group
    low, high = np.quantile(own, [0.05, 0.95]).tolist()
    first = np.all([doubt.winner == 0 for doubt in doubts], axis=0)
    nothing: Any = dict.fromkeys(
        ("motor", "gear", "brake", "spring", "fit", "driver", "not_printed"), ""
    )
    return dict(
        group=ROBOT,
        ratio=None,
        battery=chosen.battery.name,
        energy_Wh_per_day=(more + total("power_W")) * chosen.hours,
        battery_h=lasting(chosen.battery, chosen.day, chosen.least_voltage),
        battery_kg=chosen.battery.mass,
        chance_best=float(first.mean()),
        power_low_W=more + low,
        power_high_W=more + high,
        **{name: total(name) for name in ("joints", "actuator_mass_kg", "regret_W")},
        **{name: more + total(name) for name in ("power_W", "searched_power_W")},
        **nothing,
    )


def _springs(chosen: Chosen, joints: Sequence[str]) -> str:
    """Those of the options that stand beside actuators of some joints."""
    each = {text: text.partition("=")[0] for text in chosen.wanted.spring}
    return ", ".join(t for t, p in each.items() if any(fnmatchcase(j, p) for j in joints))


def words(design: tuple[str, str, str]) -> str:
    """Motor, gear and brake."""
    return " + ".join(part for part in design if part)


def front_rows(chosen: Chosen) -> list[Sequence[Any]]:
    """Robots that none beats in power and mass."""
    power, mass, taken = chosen.robots()
    groups = list(chosen.found.items())
    rows: list[Sequence[Any]] = []
    lasts = chosen.battery.hours(power[:, None], np.ones(1))
    for k, (p, m, which) in enumerate(zip(power, mass, taken, strict=True), start=1):
        names = [
            f"{group}: {words(found.designs.parts[found.looked[found.front[i]]])}"
            for (group, found), i in zip(groups, which, strict=True)
        ]
        energy, hours = float(p) * chosen.hours, float(lasts[k - 1])
        rows.append((k, float(p), energy, hours, float(m), "; ".join(names)))
    return rows


def best_rows(chosen: Chosen) -> Iterator[Row]:
    """The ten best of each group, and why nine of them lost."""
    for group, found in chosen.found.items():
        doubt = chosen.doubts[group]
        designs = chosen.shelf.designs(chosen.candidates[group])
        nominal = found.demanded.power(designs, chosen.wanted.account)
        # Where the power goes, mean over the mission [W].
        out = {name: np.zeros(len(designs)) for name in ("windings", "drivers", "brakes")}
        for track in found.demanded.tracks:
            torque = track.torque(designs)
            current = torque / designs.torque_constant[:, None, None]
            square = np.einsum("dnj,n->d", current**2, track.weight)
            mean = np.einsum("dnj,n->d", np.abs(current), track.weight)
            driver = designs.driver_resistance * square + designs.switching * designs.bus * mean
            driver = driver + designs.idle * track.drivers(designs, torque)
            held = np.einsum("nj,n->", (~track.rest | (not track.engaged)) * 1.0, track.weight)
            out["windings"] += track.share * designs.resistance * square
            out["drivers"] += track.share * driver
            out["brakes"] += track.share * designs.brake_power * held
        losses = out | {"friction and returns": nominal - sum(out.values())}
        limits = found.demanded.limits(designs)
        best, carried = doubt.order[0], doubt.score - doubt.power
        for rank, k in enumerate(doubt.order[:10], start=1):
            motor, gear, brake = designs.parts[k]
            use = {name: float(share[k]) for name, share in limits.items()}
            limit = max(use, key=lambda name: use[name])
            more = {n: each[k] - each[best] for n, each in losses.items()}
            more["mass"] = float(np.mean(carried[:, k] - carried[:, best]))
            worst = max(more, key=lambda name: more[name])
            yield dict(
                group=group,
                rank=rank,
                motor=motor,
                gear=gear,
                ratio=float(designs.ratio[k]),
                brake=brake,
                power_W=float(doubt.power[:, k].mean()),
                nominal_power_W=float(nominal[k]),
                more_than_best_W=float(doubt.expected[k] - doubt.expected[best]),
                actuator_mass_kg=float(designs.mass[k]) * len(found.demanded.joints),
                chance_best=float(doubt.chance[k]),
                chance_within=float(doubt.within[:, k].mean()),
                nearest_limit=limit,
                limit_use=use[limit],
                lost_by="" if k == best else f"{worst}: {more[worst]:+.3g} W",
                not_printed=chosen.shelf.not_printed((motor, gear, brake)),
            )


def excluded_rows(chosen: Chosen) -> Iterator[Sequence[Any]]:
    """Mask limit removed how many."""
    for group, found in chosen.found.items():
        over = {name: share > 1.0 for name, share in found.use.items()}
        count = np.sum(list(over.values()), axis=0)
        for name, own in over.items():
            yield (
                group,
                name,
                int(own.sum()),
                int((own & (count == 1)).sum()),
                len(found.designs),
                len(found.within),
            )


def day_rows(chosen: Chosen) -> Iterator[Row]:
    """Every mode at every group through the full chains, and the robot's."""
    total = sum(full.load.mode.hours * full.total for full in chosen.day)
    warm = {group: _warm(chosen, group) for group in chosen.found}
    nothing = dict.fromkeys([c for columns in _LIMITS.values() for c in columns] + [*_WARM])

    def row(load: Load, group: str, power: float, **others: Any) -> Row:
        energy = power * load.mode.hours
        share = energy / total if total else 0.0
        head = {
            "mode": load.mode.name,
            "group": group,
            "hours": load.mode.hours,
            "power_W": power,
            "energy_Wh": energy,
            "share_of_day": share,
        }
        return {**head, "cost_of_transport": None, **nothing, **others}

    for k, full in enumerate(chosen.day):
        load, means = full.load, _means(full)
        for group, found in chosen.found.items():
            at = [load.series.joints.index(joint) for joint in found.demanded.joints]
            sums = {name: float(mean[at].sum()) for name, mean in means.items()}
            # What the worst joint uses of every limit in one mode.
            design = chosen.designs(group)
            use = Demanded.of(group, chosen.found[group].demanded.joints, [load]).limits(design)
            limits: dict[str, float] = {}
            for (limit, number), (used, most) in _LIMITS.items():
                if np.isfinite(bound := float(getattr(design, number)[0])):
                    limits |= {used: float(use[limit][0]) * bound, most: bound}
            yield row(load, group, float(full.power[at].sum()), **sums, **limits, **warm[group][k])
        sums = {name: float(mean.sum()) for name, mean in means.items()}
        sums["idle_W"] += chosen.wanted.account.hotel
        sums["returned_W"] = full.lost
        if load.speed:
            sums["cost_of_transport"] = full.total / (load.weight * load.speed)
        yield row(load, ROBOT, full.total, **sums)


def _means(full: Full) -> dict[str, Array]:
    """Where the power of one mode goes, mean of every joint, by column (J,) [W]."""
    time, result = full.load.series.time, full.result
    out = {
        "mechanical_W": integral(time, result.joint.power) / full.load.duration,
        "driver_W": full.driver,
        "returned_W": full.dumped,
        "idle_W": full.idle,
    }
    out |= {name: np.zeros(len(full.idle)) for name in ("friction_W", "brakes_W")}
    for name, loss in result.losses.items():
        column = {WINDING: "winding_W", "brake": "brakes_W"}.get(name, "friction_W")
        out[column] = out.get(column, 0.0) + integral(time, loss) / full.load.duration
    return out


def _warm(chosen: Chosen, group: str) -> list[dict[str, float]]:
    """Temperature of a group's windings in every mode, through the full chains."""
    day: list[Full] = chosen.day
    at = [day[0].load.series.joints.index(j) for j in chosen.found[group].demanded.joints]
    copper = np.stack([_means(full)["winding_W"][at] for full in day], axis=1)
    design = chosen.designs(group)
    found = design.day([full.load.mode.hours for full in day], copper)
    more = (copper * (found.resistance - 1.0)).sum(axis=0)
    peak, limit = (float(x - ZERO_CELSIUS) for x in (found.peak.max(), design.winding_limit[0]))
    warmest = found.winding.max(axis=0) - ZERO_CELSIUS
    each = zip(more.tolist(), warmest.tolist(), strict=True)
    return [dict(zip(_WARM, (*mode, peak, limit), strict=True)) for mode in each]


#: Limit of a search and number of the design to the columns of what is used and of the limit.
_LIMITS = {
    ("continuous current", "continuous_current"): ("rms_current_A", "continuous_current_A"),
    ("peak current", "peak_current"): ("peak_current_A", "most_current_A"),
    ("motor's speed", "max_speed"): ("speed_rad_s", "most_speed_rad_s"),
    ("voltage", "voltage"): ("voltage_V", "most_voltage_V"),
    ("gear's continuous torque", "gear_continuous"): ("gear_rms_Nm", "gear_continuous_Nm"),
    ("gear's peak torque", "gear_peak"): ("gear_peak_Nm", "gear_most_Nm"),
}


def unknown_rows(chosen: Chosen) -> list[Sequence[Any]]:
    """What is worth measuring, the most worth first; what groups share, once."""
    found: dict[tuple[str, str], list[Any]] = {}
    for group, doubt in chosen.doubts.items():
        known = zip(doubt.unknowns, doubt.worth(), doubt.moves(), strict=True)
        for (part, entry, number), worth, moves in known:
            unit = number.unit if number.unit in known_units() else "1"  # a model file has SI
            low, high = (from_si(x, unit) for x in (number.low, number.high))
            row = found.setdefault((part, entry), [[], low, high, number.unit, 0.0, 0.0])
            row[0].append(group)
            row[-2] += float(worth)
            row[-1] += float(moves)
    rows = [(", ".join(own[0]), *key, *own[1:]) for key, own in found.items()]
    return sorted(rows, key=lambda row: (-row[-2], -abs(row[-1])))
