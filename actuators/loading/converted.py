"""From what a data sheet prints to the numbers of the laws, and where a sheet contradicts itself.

A sheet's ampere stays an ampere. With I^2 c R its copper loss (`CURRENTS` has c), the motor's law
P = U I = k omega I + R I^2 holds for c R in place of R, sqrt(c) U in place of U and
k = sqrt(c) / KV, whichever of the three amperes it is: k^2 / R and the no-load speed are the same.
The formulas stand in `actuators/catalog/README.md`.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Final

from actuators.errors import LegwattError
from actuators.loading.data_sheet import CURRENTS, Sheet
from actuators.units import from_si

#: Sheets round, and windings scatter: constants are commonly sold to this share.
TOLERANCE: Final = 0.1
#: Within this two numbers of a sheet are the same, rounded.
ROUNDING: Final = 0.05
#: Beyond this one of the two numbers is of another motor, unit or convention.
REFUSED: Final = 0.15
Values = Mapping[str, float]  # SI


def converted(x: Values) -> dict[str, float]:
    """The parameters of motor, rotor and gear, by `component.parameter` [SI].

    Args:
        x: Entries of a sheet that lacks nothing, choices as factors; see `completed`.
    """
    c, n, output = x["current_of"], x["gear_ratio"], x["shaft"]
    k = x.get("torque_constant") or math.sqrt(c) / x["speed_constant"]
    resistance, volts = c * x["resistance"] * x["resistance_of"], math.sqrt(c) * x["supply_voltage"]
    out = {
        "motor.torque_constant": k,
        "motor.resistance": resistance,
        "motor.supply_voltage": volts,
        "gear.ratio": n,
        **gear_friction(x),
    }
    load, turns, idle = out.get("gear.load", 0.0), n**output, k * x.get("no_load_current", 0.0)
    if "back_drive_torque" in x:
        out["rotor.coulomb"] = x["back_drive_torque"] * (1.0 - load) / n
    else:
        out["rotor.coulomb"] = x["coulomb_share"] * idle
    if "no_load_current" in x:
        free = math.sqrt(c) * x.get("no_load_voltage", 0.0)  # [V]
        speed = (free - resistance * x["no_load_current"]) / k  # [rad/s]
        if "no_load_speed" in x:
            speed = x["no_load_speed"] * turns
        if speed <= 0.0:
            raise LegwattError("no_load_current x resistance exceeds no_load_voltage")
        out["rotor.viscous"] = (idle - out["rotor.coulomb"]) / speed
    out["motor.max_speed"] = x["max_speed"] * turns if "max_speed" in x else volts / k
    dry = out["rotor.coulomb"] + out.get("gear.coulomb", 0.0) * output
    for rating in ("continuous", "peak"):
        current = x.get(f"{rating}_current")
        if current is None:
            current = (x[f"{rating}_torque"] / turns * (1 + load * output) + dry) / k
        out[f"motor.{rating}_current"] = current
    out |= {e.replace("_", "."): x[e] for e in ("rotor_inertia", "gear_inertia") if e in x}
    if "mass" in x or "motor_mass" in x:
        out["motor.mass"] = x.get("mass", x.get("motor_mass", 0.0) + x.get("gear_mass", 0.0))
    return out


def gear_friction(x: Values) -> dict[str, float]:
    """Friction of a gear: drive 1 / (1 + load) of the power, driven back 1 - load of it."""
    out: dict[str, float] = {}
    start = x.get("gear_starting_torque", 0.0)
    run = x.get("gear_running_torque", start)
    if "gear_load" in x:
        out["gear.load"] = x["gear_load"]
    elif "gear_efficiency" in x:
        idle = run * x["gear_ratio"] / x["gear_rated_torque"] if run else 0.0
        out["gear.load"] = 1.0 / x["gear_efficiency"] - 1.0 - idle
    if start:
        out["gear.coulomb"] = start
    if run > start:
        out["gear.viscous"] = (run - start) / x["gear_running_speed"]
    return out


def contradictions(sheet: Sheet, p: Values) -> Iterator[tuple[float, str, str]]:
    """Where numbers of a sheet say different things or what cannot be.

    Args:
        sheet: As read.
        p: What they give; see `converted`.

    Yields:
        The share by which two numbers differ (infinite for what cannot be) [1], one sentence, and
        the number that is used.
    """
    whole = {name: number.value for name, number in sheet.items()}
    for name, (low, high, why) in _expected(whole, p).items():
        if name in sheet and not sheet[name].why:
            off = max(low / whole[name] - 1.0 if low else 0.0, whole[name] / high - 1.0)
            unit = sheet[name].unit
            near = [f"{from_si(v, unit):.3g}" for v in ((low, high) if low else (high,))]
            span = " to ".join(dict.fromkeys(near))
            used = name if name == "torque_constant" else why.rpartition(" give")[0]
            yield off, f"{name} {sheet[name].words}, but {why} {span} {unit}", used
    drop, volts = p["motor.continuous_current"] * p["motor.resistance"], p["motor.supply_voltage"]
    start, run = (whole.get(f"gear_{k}_torque", 0.0) for k in ("starting", "running"))
    load, drag = p.get("gear.load", 0.0), p["rotor.coulomb"] / p["motor.torque_constant"]
    wrong = {
        f"the continuous current through the resistance drops {drop:.3g} V, more than the "
        f"supply's {volts:.3g} V: one of the three is in another unit": drop > volts,
        "the peak current or torque is below the continuous one": (
            p["motor.continuous_current"] > p["motor.peak_current"]
        ),
        "gear_efficiency: the torque that turns the gear without load alone costs more": load < 0,
        "gear friction of 1 and more per load (an efficiency of 0.5 and less) locks the gear: no "
        "law of friction drives it backwards; see the law hypoid in actuators/catalog": load >= 1,
        "gear_running_torque is below gear_starting_torque": 0.0 < run < start,
        "no_load_current: its torque is less than back_drive_torque brings to the rotor, "
        f"{drag:.3g} A": p.get("rotor.viscous", 0.0) < 0,
    }
    yield from ((math.inf, words, "") for words, holds in wrong.items() if holds)


def _expected(x: Values, p: Values) -> dict[str, tuple[float, float, str]]:
    """Lowest and highest value, SI, that other entries leave to one, and why."""
    root, turns = math.sqrt(x["current_of"]), x["gear_ratio"] ** x["shaft"]
    k, resistance = p["motor.torque_constant"], p["motor.resistance"]
    volts = root * x.get("no_load_voltage", x["supply_voltage"])
    slowed = volts - resistance * x.get("no_load_current", 0.0)
    stall = k * volts / resistance * turns
    dry = (p["rotor.coulomb"] + p.get("gear.coulomb", 0.0) * x["shaft"]) * turns
    loaded = 1.0 + p.get("gear.load", 0.0) * x["shaft"]
    km = k / math.sqrt(resistance)
    out = {
        "motor_constant": (km, km, "torque constant, resistance and their conventions give"),
        "no_load_speed": (slowed / k / turns, volts / k / turns, "voltage and k_t give"),
        "stall_torque": ((stall - dry) / loaded, stall, "voltage, resistance and k_t give"),
    }
    for rating in ("continuous", "peak"):
        most = k * x.get(f"{rating}_current", math.inf) * turns
        out[f"{rating}_torque"] = (0.0, most, f"{rating}_current gives without any loss at most")
    if "speed_constant" in x:
        by = {name: math.sqrt(c) / x["speed_constant"] for name, c in CURRENTS.items()}
        each = ", ".join(f"{value:.3g} N*m/A for current_of {name}" for name, value in by.items())
        own = root / x["speed_constant"]
        out["torque_constant"] = (own, own, f"speed_constant ({each}) gives")
    return out
