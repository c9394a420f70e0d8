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
    """Return a driver in the ampere of a motor.

    What is missing at full voltage and continuous current to the loss that its efficiency states,
    in addition to idle power and conduction, is switching, which nothing else on a sheet tells.

    Args:
        name: Of the part.
        x: Entries of its sheet: on_resistance, idle_power, efficiency, voltage_share,
            most_voltage, a current; further limits where they are known.
        current_of: c of the motor's ampere (`actuators.loading.data_sheet.CURRENTS`).

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
    return Driver(
        name,
        resistance,
        x["idle_power"],
        rest / (bus * rated),
        root * x["voltage_share"],
        x.get("continuous_current", math.inf),
        x.get("peak_current", math.inf),
        x.get("least_voltage", 0.0),
        bus,
    )


def battery_of(
    name: str, x: Values, *, energy: float | None = None, voltage: float | None = None
) -> Battery:
    """Return a battery; a sheet of cells makes one of any energy and voltage.

    `sag` is the share of the nominal voltage that the current of one hour costs, so that
    R = sag U^2 / (energy / 1 h), however cells are joined.

    Args:
        name: Of the part.
        x: Entries of its sheet: voltage_swing, sag, usable, returned; specific_energy or mass.
        energy: When full [J]; the sheet's by default.
        voltage: Nominal [V]; the sheet's by default.

    Raises:
        DataSheetError: An entry is missing; names all that are.
        UnphysicalElementError: A value that cannot be.
    """
    known = {**x}
    known |= {} if energy is None else {"energy": energy}
    known |= {} if voltage is None else {"voltage": voltage}
    _require(name, known, "energy", "voltage", "voltage_swing", "sag", "usable", "returned")
    nominal, full = known["voltage"], known["energy"]
    mass = x.get("mass", 0.0)
    if "specific_energy" in x and (energy is not None or not mass):
        mass = full / x["specific_energy"]
    return Battery(
        name,
        full * known["usable"],
        nominal * (1.0 + known["voltage_swing"]),
        nominal * (1.0 - known["voltage_swing"]),
        known["sag"] * nominal**2 * HOUR / full,
        known["returned"],
        mass,
    )


def _require(name: str, x: Values, *entries: str) -> None:
    lacking = [entry for entry in entries if entry not in x]
    if lacking:
        raise DataSheetError(f"part '{name}': missing {', '.join(lacking)}")
