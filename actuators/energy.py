"""Energy through each stage, forward and reverse, integrated block by block.

Power is linear between samples and split at its zero crossings, which is exact for piecewise
linear power. Breaks carry both limits and have no width, so no integral runs across a jump.

Electrical power that flows back is dissipated, partly used, or shared on a bus (`supply_of`). What
a motion asks is held against the motor's sheet: speed, voltage |R I + k velocity| <= U, peak
current, and the root mean square of the current.

What supplies the motors: a battery, and the drivers on its bus.

A battery's open-circuit voltage falls in proportion to the charge drawn, from `full` to `empty`,
with mean E; behind it stands a constant internal resistance (Plett, Battery Management Systems I,
section 2.2 and 2.3). Terminal power P is positive out of the battery:

    V = E(s) - R I,    P = V I    =>    I = 2 P / (E + sqrt(E^2 - 4 R P))
    ds/dt = -I / Q   (I > 0)    or   -returned I / Q   (I < 0),    Q = energy / E

The power is greatest, E^2 / 4R, where half of the voltage is left. Discharge ends at s = 0, or
where the terminals of the mode that draws most fall below a cut-off U, at E = U + R P / U.

Two transistors of a driver carry the current from terminal to terminal. In the motor's own ampere
(`actuators.loading.data_sheet`, c = 1, 0.75 or 1.5) conduction costs 2 c R_on I^2 as the winding
costs c R I^2; hard switching 1/2 U I (t_r + t_f) f (Mohan, Undeland, Robbins, Power Electronics,
chapter 2); gate drivers and logic the same at any current.

    loss = idle + 2 c R_on I^2 + switching U |I|            at the bus, positive
    |U_motor| <= voltage_share U - 2 c R_on |I|
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from actuators.arrays import Array, Scalars
from actuators.chain import ChainResult, HoldingResult
from actuators.errors import LegwattError, one_line
from actuators.parameters import Numbers, number, require
from actuators.shaft import DCMotor

BUS: Final = "bus"  # the row under which a shared bus is accounted


def duration(time: Array) -> float:
    """Return the time that a series (N,) or (N, J) spans, its shortest column [s]; not none."""
    span = float(np.min(time[-1] - time[0]))
    if span <= 0.0:
        raise LegwattError(
            f"series of {len(time)} samples spans no time: give at least two instants"
        )
    return span


def integral(time: Array, power: Array) -> Array:
    """Return the integral of a piecewise linear quantity (N, J) or (N,) over time, (J,).

    Time is (N,), or (N, J) where every column has its own [s]; repeated stamps are breaks.
    """
    half = 0.5 * np.diff(time, axis=0)
    weights = np.zeros(time.shape)  # trapezoids as one product
    weights[:-1] += half
    weights[1:] += half
    return weighted(weights, power)


def weighted(weights: Array, values: Array) -> Array:
    """Return the weighted sum over the samples, (J,), of weights (N,) or (N, J)."""
    each = weights @ values if weights.ndim == 1 else np.einsum("nj,nj->j", weights, values)
    return np.asarray(each)


def split_integral(time: Array, power: Array) -> tuple[Array, Array]:
    """Return the integrals of the positive and of the negative part, both not negative, (J,)."""
    net = integral(time, power)
    magnitude = integral(time, np.abs(power))
    # Where power crosses zero inside an interval the trapezoid of |power| is too large by
    # h |a| |b| / (|a| + |b|): the tip of the two triangles.
    row, column = np.nonzero(np.signbit(power[:-1]) != np.signbit(power[1:]))
    a, b = np.abs(power[row, column]), np.abs(power[row + 1, column])
    real = (a > 0.0) & (b > 0.0)
    row, column, a, b = row[real], column[real], a[real], b[real]
    step = np.diff(time, axis=0)[(row, column) if time.ndim == 2 else row]
    np.subtract.at(magnitude, column, step * a * (b / (a + b)))
    return np.maximum(0.5 * (magnitude + net), 0.0), np.maximum(0.5 * (magnitude - net), 0.0)


def stage_energies(result: ChainResult) -> dict[str, tuple[Array, Array]]:
    """Return E(+) and E(-), from the supply towards the joint and back, (J,) each [J], by stage.

    Stages are those of Fig. 14, 16, 18 and 20 of the paper, from `out` to `el`.
    """
    time = result.joint.time
    return {stage: split_integral(time, power) for stage, power in result.powers.items()}


def loss_energies(result: ChainResult) -> dict[str, Array]:
    """Return the energy each element dissipates, by name, (J,) [J]."""
    return {name: integral(result.joint.time, power) for name, power in result.losses.items()}


@dataclass(frozen=True, eq=False)
class Supply:
    """Energy drawn from the supply and dissipated in the braking resistor."""

    accounts: tuple[str, ...]  #: What each column stands for: the joints, or the one bus.
    time: Array  #: (N,) [s].
    electrical: Array  #: Power into the motors, per account (N, K) [W].
    recovered: float  #: Share of the returned power that goes back into the supply.

    @property
    def supplied_energy(self) -> Array:
        """Energy out of the supply, (K,) [J]."""
        forward, reverse = split_integral(self.time, self.electrical)
        return forward - self.recovered * reverse

    @property
    def dissipated_energy(self) -> Array:
        """Energy dissipated, (K,) [J]."""
        return (1.0 - self.recovered) * split_integral(self.time, self.electrical)[1]


def recovery(regeneration: str | float) -> tuple[str, float]:
    """Return what becomes of returned energy: `none`, `bus` or `fraction`, and that share of it."""
    if regeneration in ("none", BUS):
        return str(regeneration), 0.0
    with suppress(ValueError):
        if 0.0 <= float(regeneration) <= 1.0:
            return "fraction", float(regeneration)
    raise LegwattError(
        f"regeneration {one_line(regeneration)}: expected none, bus or a fraction between 0 and 1"
    )


def supply(result: ChainResult, regeneration: str | float = "none") -> Supply:
    """Return the supply's account of a chain's motors; see `supply_of`."""
    joint = result.joint
    return supply_of(result.electrical_power, joint.time, joint.joints, regeneration)


def supply_of(
    power: Array, time: Array, joints: tuple[str, ...], regeneration: str | float = "none"
) -> Supply:
    """Return the supply's account of power into each motor, driver losses included, (N, J) [W].

    `regeneration`: ``none``, each joint's returned power is dissipated (the paper); a fraction,
    that share of it goes back into the supply; ``bus``, one joint's return feeds another's demand,
    and what is left over is dissipated.

    Raises:
        LegwattError: No such regeneration.
    """
    policy, fraction = recovery(regeneration)
    if policy == BUS:
        return Supply((BUS,), time, power.sum(axis=1, keepdims=True), fraction)
    return Supply(joints, time, power, fraction)


class LimitRow(NamedTuple):
    """One quantity of one joint's motor against its limit, over the whole series."""

    joint: str  #: Name.
    quantity: str  #: speed, voltage, current or rms_current.
    unit: str  #: rad/s, V or A.
    limit: float  #: Permitted magnitude.
    peak: float  #: Greatest magnitude; for rms_current the root mean square.
    breach: bool  #: Whether the peak exceeds the limit.


