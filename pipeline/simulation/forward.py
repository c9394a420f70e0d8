"""Forward simulation: how a machine moves under its servos' own law.

The measured motion gives nothing but the first instant. With inertia M(q) and bias h(q, v) of the
rigid bodies, the motors' torques found from the servo's law, and every chain asked for what it
needs at its motor (`Element.moving`), the accelerations solve, joint by joint,

    moving(M a + h, v, a) = motor torque

A joint at rest stays there while its motor's torque lies in the interval that holds it
(`Element.holding`); friction is neither regularised nor chattering. Servo: a bridge that applies

    U = supply clip(gain (goal - position), -1, 1)

and, where it is switched off, leaves the winding open (no current) or shorted (U = 0).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.shaft import ShaftSeries
from pipeline.logs.errors import LogContentError, ModelError
from pipeline.logs.reading.log import Log
from pipeline.machine.joint import JointModel
from pipeline.machine.machine import MachineModel
from pipeline.simulation.rigid_bodies import changed_model

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: Longest step [s]; a servo's joint takes some ten times as long to answer.
LONGEST_STEP: Final = 1e-3
#: Rows whose slope is the first velocity.
_FIRST_ROWS: Final = 10
_NEWTON: Final = 30
_EXACT: Final = 1e-9  # residual over the scale of torques


@dataclass(frozen=True, eq=False)
class ServoInput:
    """What the servos of a machine are told, and the first instant.

    Attributes:
        name: Of the log.
        time: Shape (N,) [s].
        goal: Position asked for, shape (N, J) [rad].
        supply: Shape (N,) [V].
        gain: Duty per position error [1/rad].
        off: Where a drive is switched off, shape (N, J).
        open_bridge: Whether a drive that is off leaves its winding open; else it is shorted.
        position: At the first instant, as its sensor reads, shape (J,) [rad].
        velocity: Likewise [rad/s].
        temperature: Of the motors' sensors, shape (N, J) [degC], or None.
    """

    name: str
    time: Array
    goal: Array
    supply: Array
    gain: float
    off: Mask
    open_bridge: bool
    position: Array
    velocity: Array
    temperature: Array | None = None


@dataclass(frozen=True, eq=False)
class Rollout:
    """What a simulated machine did.

    Attributes:
        time: Of the input, shape (N,) [s].
        position: As its sensors read, shape (N, J) [rad].
        velocity: Shape (N, J) [rad/s].
        voltage: Applied to the motors, shape (N, J) [V]; NaN where the winding is open.
        current: Shape (N, J) [A].
    """

    time: Array
    position: Array
    velocity: Array
    voltage: Array
    current: Array


def servo_input(log: Log) -> ServoInput:
    """What a log says about its servos.

    Raises:
        LogContentError: Goal, supply or gain is missing, or what a switched-off drive does.
    """
    missing = [
        name
        for name, value in (
            ("goal positions", log.goal_position),
            ("a supply voltage", log.supply),
            ("the controller's gain_per_rad", log.gain),
        )
        if value is None
    ]
    if missing:
        raise LogContentError(
            f"{log.name}: a forward simulation needs {' and '.join(missing)}; name them in the "
            "mapping file"
        )
    assert log.goal_position is not None
    assert log.supply is not None
    assert log.gain is not None
    off = np.zeros(log.position.shape, dtype=np.bool_) if log.torque_off is None else log.torque_off
    if off.any() and log.torque_off_bridge is None:
        raise LogContentError(
            f"{log.name}: the drive is off in some rows; say in the mapping file whether "
            'torque_off_bridge is "open" or "shorted"'
        )
    first = np.isfinite(log.position[:_FIRST_ROWS]).all(axis=1)
    if first.sum() < 2 or not np.isfinite(log.goal_position[~off]).all():
        raise LogContentError(f"{log.name}: first positions or goals are empty; cut the log")
    t = log.time[:_FIRST_ROWS][first]
    slope, start = np.polyfit(t - log.time[0], log.position[:_FIRST_ROWS][first], 1)
    return ServoInput(
        name=log.name,
        time=log.time,
        goal=np.where(np.isfinite(log.goal_position), log.goal_position, 0.0),
        supply=log.supply,
        gain=log.gain,
        off=off,
        open_bridge=log.torque_off_bridge == "open",
        position=np.asarray(start),
        velocity=np.asarray(slope),
        temperature=log.temperature,
    )


@dataclass(frozen=True, eq=False)
class _Instant:
    """What the servos are told at one instant, and how warm their motors are."""

    goal: Array
    supply: float
    off: Mask
    constant: Array
    resistance: Array


class ForwardSimulator:
    """Forward simulation of one machine.

    Args:
        model: Fixed base, a motor in every joint, transmissions without play or coupling.

    Raises:
        ModelError: The model has something else.

    Note:
        Transmissions are taken as rigid: a compliance that naming has estimated as a tolerance
        moves the joint by far less than a servo's error.
    """

    def __init__(self, model: MachineModel) -> None:
        if model.floating:
            raise ModelError(f"{model.name}: a forward simulation stands on a fixed base only")
        self.model = model
        for actuator in model.actuators:
            _refuse(actuator)
        self._rigid = changed_model(model.rigid, model.bodies)
        self._data = self._rigid.createData()
        self._columns = np.array(
            [self._rigid.joints[self._rigid.getJointId(j)].idx_v for j in model.joints]
        )
        self._neutral = pin.neutral(self._rigid)
        self._offset = np.array([a.encoder_offset for a in model.actuators])
        self._ratio = np.array([a.ratio for a in model.actuators])

    def run(self, servo: ServoInput) -> Rollout:
        """Simulate from the first instant to the last.

        Args:
            servo: Goals, supply, gain, first position and velocity.
        """
        n, joints = servo.goal.shape
        position, velocity, voltage, current = (np.empty((n, joints)) for _ in range(4))
        q, v = servo.position - self._offset, servo.velocity.copy()
        own = np.array([0.0 if a.heating is None else a.heating.initial for a in self._actuators])
        for row in range(n):
            constant, resistance = self._warm(servo, row, own)
            now = _Instant(
                servo.goal[row], float(servo.supply[row]), servo.off[row], constant, resistance
            )
            position[row], velocity[row] = q + self._offset, v
            voltage[row], current[row] = self._electrical(servo, now, q, v)
            if row + 1 == n:
                break
            width = float(servo.time[row + 1] - servo.time[row])
            own = self._warmed(own, current[row], width)
            steps = max(1, int(np.ceil(width / LONGEST_STEP - 1e-9)))
            for k in range(steps):
                share = (k + 0.5) / steps
                middle = replace(
                    now,
                    goal=(1 - share) * servo.goal[row] + share * servo.goal[row + 1],
                    supply=float((1 - share) * servo.supply[row] + share * servo.supply[row + 1]),
                )
                q, v = self._step(servo, middle, q, v, width / steps)
        return Rollout(servo.time, position, velocity, voltage, current)

    @property
    def _actuators(self) -> tuple[JointModel, ...]:
        return self.model.actuators

    def _warm(self, servo: ServoInput, row: int, own: Array) -> tuple[Array, Array]:
        """Torque constants and resistances of the warm motors, each (J,)."""
        constant, resistance = np.empty(own.size), np.empty(own.size)
        for k, a in enumerate(self._actuators):
            rise = np.array(own[k])
            if a.heating is not None and servo.temperature is not None:
                rise = rise + a.heating.sensed(servo.temperature[row, k])
            warm = a.warm(rise)
            constant[k], resistance[k] = warm.torque_constant, warm.resistance
        return constant, resistance

    def _warmed(self, own: Array, current: Array, width: float) -> Array:
        """The motors' thermal nodes after a time [s] at a current (J,) [A]."""
        out = own.copy()
        for k, a in enumerate(self._actuators):
            if a.heating is not None and a.motor is not None:
                node = replace(a.heating, initial=float(own[k]))
                loss = float(np.asarray(a.motor.resistance)) * float(current[k]) ** 2
                out[k] = node.temperature_rise(np.array([0.0, width]), np.full(2, loss))[-1]
        return out

    def _electrical(
        self, servo: ServoInput, now: _Instant, q: Array, v: Array
    ) -> tuple[Array, Array]:
        """Voltage and current of the motors, each (J,)."""
        error = now.goal - (q + self._offset)
        voltage = now.supply * np.clip(servo.gain * error, -1.0, 1.0)
        voltage = np.where(now.off, np.nan if servo.open_bridge else 0.0, voltage)
        current = (voltage - now.constant * self._ratio * v) / now.resistance
        return voltage, np.where(now.off & servo.open_bridge, 0.0, current)

    def _step(
        self, servo: ServoInput, now: _Instant, q: Array, v: Array, width: float
    ) -> tuple[Array, Array]:
        """One step of the midpoint rule, cut where a joint comes to rest: friction may hold it."""
        for _ in range(2 * v.size + 1):
            direction, a = self._accelerations(servo, now, q, v, None)
            half = q + 0.5 * width * v, v + 0.5 * width * a
            _, a = self._accelerations(servo, now, *half, direction)
            new = v + width * a
            back = (new * direction < 0.0) & (v != 0.0)
            if not back.any():
                return q + width * half[1], new
            share = np.where(back, v / np.where(back, v - new, 1.0), 1.0)
            first = float(share.min())
            q = q + first * width * (v + 0.5 * first * width * a)
            v = np.where(back & (share <= first), 0.0, v + first * width * a)
            width *= 1.0 - first
        return q, v

    def _accelerations(
        self, servo: ServoInput, now: _Instant, q: Array, v: Array, given: Array | None
    ) -> tuple[Array, Array]:
        """Directions of motion (zero where a joint is held) and accelerations, each (J,).

        Args:
            servo: The input.
            now: The present instant.
            q: Joint positions.
            v: Joint velocities.
            given: Directions decided before; by velocity and holding torque when None.
        """
        full = pin.integrate(self._rigid, self._neutral, self._spread(q))
        bias = pin.rnea(self._rigid, self._data, full, self._spread(v), np.zeros(self._rigid.nv))
        load = np.asarray(bias)[self._columns]
        for k, actuator in enumerate(self._actuators):
            load[k] = actuator.beside(q[k], load[k])
        mass = np.asarray(pin.crba(self._rigid, self._data, full))
        mass = (np.triu(mass) + np.triu(mass, 1).T)[np.ix_(self._columns, self._columns)]
        _, current = self._electrical(servo, now, q, v)
        torque = now.constant * current
        if given is not None:
            return given, self._solved(mass, load, q, v, given, torque)
        direction = np.sign(v)
        for _ in range(direction.size + 1):
            a = self._solved(mass, load, q, v, direction, torque)
            needed = mass @ a + load
            freed = False
            for k in np.flatnonzero(direction == 0.0).tolist():
                push = self._breaking_away(k, float(needed[k]), float(torque[k]))
                if push:
                    direction[k], freed = push, True
            if not freed:
                break
        return direction, a

    def _breaking_away(self, joint: int, needed: float, torque: float) -> float:
        """Sense in which a motor's torque starts a joint that is held; 0 where it does not."""
        load = np.array([needed])
        low, high = self._actuators[joint].holding(load, load)
        return float(torque > high[0]) - float(torque < low[0])

    def _solved(
        self, mass: Array, load: Array, q: Array, v: Array, direction: Array, torque: Array
    ) -> Array:
        """Accelerations (J,) of the joints that move; the laws are linear piece by piece."""
        a = np.zeros(v.size)
        free = np.flatnonzero(direction)
        if free.size == 0:
            return a
        scale = 1e-12 + np.abs(torque).max() + np.abs(load / self._ratio).max()
        for _ in range(_NEWTON):
            needed = mass @ a + load
            rest, by_load, by_acceleration = (np.empty(free.size) for _ in range(3))
            for row, k in enumerate(free.tolist()):
                value = self._at_motor(k, needed[k], q[k], v[k], a[k], direction[k])
                rest[row], by_load[row], by_acceleration[row] = value
            rest = rest - torque[free]
            if np.abs(rest).max() < _EXACT * scale:
                break
            slope = by_load[:, None] * mass[np.ix_(free, free)] + np.diag(by_acceleration)
            a[free] -= np.linalg.solve(slope, rest)
        return a

    def _at_motor(
        self, joint: int, load: float, q: float, v: float, a: float, direction: float
    ) -> tuple[float, float, float]:
        """Torque needed at a motor, and its slopes over load and acceleration."""
        step = 1e-6 * (1.0 + abs(load))
        # Towards larger loads, away from the kink of load-dependent friction at none.
        step = step if load >= 0.0 else -step
        side = ShaftSeries(
            joints=(self.model.joints[joint],),
            time=np.zeros(3),
            position=np.full((3, 1), q),
            velocity=np.full((3, 1), v),
            acceleration=np.array([[a], [a], [a + 1.0]]),
            torque=np.array([[load], [load + step], [load]]),
            direction=np.full((3, 1), direction),
        )
        needed = self._actuators[joint].at_motor(side).torque[:, 0]
        return float(needed[0]), float(needed[1] - needed[0]) / step, float(needed[2] - needed[0])

    def _spread(self, values: Array) -> Array:
        out = np.zeros(self._rigid.nv)
        out[self._columns] = values
        return out


def _refuse(actuator: JointModel) -> None:
    """Refuse a joint that cannot be simulated forward.

    Raises:
        ModelError: It has no motor, or a transmission that is not rigid and its own.
    """
    if actuator.motor is None:
        raise ModelError(f"joint '{actuator.name}': no motor; name the actuator with --alternative")
    if actuator.coupled_to or actuator.backlash:
        raise ModelError(
            f"joint '{actuator.name}': a coupled or loose transmission cannot be simulated forward"
        )
