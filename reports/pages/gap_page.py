"""The pages of `gap` and `gap power`, and the answer in at most ten sentences.

The words of the answer are `templates/gap_answer.j2`; here is what goes into them, and where, whose
motors and what has changed. Reasons of levels stand in `pipeline.identification.results`. A page is
figures, tables, and a template that shows them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pipeline.effects.base import EVERY
from pipeline.effects.bodies import AXES, RigidBodyParameters
from pipeline.identification.residual import WHOLE
from pipeline.identification.results import INDISTINGUISHABLE, UNEXPLAINED
from pipeline.identification.supply import account
from pipeline.identification.workflow.changed import BODY
from pipeline.identification.workflow.outcome import Outcome
from pipeline.simulation.walk_stand import IDEAL
from reports.figures.gap import in_time_figure, power_time_figure
from reports.figures.style import save_figure
from reports.page import number, percent, rendered, unit_text, write_page
from reports.pages.robot_page import motors_text

if TYPE_CHECKING:
    from pandas import DataFrame

Tables = Mapping[str, "DataFrame"]
#: Sentences of an answer; names, bodies or joints in one of them.
_SENTENCES, _MANY = 10, 3
_COSTS: Final = (("cycle", "J"), ("standing", "W"))


def answer(outcome: Outcome, tables: Tables) -> list[str]:
    """What is missing, where, how much smaller the gap is with it, what is left, what it costs."""
    left = outcome.held.left
    told = "bodies" in tables and "changed" not in tables
    every = tables["bodies"].to_dict("records") if told else []
    rest = tables["rest"].sort_values("share", ascending=False) if "rest" in tables else None
    energy = outcome.energy
    costs = () if energy is None else energy[["cycle_J", "cycle_J_after"]].dropna().itertuples()
    if outcome.given.alternative:  # which motors turn the log's currents into torque
        motors = motors_text(outcome.given.motors)
    else:
        read = (one.recording for one in outcome.compared.logs)
        laws = (log.derived.get("torque") for log in read if log is not None)
        law = next(filter(None, laws), "")
        torque = f"torque by the servos' law ({law}), not measured," if law else "the log's torque"
        motors = f"**Whose motors:** none; {torque} is compared at the joints."
    lines = rendered(
        "gap_answer.j2",
        many=_MANY,
        suspected=outcome.suspected,
        changed=changed(tables),
        laws=_laws(outcome.given.model.joints, tables),
        nothing=tables["found"].empty,
        tried=len(tables["candidates"]),
        where=where_line(tables["where"]),
        bodies=len(every),
        differing=[_differs(row) for row in every if row["differs_in"]],
        gaps=outcome.gaps,
        noise=outcome.noise,
        unit=unit_text(outcome.unit),
        rest=[] if rest is None else rest.to_dict("records"),
        left=sorted((r for r in left if r.significant), key=lambda r: -r.ratio),
        untested=list(dict.fromkeys(r.joint for r in left if not r.rows)),
        worst=max(left, key=lambda r: r.ratio),
        limit=UNEXPLAINED,
        costs=[row for row in costs if row[0] != IDEAL],
        motors=motors,
    )
    return lines[:_SENTENCES]


def _laws(joints: Sequence[str], tables: Tables) -> list[dict[str, Any]]:
    """Each law: how sure, where it stands, how large; those written first."""
    found, classes = tables["found"], _classes(tables["candidates"])
    names = found[found["effect"] != RigidBodyParameters.name]
    if "changed" in tables:
        names = names[names["effect"] != "friction_factor"]
    laws = [*names.groupby(["written", "effect"], sort=False)]
    laws.sort(key=lambda law: (not law[0][0], -law[1]["place"].nunique()))
    out = []
    for (written, effect), rows in laws:
        places = list(dict.fromkeys(rows["place"]))
        name = f"{law_words(effect)} at {_places(places, joints)}"
        free = rows[rows["ci_low"] < rows["ci_high"]]  # what was not estimated says nothing
        like = [other for place in places for other in classes.get((effect, place), ())]
        levels = rows.drop_duplicates("place")["level"].value_counts(sort=False)
        state = " and ".join(f"{n} {level}" if len(levels) > 1 else level
                             for level, n in levels.items())  # fmt: skip
        law = {
            "state": state + ("" if written else ", not written"),
            "name": f"one of {name} or {', '.join(like[:_MANY])}" if like else name,
            "sizes": [_size(own) for _, own in free.groupby("parameter", sort=False)],
            "reason": "" if like else next(filter(None, rows["reason"]), ""),
        }
        out.append(law)
    return out


def changed(tables: Tables) -> list[str]:
    """What is another than in the model file that was given; empty where nothing is, or no file."""
    if "changed" not in tables:
        return []
    rows, said = tables["changed"], []
    for link, own in rows[rows["what"] == BODY].groupby("place", sort=False):
        by = {row["quantity"]: row for row in own.to_dict("records")}
        mass = by["mass"]
        if f"centre {AXES[0]}" in by:
            at = ", ".join(
                f"{axis} {number(own['value'], 2)} ± "
                f"{number((own['ci_high'] - own['ci_low']) / 2, 1)}"
                for axis, own in ((axis, by[f"centre {axis}"]) for axis in AXES)
            )
            more = "more" if mass["value"] > 0.0 else "less"
            low, high = sorted(abs(mass[end]) for end in ("ci_low", "ci_high"))
            said.append(
                f"{number(abs(mass['value']))} kg {more} on {link} (95 % {number(low)} to "
                f"{number(high)}), at {at} m of its joint's frame"
            )
        else:
            far = ", ".join(number(by[f"first moment {axis}"]["value"], 2) for axis in AXES)
            said.append(f"first moment of {link} by {far} kg·m")
    for row in rows[rows["what"] == "friction_factor"].to_dict("records"):
        more, ends = row["value"] - 1.0, (row["ci_low"] - 1.0, row["ci_high"] - 1.0)
        low, high = sorted(abs(100.0 * end) for end in ends)
        said.append(
            f"friction at {row['place']} {percent(abs(more))} {'higher' if more > 0 else 'lower'} "
            f"(95 % {low:.0f} to {high:.0f} %)"
        )
    return said


def _classes(candidates: DataFrame) -> dict[tuple[str, str], list[str]]:
    """Effect and place to the names that explain the log as well."""
    like = candidates[candidates["verdict"].str.startswith(INDISTINGUISHABLE)]
    out = {}
    for row in like.to_dict("records"):
        names = row["verdict"].removeprefix(INDISTINGUISHABLE).split("; ")
        parts = [name.partition(" at ") for name in names]
        out[row["effect"], row["place"]] = [
            f"{law_words(effect)} at {_places([place], ())}" for effect, _, place in parts
        ]
    return out


def law_words(effect: str) -> str:
    """An effect's name as people write it."""
    text = effect.replace("_", " ")
    return text.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck")