#: Unit of each quantity, and the motor's number that limits it.
_LIMITS: Final = {
    "speed": ("rad/s", "max_speed"),
    "voltage": ("V", "supply_voltage"),
    "current": ("A", "peak_current"),
    "rms_current": ("A", "continuous_current"),
}


def limit_rows(result: ChainResult) -> Iterator[LimitRow]:
    """Return a row for every joint and limit of its motor, breached or not.

    Raises:
        LegwattError: The series spans no time.
    """
    every = {"speed": result.motor.velocity, "voltage": result.voltage, "current": result.current}
    peaks = {name: np.abs(values).max(axis=0) for name, values in every.items()}
    peaks["rms_current"] = rms_over_time(result.joint.time, result.current)
    return _rows(result.joint.joints, result.motors, peaks)


def standing_rows(
    holding: HoldingResult, joints: Sequence[str], motors: Sequence[DCMotor]
) -> Iterator[LimitRow]:
    """Return a row for every joint and limit that holding still (J,) can breach."""
    current, voltage = np.abs(holding.current), np.abs(holding.voltage)
    return _rows(joints, motors, {"voltage": voltage, "current": current, "rms_current": current})


def _rows(
    joints: Sequence[str], motors: Sequence[DCMotor], peaks: Mapping[str, Array]
) -> Iterator[LimitRow]:
    """A row for each joint and quantity, whose greatest magnitudes are (J,)."""
    for j, (joint, motor) in enumerate(zip(joints, motors, strict=True)):
        for quantity, values in peaks.items():
            unit, name = _LIMITS[quantity]
            limit, peak = getattr(motor, name), float(values[j])
            yield LimitRow(joint, quantity, unit, limit, peak, bool(peak > limit))


