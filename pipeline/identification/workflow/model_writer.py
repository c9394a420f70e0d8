"""Model files as text, and edits from what naming found."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import tomlkit

from pipeline.effects.model_file import SCHEMA, Edit, EditParameter, ModelFile
from pipeline.effects.registry import effect_named
from pipeline.identification.results import Estimate, Found


def edits_of(found: Sequence[Found], source: str) -> tuple[Edit, ...]:
    """Edits of what belongs into a model file, what is only suspected left out.

    Args:
        found: From identification.
        source: The logs and their hashes, in words.
    """
    return tuple(
        Edit(
            effect=one.effect,
            place=member.place,
            parameters=_in_order(one.effect, member.parameters),
            source=source,
            level=member.level,
        )
        for one in found
        if one.kept
        for member in one.each
    )


def _in_order(effect: str, parameters: Sequence[Estimate]) -> tuple[EditParameter, ...]:
    """Parameters in the effect's order, in which a reader has them, too."""
    names = [p.name for p in effect_named(effect).parameters]
    return tuple(
        EditParameter(p.name, p.value, p.unit, (p.low, p.high))
        for p in sorted(parameters, key=lambda p: names.index(p.name))
    )


def model_text(file: ModelFile, beside: Path) -> str:
    """A model file as TOML.

    Args:
        file: Its contents.
        beside: Folder it will lie in: the robot file is named relative to it.
    """
    document = tomlkit.document()
    document.add(tomlkit.comment("What the robot and actuator files lack, as found in a log."))
    document["schema"] = SCHEMA
    robot = tomlkit.table()
    robot["file"] = Path(os.path.relpath(file.robot, beside)).as_posix()
    robot["sha256"] = file.robot_sha256
    document["robot"] = robot
    actuators = tomlkit.table()
    actuators["alternative"] = file.alternative
    hashes = tomlkit.table()
    for name, value in sorted(file.actuators_sha256.items()):
        hashes[name] = value
    actuators["sha256"] = hashes
    document["actuators"] = actuators
    edits = tomlkit.aot()
    for edit in file.edits:
        edits.append(_edit(edit))
    if file.edits:
        document["edit"] = edits
    if file.noise:
        noise = tomlkit.table()
        for channel, joints in file.noise.items():
            table = tomlkit.table()
            table.update({joint: float(f"{value:.6g}") for joint, value in joints.items()})
            noise[channel] = table
        document["noise"] = noise
    return tomlkit.dumps(document)


def _edit(edit: Edit) -> tomlkit.items.Table:
    table = tomlkit.table()
    table["effect"] = edit.effect
    table["place"] = list(edit.place)
    table["basis"] = edit.basis
    table["level"] = edit.level
    table["source"] = edit.source
    parameters = tomlkit.table()
    for p in edit.parameters:
        entry = tomlkit.table()
        entry["value"] = float(p.value)
        entry["unit"] = p.unit
        entry["interval"] = [float(p.interval[0]), float(p.interval[1])]
        parameters[p.name] = entry
    table["parameters"] = parameters
    return table
