"""The paper beside what is computed: every printed number, every sentence, and what it leaves out.

The paper describes one robot that stands and walks with one gait on level ground, and prints what
its actuators take: by what a run may be held against it, and how far the fit's study speaks of it,
is said first. What data sheets and literature say before anything is fitted (*prior*), and what
sets say that are fitted without a figure (*left out*), comes from that frozen study. *Much higher*
has no number in the paper: `sentences.csv` takes it for at least twice as high.

Every row of `omissions.csv` changes one thing against the run's own numbers: break-even and walking
ratios with it, and how far they move. Friction and winding go through the same chains as everything
else; drivers and brakes add a constant power to what these draw.

Idle power P of n drivers cancels between two actuators that walk. Standing, a reversible joint
needs its driver to hold, an irreversible one may switch it off, so that with the break-even f0 and
the holding power p without drivers

    f = f0 p / (f0 p + (1 - f0) (p + n P)).

Costs are arrays (4, 3): what each of `ALTERNATIVES` takes per cycle in the middle left and in the
middle right leg [J], and to stand [W].
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from actuators.arrays import Array
from actuators.chain import Chain
from actuators.checked import read_toml
from actuators.elements.element import Inertia
from actuators.elements.heating import COPPER
from actuators.energy import BUS, integral, loss_energies, stage_energies, supply
from actuators.loading.build import WINDING, Catalog
from actuators.parameters import dimension, from_si, parameters_from_table
from pipeline.columns import declared, frame
from pipeline.dynamics.contact_forces import PAPER
from pipeline.paper import hexapod
from pipeline.paper.hexapod import (
    PRINTED,
    Demand,
    Outcome,
    computed,
    outcomes,
    printed_leg,
    robot_part,
)
from pipeline.paper.published import ALTERNATIVES, CYCLE, PAIR, UNMET, Published, load_published
from pipeline.robot.robot import Robot
from pipeline.robot.robot_file import RobotSpec
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import break_even

if TYPE_CHECKING:
    from pandas import DataFrame

STUDY = Path(__file__).with_name("study")
Fingerprint = Mapping[str, float | str]
_SAME = 1e-8  # stored numbers have nine digits
#: A robot or an actuator built otherwise than the paper's has no such numbers to compare.
_STRUCTURE = ("legs", "gait.", "standing.feet")
_ALTERNATIVE = "alternatives."
_SHOWN = 3


class Judgement(NamedTuple):
    """Ours against the paper's, and what it was judged by."""

    results: Mapping[str, Any] | None  #: The fit's study; None where it is of other numbers.
    catalog: Catalog  #: The paper's own alternatives among the run's.
    word: str  #: What to say of actuators and numbers that differ; empty where none does.
    #: By the name of their file; rows of `conclusions` are labelled by what they compute.
    tables: Mapping[str, pd.DataFrame] = MappingProxyType({})
    #: What the fit asks of the planetary gear's constant friction: `friction_mNm`, its `heat_J` in
    #: the printed leg in one cycle, and what that leg draws, `leg_J`.
    price: Mapping[str, float] = MappingProxyType({})


def basis(given: Machine) -> Judgement | str | None:
    """What a run may be judged by, or why not at all, in words; None for any other robot."""
    study = json.loads((STUDY / "fitted.json").read_text(encoding="utf-8"))
    spec, stored = given.robot.spec, study["numbers"]
    if spec.path.name != study["robot"]:
        return None
    catalog, own = given.catalog.only(ALTERNATIVES), given.own.usual or given.own.groups
    differ = differences(stored, fingerprint(spec, catalog))
    if "legs" in differ:
        return None
    reasons = {
        "its joints have actuators of their own, of which the paper says nothing": bool(own),
        "a model file changes the robot, and the paper knows nothing of its effects": (
            given.model_file is not None
        ),
        "the paper's ground forces are the least tangential ones, this run's are others": (
            given.forces != PAPER
        ),
        "in the paper energy that flows back is lost, in this run it is used again": (
            given.options.regeneration != "none"
        ),
    }
    for name in ALTERNATIVES:
        words = f"no actuator alternative is built as the paper's '{name}'"
        reasons[words] = f"{_ALTERNATIVE}{name}" in differ
    built = [name for name in differ if name.startswith(_STRUCTURE)]
    reasons |= {f"{name} differs from the paper's": True for name in built}
    said = [
        f"the paper says nothing of '{name}': left out"
        for name in given.catalog.alternatives
        if name not in ALTERNATIVES
    ]
    for reason, there in reasons.items():
        if there:
            return reason
    if differ:
        more = f" and {len(differ) - _SHOWN} more" if len(differ) > _SHOWN else ""
        said.append(
            f"not the calibration's: {', '.join(differ[:_SHOWN])}{more}; what is compared with the "
            "paper was computed anew, the fit's intervals are left out"
        )
    return Judgement(None if differ else study, catalog, "; ".join(said))


