"""Predict what the sensors of a machine show along a measured motion.

Measured motion -> bodies and ground (`rigid`) -> an actuator per joint -> sensors. Two predictions
that share a part of their model share its computation: a change at one joint costs one joint.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from actuators.arrays import Array
from actuators.chain import Chain, moved
from actuators.elements.heating import ZERO_CELSIUS, warmed
from actuators.errors import LegwattError
from actuators.shaft import ShaftSeries
from pipeline.dynamics.contact_forces import FeetOnGround
from pipeline.dynamics.residual import body_columns, by_body, of_other_bodies
from pipeline.effects.base import Measured
from pipeline.logs.filters import late
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot import inverse_dynamics
from pipeline.simulation.equations import Moved, OnLegs, is_on_legs, motion_of, on_legs

#: Bytes of a regressor beyond which bodies go through inverse dynamics one by one.
_REGRESSOR: Final = 4e8
#: Position, velocity, acceleration.
Course = tuple[Array, Array, Array]
#: Turns in which a load is found from what sensors show: each leaves a tenth of the error.
_TURNS: Final = 3


class RigidBodies:
    """Torque at the joints that bodies, gravity and ground ask for along one measured motion.

    The ground's forces are those that were measured, else those with the least tangential parts
    (`pipeline.dynamics.contact_forces`). What depends on the motion and the measured forces alone
    is computed once.
    """

    def __init__(self, measurement: Log) -> None:
        self.measurement = measurement
        self._moved: Moved | None = None
        self._measured: tuple[Array, Array] | None = None
        self._asked: tuple[Course, tuple[float, float]] | None = None
        #: Motion, model, its torque (N, nv), and the regressor by body (B, N, nv, 10).
        self._linear: tuple[Course, MachineModel, Array, Array] | None = None

    def torque(self, machine: MachineModel, motion: tuple[Array, Array, Array]) -> Array:
        """Joint torques, shape (N, J) [N*m].

        `motion`: position, velocity and acceleration of the joints, each (N, J).
        """
        robot = machine.robot
        q, v, a = robot.configuration(motion[0]), *map(robot.tangent, motion[1:])
        if robot.floating:
            if self._moved is None:  # the measured motion, whatever an effect makes of it
                self._moved = motion_of(machine, self.measurement)
            base = self._moved.motion
            q[:, :7], v[:, :6], a[:, :6] = base[0][:, :7], base[1][:, :6], base[2][:, :6]
        if self._moved is None:
            return np.asarray(self._of_bodies(machine, (q, v, a))[:, robot.velocity_index])
        generalised = inverse_dynamics(machine.rigid, (q, v, a))
        of_ground = self._of_ground(machine, motion[0], generalised[:, :6])
        return generalised[:, robot.velocity_index] - of_ground

    def _of_bodies(self, machine: MachineModel, motion: Course) -> Array:
        """Inverse dynamics on a fixed base, (N, nv).

        From the third time on that a motion is asked for one regressor serves all bodies.
        """
        rigid, tilt, asked = machine.rigid, machine.bodies.tilt, self._asked
        if self._linear is not None:
            of, old, out, regressor = self._linear
            same = old.robot is machine.robot and old.bodies.tilt == tilt
            if same and all(map(np.array_equal, of, motion)):
                return out + of_other_bodies(regressor, rigid, old.rigid)
        out, self._asked = inverse_dynamics(rigid, motion), (motion, tilt)
        again = (
            asked is not None and asked[1] == tilt and all(map(np.array_equal, asked[0], motion))
        )
        if again and 10 * out.nbytes * (rigid.njoints - 1) < _REGRESSOR:
            self._linear = motion, machine, out, by_body(body_columns(rigid, motion))
        return out

    def regressor(self, machine: MachineModel, motion: Course) -> Array | None:
        """By body (B, N, nv, 10) on a fixed base, of joints' motion; None where it is too large."""
        robot = machine.robot
        if robot.floating:
            return None
        q, v, a = robot.configuration(motion[0]), *map(robot.tangent, motion[1:])
        course = (q, v, a)
        for _ in range(3):
            known, tilt = self._linear, machine.bodies.tilt
            same = known is not None and known[1].bodies.tilt == tilt
            if known is not None and same and all(map(np.array_equal, known[0], course)):
                return known[3]
            self._of_bodies(machine, course)
        return None

    def _of_ground(self, machine: MachineModel, q: Array, wrench: Array) -> Array:
        """What the ground's forces put into the joints, shape (N, J) [N*m]."""
        m = self.measurement
        # Measured forces ask for nothing of the bodies.
        measured = m.foot_force is not None and not np.isnan(m.foot_force[0]).any()
        if measured and self._measured is not None and self._measured[0] is q:
            return self._measured[1]
        assert self._moved is not None
        assert self._moved.stance is not None
        stance = self._moved.stance
        legs = machine.robot.chains
        feet = FeetOnGround(legs, legs.by_leg(q), stance.turn)
        force = np.full((*stance.standing.shape, 3), np.nan)
        if m.foot_force is not None:
            force[:] = m.foot_force
        if np.isnan(force).any():
            least = feet.least_tangential(wrench, stance.standing)
            force = np.where(np.isnan(force), least, force)
        out = legs.by_joint(feet.torque(force))
        if measured:
            self._measured = (q, out)
        return out


