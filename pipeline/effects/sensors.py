"""Effects of sensors: zeros, gains and delays of what a log holds."""

from typing import Final

from actuators.errors import LegwattError
from pipeline.effects.base import CHANNEL_UNITS, EVERY, MORE, Effect, Parameter, Place, Size, Values
from pipeline.logs.log import Log
from pipeline.machine.machine import MachineModel

#: What a joint's column of an effort is called in the log format.
_COLUMNS: Final = {f"{name}_{unit.replace('*', '')}": name for name, unit in CHANNEL_UNITS.items()}
ENCODER_TOLERANCE: Final = 2.5e-3  # one standard deviation [rad]
#: Skew between channels that sampling leaves, one standard deviation [s].
SKEW_TOLERANCE: Final = 3e-4
_ZERO: Final = Size(9e-3, "", "half a degree is usual after calibration")
_OFFSET: Final = Size(0.1, "effort", "zeros of torque and current sensors drift by a few per cent")
_GAIN: Final = Size(0.03, "", "calibrated sensors: a few per cent; what is more is a unit's factor")
_SENSOR: Final = "it acts on a sensor"
_LATE: Final = Size(1.0, "sample", "sampling and buses delay by about one period")


class PositionOffset(Effect):
    """A constant added by the position sensor: an encoder whose zero is off."""

    name = "position_offset"
    parameters = (Parameter("angle", "rad", -1.6, 1.6, _ZERO, step=1e-3),)
    excitation = "holds the link in postures all around its axis"
    unseen = _SENSOR
    adds = (("angle", "encoder_offset"),)


class EffortOffset(Effect):
    """A constant added by the sensor of torque, current or voltage."""

    name = "effort_offset"
    additive = True
    parameters = (Parameter("offset", "channel", -1e4, 1e4, _OFFSET, step=1e-3),)
    excitation = "stands still without load, then moves both ways"
    unseen = _SENSOR
    adds = (("offset", "effort_offset"),)


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
    place_kind = "effort column"
    parameters = (Parameter("gain", "1", 0.01, 100.0, _GAIN, step=1e-3, form=MORE),)
    replaces = True
    excitation = "carries clearly different known loads"
    unseen = _SENSOR

    def places(self, model: MachineModel, m: Log) -> list[Place]:
        """All columns of a channel together, then each of its own."""
        joints = () if m.channels == ("current",) else model.joints
        every = (EVERY,) if len(model.joints) > 1 else ()
        if model.robot.floating and m.channels == ("torque",) and m.foot_force is None:
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
    place_kind = "effort channels"
    #: A servo whose torque comes later than this does not hold a leg; logs are aligned better.
    parameters = (Parameter("delay", "s", -0.06, 0.06, _LATE, step=2e-4),)
    adds = (("delay", "delay"),)
    excitation = "changes its torque fast: accelerates, brakes and reverses"
    unseen = _SENSOR

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Delay them further, or one joint's alone."""
        for joint in model.joints if place == (self.place_kind,) else place[:1]:
            model = super().edit(model, (joint,), x, shape)
        return model
