"""From what a data sheet prints to the numbers of the laws, and where a sheet contradicts itself.

A sheet's ampere stays an ampere. With I^2 c R its copper loss (`CURRENTS` has c), the motor's law
P = U I = k omega I + R I^2 holds for c R in place of R, sqrt(c) U in place of U and
k = sqrt(c) / KV, whichever of the three amperes it is: k^2 / R and the no-load speed are the same.
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
#: Parameter, SI, and its formula.
Found = dict[str, tuple[float, str]]


def converted(x: Mapping[str, float]) -> Found:
    """The parameters of motor, rotor and gear, by `component.parameter`.

    Args:
        x: Entries of a sheet that lacks nothing, SI, choices as factors; see `read_sheet`.
    """
    c, n = x["current_of"], x["gear_ratio"]
    k = x.get("torque_constant") or math.sqrt(c) / x["speed_constant"]
    out: Found = {
        "motor.torque_constant": (k, f"60 sqrt(c) / (2 pi KV), c = {c:g}"),
        "motor.resistance": (
            c * x["resistance"] * x["resistance_of"],
            f"c R between terminals, which is 2 R of a phase; c = {c:g}",
        ),
        "motor.supply_voltage": (math.sqrt(c) * x["supply_voltage"], f"sqrt(c) U, c = {c:g}"),
        "gear.ratio": (n, ""),
    }
    out |= gear_friction(x)
    load = out.get("gear.load", (0.0, ""))[0]
    out |= _rotor(x, load, {name: value for name, (value, _) in out.items()})
    turns = n ** x["shaft"]
    if "max_speed" in x:
        out["motor.max_speed"] = x["max_speed"] * turns, "speed of the output times ratio"
    else:
        out["motor.max_speed"] = out["motor.supply_voltage"][0] / k, "supply voltage / k"
    dry = out.get("rotor.coulomb", (0.0, ""))[0]
    dry += out.get("gear.coulomb", (0.0, ""))[0] * x["shaft"]
    for rating in ("continuous", "peak"):
        current = x.get(f"{rating}_current")
        if current is None:
            current = (x[f"{rating}_torque"] / turns * (1 + load * x["shaft"]) + dry) / k
        out[f"motor.{rating}_current"] = current, "(torque / ratio (1 + load) + coulomb) / k"
    for name in ("rotor_inertia", "gear_inertia"):
        if name in x:
            out[name.replace("_", ".")] = x[name], ""
    if "mass" in x:
        out["motor.mass"] = x["mass"], ""
    elif "motor_mass" in x:
        gear = "gear_mass" in x or n == 1.0
        words = "motor and gear" if gear else "the motor alone, without its gear"
        out["motor.mass"] = x["motor_mass"] + x.get("gear_mass", 0.0), words
    return out


def gear_friction(x: Mapping[str, float]) -> Found:
    """Friction of a gear: drive 1 / (1 + load) of the power, driven back 1 - load of it."""
    out: Found = {}
    start = x.get("gear_starting_torque", 0.0)
    run = x.get("gear_running_torque", start)
    if "gear_load" in x:
        out["gear.load"] = x["gear_load"], ""
    elif "gear_efficiency" in x:
        idle = run * x["gear_ratio"] / x["gear_rated_torque"] if run else 0.0
        words = "1 / efficiency - 1" + " - ratio x torque without load / rated torque" * (run > 0)
        out["gear.load"] = 1.0 / x["gear_efficiency"] - 1.0 - idle, words
    if start:
        out["gear.coulomb"] = start, ""
    if run > start:
        words = "(running - starting torque) / running speed"
        out["gear.viscous"] = (run - start) / x["gear_running_speed"], words
    return out


def _rotor(x: Mapping[str, float], load: float, motor: Mapping[str, float]) -> Found:
    """Friction that no load changes, at the rotor."""
    out: Found = {}
    k = motor["motor.torque_constant"]
    idle = k * x.get("no_load_current", 0.0)  # [N*m]
    if "back_drive_torque" in x:
        coulomb = x["back_drive_torque"] * (1.0 - load) / x["gear_ratio"]
        out["rotor.coulomb"] = coulomb, "back-drive torque (1 - load) / ratio"
    else:
        coulomb = x["coulomb_share"] * idle
        out["rotor.coulomb"] = coulomb, "coulomb share x k x no-load current"
    if "no_load_current" in x:
        free = math.sqrt(x["current_of"]) * x.get("no_load_voltage", 0.0)  # [V]
        speed = (free - motor["motor.resistance"] * x["no_load_current"]) / k  # [rad/s]
        if "no_load_speed" in x:
            speed = x["no_load_speed"] * x["gear_ratio"] ** x["shaft"]
        if speed <= 0.0:
            raise LegwattError("no_load_current x resistance exceeds no_load_voltage")
        words = "(k x no-load current - coulomb) / no-load speed"
        out["rotor.viscous"] = (idle - coulomb) / speed, words
    return out


def contradictions(sheet: Sheet, found: Found) -> Iterator[tuple[float, str, str]]:
    """Where numbers of a sheet say different things or what cannot be.

    Args:
        sheet: As read.
        found: What they give; see `converted`.

    Yields:
        The share by which two numbers differ (infinite for what cannot be) [1], one sentence, and
        the number that is used.
    """
    whole = {name: number.value for name, number in sheet.items()}
    p = {name: value for name, (value, _) in found.items()}
    for name, (low, high, why) in _expected(whole, p).items():
        if name in sheet and not sheet[name].why:
            off = max(low / whole[name] - 1.0 if low else 0.0, whole[name] / high - 1.0)
            unit = sheet[name].unit
            near = [f"{from_si(v, unit):.3g}" for v in ((low, high) if low else (high,))]
            span = " to ".join(dict.fromkeys(near))
            used = name if name == "torque_constant" else why.rpartition(" give")[0]
            yield off, f"{name} {sheet[name].words}, but {why} {span} {unit}", used
    drop, volts = p["motor.continuous_current"] * p["motor.resistance"], p["motor.supply_voltage"]
    start, run = (sheet.get(f"gear_{k}_torque") for k in ("starting", "running"))
    load, drag = p.get("gear.load", 0.0), p.get("rotor.coulomb", 0.0) / p["motor.torque_constant"]
    wrong = {
        f"the continuous current through the resistance drops {drop:.3g} V, more than the "
        f"supply's {volts:.3g} V: one of the three is in another unit": drop > volts,
        "the peak current or torque is below the continuous one": (
            p["motor.continuous_current"] > p["motor.peak_current"]
        ),
        "gear_efficiency: the torque that turns the gear without load alone costs more": load < 0,
        "gear friction of 1 and more per load (an efficiency of 0.5 and less) locks the gear: no "
        "law of friction drives it backwards; see the law hypoid in actuators/catalog": load >= 1,
        "gear_running_torque is below gear_starting_torque": (
            start is not None and run is not None and run.value < start.value
        ),
        "no_load_current: its torque is less than back_drive_torque brings to the rotor, "
        f"{drag:.3g} A": p.get("rotor.viscous", 0.0) < 0,
    }
    yield from ((math.inf, words, "") for words, holds in wrong.items() if holds)


def _expected(
    x: Mapping[str, float], p: Mapping[str, float]
) -> dict[str, tuple[float, float, str]]:
    """Lowest and highest value, SI, that other entries leave to one, and why."""
    root, turns = math.sqrt(x["current_of"]), x["gear_ratio"] ** x["shaft"]
    k, resistance = p["motor.torque_constant"], p["motor.resistance"]
    volts = root * x.get("no_load_voltage", x["supply_voltage"])
    slowed = volts - resistance * x.get("no_load_current", 0.0)
    stall = k * volts / resistance * turns
    dry = (p.get("rotor.coulomb", 0.0) + p.get("gear.coulomb", 0.0) * x["shaft"]) * turns
    loaded = 1.0 + p.get("gear.load", 0.0) * x["shaft"]
    km = k / math.sqrt(resistance)
    out = {
        "motor_constant": (km, km, "torque constant, resistance and their conventions give"),
        "no_load_speed": (slowed / k / turns, volts / k / turns, "voltage and k_t give"),
        "stall_torque": ((stall - dry) / loaded, stall, "voltage, resistance and k_t give"),
    }
    for rating in ("continuous", "peak"):
        most = k * x.get(f"{rating}_current", math.inf) * turns
        why = f"{rating}_current gives without any loss at most"
        out[f"{rating}_torque"] = (0.0, most, why)
    if "speed_constant" in x:
        by = {name: math.sqrt(c) / x["speed_constant"] for name, c in CURRENTS.items()}
        each = ", ".join(f"{value:.3g} N*m/A for current_of {name}" for name, value in by.items())
        own = root / x["speed_constant"]
        out["torque_constant"] = (own, own, f"speed_constant ({each}) gives")
    return out
