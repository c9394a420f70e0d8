"""A column of the log that reads a multiple of what it should."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Final

from pipeline.effects.base import (
    CHANNEL_COLUMNS,
    Coordinate,
    Effect,
    Parameter,
    Place,
    Values,
)
from pipeline.logs.errors import EffectError
from pipeline.logs.prepared.measurement import Measurement
from pipeline.machine.machine import MachineModel

#: Stands for every joint: one scale of a whole channel, as of a unit or a driver's setting.
EVERY: Final = "*"


class EffortGain(Effect):
    """A column of torque, current, voltage or power that reads a multiple of what it should.

    It acts at one column, or at the like columns of all joints (``*__current_A``). A current
    without a voltage cannot tell the sensor's gain of one joint from the torque constant,
    so that there the constant has the name. With a measured current, voltage is predicted from
    that current over its gain: the two columns together tell gain and constant apart.
    """

    name = "effort_gain"
    place_kind = "effort column"
    parameters: ClassVar = (Parameter("gain", "1", 0.01, 100.0),)
    coordinates: ClassVar = (Coordinate("more", 1e-3, signed=True),)
    signature = "load"
    rescales = True
    #: Gains 1, 2, 5, 1/2 and 1/5: what a voltage makes of a wrong current is not linear in it.
    excitation = "carries clearly different known loads"

    def places(self, model: MachineModel, m: Measurement) -> list[Place]:
        """All columns of a channel together, then each of its own."""
        out: list[Place] = []
        for channel in m.channels:
            if len(model.joints) > 1:
                out.append((f"{EVERY}__{CHANNEL_COLUMNS[channel]}",))
            if m.channels == ("current",):
                continue
            out += [(f"{joint}__{CHANNEL_COLUMNS[channel]}",) for joint in model.joints]
        return out

    def edit(self, model: MachineModel, place: Place, x: Values, shape: Values) -> MachineModel:
        """Let the column read more."""
        owner, channel = column_of(place)
        if owner != EVERY:
            model.index(owner)  # refuses a joint that is not there
        changed = tuple(
            replace(a, gains={**a.gains, channel: a.gains.get(channel, 1.0) * (1.0 + x["more"])})
            if owner in (EVERY, a.name)
            else a
            for a in model.actuators
        )
        return replace(model, actuators=changed)

    def physical(self, x: Values, shape: Values) -> dict[str, float]:
        """How many times what it should."""
        return {"gain": 1.0 + x["more"]}

    def internal(self, values: Values) -> tuple[dict[str, float], dict[str, float]]:
        """How much more than once."""
        return {"more": float(values["gain"]) - 1.0}, {}


def column_of(place: Place) -> tuple[str, str]:
    """Joint, or `EVERY`, and channel of a place.

    Raises:
        EffectError: It is no column of an effort.
    """
    owner, _, quantity = place[0].rpartition("__")
    channels = {column: channel for channel, column in CHANNEL_COLUMNS.items()}
    if len(place) != 1 or not owner or quantity not in channels:
        raise EffectError(
            f"effort_gain: place '{' '.join(place)}' is no column of an effort; expected "
            f"JOINT__{', JOINT__'.join(channels)}, or * for all joints"
        )
    return owner, channels[quantity]
