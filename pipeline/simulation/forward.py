"""Forward simulation: how a machine moves under its servos' own law.

The measured motion gives nothing but the first instant. With inertia M(q) and bias h(q, v) of the
rigid bodies, the motors' torques found from the servo's law, and every chain asked for what it
needs at its motor (`Element.inverse`), the accelerations solve, joint by joint,

    inverse(M a + h, v, a) = motor torque

A joint at rest stays there while its motor's torque lies in the interval that holds it
(`Element.holding`); friction is neither regularised nor chattering. Servo: a bridge that applies

    U = supply clip(gain (goal - position), -1, 1)

and, where it is switched off, leaves the winding open (no current) or shorted (U = 0).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import pinocchio as pin

from actuators.arrays import Array, Mask
from actuators.chain import held
from actuators.elements.heating import warmed
from actuators.errors import LegwattError
from actuators.shaft import ShaftSeries
from pipeline.logs.log import Recording
from pipeline.machine.machine import MachineModel

#: Longest step [s]; a servo's joint takes some ten times as long to answer.
LONGEST_STEP: Final = 1e-3
#: Rows whose slope is the first velocity.
_FIRST_ROWS: Final = 10
_NEWTON: Final = 30
_EXACT: Final = 1e-9  # residual over the scale of torques
#: Voltage [V] and current [A] of the motors (J,) by positions [rad] and velocities [rad/s] of their
#: joints, at one instant.
Bridge = Callable[[Array, Array], tuple[Array, Array]]


@dataclass(frozen=True, eq=False)
class ServoInput:
    """What the servos of a machine are commanded, and the first instant."""

    time: Array  #: Shape (N,) [s].
    goal: Array  #: Position asked for, shape (N, J) [rad].
    supply: Array  #: Shape (N,) [V].
    gain: float  #: Duty per position error [1/rad].
    off: Mask  #: Where a drive is switched off, shape (N, J).
    open_bridge: bool  #: Whether a drive that is off leaves its winding open; else it is shorted.
    position: Array  #: At the first instant, as its sensor reads, shape (J,) [rad].
    velocity: Array  #: Likewise [rad/s].
    temperature: Array | None = None  #: Of the motors' sensors, shape (N, J) [degC], or None.


@dataclass(frozen=True, eq=False)
class Rollout:
    """What a simulated machine did."""

    time: Array  #: Of the input, shape (N,) [s].
    position: Array  #: As its sensors read, shape (N, J) [rad].
    velocity: Array  #: Shape (N, J) [rad/s].
    voltage: Array  #: Applied to the motors, shape (N, J) [V]; NaN where the winding is open.
    current: Array  #: Shape (N, J) [A].


def servo_input(log: Recording) -> ServoInput:
    """What a log says about its servos.

    Raises:
        LegwattError: Goal, supply or gain is missing, or what a switched-off drive does.
    """
    goal, supply, gain = log.of("goal_position"), log.of("supply"), log.gain
    if goal is None or supply is None or gain is None:
        raise LegwattError(
            f"{log.name}: a forward simulation needs goal positions, a supply voltage and the "
            "controller's gain_per_rad; name them in the mapping file"
        )
    position, switched = log.position, log.torque_off
    off = np.zeros(position.shape, dtype=np.bool_) if switched is None else switched
    if off.any() and log.torque_off_bridge is None:
        raise LegwattError(
            f"{log.name}: the drive is off in some rows; say in the mapping file whether "
            'torque_off_bridge is "open" or "shorted"'
        )
    first = np.isfinite(position[:_FIRST_ROWS]).all(axis=1)
    if first.sum() < 2 or not np.isfinite(goal[~off]).all():
        raise LegwattError(f"{log.name}: first positions or goals are empty; cut the log")
    t = log.time[:_FIRST_ROWS][first]
    slope, start = np.polyfit(t - log.time[0], position[:_FIRST_ROWS][first], 1)
    goal, bridge = np.where(np.isfinite(goal), goal, 0.0), log.torque_off_bridge == "open"
    first_instant = np.asarray(start), np.asarray(slope), log.of("temperature")
    return ServoInput(log.time, goal, supply, gain, off, bridge, *first_instant)


class ForwardSimulator:
    """Forward simulation of one machine on a fixed base, with a motor at every joint.

    Note:
        Transmissions are taken as rigid: an elastic deflection moves the joint by far less than a
        servo's error. Motors are as warm as their sensors say, or as at the first instant.
    """

    def __init__(self, model: MachineModel) -> None:
        if model.robot.floating:
            raise LegwattError(f"{model.name}: a forward simulation stands on a fixed base only")
        for a in model.actuators:
            _ = a.driven
            if a.coupled_to or a.backlash or a.warming:
                raise LegwattError(
                    f"joint '{a.name}': no transmission that is coupled, loose, or rubs less as it "
                    "warms is simulated forward"
                )
        self.model, self._actuators = model, model.actuators
        self._data = model.rigid.createData()
        self._offset = np.array([a.encoder_offset for a in model.actuators])
        self._ratio = np.array([a.ratio for a in model.actuators])

    def run(self, servo: ServoInput) -> Rollout:
        """Simulate from the first instant to the last."""
        q, v, rows = servo.position - self._offset, servo.velocity.copy(), []
        bridge_at = self._bridges(servo)
        for row, width in enumerate(np.diff(servo.time, append=servo.time[-1]).tolist()):
            rows.append((q + self._offset, v, *bridge_at(row, 0.0)[0](q, v)))
            steps = int(np.ceil(width / LONGEST_STEP - 1e-9))
            for k in range(steps):
                q, v = self._step(bridge_at(row, (k + 0.5) / steps), q, v, width / steps)
        return Rollout(servo.time, *map(np.array, zip(*rows, strict=True)))

    def _bridges(self, servo: ServoInput) -> Callable[[int, float], tuple[Bridge, Array]]:
        """By row and share of its step: the bridge, and the motors' torque constants [N*m/A]."""
        motors = []
        for k, a in enumerate(self._actuators):
            rise = np.zeros(servo.time.size)
            if a.heating is not None and servo.temperature is not None:
                rise += a.heating.sensed(servo.temperature[:, k])
            motors.append(warmed(a.driven, rise))
        constant = np.stack([np.asarray(motor.torque_constant) for motor in motors], axis=1)
        resistance = np.stack([np.asarray(motor.resistance) for motor in motors], axis=1)
        idle = np.nan if servo.open_bridge else 0.0

        def at(row: int, share: float) -> tuple[Bridge, Array]:
            after = min(row + 1, servo.time.size - 1)
            goal, supply = (
                (1 - share) * x[row] + share * x[after] for x in (servo.goal, servo.supply)
            )
            off = servo.off[row]

            def bridge(q: Array, v: Array) -> tuple[Array, Array]:
                duty = np.clip(servo.gain * (goal - q - self._offset), -1.0, 1.0)
                voltage = np.where(off, idle, supply * duty)
                current = (voltage - constant[row] * self._ratio * v) / resistance[row]
                return voltage, np.where(off & servo.open_bridge, 0.0, current)

            return bridge, constant[row]

        return at

    def _step(
        self, drive: tuple[Bridge, Array], q: Array, v: Array, width: float
    ) -> tuple[Array, Array]:
        """One step of the midpoint rule, cut where a joint comes to rest: friction may hold it."""
        for _ in range(2 * v.size + 1):
            direction, a = self._accelerations(drive, q, v)
            half = q + 0.5 * width * v, v + 0.5 * width * a
            _, a = self._accelerations(drive, *half, direction)
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
        self, drive: tuple[Bridge, Array], q: Array, v: Array, given: Array | None = None
    ) -> tuple[Array, Array]:
        """Directions of motion (zero where a joint is held) and accelerations, each (J,).

        `given`: directions decided before; by velocity and holding torque when None.
        """
        rigid, robot = self.model.rigid, self.model.robot
        full, speed = robot.configuration(q[None])[0], robot.tangent(v[None])[0]
        at, none = robot.velocity_index, np.zeros(rigid.nv)
        load = np.asarray(pin.rnea(rigid, self._data, full, speed, none))[at]
        for k, actuator in enumerate(self._actuators):
            load[k] = actuator.drive_load(q[k], load[k])
        mass = np.asarray(pin.crba(rigid, self._data, full))
        mass = (np.triu(mass) + np.triu(mass, 1).T)[np.ix_(at, at)]
        bridge, constant = drive
        torque = constant * bridge(q, v)[1]
        direction = np.sign(v) if given is None else given
        for _ in range(v.size + 1):
            a = self._solved(mass, load, q, v, direction, torque)
            still = np.flatnonzero((direction == 0.0) & (given is None))
            for k in still.tolist():  # a motor's torque outside the interval starts the joint
                needed = (mass @ a + load)[[k]]
                low, high = held(self._actuators[k].path, needed, needed, q[[k]])
                direction[k] = float(torque[k] > high[0]) - float(torque[k] < low[0])
            if not direction[still].any():
                break
        return direction, a

    def _solved(
        self, mass: Array, load: Array, q: Array, v: Array, direction: Array, torque: Array
    ) -> Array:
        """Accelerations (J,) of the joints that move; the laws are linear piece by piece."""
        a, free = np.zeros(v.size), np.flatnonzero(direction)
        scale = 1e-12 + np.abs(torque).max() + np.abs(load / self._ratio).max()
        for _ in range(_NEWTON if free.size else 0):
            needed = mass @ a + load
            rows = [
                self._at_motor(k, needed[k], q[k], v[k], a[k], direction[k]) for k in free.tolist()
            ]
            rest, by_load, by_acceleration = np.array(rows).T
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
        # Towards larger loads, away from the kink of load-dependent friction at none.
        step = 1e-6 * (1.0 + abs(load)) * (1.0 if load >= 0.0 else -1.0)
        motion = (np.full((3, 1), q), np.full((3, 1), v), np.array([[a], [a], [a + 1.0]]))
        loads = np.array([[load], [load + step], [load]])
        own = self._actuators[joint]
        side = ShaftSeries((own.name,), np.zeros(3), *motion, loads, np.full((3, 1), direction))
        needed = own.at_motor(side).torque[:, 0]
        return float(needed[0]), float(needed[1] - needed[0]) / step, float(needed[2] - needed[0])