def fingerprint(spec: RobotSpec, catalog: Catalog) -> Fingerprint:
    """Everything of a run that its judgement depends on, by name: SI numbers and texts."""
    out: dict[str, float | str] = {f"robot.{name}": x for name, x in spec.parameters.items()}
    out |= {f"gait.{key}": _text(value) for key, value in sorted(spec.gait.items())}
    out["standing.feet"] = repr(spec.standing_feet)
    out["legs"] = repr([(leg.name, leg.joints, leg.foot, leg.side) for leg in spec.legs])
    # No law takes a part's mass.
    parts = [(component, p) for component, p in catalog.rows() if dimension(p.unit) != "mass"]
    out |= {f"{component}.{p.name}": p.value for component, p in parts}
    for name, a in catalog.alternatives.items():
        elements = [(e.name, e.law, e.stage, sorted(e.arguments.items())) for e in a.elements]
        out[f"{_ALTERNATIVE}{name}"] = repr((a.motor, a.ratio, elements))
    return out


def _text(value: object) -> str:
    if isinstance(value, list):
        return repr(tuple(tuple(v) if isinstance(v, list) else v for v in value))
    return value if isinstance(value, str) else repr(value)


def differences(stored: Fingerprint, now: Fingerprint) -> list[str]:
    """Names under which two fingerprints differ, in order; empty where they are the same."""

    def same(a: float | str | None, b: float | str | None) -> bool:
        if isinstance(a, str) or isinstance(b, str) or a is None or b is None:
            return a == b
        return math.isclose(a, b, rel_tol=_SAME, abs_tol=1e-12)

    return [name for name in {**now, **stored} if not same(stored.get(name), now.get(name))]


ROWS_FILE, ASSUMPTIONS_FILE = (
    Path(__file__).with_name(name) for name in ("omissions.csv", "assumptions.toml")
)
_KINDS = {
    **dict.fromkeys(("gate_driver_idle", "driver_idle", "brake_open", "brake_latching"), "power"),
    **dict.fromkeys(("grease_at_0_degC", "grease_at_40_degC"), "ratio"),
    **dict.fromkeys(("hold_middle", "hold_most"), "ratio"),
    "winding_rise": "temperature",
}
#: Friction without load of what runs in grease.
_GREASED = (
    *("harmonic_drive.coulomb", "harmonic_drive.viscous", "planetary.coulomb"),
    *("pinion.coulomb", "pinion.viscous", "output_bearing.coulomb", "output_bearing.viscous"),
)
_REVERSIBLE, _IRREVERSIBLE = (ALTERNATIVES.index(name) for name in PAIR)
#: What a watt per joint adds to the costs of an alternative that walks, and to one that stands.
_WALKING = np.array([len(hexapod.JOINTS) * CYCLE, len(hexapod.JOINTS) * CYCLE, 0.0])
_STANDING = np.array([0.0, 0.0, hexapod.COLUMNS])


def costs_of(found: Mapping[str, Outcome], *, net: bool = False) -> Array:
    """Costs (4, 3), net of what flows back or not; the loaded leg alone stands."""
    rows = []
    for o in (found[name] for name in ALTERNATIVES):
        drawn, returned = (energy[0] for energy in o.energy)
        stand = printed_leg(o.holding.power).sum()
        rows.append([*(drawn - returned if net else drawn), stand])
    return np.array(rows)