def rms_over_time(time: Array, values: Array) -> Array:
    """Return the root mean square of a piecewise linear quantity (N, J), (J,).

    Time is (N,), or (N, J) where every column has its own [s]; repeated stamps are breaks.

    Raises:
        LegwattError: The series spans no time.
    """
    duration(time)
    a, b = values[:-1], values[1:]
    square = weighted(np.diff(time, axis=0), a * a + a * b + b * b) / 3.0  # exact if linear
    return np.sqrt(np.asarray(square / (time[-1] - time[0])))


Values = Mapping[str, float]
#: Nodes of Gauss and Legendre over the charge; the integrand is smooth above the greatest power.
_NODES, _WEIGHTS = (np.asarray(a) for a in np.polynomial.legendre.leggauss(24))
HOUR: Final = 3600.0  # [s]
#: 1/2 (t_r + t_f) f: edges of 50 ns and 50 kHz, the middle of what sheets of bridges below 60 V
#: print (20 to 100 ns, 20 to 100 kHz) [1].
SWITCHING: Final = 0.5 * (50e-9 + 50e-9) * 50e3


@dataclass(frozen=True)
class Battery(Numbers):
    """One battery."""

    name: str  #: Of the part.
    energy: float  #: From full to empty at a small current [J].
    full: float  #: Open-circuit voltage when full [V].
    empty: float  #: Open-circuit voltage when it counts as empty [V].
    resistance: float = 0.0  #: Internal [ohm].
    returned: float = 1.0  #: Share of the charge fed into it that can be drawn again [1].
    mass: float = 0.0  #: [kg]; no law uses it.

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.energy > 0.0, self.name, "energy must be positive")
        require(0.0 < self.empty <= self.full, self.name, "0 < empty <= full voltage must hold")
        require(self.returned <= 1.0, self.name, "returned must not be above 1")

    @property
    def charge(self) -> float:
        """From full to empty [C]."""
        return 2.0 * self.energy / (self.full + self.empty)

    def current(self, power: Array, charged: Array) -> Array:
        """Return the current out of the battery, (...) [A]; NaN where it cannot give the power.

        Power is at the terminals (...) [W], `charged` the share of charge that is left, (...).
        """
        voltage = self.empty + (self.full - self.empty) * charged  # without current [V]
        left = voltage * voltage - 4.0 * self.resistance * power
        root = np.sqrt(np.where(left >= 0.0, left, np.nan))
        return np.asarray(2.0 * power / (voltage + root))

    def charge_at_end(self, power: float, cut_off: float = 0.0) -> float:
        """Return the share of charge that stays, 0 to 1; 1 where it cannot even begin.

        Power is the greatest [W], `cut_off` the least voltage [V] that drivers work with.
        """
        lost = self.resistance * max(power, 0.0)  # [V^2]
        # The branch above half of the voltage; below it the greatest power is the bound.
        limit = max(cut_off, math.sqrt(lost))
        needed = limit + (lost / limit if limit else 0.0)
        if self.full == self.empty:
            return float(needed > self.full)
        return min(max((needed - self.empty) / (self.full - self.empty), 0.0), 1.0)

    def hours(
        self, power: Array, shares: Array, *, peak: float = -math.inf, cut_off: float = 0.0
    ) -> float:
        """Return how long a full battery lasts [h]; infinite where nothing is drawn.

        The modes alternate so quickly that the charge hardly changes in one round of them.

        Args:
            power: Of each mode at the terminals, hotel load and drivers included, (M,) [W].
            shares: Of the time in each mode, (M,), which sum to one.
            peak: Greatest power within a mode [W]; that of the modes by default.
            cut_off: Least voltage at the terminals that drivers work with [V].

        Raises:
            LegwattError: The shares are negative or do not sum to one.
        """
        require(shares >= 0.0, self.name, "shares must not be negative")
        require(math.isclose(shares.sum(), 1.0, abs_tol=1e-6), self.name, "shares must sum to 1")
        last = self.charge_at_end(max(float(power.max()), peak), cut_off)
        if last >= 1.0:
            return 0.0
        half = 0.5 * (1.0 - last)
        current = self.current(power[:, None], last + half + half * _NODES)  # (M, 24)
        drawn = shares @ np.where(current < 0.0, self.returned * current, current)  # [A]
        if not (drawn > 0.0).all():
            return math.inf
        return float(self.charge * half * (_WEIGHTS / drawn).sum() / HOUR)


