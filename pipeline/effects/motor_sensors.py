"""Effects of a motor, of torques beside it that follow from the joint's motion, and of sensors."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from actuators.arrays import Array
from actuators.elements.heating import Heating
from actuators.elements.position_torque import PositionTorque, TorqueTable
from actuators.errors import LegwattError
from pipeline.effects.base import (
    CHANNEL_UNITS,
    EVERY,
    Effect,
    Measured,
    Place,
    Shapes,
    Values,
)
from pipeline.machine.machine import MachineModel

CONSTANT_TOLERANCE: Final = 0.02  # one standard deviation [1]
_TIMES: Final = (1.5, 4.0, 10.0, 30.0)  # [s]
_LEAST_ORDER: Final = 4.0  # periods per turn; below it is a spring rather than a ripple
_PERIODS: Final = 1.5  # least number of periods inside the travel
_SOFTEST: Final = 1e-9  # [N*m/rad]
_FURTHEST_REST: Final = 4.0 * np.pi  # [rad]


class TorqueConstantError(Effect):
    """Torque per current, and voltage per speed, off by a factor.

    Fitted as the factor more of current (x > 0: k / (1 + x)) or of back-EMF (x < 0: k (1 - x)), in
    which the larger one is linear: a factor of five is found in one step. Where current alone is
    measured, a current sensor's wrong gain is the same and goes by this name.
    """

    name = "torque_constant_error"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Scale it."""
        motor = model.actuator(place[0]).motor
        if motor is None:
            raise LegwattError(f"{self.name}: joint '{place[0]}' has no motor in the model")
        factor = 1.0 + self.physical(x, shape)["relative"]
        constant = float(np.asarray(motor.torque_constant) * factor)
        return self.at_joint(model, place, motor=replace(motor, torque_constant=constant))


class WindingHeating(Effect):
    """Windings that warm up: one thermal node per motor, warmed by R I^2 and what surrounds it."""

    name = "winding_heating"
    fits = ("rise", "thermal_resistance")
    sensed = False  #: Whether the motors' temperature is measured where it competes.

    def places(self, model: MachineModel, m: Measured) -> list[Place]:
        """Joints with a motor without thermal node, where an electrical channel is measured."""
        if (m.kelvin is not None) != self.sensed:
            return []
        every = super().places(model, m)
        return [place for place in every if model.actuator(place[0]).heating is None]

    def shapes(self, model: MachineModel, m: Measured, place: Place) -> Shapes:
        """Time constants that a log of this length can show."""
        return [{"time_constant": t} for t in _TIMES if t < 1.5 * m.length]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Give the motor a thermal node."""
        return self.at_joint(model, place, heating=Heating(**x, **shape))


class SensedHeating(WindingHeating):
    """The same where a sensor on the motor's housing is read: it shows what warmed it before."""

    fits = ("sensor_gain", "thermal_resistance")
    sensed = True


