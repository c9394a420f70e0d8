"""The numbers the paper prints, with half their last digit and the part they play."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from pathlib import Path

from actuators.units import to_si

PUBLISHED_FILE = Path(__file__).with_name("published_values.csv")
#: What part a printed number plays, and what is said of it.
ROLES = {
    "input": "put in",
    "target": "fitted to",
    "consequence": "follows from inputs and targets by Eq. 1, Ohm's law, P = U I and E = 3 P",
    "symmetry": "zero because the robot is symmetric",
    "bound": "zero by the prior's bounds alone, whatever is fitted",
    "contradicted": "another printed number contradicts it",
}
#: Duration of a walking cycle, over which section IV.B adds up [s].
CYCLE = 3.0
EVEN = "break_even_standing_fraction"
#: What walking takes more with the irreversible than with the reversible actuator, which the
#: printed break-even asks for in other words [J].
EXTRA = "walking_extra_J"
#: What the reversible actuator's motor holds at joint 2.
HELD = "reversible_motor_torque_2"
#: Alternatives between which the break-even is.
PAIR = ("reversible", "irreversible")
ALTERNATIVES = ("ideal", "rotor", *PAIR)


@dataclass(frozen=True)
class Published:
    """One printed number."""

    id: str  #: Short name.
    where: str  #: Table or section.
    quantity: str  #: In words.
    joint: str  #: Number of the joint, or empty.
    unit: str  #: As printed.
    value: float  #: As printed.
    half_width: float  #: Half of the last printed digit, or of the range the words leave.
    role: str  #: One of `ROLES`.
    note: str = field(repr=False)

    @property
    def si(self) -> float:
        """The printed value in SI units."""
        return to_si(self.value, self.unit)

    @property
    def half_width_si(self) -> float:
        """Its half width in SI units."""
        return to_si(self.half_width, self.unit)

    def reproduced(self, computed: float) -> bool:
        """Whether a computed value, in `unit`, lies within the half width; never for NaN."""
        return abs(computed - self.value) <= self.half_width + 1e-9 * max(1.0, abs(self.value))


def load_published() -> dict[str, Published]:
    """Read the printed values, by id."""
    out = {}
    with PUBLISHED_FILE.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            numbers = {name: float(row[name]) for name in ("value", "half_width")}
            out[row["id"]] = Published(**{**row, **numbers})  # type: ignore[arg-type]
    return out
