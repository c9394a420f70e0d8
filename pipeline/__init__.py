"""Electrical energy of legged robots: from a URDF to the supply, and from a log to a model.

    >>> import pipeline as lw
    >>> machine = lw.load("urdf/hexapod.toml")      # robot file, URDF or a published robot's name
    >>> walk = lw.walk(machine, actuator="reversible")  # keyword options, the command line's
    >>> walk.energy.columns.tolist()                # a DataFrame, units in the column names
    ['alternative', 'leg', 'electrical_J', 'ratio_to_ideal']
    >>> folder = walk.save("reports/out/walk")      # CSV and datapackage.json

    >>> log = lw.read_log("pipeline/identification/demo/walk.parquet", machine)
    >>> gap = lw.gap(log, machine, test="pipeline/identification/demo/walk_slow.parquet")
    >>> gap.found.query("written")["effect"].tolist()  # what is suspected alone is not
    ['coulomb_friction']
    >>> model = gap.model.save("reports/out/model.toml")
    >>> found = lw.walk(gap.model, actuator="rotor")  # a machine like any other
    >>> best = lw.choose(machine, mission="pipeline/choice/day.csv")
    >>> list(best.front.columns[:2])
    ['point', 'power_W']

Functions load what they need when they are first called.
"""

# ruff: noqa: F401
from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actuators.loading.own_folder import init_actuator
    from pipeline.choice.result import choice as choose
    from pipeline.commands.choose import components
    from pipeline.commands.gap import gap, read_log
    from pipeline.commands.robots import check, init, load
    from pipeline.commands.walking import demand, energy, reports, stand, walk
    from pipeline.simulation.machine import Machine
    from pipeline.simulation.walk_stand import Demand
    from pipeline.sweeps import sweep

#: Module to the names of the public API that it defines.
_NAMES = {
    "actuators.loading.own_folder": "init_actuator",
    "pipeline.choice.result": "choose",
    "pipeline.commands.choose": "components",
    "pipeline.commands.gap": "gap read_log",
    "pipeline.commands.robots": "check init load",
    "pipeline.commands.walking": "demand energy reports stand walk",
    "pipeline.simulation.machine": "Machine",
    "pipeline.simulation.walk_stand": "Demand",
    "pipeline.sweeps": "sweep",
}
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    """A name of the public API, imported when it is first asked for."""
    if name not in _HOME:
        raise AttributeError(f"module 'pipeline' has no attribute '{name}'")
    return getattr(import_module(_HOME[name]), {"choose": "choice"}.get(name, name))


def __dir__() -> list[str]:
    return sorted(_HOME)
