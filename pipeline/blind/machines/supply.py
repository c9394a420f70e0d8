"""A walking hexapod with something hidden between its battery and its motors, and its log.

The motors' torque is that of the own source, friction included; what the log holds as torque is
measured at the joints, so that the hidden friction of one leg shows in no column. Each driver draws

    p_j / efficiency  where p_j = u i > 0,    returned p_j  where it is negative,    idle always

beside a hotel load; the battery's voltage is V0 - R I. Its samples are few, means of the time since
the one before or values of an instant, rounded, with noise.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import parquet

from actuators.arrays import Array
from actuators.errors import closest
from actuators.text_file import read_toml_file
from actuators.units import to_si
from pipeline.atomic import write_text
from pipeline.blind.machines import own
from pipeline.blind.machines.plant import rigid_plant
from pipeline.blind.machines.sensors import draw_sensors, measure, sampled
from pipeline.blind.machines.trial import stream, write_given
from pipeline.blind.machines.walk import draw_walker, gait_course
from pipeline.errors import PipelineError

#: What may be hidden; each is drawn in half of the trials.
HIDDEN: Final = ("constant", "drivers", "returned", "extra_friction", "sag", "wrong_sum")
_CATALOG: Final = Path(__file__).parents[3] / "actuators" / "catalog"
_STEP: Final = 2e-3  # of the motion [s]
_RATE: Final = 100.0  # of the joints [Hz]


@dataclass(frozen=True)
class Supply:
    """What stands between battery and motors."""

    hidden: tuple[str, ...]  #: Names of `HIDDEN`.
    constant: float  #: Hotel load and idle of all drives [W].
    efficiency: float  #: Of the drivers [1].
    returned: float  #: Share of returned power that is used again [1].
    leg: str  #: That rubs.
    friction: float  #: Of each of its joints, Coulomb [N*m].
    resistance: float  #: Of the battery [ohm].
    voltage: float  #: Of the battery without current [V].
    rate: float  #: Of the samples [Hz].
    reading: str  #: ``"mean"`` or ``"instant"``.
    stated: bool  #: Whether the log lacks the voltage and only a nominal one is known.


def draw_supply(
    rng: np.random.Generator, legs: tuple[str, ...], hidden: tuple[str, ...] | None = None
) -> Supply:
    """Draw it; what is not hidden is absent."""
    drawn = tuple(n for n in HIDDEN if rng.random() < (0.15 if n == "wrong_sum" else 0.5))
    names = drawn if hidden is None else hidden
    there = {n: float(n in names) for n in HIDDEN}
    return Supply(
        hidden=names,
        constant=there["constant"] * rng.uniform(5.0, 40.0),
        efficiency=1.0 / (1.0 + there["drivers"] * rng.uniform(0.08, 0.3)),
        returned=there["returned"] * rng.uniform(0.4, 0.95),
        leg=str(rng.choice(legs)),
        friction=there["extra_friction"] * rng.uniform(4.0, 12.0),
        resistance=there["sag"] * rng.uniform(0.05, 0.3),
        voltage=float(rng.choice([24.0, 36.0, 48.0])),
        rate=float(rng.choice([1.0, 2.0, 10.0])),
        reading=str(rng.choice(["mean", "instant"], p=[0.7, 0.3])),
        stated=bool(rng.random() < 0.5) and "sag" not in names,
    )


def make_supply(
    seed: int, k: int, folder: Path, hidden: tuple[str, ...] | None = None
) -> dict[str, Any]:
    """Make a trial: ``given/`` with log and robot files, ``truth.json`` beside it.

    Args:
        seed: Of all trials, not negative.
        k: Number of the trial.
        folder: New.
        hidden: What to hide; drawn by default.

    Returns:
        The truth, as written.

    Raises:
        PipelineError: Something else to hide.
    """
    for name in hidden or ():
        if name not in HIDDEN:
            raise PipelineError(f"'{name}' is nothing of a supply; {closest(name, HIDDEN)}")
    random = partial(stream, "supply", seed, k, 0)
    machine = draw_walker()
    assert machine.robot is not None
    supply = draw_supply(random("supply"), machine.robot.leg_names, hidden)
    rng = random("motion")
    course = gait_course(machine.robot, tuple(rng.uniform(2.0, 6.0, 18)), _STEP)
    plant, n = rigid_plant(machine, machine.model), len(machine.joints)
    background = random("friction")
    for j in range(n):
        law = {"coulomb": background.uniform(0.5, 2.0), "viscous": background.uniform(0.2, 2.0)}
        plant = replace(plant, friction=plant.friction.at(j, **law))
    happened = own.run(machine, plant, course)
    sensors = replace(draw_sensors(random("sensors"), happened.torque), rate=_RATE, velocity=0.0)
    sensors = replace(sensors, bits=19)
    columns = measure(machine, plant, happened, sensors, random("noise"))
    rubbing = [j.startswith(f"{supply.leg}_") for j in machine.joints]
    torque = happened.torque + np.where(rubbing, supply.friction, 0.0) * np.tanh(course.v / 1e-3)
    given, truth = _supplied(supply, torque, course.v)
    rows = sampled(happened, sensors)
    columns |= _sampled(supply, given, course.time, rows, random("meter"))
    options = write_given(machine, folder / "given")
    parquet.write_table(pa.table(columns), folder / "given" / "log.parquet")
    options = ["power", "log.parquet", *options[options.index("--robot") :]]
    if supply.stated:
        text = f'[supply]\nvoltage = {{value = {supply.voltage}, unit = "V"}}\n'
        write_text(folder / "given" / "mapping.toml", text)
        options += ["--mapping", "mapping.toml"]
    out = {"source": "supply", "seed": seed, "trial": k} | vars(supply) | truth
    out["options"] = options
    write_text(folder / "truth.json", json.dumps(out, indent=1, default=float) + "\n")
    return out


def _supplied(supply: Supply, torque: Array, speed: Array) -> tuple[dict[str, Array], Any]:
    """Power, current and voltage at the battery (N,), and means of what they are made of."""
    motor = read_toml_file(_CATALOG / "motor_re40_24v.toml")["parameters"]
    ratio = read_toml_file(_CATALOG / "requirement.toml")["parameters"]["ratio"]["value"]
    k, r = (to_si(motor[x]["value"], motor[x]["unit"]) for x in ("torque_constant", "resistance"))
    current = torque / (ratio * k)  # [A]
    power = torque * speed + r * current**2  # [W]
    drawn, back = np.maximum(power, 0.0).sum(axis=1), np.minimum(power, 0.0).sum(axis=1)
    total = drawn / supply.efficiency + supply.returned * back + supply.constant
    v0, ohm = supply.voltage, max(supply.resistance, 1e-9)
    i = (v0 - np.sqrt(v0**2 - 4.0 * ohm * total)) / (2.0 * ohm)
    if "wrong_sum" in supply.hidden:
        i = np.abs(current).sum(axis=1)
    volts = v0 - supply.resistance * i
    means = {"drawn_W": drawn.mean(), "returned_W": back.mean(), "total_W": total.mean()}
    return {"power": volts * i, "current": i, "voltage": volts}, means


def _sampled(
    supply: Supply,
    given: dict[str, Array],
    time: Array,
    rows: NDArray[np.intp],
    rng: np.random.Generator,
) -> dict[str, Array]:
    """The supply's columns at the log's rows (N,), empty between samples."""
    every = round(_RATE / supply.rate)
    at = np.arange(every, rows.size, every)
    out = {}
    for name, header, digits in (("current", "current_A", 3), ("voltage", "voltage_V", 3)):
        total = np.concatenate(
            [[0.0], np.cumsum(0.5 * np.diff(time) * (given[name][1:] + given[name][:-1]))]
        )
        values = given[name][rows[at]]
        if supply.reading == "mean":
            begin = rows[at - every]
            values = (total[rows[at]] - total[begin]) / (time[rows[at]] - time[begin])
        scale = {"current": 5e-3, "voltage": 5e-4}[name]
        values = np.round(values * (1.0 + scale * rng.standard_normal(at.size)), digits)
        column = np.full(rows.size, np.nan)
        column[at] = values
        out[f"supply__{header}"] = column
    if supply.stated:
        del out["supply__voltage_V"]
    return out
