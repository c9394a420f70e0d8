"""Tables of the forward simulation: position errors by model and log, and what each log did."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from actuators.arrays import Array
from pipeline.column import column
from reports.table import Quantity, Table, wide_series


@dataclass(frozen=True)
class ForwardRow:
    """Position error of a model that drives itself under the servos' law."""

    table: ClassVar = "forward"
    about: ClassVar = (
        "Measured minus simulated position; nothing but the first instant is taken from the log."
    )
    model: str = column("what the model has that the one of the rows before has not")
    log: str = column("name of the log; all: of all logs together")
    joint: str = column("name of the joint")
    position_rms_rad: float = column("root mean square of measured minus simulated position", "rad")
    position_mean_abs_rad: float = column("mean of its magnitude", "rad")
    position_largest_rad: float = column("largest magnitude", "rad")
    rows: int = column("rows compared", "1")


def rollout(
    log: str,
    joints: Sequence[str],
    time: Array,
    measured: Array,
    before: Array,
    after: Array,
    voltage: Array,
) -> Table:
    """One log and two simulations of it.

    Args:
        time: Shape (N,) [s].
        measured: Positions of the machine, shape (N, J) [rad].
        before: Of the model as it was, likewise.
        after: Of the model with all effects, likewise.
        voltage: Applied by its servos, shape (N, J) [V].
    """
    quantities = (
        Quantity("measured_position", "rad", "position that the machine reached", measured),
        Quantity("before_position", "rad", "position of the model as it was", before),
        Quantity("after_position", "rad", "position of the model with all effects", after),
        Quantity(
            "after_voltage", "V", "that its servo applies; empty with an open bridge", voltage
        ),
    )
    text = f"Forward simulation of log {log} under the servos' own law."
    return wide_series(f"rollout_{log}", time, joints, quantities, description=text)