def shared_bus(found: Mapping[str, Outcome], costs: Array) -> Array:
    """Costs (4, 3) with what flows back from a motor driving the others of its leg."""
    out = costs.copy()
    for k, walking in enumerate(found[name].walking for name in ALTERNATIVES):
        power = np.split(walking.electrical_power, len(hexapod.MIDDLE_LEGS), axis=1)
        legs = (supply(replace(walking, electrical_power=own), BUS) for own in power)
        out[k, :2] = [leg.supplied_energy.sum() for leg in legs]
    return out


def _standing_power(outcome: Outcome, share: float) -> float:
    """What the printed leg draws to stand at a place in the band of torques that hold [W].

    `share` goes from the torque of least magnitude (0) to that of the greatest (1).
    """
    held, motor = outcome.holding, outcome.chain.driven
    least = held.motor_torque
    most = np.where(np.abs(held.low) > np.abs(held.high), held.low, held.high)
    current = (least + share * (most - least)) / motor.torque_constant
    return float(printed_leg(current**2 * motor.resistance).sum())


def answers(costs: Array) -> Array:
    """Break-even, NaN where there is none, and the printed leg's walking ratios, (4,)."""
    more = costs[_IRREVERSIBLE] - costs[_REVERSIBLE]
    even = break_even(float(more[:2].sum()), float(-more[2] * CYCLE))
    return np.array([even, *(costs[1:, hexapod.PRINTED] / costs[0, hexapod.PRINTED])])


def omissions(demand: Demand, catalog: Catalog) -> DataFrame:
    """Every row, the paper's own way first; the catalogue has the paper's four alternatives."""
    found = outcomes(demand, catalog)
    base = costs_of(found)
    motors = {catalog.alternatives[name].motor for name in ALTERNATIVES}

    def scaled(keys: Iterable[str], factor: float) -> Array:
        values = {key: factor * catalog.parameter(key).value for key in keys}
        return costs_of(outcomes(demand, catalog, values))

    def braked(watt: float) -> Array:
        out = base.copy()
        out[_REVERSIBLE] = [1, 1, 0] * base[_REVERSIBLE] + watt * _WALKING
        return out

    def held(share: float) -> Array:
        out = base.copy()
        for k, name in enumerate(ALTERNATIVES[:_IRREVERSIBLE]):
            out[k, 2] = _standing_power(found[name], share)
        return out

    stands_on = np.arange(len(ALTERNATIVES)) != _IRREVERSIBLE  # with its drivers on
    ways: dict[str, Callable[[float], Array]] = {
        "nothing": lambda _: base,
        "drivers": lambda watt: base + watt * (_WALKING + stands_on[:, None] * _STANDING),
        "grease": lambda times: scaled(_GREASED, times),
        "winding": lambda rise: scaled([f"{m}.resistance" for m in motors], 1 + COPPER * rise),
        "shared": lambda _: shared_bus(found, base),
        "stored": lambda _: costs_of(found, net=True),
        "brakes": braked,
        "hold": held,
    }
    stated = parameters_from_table(read_toml(ASSUMPTIONS_FILE), _KINDS, ASSUMPTIONS_FILE.name)
    rows = []
    with ROWS_FILE.open(encoding="utf-8", newline="") as file:
        for way, name, left_out, assumption, note in [*csv.reader(file)][1:]:
            number = stated.parameter(name) if name else None
            costs = ways[way](number.value if number else 0.0)
            cells: list[Any] = [None, "", "", ""]
            if number:
                cells = [number.value_as_written, number.unit, number.basis, number.source]
            even, *ratios = answers(costs)
            even_change, *changes = answers(costs) - answers(base)
            numeric = [even, even_change, *ratios, *changes]
            rows.append([left_out, assumption, *cells, *map(float, numeric), note])
    return frame("omissions", rows)


SENTENCES_FILE = Path(__file__).with_name("sentences.csv")
REPRODUCED = "reproduced"
MINUTE = 60.0  # [s]
#: The pair of legs of which Fig. 21 shows a minute.
SUBJECT = "middle_legs"
#: Of the motor's data sheet, to hold the calibration against: maxon RE 40 148867, older edition, as
#: quoted in the calibration files of the MEKA M3 robot [A].
NO_LOAD_CURRENT = 0.137
#: A no-load current above the data sheet's by more than this is called out.
NOTABLE = 1.3
#: Columns of the study to those of each table.
_NAMES = {
    "reproduction": {"posterior_share": "met_share"},
    "conclusions": {f"{x}_share": f"{x}_holds_share" for x in ("prior", "left_out", "posterior")},
    "break_even": {"remark": "note"},
}


