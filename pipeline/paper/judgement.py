"""The paper beside what is computed: every printed number, every sentence, and what it leaves out.

What data sheets and literature say before anything is fitted (*prior*), and what sets say that are
fitted without a figure (*left out*), comes from the frozen study. *Much higher* has no number in
the paper: `sentences.csv` takes it for at least twice as high.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from actuators.arrays import Array
from actuators.chain import Chain
from actuators.elements.element import Inertia
from actuators.energy.energy import integral, loss_energies, stage_energies
from actuators.loading.build import WINDING
from actuators.units import from_si
from pipeline.columns import declared
from pipeline.paper.basis import STUDY, Basis, basis
from pipeline.paper.hexapod import PRINTED, Outcome, computed, outcomes, printed_leg, robot_part
from pipeline.paper.motor_constants import UNMET
from pipeline.paper.omissions import omissions
from pipeline.paper.published import ALTERNATIVES, CYCLE, PAIR, Published, load_published
from pipeline.robot.robot import Robot
from pipeline.simulation.machine import Machine
from pipeline.simulation.walk_stand import break_even

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


@dataclass(frozen=True)
class Judgement:
    """Ours against the paper's."""

    by: Basis  #: What it was judged by.
    #: By the name of their file; rows of `conclusions` are labelled by what they compute.
    tables: dict[str, pd.DataFrame]
    #: What the fit asks of the planetary gear's constant friction: `friction_mNm`, its `heat_J` in
    #: the printed leg in one cycle, and what that leg draws, `leg_J`.
    price: Mapping[str, float]


def judged(machine: Machine) -> tuple[Judgement | None, str]:
    """A run held against the paper, where it may be; what is to be said of that, often nothing."""
    by = basis(machine)
    if isinstance(by, str):
        return None, f"not held against the paper: {by}"
    if by is None:
        return None, ""
    return judge(machine.robot, by, samples=machine.options.samples), by.word


def judge(robot: Robot, by: Basis, *, samples: int = 751) -> Judgement:
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
    return Judgement(by, tables, price)


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
