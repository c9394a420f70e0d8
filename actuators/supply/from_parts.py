"""Drivers and batteries by what data sheets print (`actuators.loading.parts`).

Values are SI, one for each entry: printed, or chosen from the range of a part's class.
"""

import math
from collections.abc import Mapping

from actuators.errors import DataSheetError
from actuators.supply.battery import HOUR, Battery
from actuators.supply.driver import Driver

Values = Mapping[str, float]


def driver_of(name: str, x: Values, *, current_of: float = 1.0) -> Driver:
    """Return a driver in the ampere of a motor, by c (`actuators.loading.data_sheet.CURRENTS`).

    What is missing at full voltage and continuous current to the loss that its efficiency states,
    in addition to idle power and conduction, is switching, which nothing else on a sheet tells.

    Raises:
        DataSheetError: An entry is missing; names all that are.
        UnphysicalElementError: A value that cannot be.
    """
    _require(name, x, "on_resistance", "idle_power", "efficiency", "voltage_share", "most_voltage")
    rated = x.get("continuous_current", x.get("peak_current", math.nan))  # [A]
    if math.isnan(rated):
        raise DataSheetError(f"driver '{name}': missing continuous_current or peak_current")
    root, bus = math.sqrt(current_of), x["most_voltage"]
    resistance = 2.0 * current_of * x["on_resistance"]
    given = root * x["voltage_share"] * bus * rated  # into the motor at full voltage [W]
    lost = given * (1.0 / x["efficiency"] - 1.0)  # [W]
    rest = max(lost - x["idle_power"] - resistance * rated**2, 0.0)
    limits = {k: x[k] for k in ("continuous_current", "peak_current", "least_voltage") if k in x}
    return Driver(
        name,
        resistance,
        x["idle_power"],
        switching=rest / (bus * rated),
        voltage_share=root * x["voltage_share"],
        most_voltage=bus,
        **limits,
    )


def battery_of(
    name: str, x: Values, *, energy: float | None = None, voltage: float | None = None
) -> Battery:
    """Return a battery of an energy when full [J] and a nominal voltage [V], or of the sheet's.

    `sag` is the share of the nominal voltage that the current of one hour costs, so that
    R = sag U^2 / (energy / 1 h), however cells are joined.

    Raises:
        DataSheetError: An entry is missing; names all that are.
        UnphysicalElementError: A value that cannot be.
    """
    stated = {"energy": energy, "voltage": voltage}
    known = {**x, **{entry: value for entry, value in stated.items() if value is not None}}
    _require(name, known, "energy", "voltage", "voltage_swing", "sag", "usable", "returned")
    nominal, full, swing = known["voltage"], known["energy"], known["voltage_swing"]
    mass = x.get("mass", 0.0)
    if "specific_energy" in x and (energy is not None or not mass):
        mass = full / x["specific_energy"]
    return Battery(
        name,
        full * known["usable"],
        nominal * (1.0 + swing),
        nominal * (1.0 - swing),
        known["sag"] * nominal**2 * HOUR / full,
        known["returned"],
        mass,
    )


def _require(name: str, x: Values, *entries: str) -> None:
    if lacking := ", ".join(entry for entry in entries if entry not in x):
        raise DataSheetError(f"part '{name}': missing {lacking}")
