"""A walking hexapod with something hidden between its battery and its motors, and its log.

The motors' torque is that of the own source, friction included; what the log holds as torque is
measured at the joints, so that the hidden friction of one leg shows in no column. Each driver draws

    p_j / efficiency  where p_j = u i > 0,    returned p_j  where it is negative,    idle always

beside a hotel load; the battery's voltage is V0 - R I. Its samples are few, means of the time since
the one before or values of an instant, rounded, with noise.
"""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import parquet

from actuators.errors import LegwattError
from tests.blind.machines import own
from tests.blind.machines.plant import Array, Plant
from tests.blind.machines.sensors import measure, sampled, with_sensors
from tests.blind.machines.trial import stream, write_given

#: What may be hidden; each is drawn in half of the trials.
HIDDEN: Final = ("constant", "drivers", "returned", "extra_friction", "sag", "wrong_sum")
_CATALOG: Final = Path(__file__).parents[3] / "actuators" / "catalog"
_STEP: Final = 2e-3  # of the motion [s]
_RATE: Final = 100.0  # of the joints [Hz]


def draw_supply(
    rng: np.random.Generator, legs: tuple[str, ...], hidden: tuple[str, ...] | None = None
) -> dict[str, Any]:
    """Draw what stands between battery and motors; what is not hidden is absent."""
    drawn = tuple(n for n in HIDDEN if rng.random() < (0.15 if n == "wrong_sum" else 0.5))
    names = drawn if hidden is None else hidden
    there = {n: float(n in names) for n in HIDDEN}
    return {
        "hidden": names,
        "constant": there["constant"] * rng.uniform(5.0, 40.0),  # hotel load, idle drives [W]
        "efficiency": 1.0 / (1.0 + there["drivers"] * rng.uniform(0.08, 0.3)),  # of the drivers
        "returned": there["returned"] * rng.uniform(0.4, 0.95),  # share that is used again
        "leg": str(rng.choice(legs)),  # that rubs
        "friction": there["extra_friction"] * rng.uniform(4.0, 12.0),  # of each joint of it [N*m]
        "resistance": there["sag"] * rng.uniform(0.05, 0.3),  # of the battery [ohm]
        "voltage": float(rng.choice([24.0, 36.0, 48.0])),  # of the battery without current [V]
        "rate": float(rng.choice([1.0, 2.0, 10.0])),  # of the samples [Hz]
        "reading": str(rng.choice(["mean", "instant"], p=[0.7, 0.3])),
        # Whether the log lacks the voltage and only a nominal one is known.
        "stated": bool(rng.random() < 0.5) and "sag" not in names,
    }


def make_supply(
    seed: int, k: int, folder: Path, hidden: tuple[str, ...] | None = None
) -> dict[str, Any]:
    """Make trial number k in a new folder, hidden things drawn: ``given/``, ``truth.json``.

    Raises:
        LegwattError: Something else to hide.
    """
    for name in hidden or ():
        if name not in HIDDEN:
            raise LegwattError(f"'{name}' is nothing of a supply: {', '.join(HIDDEN)}")
    random = partial(stream, "supply", seed, k, 0)
    machine = own.draw_walker()
    assert machine.robot is not None
    supply = draw_supply(random("supply"), machine.robot.leg_names, hidden)
    rng = random("motion")
    course = own.gait_course(machine.robot, tuple(rng.uniform(2.0, 6.0, 18)), _STEP)
    plant = Plant.rigid(machine.model, len(machine.joints))
    background = random("friction")
    law = background.uniform([0.5, 0.2], [2.0, 2.0], (len(machine.joints), 2))
    plant = replace(plant, coulomb=law[:, 0], viscous=law[:, 1])
    happened = own.run(machine, plant, course)
    plant = with_sensors(random("sensors"), plant, happened.torque)
    plant = replace(plant, rate=_RATE, velocity=0.0, bits=19)
    columns = measure(machine, plant, happened, random("noise"))
    rubbing = [j.startswith(f"{supply['leg']}_") for j in machine.joints]
    torque = happened.torque + np.where(rubbing, supply["friction"], 0.0) * np.tanh(course.v / 1e-3)
    given, truth = _supplied(supply, torque, course.v)
    rows = sampled(happened, plant)
    columns |= _sampled(supply, given, course.time, rows, random("meter"))
    options = write_given(machine, folder / "given")
    parquet.write_table(pa.table(columns), folder / "given" / "log.parquet")
    options = ["power", "log.parquet", *options[options.index("--robot") :]]
    if supply["stated"]:
        text = f'[constants]\nsupply__voltage_V = {{value = {supply["voltage"]}, unit = "V"}}\n'
        (folder / "given" / "mapping.toml").write_text(text, "utf-8")
        options += ["--mapping", "mapping.toml"]
    out = {"source": "supply", "seed": seed, "trial": k} | supply | truth | {"options": options}
    (folder / "truth.json").write_text(json.dumps(out, indent=1, default=float) + "\n", "utf-8")
    return out


def _supplied(
    supply: dict[str, Any], torque: Array, speed: Array
) -> tuple[dict[str, Array], dict[str, float]]:
    """Current and voltage at the battery (N,), and means of what they are made of."""

    def known(name: str) -> dict[str, Any]:
        return tomllib.loads((_CATALOG / f"{name}.toml").read_text("utf-8"))["parameters"]

    motor, ratio = known("motor_re40_24v"), known("requirement")["ratio"]["value"]
    k = motor["torque_constant"]["value"] * 1e-3  # [N*m/A] of the file's mN*m/A
    current = torque / (ratio * k)  # [A]
    power = torque * speed + motor["resistance"]["value"] * current**2  # [W]
    drawn, back = np.maximum(power, 0.0).sum(axis=1), np.minimum(power, 0.0).sum(axis=1)
    total = drawn / supply["efficiency"] + supply["returned"] * back + supply["constant"]
    v0, ohm = supply["voltage"], max(supply["resistance"], 1e-9)
    i = (v0 - np.sqrt(v0**2 - 4.0 * ohm * total)) / (2.0 * ohm)
    if "wrong_sum" in supply["hidden"]:
        i = np.abs(current).sum(axis=1)
    means = {"drawn_W": drawn.mean(), "returned_W": back.mean(), "total_W": total.mean()}
    return {"current_A": i, "voltage_V": v0 - supply["resistance"] * i}, means


def _sampled(
    supply: dict[str, Any],
    given: dict[str, Array],
    time: Array,
    rows: NDArray[np.intp],
    rng: np.random.Generator,
) -> dict[str, Array]:
    """The supply's columns at the log's rows (N,), empty between samples."""
    every = round(_RATE / supply["rate"])
    at = np.arange(every, rows.size, every)
    out = {}
    for name, scale in (("current_A", 5e-3), ("voltage_V", 5e-4)):
        x, values = given[name], given[name][rows[at]]
        if supply["reading"] == "mean":
            total = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (x[1:] + x[:-1]))])
            begin = rows[at - every]
            values = (total[rows[at]] - total[begin]) / (time[rows[at]] - time[begin])
        out[f"supply__{name}"] = np.full(rows.size, np.nan)
        noise = 1.0 + scale * rng.standard_normal(at.size)
        out[f"supply__{name}"][at] = np.round(values * noise, 3)
    if supply["stated"]:
        del out["supply__voltage_V"]
    return out