class TorqueRipple(Effect):
    """Torque periodic in the joint's angle: error of a gear, cogging of a motor; of any order.

    The torque amplitude sin(order position + phase) acts on the joint in its positive sense: the
    actuator has to supply so much less.
    """

    name = "torque_ripple"

    def orders(self, m: Measured, joint: int) -> Array:
        """Orders that this motion can show, so dense that none lies between two."""
        travel, speed = float(m.travel[joint]), float(m.slow[joint] + m.rest_speed[joint])
        if travel < 1e-3:
            return np.empty(0)
        top = min(2 * np.pi * 0.6 * m.bandwidth / speed, 2000.0)
        low = max(_LEAST_ORDER, _PERIODS * 2 * np.pi / travel)
        return np.arange(low, max(top, low), 0.35 * 2 * np.pi / travel)

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add it at the joint."""
        p = self.physical(x, shape)
        p["amplitude"] *= -1.0
        return _turning(model, place, PositionTorque(self.name, **p))

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Amplitude and phase."""
        return {
            "amplitude": float(np.hypot(x["sine"], x["cosine"])),
            "order": shape["order"],
            "phase": float(np.arctan2(x["cosine"], x["sine"])),
        }

    def internal(self, values: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Sine and cosine."""
        a, phase = values["amplitude"], values["phase"]
        return {"sine": a * np.cos(phase), "cosine": a * np.sin(phase)}, {"order": values["order"]}


def _turning(model: MachineModel, place: Place, law: PositionTorque) -> MachineModel:
    laws = (*model.actuator(place[0]).position_torques, law)
    return Effect.at_joint(model, place, position_torques=laws)


class ParallelSpring(Effect):
    """A spring from one link to the next: torque in proportion to the distance from its rest."""

    name = "parallel_spring"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Add it at the joint; the preload is its torque at position zero."""
        law = PositionTorque(self.name, **self.physical(x, shape))
        return _turning(model, place, law)

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """Stiffness and rest."""
        stiffness = x["stiffness"] if abs(x["stiffness"]) > _SOFTEST else _SOFTEST
        return {"stiffness": stiffness, "rest": -x["preload"] / stiffness}

    def internal(self, values: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Stiffness and preload."""
        k = values["stiffness"]
        return {"stiffness": k, "preload": -k * values["rest"]}, {}

    def plausible(self, model: MachineModel, place: Place, x: Values, shape: Values) -> bool:
        """At rest within two turns: from further away its torque is a constant."""
        rest = self.physical(x, shape)["rest"]
        return abs(rest) <= _FURTHEST_REST and super().plausible(model, place, x, shape)


class UnnamedTorque(Effect):
    """What has no name: a table over angle, direction, speed and the way a joint came.

    Its numbers are lists, under ``table`` in a model file (`TorqueTable`).
    """

    name = "unnamed_torque"
    tables = ("angle", "level", "friction", "speed", "drag", "radius", "memory")

    def apply(self, model: MachineModel, place: Place, values: Mapping[str, Any]) -> MachineModel:
        """The machine with the table at the joint's own side.

        Raises:
            LegwattError: No such list. Knots do not ascend, or there is not one number at each.
        """
        self.refuse_other_names(values)
        lists = {name: tuple(own) for name, own in values.items()}
        element = TorqueTable(name=self.name, **lists)
        return model.with_actuator(model.actuator(place[0]).with_output(element))


#: What a joint's column of an effort is called in the log format.
_COLUMNS: Final = {f"{name}_{unit.replace('*', '')}": name for name, unit in CHANNEL_UNITS.items()}
ENCODER_TOLERANCE: Final = 2.5e-3  # one standard deviation [rad]
#: Skew between channels that sampling leaves, one standard deviation [s].
SKEW_TOLERANCE: Final = 3e-4


class EffortGain(Effect):
    """A column of torque, current, voltage or power that reads a multiple of what it should.

    It acts at one column, or at the like columns of all joints (``*__current_A``). A current
    without a voltage cannot tell the sensor's gain of one joint from the torque constant, so that
    there the constant has the name. With a measured current, voltage is predicted from that current
    over its gain: the two columns together tell gain and constant apart. On legs whose forces no
    sensor measures, all torques and all masses scaled alike say the same: there the files' masses
    are the scale, and the columns of all joints together have no gain.
    """

    name = "effort_gain"

    def places(self, model: MachineModel, m: Measured) -> list[Place]:
        """All columns of a channel together, then each of its own."""
        joints = () if m.channels == ("current",) else model.joints
        every = (EVERY,) if len(model.joints) > 1 else ()
        if model.robot.floating and m.channels == ("torque",) and m.feet is None:
            every = ()
        columns = [column for column, channel in _COLUMNS.items() if channel in m.channels]
        columns.sort(key=lambda column: m.channels.index(_COLUMNS[column]))
        return [(f"{owner}__{column}",) for column in columns for owner in (*every, *joints)]

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Let the column read more."""
        owner, _, column = place[0].rpartition("__")
        channel = _COLUMNS.get(column)
        if len(place) != 1 or not owner or channel is None:
            raise LegwattError(
                f"effort_gain: place '{' '.join(place)}' is no column of an effort; expected "
                f"JOINT__{', JOINT__'.join(_COLUMNS)}, or * for all joints"
            )
        for joint in model.joints if owner == EVERY else (owner,):
            gains = dict(model.actuator(joint).gains)
            gains[channel] = gains.get(channel, 1.0) * (1.0 + x["more"])
            model = self.at_joint(model, (joint,), gains=gains)
        return model


class TimeDelay(Effect):
    """One delay between position and effort, of all joints alike or of one joint."""

    name = "time_delay"

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Delay them further, or one joint's alone."""
        for joint in model.joints if place == (self.place_kind,) else place[:1]:
            model = super().edit(model, (joint,), x, shape)
        return model
