"""Machines as a command loads them, before anything is computed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.commands.gap import order_of
from pipeline.commands.main import parser
from pipeline.commands.robots import machine_of, walking_machine
from pipeline.effects.model_file import ModelFile
from pipeline.identification.workflow.compared import Order, compared_machine
from pipeline.machine.machine import MachineModel
from pipeline.simulation.machine import Machine, read_machine


def as_compared(
    *logs: Path,
    robot: Path | None = None,
    actuators: Path | None = None,
    **options: Any,
) -> tuple[Order, Machine]:
    """What `gap` is asked, and the machine as it compares it with the logs."""
    order = Order.of(logs=logs, **options)
    return order, compared_machine(order, read_machine(robot, actuators=actuators))


def as_asked(words: Sequence[str]) -> tuple[Order, Machine]:
    """The same by the words of a command line behind ``gap``."""
    given = parser("gap").parse_args(["gap", *words])
    order = order_of(given)
    return order, compared_machine(order, machine_of(given))


def walked_by(verb: str, *words: str) -> Machine:
    """A machine as ``walk`` or ``reports`` has it."""
    return walking_machine(parser(verb).parse_args([verb, *words]))


def base_model(file: ModelFile) -> MachineModel:
    """The machine of a model file before its edits."""
    return read_machine(file.robot, alternative=file.alternative, tolerant=True).bare_model