def judged(machine: Machine) -> tuple[Judgement | None, str]:
    """A run held against the paper, where it may be; what is to be said of that, often nothing."""
    by = basis(machine)
    if isinstance(by, str):
        return None, f"not held against the paper: {by}"
    if by is None:
        return None, ""
    return judge(machine.robot, by, samples=machine.options.samples), by.word


def judge(robot: Robot, by: Judgement, *, samples: int = 751) -> Judgement:
    """Judge the robot and its actuators as they stand, with so many samples per half period."""
    fitted = by.results is not None
    part = robot_part(robot.spec, samples)
    found = outcomes(part.demand, by.catalog)
    ours = computed(part, found)
    tables = {
        "reproduction": reproduction(load_published(), ours, fitted=fitted),
        "conclusions": conclusions(ours | comparisons(ours, found), fitted=fitted),
        **fig_21(found, fitted=fitted),
        "omissions": omissions(part.demand, by.catalog),
    }
    heat = loss_energies(found["irreversible"].walking)["planetary_friction"]
    price = {
        "friction_mNm": from_si(by.catalog.parameter("planetary.coulomb").value, "mN*m"),
        "heat_J": float(printed_leg(heat).sum()),
        "leg_J": float(found["irreversible"].drawn[0, PRINTED]),
    }
    return by._replace(tables=tables, price=price)


def _with_study(table: str, rows: pd.DataFrame, *, fitted: bool) -> pd.DataFrame:
    """Rows labelled by ids, with what the study says of them where it belongs to their numbers."""
    known = pd.read_csv(STUDY / "known.csv", index_col="id")
    known = known[(known.pop("table") == table) & fitted].reindex(rows.index)
    remark = rows["remark"].str.cat(known.pop("remark").fillna(""), sep="; ").str.strip("; ")
    out = rows.join(known).assign(remark=remark).rename(columns=_NAMES[table])
    return out[[name for name in declared(table) if name]]


def reproduction(
    published: Mapping[str, Published], ours: Mapping[str, float], *, fitted: bool
) -> pd.DataFrame:
    """Every printed number, what it is here, and what that proves.

    Args:
        published: The printed values.
        ours: What is computed, SI, by id.
        fitted: Whether the study belongs to these numbers.
    """
    rows = []
    for p in published.values():
        computed = from_si(ours[p.id], p.unit)
        missed = "contradicted" if p.id in UNMET else "not reproduced"
        verdict = REPRODUCED if p.reproduced(computed) else missed
        remark = p.note if p.role == "contradicted" else ""
        more = {"computed": computed, "error": computed - p.value, "verdict": verdict}
        rows.append({**asdict(p), "published": p.value, **more, "remark": remark})
    labelled = pd.DataFrame(rows).set_index("id", drop=False)
    return _with_study("reproduction", labelled, fitted=fitted)


def sentences() -> pd.DataFrame:
    """The sentences of sections V and IV.A by id, the latter at every joint that they speak of.

    Columns are those of the table, and the bounds of what is true of ours: `at_least`,
    `more_than`, `at_most`.
    """
    texts = dict.fromkeys(("id", "joints", "printed"), str)
    said = pd.read_csv(SENTENCES_FILE, dtype=texts)
    said = said.fillna({"joints": "", "at_least": -np.inf, "more_than": -np.inf, "at_most": np.inf})
    said = said.assign(joint=said["joints"].str.split(" "), remark="").explode("joint")
    return said.set_index(said["id"].str.cat(said["joint"], sep=" ").str.strip().rename("id_"))


def conclusions(ours: Mapping[str, float], *, fitted: bool) -> pd.DataFrame:
    """Every sentence about numbers, and whether it holds for ours.

    Args:
        ours: What is computed, SI, by the sentences' ids.
        fitted: Whether the study belongs to these numbers.
    """
    said = sentences()
    x = np.array([from_si(ours[i], unit) for i, unit in zip(said.index, said["unit"], strict=True)])
    holds = (x >= said["at_least"]) & (x > said["more_than"]) & (x <= said["at_most"])
    return _with_study("conclusions", said.assign(computed=x, holds=holds), fitted=fitted)