def _places(places: Sequence[str], joints: Sequence[str]) -> str:
    """Places in words: all joints, all but the others where these are fewer, or each by name."""
    if len(places) < 3 or not {*places} <= {*joints}:
        words = {EVERY: "all joints", "": "the whole machine"}
        named = (EVERY if p.startswith(f"{EVERY}__") else p for p in places)
        return " and ".join(words.get(p, p.replace("+", " with ")) for p in named)
    others = [joint for joint in joints if joint not in places]
    if not others:
        return f"all {len(joints)} joints"
    few = len(others) < len(places)
    names = f"{'not ' * few}{', '.join(others if few else places)}"
    return f"{len(places)} of {len(joints)} joints ({names})"


def _size(rows: DataFrame) -> str:
    """One parameter of a law: its value and interval at one place, its range at several."""
    row, unit = rows.iloc[0], f" {unit_text(rows['unit'].iloc[0])}"
    unit = "" if unit in (" ", " 1") else unit
    if len(rows) > 1:
        low, high = number(rows["value"].min()), number(rows["value"].max())
        return f"{row['parameter']} {low} to {high}{unit}"
    ends = f"{number(row['ci_low'])} to {number(row['ci_high'])}"
    return f"{row['parameter']} {number(row['value'])}{unit}, 95 % {ends}"


def where_line(where: DataFrame) -> str:
    """Where the model as it was misses most."""
    whole = where[where["by"] == WHOLE]
    if whole.empty:
        return "No joint has enough rows to compare."
    worst = whole.iloc[0]
    return (
        f"**Where:** most at {worst['joint']}, {number(worst['gap'])} {unit_text(worst['unit'])} "
        f"root mean square: {percent(worst['share_of_total'])} of the squared gap of all "
        "joints."
    )


def _differs(row: Mapping[Any, Any]) -> str:
    """A link that differs from the URDF's beyond its interval: by what, as one thing mounted."""
    before, after = row["urdf_mass_kg"], row["found_mass_kg"]
    more, others = after - before, row["differs_in"].split("+")
    ends = " to ".join(number(row[f"{end}_mass_kg"] - before) for end in ("low", "high"))
    mass = f" {'+' * (more > 0)}{number(more, 2)} kg (95 % {ends})" if "mass" in others else ""
    if mass and more > 0.0:
        moments = [
            (a, after * row[f"found_center_{a}_m"] - before * row[f"urdf_center_{a}_m"])
            for a in AXES
            if a in others
        ]
        at = ", ".join(f"{a} {number(moment / more, 2)}" for a, moment in moments)
        mass += f" at {at} m" * bool(at)
    return f"{row['link']}{mass} ({', '.join(others)})"


