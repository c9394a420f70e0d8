"""Electrical energy of legged robots: from a URDF to the supply, and from a log to a model.

    >>> import pipeline as lw
    >>> machine = lw.load("urdf/hexapod.toml")
    >>> energy = lw.walk(machine, "reversible").energy
    >>> energy.columns.tolist()
    ['alternative', 'leg', 'electrical_J', 'ratio_to_ideal']

Functions load what they need when they are first called.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actuators.loading.own_folder import init_actuator
    from pipeline.api.init import init
    from pipeline.api.logs import compare, forward, identify, power, read_log, validate
    from pipeline.api.machine import Machine, load
    from pipeline.api.motion import Demand, demand, energy, stand, walk
    from pipeline.api.reports import reports

_HOME = {
    **dict.fromkeys(("Machine", "load"), "pipeline.api.machine"),
    **dict.fromkeys(("stand", "walk"), "pipeline.api.motion"),
    **dict.fromkeys(("Demand", "demand", "energy"), "pipeline.api.motion"),
    **dict.fromkeys(
        ("read_log", "compare", "identify", "validate", "power", "forward"), "pipeline.api.logs"
    ),
    "init": "pipeline.api.init",
    "init_actuator": "actuators.loading.own_folder",
    "reports": "pipeline.api.reports",
}
__all__ = [
    "Demand",
    "Machine",
    "compare",
    "demand",
    "energy",
    "forward",
    "identify",
    "init",
    "init_actuator",
    "load",
    "power",
    "read_log",
    "reports",
    "stand",
    "validate",
    "walk",
]


def __getattr__(name: str) -> Any:
    """A name of the public API, imported when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module 'pipeline' has no attribute '{name}'")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