@dataclass(frozen=True, eq=False)
class Driver(Numbers):
    """One driver; numbers may be arrays that broadcast against current and voltage."""

    name: str  #: Of the part.
    resistance: Scalars = 0.0  #: In series with the winding, at least 2 c R_on [ohm].
    idle: Scalars = 0.0  #: Power while it is enabled, whatever the current [W].
    switching: Scalars = 0.0  #: Loss over bus voltage times current [1].
    #: Greatest motor voltage over bus voltage, without current [1].
    voltage_share: Scalars = number("", "positive", 1.0)
    continuous_current: Scalars = number("", "limit", math.inf)  #: Root mean square [A].
    peak_current: Scalars = number("", "limit", math.inf)  #: At every instant [A].
    least_voltage: Scalars = 0.0  #: Of the bus, below which it switches off [V].
    most_voltage: Scalars = number("", "limit", math.inf)  #: Of the bus [V].

    def loss(self, current: Array, bus: Scalars) -> Array:
        """Return the heat of the enabled driver at a current (...) [A] and bus [V], (...) [W]."""
        size = np.abs(current)
        return self.idle + self.resistance * size * size + self.switching * bus * size


def driver_of(name: str, x: Values, *, current_of: float = 1.0) -> Driver:
    """Return a driver in the ampere of a motor, by c (`actuators.loading.data_sheet.CURRENTS`).

    At full voltage and continuous current it loses what its efficiency states: idle power,
    switching in physical times, and for the rest conduction, by transistors that are warm, chokes,
    shunts and leads. A LegwattError names what is missing.
    """
    _require(name, x, "on_resistance", "idle_power", "efficiency", "voltage_share", "most_voltage")
    rated = x.get("continuous_current", x.get("peak_current", math.nan))  # [A]
    if math.isnan(rated):
        raise LegwattError(f"driver '{name}': missing continuous_current or peak_current")
    root, bus = math.sqrt(current_of), x["most_voltage"]
    given = x["voltage_share"] * bus * rated  # into the motor at full voltage [W]
    rest = max(given * (1.0 / x["efficiency"] - 1.0) - x["idle_power"], 0.0)  # [W]
    switching = min(SWITCHING, rest / (bus * rated))
    conduction = max(2.0 * x["on_resistance"], rest / rated**2 - switching * bus / rated)  # [ohm]
    limits = {k: x[k] for k in ("continuous_current", "peak_current", "least_voltage") if k in x}
    losses = (current_of * conduction, x["idle_power"], root * switching)
    return Driver(name, *losses, root * x["voltage_share"], most_voltage=bus, **limits)


def battery_of(
    name: str, x: Values, *, energy: float | None = None, voltage: float | None = None
) -> Battery:
    """Return a battery of an energy when full [J] and a nominal voltage [V], or of the sheet's.

    `sag` is the share of the nominal voltage that the current of one hour costs, so that
    R = sag U^2 / (energy / 1 h), however cells are joined. A LegwattError names what is missing.
    """
    stated = {"energy": energy, "voltage": voltage}
    known = {**x, **{entry: value for entry, value in stated.items() if value is not None}}
    _require(name, known, "energy", "voltage", "voltage_swing", "sag", "usable", "returned")
    nominal, full, swing = known["voltage"], known["energy"], known["voltage_swing"]
    mass = x.get("mass", 0.0)
    if "specific_energy" in x and (energy is not None or not mass):
        mass = full / x["specific_energy"]
    volts = nominal * (1.0 + swing), nominal * (1.0 - swing)
    resistance = known["sag"] * nominal**2 * HOUR / full
    return Battery(name, full * known["usable"], *volts, resistance, known["returned"], mass)


def _require(name: str, x: Values, *entries: str) -> None:
    if lacking := ", ".join(entry for entry in entries if entry not in x):
        raise LegwattError(f"part '{name}': missing {lacking}")