def write_gap_page(outcome: Outcome, tables: Tables, folder: Path) -> None:
    """Draw the figures, and write ``index.html`` that shows them."""
    compared, model, stages = outcome.compared, outcome.given.model, outcome.held.stages
    first, last, unit = stages[0], stages[-1], outcome.unit
    predictions = first.predictions, last.predictions
    title = "Measured and predicted, without and with what was found"
    figure = in_time_figure(compared.logs, predictions, outcome.shown, unit, title=title)
    save_figure(figure, folder, "in_time")
    files = {}
    if outcome.text:
        files["model.toml"] = "Model file with the effects found; give it to any command as --model"
    settings, parts, costs = compared.loaded.settings, compared.loaded, outcome.energy
    if costs is not None:
        names = [f"{x} {when} [{u}]" for when in ("before", "after") for x, u in _COSTS]
        costs = costs.set_axis(names, axis=1).rename_axis("drivetrain option").reset_index()
    found = tables["found"][tables["found"]["effect"] != RigidBodyParameters.name]
    at_joint = found[(found["place"] == found["joint"]) & found["joint"].isin(model.joints)]
    joints = at_joint.groupby("effect")["joint"].nunique()
    several = at_joint[at_joint["effect"].isin(joints.index[joints > 1])]
    write_page(
        "gap",
        folder,
        tables,
        title=f"What the model of '{model.name}' lacks, by log "
        f"'{', '.join(m.name for m in compared.logs)}'",
        answer=answer(outcome, tables),
        files=files,
        gap_unit=unit,
        gaps=outcome.gaps,
        noise=outcome.noise,
        unexplained=any(r.significant for r in outcome.held.left),
        names=found["effect"].nunique(),
        laws=law_table(several, model.joints) if len(several) else None,
        single=tables["found"].index.isin(found.index.difference(several.index)),
        nearest=tables["candidates"]["verdict"].str.startswith(INDISTINGUISHABLE).tolist(),
        whole=WHOLE,
        costs=costs,
        remarks=outcome.remarks,
        left=_left_table(outcome),
        limit=f"{UNEXPLAINED:g}",
        warnings=[*outcome.given.warnings, *filter(None, [parts.warning])],
        bandwidth=f"{settings.cutoff:.3g} Hz ({settings.reason})",
        counted=float(np.mean([float(m.mask.mean()) for m in compared.logs])),
        split=f"{parts.rule}, {parts.guard:.2g} s apart",
    )


def law_table(rows: DataFrame, joints: Sequence[str]) -> DataFrame:
    """All joints by the numbers of some laws, each with its 95 % interval."""
    interval = [
        f"{number(v)} ({number(a)} to {number(b)})"
        for v, a, b in rows[["value", "ci_low", "ci_high"]].itertuples(index=False)
    ]
    units = [f" [{unit_text(u)}]" if u not in ("", "1") else "" for u in rows["unit"]]
    pairs = zip(rows["effect"], rows["parameter"], units, strict=True)
    head = [f"{law_words(effect)}, {name}{unit}" for effect, name, unit in pairs]
    table = rows.assign(head=head, cell=interval).pivot_table(
        index="joint", columns="head", values="cell", aggfunc="first", sort=False
    )
    return table.reindex([*joints]).reset_index().rename_axis(columns=None)


def _left_table(outcome: Outcome) -> DataFrame:
    """What the model as written leaves, by joint and channel."""
    import pandas

    rows = [
        {
            "joint": r.joint,
            "channel": r.channel,
            "left": r.error,
            "noise floor": r.noise_floor,
            "unit": r.unit,
            "verdict": "unexplained" if r.significant else "noise",
            "what it looks like": r.description or None,
        }
        for r in sorted(outcome.held.left, key=lambda r: -r.ratio)
    ]
    return pandas.DataFrame(rows)


def power_answer(balance: account.Account) -> list[str]:
    """What the supply gives, term by term, and what stays unexplained."""
    rows = balance.power.set_index("term", drop=False).to_dict("index")
    model, found = (
        [row for row in rows.values() if row["basis"] == basis] for basis in ("model", "found")
    )
    return rendered(
        "power_answer.j2",
        measured=rows[account.MEASURED],
        left=rows[account.UNEXPLAINED],
        model=model,
        found=found,
        samples=len(balance.samples),
        drives=len(balance.drives),
        test=balance.samples.loc[balance.samples["test"], "measured_W"],
        wrong_sum=balance.wrong_sum,
        rms=balance.rms,
        reading=balance.reading,
        by_model=balance.by_model,
    )


def write_power_page(
    balance: account.Account,
    robot: str,
    warnings: Sequence[str],
    tables: Mapping[str, DataFrame],
    folder: Path,
) -> None:
    """Draw the figures, and write ``index.html`` that shows them."""
    title = f"{robot}: power at the supply"
    save_figure(power_time_figure(balance.samples, title=title), folder, "power_in_time")
    rows = balance.power.set_index("term")["mean_W"]
    logs = ", ".join(balance.samples["log"].unique())
    write_page(
        "power",
        folder,
        tables,
        title=f"What the supply of '{robot}' gives, by log '{logs}'",
        answer=power_answer(balance),
        measured=rows[account.MEASURED],
        drives=balance.power.loc[balance.power["basis"] == "model", "mean_W"].sum(),
        left=rows[account.UNEXPLAINED],
        negative=balance.negative,
        warnings=warnings,
    )
