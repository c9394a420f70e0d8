"""Electrical energy of legged robots: from a URDF to the supply, and from a log to a model.

    >>> import pipeline as lw
    >>> machine = lw.load("urdf/hexapod.toml")      # robot file, URDF or a published robot's name
    >>> walk = lw.walk(machine, actuator="reversible")  # keyword options, the command line's
    >>> walk.energy.columns.tolist()                # a DataFrame, units in the column names
    ['alternative', 'leg', 'electrical_J', 'ratio_to_ideal']
    >>> folder = walk.save("reports/out/walk")      # CSV and datapackage.json

    >>> log = lw.read_log("pipeline/identification/demo/walk.parquet", machine)
    >>> gap = lw.gap(log, machine, test="pipeline/identification/demo/walk_slow.parquet")
    >>> gap.found["effect"].tolist()
    ['coulomb_friction']
    >>> model = gap.model.save("reports/out/model.toml")
    >>> found = lw.walk(gap.model, actuator="rotor")  # a machine like any other
    >>> best = lw.choose(machine, mission="pipeline/choice/day.csv")
    >>> list(best.front.columns[:2])
    ['point', 'power_W']

Functions load what they need when they are first called.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actuators.loading.own_folder import init_actuator
    from pipeline.choice.result import choice as choose
    from pipeline.commands.components import components
    from pipeline.commands.gap import gap, read_log
    from pipeline.commands.robots import check, init, load
    from pipeline.commands.walking import demand, energy, reports, stand, walk
    from pipeline.simulation.machine import Machine
    from pipeline.simulation.walk_stand import Demand
    from pipeline.sweeps import sweep

_COMMANDS = {
    "components": ("components",),
    "gap": ("gap", "read_log"),
    "robots": ("check", "init", "load"),
    "walking": ("demand", "energy", "reports", "stand", "walk"),
}
#: Name of the public API to the module that defines it, and what it is called there.
_HOME = {
    **{name: (f"pipeline.commands.{m}", name) for m, names in _COMMANDS.items() for name in names},
    "Demand": ("pipeline.simulation.walk_stand", "Demand"),
    "Machine": ("pipeline.simulation.machine", "Machine"),
    "choose": ("pipeline.choice.result", "choice"),
    "init_actuator": ("actuators.loading.own_folder", "init_actuator"),
    "sweep": ("pipeline.sweeps", "sweep"),
}
__all__ = [
    "Demand",
    "Machine",
    "check",
    "choose",
    "components",
    "demand",
    "energy",
    "gap",
    "init",
    "init_actuator",
    "load",
    "read_log",
    "reports",
    "stand",
    "sweep",
    "walk",
]


def __getattr__(name: str) -> Any:
    """A name of the public API, imported when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module 'pipeline' has no attribute '{name}'")
    module, own = _HOME[name]
    return getattr(import_module(module), own)


def __dir__() -> list[str]:
    return sorted(__all__)