@dataclass(frozen=True, eq=False)
class Prediction:
    """What a model says the sensors show, before the low-pass."""

    model: MachineModel  #: The model.
    q: Array  #: Joint positions, link side, shape (N, J) [rad].
    torque: Array  #: Demanded of the actuators by the rigid bodies, shape (N, J) [N*m].
    motor_torque: Array  #: Of the motors brought to the joint side, shape (N, J) [N*m].
    effort: Array  #: Shape (N, J, C) in the measurement's channels.
    computed: tuple[int, ...] = ()  #: Joints computed for it; the others were taken over.
    #: Measured less predicted torque at the bandwidth, beside the forces of the ground that fit
    #: best, shape (N, J) [N*m]; None where no such forces are looked for.
    rest: Array | None = None
    load: Array | None = None  #: That the drivetrains carry by the log, likewise.
    #: The ground's forces with which columns are made, shape (N, 3 L) [N]; see `OnLegs.steady`.
    force: Array | None = None
    carried: Array | None = None  #: Torque of the bodies under these, shape (N, J) [N*m].


class Simulator:
    """Predictions of many models along one motion."""

    def __init__(self, measurement: Log) -> None:
        self.measurement = measurement
        self._bodies = RigidBodies(measurement)
        self.on_legs: OnLegs | None = None  #: Of a robot on legs, once something was predicted.
        #: What drives show that carry the bodies of a prediction under its steady forces, (N, J).
        self._drives: tuple[Prediction, Array] | None = None
        self._shifted: tuple[tuple[float, ...], Array] | None = None
        self._slopes: tuple[Prediction, list[dict[int, Array]] | None] | None = None

    @cached_property
    def measured(self) -> Measured:
        """What its log holds, as effects ask."""
        m = self.measurement
        rows, speed = np.ascontiguousarray(m.effort[m.has_say, :, 0].T), np.abs(m.v)
        squares = [np.nansum(x**2) / max(np.isfinite(x).sum(), 1) for x in rows]
        kelvin = None
        if m.temperature is not None:
            kelvin = np.array([np.mean(x + ZERO_CELSIUS) for x in m.temperature.T])
        return Measured(
            channels=m.channels,
            feet=None if m.foot_force is None else not np.isnan(m.foot_force).any(),
            length=float(m.time[-1] - m.time[0]),
            bandwidth=m.bandwidth,
            rest_speed=m.rest_speed,
            slow=np.quantile(speed, 0.3, axis=0),
            fast=np.quantile(speed, 0.98, axis=0),
            travel=np.ptp(m.q, axis=0),
            effort=np.sqrt(squares),
            kelvin=kelvin,
        )

    def predict(self, model: MachineModel, near: Prediction | None = None) -> Prediction:
        """Predict with a model; equal parts of a `near` model's prediction are taken over.

        Raises:
            LegwattError: The model's joints are not the measurement's.
        """
        m = self.measurement
        if model.joints != m.joints:
            raise LegwattError(f"{model.name}: the model's joints are not those of log '{m.name}'")
        if self.legs(model) is not None:
            return self._predict_on_legs(model)
        before = model if near is None else near.model
        pairs = enumerate(zip(model.actuators, before.actuators, strict=True))
        changed = {k for k, (new, old) in pairs if near is None or new is not old}
        if near is None or self._moves_bodies(model, near.model, changed):
            q, torque = self.rigid(model)
            if near is not None:
                differs = np.abs(torque - near.torque).max(axis=0)
                scale = 1e-12 * (1.0 + np.abs(torque).max(axis=0))
                changed |= set(np.flatnonzero(differs > scale).tolist())
        else:
            q, torque = near.q, near.torque
        # A changed joint's motor takes part in the torque of the joint it is coupled to.
        coupled = {
            machine.index(machine.actuators[k].coupled_to)
            for machine in (model, before)
            for k in changed
            if machine.actuators[k].coupled_to
        }
        computed = tuple(sorted(changed | coupled))
        motor, effort = self._sensed(model, q, torque, computed, near)
        return Prediction(model, q, torque, motor, effort, computed)

    def legs(self, model: MachineModel) -> OnLegs | None:
        """Its equations of motion, of a robot on legs whose torques are logged; else None."""
        if self.on_legs is None and is_on_legs(model, self.measurement):
            self.on_legs = on_legs(model, self.measurement, lambda: self.load(model))
        return self.on_legs

    def load(self, model: MachineModel, near: Prediction | None = None) -> Array:
        """Torque that the drivetrains carry where sensors show what they do, (N, J) [N*m].

        `near`: of another model, whose equal drivetrains carry what they do there.
        """
        m = self.measurement
        seen = np.nan_to_num(m.effort[..., 0])
        changed = [
            k
            for k, a in enumerate(model.actuators)
            if (a != Chain(a.name) if near is None else a is not near.model.actuators[k])
        ]
        load = seen.copy()
        if near is not None and near.load is not None:
            load = near.load.copy()
        if not changed:
            return load
        if any(a.coupled_to for a in model.actuators):
            changed = list(range(len(model.actuators)))
        # A sensor's gain is no torque that the filter has to pass.
        gains = [a.gains.get("torque", 1.0) for a in model.actuators]
        seen = seen / gains
        if near is None:
            load[:, changed] = seen[:, changed]
        for _ in range(_TURNS if near is None else 1):
            shown = self._sensed(model, m.q, load, changed)[1][..., 0] / gains
            drives = m.smooth((shown - load)[:, changed])
            load[:, changed] = seen[:, changed] - drives
        return load

    def _predict_on_legs(self, model: MachineModel) -> Prediction:
        legs = self.legs(model)
        assert legs is not None
        load = self.load(model)
        left = legs.left(model, load, self.positions(model))
        force, at = legs.forces(left), left.moved.joints
        torque = (left.rigid - left.pushed(force))[:, at]
        every = tuple(range(torque.shape[1]))
        motor, effort = self._sensed(model, left.q, torque, every)
        gains = np.array([a.gains.get("torque", 1.0) for a in model.actuators])
        rest = left.under(force)[:, at] * gains
        steady = legs.steady(force)
        carried = (left.rigid - left.pushed(steady))[:, at]
        return Prediction(model, left.q, torque, motor, effort, every, rest, load, steady, carried)

    def positions(self, model: MachineModel) -> Array:
        """Of the joints, where a model says their sensors' zeros are, shape (N, J) [rad]."""
        offset = tuple(a.encoder_offset for a in model.actuators)
        if not any(offset):
            return self.measurement.q
        if self._shifted is None or self._shifted[0] != offset:
            self._shifted = offset, self.measurement.q - np.array(offset)
        return self._shifted[1]

    def _sensed(
        self,
        model: MachineModel,
        q: Array,
        torque: Array,
        joints: Sequence[int],
        near: Prediction | None = None,
    ) -> tuple[Array, Array]:
        """Motor torque (N, J) and channels (N, J, C) of some joints; the others' are `near`'s."""
        shape = (*torque.shape, len(self.measurement.channels))
        motor = np.zeros_like(torque) if near is None else near.motor_torque.copy()
        effort = np.zeros(shape) if near is None else near.effort.copy()
        # Coupled motors first: what they supply to the other joint must be known.
        for k in sorted(joints, key=lambda k: not model.actuators[k].coupled_to):
            motor[:, k], effort[:, k] = self._joint(model, k, q, torque, motor)
        return motor, effort

    def drives_apart(self, base: Prediction, model: MachineModel) -> dict[int, Array]:
        """Torque that other drivetrains show on legs beside those of a prediction, (N,) by joint.

        Both carry the bodies of that prediction under its steady forces.
        """
        assert base.carried is not None
        pairs = zip(model.actuators, base.model.actuators, strict=True)
        changed = {k for k, (new, old) in enumerate(pairs) if new is not old}
        couplings = [
            {k, one.index(a.coupled_to)}
            for one in (model, base.model)
            for k, a in enumerate(one.actuators)
            if a.coupled_to
        ]
        for _ in couplings:  # a change goes on through the joints that are coupled
            changed = changed.union(*(pair for pair in couplings if pair & changed))
        if not changed:
            return {}
        joints = sorted(changed)
        if self._drives is None or self._drives[0] is not base:
            every = range(len(base.model.actuators))
            self._drives = base, self._sensed(base.model, base.q, base.carried, every)[1][..., 0]
        shown = self._sensed(model, base.q, base.carried, joints)[1][..., 0]
        change = self.measurement.smooth((shown - self._drives[1])[:, joints])
        gains = [base.model.actuators[k].gains.get("torque", 1.0) for k in joints]
        return dict(zip(joints, (change / gains).T, strict=True))

    def difference(self, base: Prediction, model: MachineModel) -> dict[int, Array]:
        """Prediction of a model less that of another, (N, C) by joint where they differ."""
        new = self.predict(model, base)
        delta = new.effort - base.effort
        return {k: delta[:, k] for k in new.computed if delta[:, k].any()}

    def of_body(self, base: Prediction, number: int, ten: Array) -> dict[int, Array] | None:
        """What other inertial parameters of one body change of a prediction, (N, C, n) by joint.

        None where a torque shows at other joints or times than it acts, so that each is simulated.

        Args:
            base: The prediction.
            number: Of the joint that carries the body, in Pinocchio's order.
            ten: Changes, shape (10, n).
        """
        m = self.measurement
        regressor = self._bodies.regressor(base.model, (base.q, m.v, m.a))
        shown = None if regressor is None else self._by_load(base)
        if regressor is None or shown is None:
            return None
        torque = (regressor[number - 1] @ ten)[:, base.model.robot.velocity_index]
        out: dict[int, Array] = {}
        for i in np.flatnonzero(torque.any(axis=(0, 2))).tolist():
            for k, own in shown[i].items():
                out[k] = out.get(k, 0.0) + own[..., None] * torque[:, i, None]
        return {k: self._sampled(base.model.actuators[k], x) for k, x in out.items()}

    def _by_load(self, base: Prediction) -> list[dict[int, Array]] | None:
        """What sensors of joints see per torque at each joint, (N, C); None as in `of_body`."""
        if self._slopes is None or self._slopes[0] is not base:
            self._slopes = base, None
            every, model = base.model.actuators, base.model
            if not any(a.is_elastic or a.heating for a in every):
                pairs = [{a.name, a.coupled_to} for a in every if a.coupled_to]
                coupled = [model.index(name) for name in sorted(set().union(*pairs))]
                step = 1e-3 * (1e-3 + np.abs(base.torque).max(axis=0)) * np.eye(len(every))
                out = []
                for i in range(len(every)):
                    joints = coupled if i in coupled else [i]
                    up, down = (
                        self._before_sensors(model, base.q, base.torque + way * step[i], joints)
                        for way in (1.0, -1.0)
                    )
                    out.append({k: (up[k] - down[k]) / (2.0 * step[i, i]) for k in joints})
                self._slopes = base, out
        return self._slopes[1]

    def _before_sensors(
        self, model: MachineModel, q: Array, torque: Array, joints: Sequence[int]
    ) -> dict[int, Array]:
        """Channels of some joints (N, C) that are coupled to no others, before their sensors."""
        motor, out = np.zeros_like(torque), {}
        for k in sorted(joints, key=lambda k: not model.actuators[k].coupled_to):
            motor[:, k], out[k], _ = self._shown(model, k, q, torque, motor)
        return out

    def _moves_bodies(self, model: MachineModel, near: MachineModel, changed: set[int]) -> bool:
        """Whether bodies move or weigh otherwise."""
        if model.robot is not near.robot or model.bodies != near.bodies:
            return True
        return any(
            new.encoder_offset != old.encoder_offset
            or (self.measurement.at_motor and _deflection(new) != _deflection(old))
            for new, old in ((model.actuators[k], near.actuators[k]) for k in changed)
        )

    def rigid(self, model: MachineModel) -> tuple[Array, Array]:
        """Positions and what bodies, gravity and the ground by its rule ask for, (N, J) each."""
        m, q = self.measurement, self.positions(model)
        torque = self._bodies.torque(model, (q, m.v, m.a))
        if not m.at_motor or not any(a.is_elastic for a in model.actuators):
            return q, torque
        # The encoder sits on the motor: the link lags behind by the elastic deflection.
        lag, rate, second = np.zeros((3, *q.shape))
        for k, a in enumerate(model.actuators):
            if a.is_elastic:
                load = self._load(model, k, q, torque)
                lag[:, k], rate[:, k], second[:, k] = self._wind_up(a, load)
        return q - lag, self._bodies.torque(model, (q - lag, m.v - rate, m.a - second))

    def _wind_up(self, a: Chain, load: Array) -> tuple[Array, Array, Array]:
        """How far a motor leads its joint, at the bandwidth, and its derivatives, (N,) each."""
        angle = self.measurement.smooth(a.deflection(load))
        rate = self.measurement.derivative(angle)
        return angle, rate, self.measurement.derivative(rate)

    def _load(self, model: MachineModel, k: int, q: Array, torque: Array) -> Array:
        """What one motor's transmission has to supply, at the joint side, (N,) [N*m]."""
        m, joints = self.measurement, model.actuators

        def demand(i: int) -> Array:
            asked = joints[i].drive_load(q[:, i], torque[:, i])
            if not joints[i].apart:
                return asked
            own = self._side(i, (q[:, i], m.v[:, i], m.a[:, i]), asked)
            return np.asarray(moved(joints[i].apart, own).torque[:, 0])

        return model.drivetrains.load(k, demand)

    def _side(
        self, k: int, motion: Sequence[Array], torque: Array, *, coupled: bool = False
    ) -> ShaftSeries:
        """The joint side of one joint's drivetrain, for a motion and its load, (N,) each."""
        m = self.measurement
        # The expected sign is that of the joint, a motor of two joints turns otherwise.
        sign = np.tanh(motion[1] / m.rest_speed[k]) if m.sign is None or coupled else m.sign[:, k]
        columns = (x[:, None] for x in (*motion, torque, sign))
        return ShaftSeries((m.joints[k],), m.time, *columns)

    def _joint(
        self, model: MachineModel, k: int, q: Array, torque: Array, motor: Array
    ) -> tuple[Array, Array]:
        """Motor torque at the joint side (N,) and effort channels (N, C) of one joint."""
        m, a = self.measurement, model.actuators[k]
        at_joint, out, drop = self._shown(model, k, q, torque, motor)
        out = self._sampled(a, out)
        if drop is not None:
            i = m.channels.index("voltage")
            out[:, i] += drop * a.gains.get("voltage", 1.0)
        out[:, 0] += a.effort_offset
        return at_joint, out

    def _shown(
        self, model: MachineModel, k: int, q: Array, torque: Array, motor: Array
    ) -> tuple[Array, Array, Array | None]:
        """The same before sensors, without the drop R I that a log's current tells, (N,)."""
        m, a, drives = self.measurement, model.actuators[k], model.drivetrains
        load = self._load(model, k, q, torque)
        motion = [drives.turned(k, x) for x in (m.q, m.v, m.a)]
        if a.is_elastic and not m.at_motor:
            motion = [x + y for x, y in zip(motion, self._wind_up(a, load), strict=True)]
        side = self._side(k, motion, load, coupled=bool(a.coupled_to))
        if a.warming is not None:
            warm = self._temperature(k, "warming_friction takes the gear's")
            fallen = a.warming.torque(warm, side.direction[:, 0], motion[1])
            side = side.with_torque(side.torque + fallen[:, None])
        shaft = a.at_motor(side)
        shaft_torque, speed = shaft.torque[:, 0], shaft.velocity[:, 0]
        at_joint = shaft_torque * a.ratio
        # Drives report the torque of the motor with every friction and inertia of its elements.
        shown = {"torque": at_joint + drives.carried(k, motor)}
        both = "current" in m.channels and "voltage" in m.channels
        drop = np.zeros_like(at_joint)
        if "torque" not in m.channels:
            shown, drop = self._electrical(a, k, shaft_torque, speed)
        out = np.stack([shown[channel] for channel in m.channels], axis=1)
        return at_joint, out, drop if both else None

    def _sampled(self, a: Chain, out: Array) -> Array:
        """Channels (N, C, ...) of a joint as its sensors log them: late, and by their gains."""
        m = self.measurement
        if a.delay:
            for piece in m.pieces:
                t = m.time[piece]
                if t.size > 3:
                    out[piece] = late(out[piece], a.delay * (t.size - 1) / (t[-1] - t[0]))
        gains = np.array([a.gains.get(channel, 1.0) for channel in m.channels])
        return out * gains.reshape(-1, *(1,) * (out.ndim - 2))

    def _electrical(
        self, a: Chain, k: int, torque: Array, speed: Array
    ) -> tuple[dict[str, Array], Array]:
        """A motor's current, voltage and power, (N,) each, and the drop R I of its voltage.

        Where the log has the current, it tells the drop, which is then not in the voltage: the two
        channels tell different things.
        """
        m = self.measurement
        if a.motor is None:
            raise LegwattError(
                f"joint '{a.name}': the log measures {m.channels[0]} and the model has no "
                "motor; name the drivetrain option as alternative"
            )
        measured = None
        if "current" in m.channels:
            seen = m.effort[:, k, m.channels.index("current")] - a.effort_offset
            measured = np.asarray(seen / a.gains.get("current", 1.0))
        motor = a.motor
        if a.heating is not None:
            heats = motor.current(torque) if measured is None else measured
            rise = a.heating.temperature_rise(m.time, motor.copper_loss(heats))
            if a.heating.sensor_gain:
                warm = self._temperature(k, "winding_heating takes the winding's")
                rise = rise + a.heating.sensed(warm)
            motor = warmed(a.driven, rise)
        current = motor.current(torque)
        driven = speed if m.open_winding is None else np.where(m.open_winding[:, k], 0.0, speed)
        voltage = motor.voltage(current, driven)
        shown = {"current": current, "voltage": voltage, "power": voltage * current}
        if measured is None:
            return shown, np.zeros_like(current)
        shown["voltage"] = np.asarray(motor.torque_constant * speed)
        return shown, np.asarray(motor.resistance * measured)

    def _temperature(self, k: int, why: str) -> Array:
        """By one joint's sensor, (N,) [degC]."""
        m = self.measurement
        if m.temperature is None:
            raise LegwattError(
                f"log '{m.name}' has no temperature of joint '{m.joints[k]}', from which the "
                f"model's {why}"
            )
        return m.temperature[:, k]


def _deflection(a: Chain) -> tuple[float, float, float]:
    return a.compliance, a.backlash, a.crossing
