"""What has no name at a joint: a table of torques, no law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from actuators.elements.torque_table import TorqueTable
from pipeline.effects.base import Effect, Place
from pipeline.machine.machine import MachineModel


class UnnamedTorque(Effect):
    """What has no name: a table over angle, direction, speed and the way a joint came.

    Its numbers are lists, under ``table`` in a model file (`TorqueTable`).
    """

    name = "unnamed_torque"
    parameters = ()
    tables = ("angle", "level", "friction", "speed", "drag", "radius", "memory")
    competes = False
    excitation = "moves both ways at many speeds and angles"

    def apply(self, model: MachineModel, place: Place, values: Mapping[str, Any]) -> MachineModel:
        """The machine with the table at the joint's own side.

        Raises:
            LegwattError: No such list. Knots do not ascend, or there is not one number at each.
        """
        self.refuse_other_names(values)
        lists = {name: tuple(own) for name, own in values.items()}
        element = TorqueTable(name=self.name, **lists)
        return model.with_actuator(model.actuator(place[0]).with_output(element))