def comparisons(ours: Mapping[str, float], found: Mapping[str, Outcome]) -> dict[str, float]:
    """What sentences compare beside printed numbers, by their ids.

    ``<energy> / <energy> <joint>`` is of section IV.A: energies of the middle right leg per cycle,
    NaN where nothing is below. Of section V, `ideal_most` is by how much the ideal actuator draws
    more than any other to stand [J in 3 s], `ordered` the least step from one actuator to the next
    with more friction, `ideal_conversion` the winding's heat over what the ideal actuator draws to
    walk, `inertia_<name>` what walking draws over the same without inertia of the drive's parts.
    """
    light = {name: Outcome(found[name].demand, _light(found[name].chain)) for name in found}
    drawn = {name: float(outcome.drawn[0, PRINTED]) for name, outcome in found.items()}
    standing = np.array([ours[f"{name}_leg_energy_3s"] for name in ALTERNATIVES])
    heat = loss_energies(found["ideal"].walking)[WINDING]
    out = {
        "ideal_most": float(standing[0] - standing[1:].max()),
        "ordered": float(-np.diff(standing).max()),
        "ideal_conversion": float(printed_leg(heat).sum()) / drawn["ideal"],
    }
    for name in ("rotor", *PAIR):
        out[f"inertia_{name}"] = drawn[name] / float(light[name].drawn[0, PRINTED])
    energy: dict[str, Array] = {}
    for name, outcome in {**found, "rotor without inertia": light["rotor"]}.items():
        walk = outcome.walking
        for stage, (forward, reverse) in stage_energies(walk).items():
            energy |= {f"{name}:{stage}+": forward, f"{name}:{stage}-": reverse}
        losses = [power for element, power in walk.losses.items() if element != WINDING]
        if losses:
            energy[f"{name}:dissipated"] = integral(walk.joint.time, np.sum(losses, axis=0))
    for label, row in sentences().to_dict("index").items():
        if " / " in row["id"]:
            over, under = (
                float(printed_leg(energy[name])[0, int(row["joint"]) - 1])
                for name in row["id"].split(" / ")
            )
            out[str(label)] = over / under if under else math.nan
    return out


def _light(chain: Chain) -> Chain:
    """A drivetrain whose parts have no inertia."""
    each = (replace(e, inertia=0.0) if isinstance(e, Inertia) else e for e in chain.elements)
    return replace(chain, elements=tuple(each))


def fig_21(found: Mapping[str, Outcome], *, fitted: bool) -> dict[str, pd.DataFrame]:
    """Fig. 21 of both middle legs: energy in a minute over the time spent standing, the crossing.

    Standing on three feet, the lifted leg holds its own weight. `fitted` says whether the study
    belongs to these outcomes.
    """
    cycle = {name: float(o.drawn.sum()) for name, o in found.items()}  # [J]
    stand = {name: float(o.holding.power.sum()) for name, o in found.items()}  # [W]
    lines = pd.read_csv(STUDY / "bands.csv").assign(subject=SUBJECT)
    share = lines["standing_fraction"]
    walking = (1 - share) * lines["alternative"].map(cycle) / CYCLE  # [W]
    lines["energy_J"] = MINUTE * (walking + share * lines["alternative"].map(stand))
    if not fitted:
        lines[["prior_low_J", "prior_high_J", "left_out_low_J", "left_out_high_J"]] = np.nan
    more = cycle["irreversible"] - cycle["reversible"]
    saved = stand["reversible"] - stand["irreversible"]
    note = "above this share of standing the irreversible actuator uses less"
    if saved <= 0:
        note = "no break-even: standing, the irreversible actuator uses no less than the reversible"
    if more <= 0:
        note = "no break-even: walking, the irreversible actuator uses no more than the reversible"
    crossing = pd.DataFrame({"subject": SUBJECT, "remark": note}, index=[SUBJECT])
    crossing["standing_fraction"] = break_even(more, saved * CYCLE)
    return {
        "break_even": _with_study("break_even", crossing, fitted=fitted),
        "energy_per_minute": lines[[name for name in declared("energy_per_minute") if name]],
    }
