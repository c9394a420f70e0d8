"""Drawings of what each alternative is built of."""

from __future__ import annotations

from functools import partial

from pipeline.machine.own_actuators import AS_BUILT
from pipeline.simulation.settings import Settings
from reports.figures.energy.actuator_chain import actuator_chain_figure, chain_parts
from reports.figures.several import Drawing


def actuator_drawings(given: Settings) -> list[Drawing]:
    """One for each alternative that is built of one row of elements at all joints."""
    subtitle = "from the motor's terminals to the joint, as in the actuator files"
    if given.own.numbers:
        subtitle = "as in the actuator files; some joints have numbers of their own"
    return [
        Drawing(
            f"actuator_chain_{name}",
            partial(
                actuator_chain_figure,
                chain_parts(given.catalog, name),
                title=alternative.title,
                subtitle=subtitle,
            ),
        )
        for name, alternative in given.catalog.alternatives.items()
        if name != AS_BUILT
    ]
