"""The numbers the paper prints, and all motor constants that give Tables IV to VI as printed.

Every number has half its last digit and the part it plays. The tables leave a set of the motor's
three constants so narrow that no data sheet resolves it, except for the entries that contradict one
another: those that the best rotor friction leaves unmet.
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from actuators.arrays import Array
from actuators.errors import LegwattError
from actuators.parameters import to_si

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


#: References of the constants, in the order in which they are drawn.
KEYS = ("motor_re40_24v.torque_constant", "motor_re40_24v.resistance", "rotor_re40.coulomb")
#: Rotor friction that leaves the fewest entries unmet, and which; `study/rotor_friction.csv` has
#: all frictions tried [N*m].
FRICTION = (3.615e-3, 3.625e-3)
UNMET = ("rotor_motor_torque_2", "rotor_leg_energy_3s")
_BATCH, _MOST = 4000, 5000  # draws at a time, and how often before none is said to fit


def standing_entries(
    published: Mapping[str, Published], u: Array, w: Array, friction: Array, held: Array
) -> dict[str, Array]:
    """Magnitudes of the electrical entries of Tables IV to VI, by id, SI.

    At standstill Eq. 1, Ohm's law and P = U I make every entry a product of a motor torque G with
    powers of u = 1 / k and w = R / k:

        G        I = G u        U = G w        P = G^2 u w        E = 3 s (G2^2 + G3^2) u w

    Args:
        published: The printed values: G is Table III over the transmission ratio.
        u: Current over torque [A/(N*m)].
        w: Voltage over torque [V/(N*m)].
        friction: Of the rotor, which lowers the torque of Table V [N*m].
        held: What the reversible actuator's motor holds at joint 2 [N*m].
    """
    ratio = published["transmission_ratio"].value
    ideal = {j: np.asarray(abs(published[f"standing_torque_{j}"].si) / ratio) for j in (2, 3)}
    rotor = {j: np.maximum(torque - friction, 0.0) for j, torque in ideal.items()}
    out: dict[str, Array] = {}
    for table, torques in (
        ("ideal", ideal),
        ("rotor", rotor),
        ("reversible", {2: held, 3: 0.0 * held}),
    ):
        for j, torque in torques.items():
            out[f"{table}_motor_torque_{j}"] = torque + 0.0 * u
            out[f"{table}_current_{j}"] = torque * u
            out[f"{table}_voltage_{j}"] = torque * w
            out[f"{table}_power_{j}"] = torque**2 * u * w
        both = out[f"{table}_power_2"] + out[f"{table}_power_3"]
        out[f"{table}_leg_energy_3s"] = CYCLE * both
    return out


def draws(published: Mapping[str, Published], rng: np.random.Generator, count: int) -> Array:
    """Sets uniform in u, w, friction and held torque that give every entry but those of `UNMET`.

    Returns:
        Constants as in `KEYS`, and the held torque [N*m], (count, 4).

    Raises:
        LegwattError: No constants give the entries.
    """

    def ends(row: Published, over: float = 1.0) -> Array:
        return (abs(row.si) + np.array([-1, 1]) * row.half_width_si) / over

    torque = abs(published["standing_torque_2"].si) / published["transmission_ratio"].value
    # All signs of a table are those of the joint's torque, so magnitudes are compared.
    asked = {name: abs(row.si) for name, row in published.items()}
    low, high = np.transpose(
        [
            ends(published["ideal_current_2"], torque),
            ends(published["ideal_voltage_2"], torque),
            FRICTION,
            ends(published[HELD]),
        ]
    )
    found = np.empty((0, 4))
    for _ in range(_MOST):
        u, w, friction, held = rng.uniform(low, high, (_BATCH, 4)).T
        good = np.full(_BATCH, True)
        for name, value in standing_entries(published, u, w, friction, held).items():
            slack = published[name].half_width_si + 1e-9 * max(1.0, asked[name])
            good &= (name in UNMET) | (np.abs(value - asked[name]) <= slack)
        found = np.concatenate([found, np.stack([1 / u, w / u, friction, held], axis=1)[good]])
        if len(found) >= count:
            return found[:count]
    raise LegwattError("no motor constants give the entries of Tables IV to VI")


def middle(published: Mapping[str, Published]) -> dict[str, float]:
    """Mean of all sets, by reference: on average as far from the edges as they are."""
    means = draws(published, np.random.default_rng(0), 4000)[:, : len(KEYS)].mean(axis=0)
    return dict(zip(KEYS, means.tolist(), strict=True))
