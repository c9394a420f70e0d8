"""The model file: a robot, its actuators, and an ordered list of edits with their evidence.

The README of this room shows one. Edits are applied in order to what the files say; the files
themselves are never changed.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Final, Literal, Self

import tomlkit
from pydantic import AfterValidator, Field, Strict, model_validator

from actuators.checked import Names, Number, Pair, Table, Text, checked, parsed_toml, read_toml
from actuators.errors import LegwattError, one_line
from actuators.loading.build import CATALOG
from pipeline.effects.base import CHANNEL_UNITS
from pipeline.effects.registry import effect_named
from pipeline.machine.machine import MachineModel
from pipeline.machine.own_actuators import actuator_folder
from pipeline.robot.robot_file import load_robot_file

SCHEMA: Final = 1


@dataclass(frozen=True)
class EditParameter:
    """One parameter of an edit."""

    name: str  #: Of the effect's parameter.
    value: float  #: In `unit`.
    unit: str  #: SI.
    interval: tuple[float, float]  #: 95 % interval in `unit`.


@dataclass(frozen=True)
class Edit:
    """One effect at one place."""

    effect: str  #: Name in the catalogue of effects.
    place: tuple[str, ...]  #: Joints, link, ground or effort channels.
    parameters: tuple[EditParameter, ...]  #: In the effect's order.
    basis: str = "identified"  #: ``"identified"`` or ``"assumed"``.
    source: str = ""  #: The log and its hash.
    #: ``"confirmed"``, or ``"approximate"``: it closes a large part of the gap, though its law is
    #: not exactly the machine's or its size scatters.
    level: str = "confirmed"

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return {p.name: p.value for p in self.parameters}


@dataclass(frozen=True)
class ModelFile:
    """A model file after loading."""

    robot: Path  #: Path of the robot file or URDF.
    robot_sha256: str  #: Its hash as written.
    alternative: str  #: Actuator of the catalogue; empty for none.
    #: Catalogue file to its hash as written.
    actuators_sha256: Mapping[str, str] = field(default_factory=dict)
    edits: tuple[Edit, ...] = ()  #: In order.
    #: Channel to joint to standard deviation of what no effect explains, in the channel's unit;
    #: empty where no log was compared.
    noise: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    #: Files whose contents are no longer those of the hashes, in words.
    changed: tuple[str, ...] = ()

    def with_edits(self, edits: Sequence[Edit]) -> ModelFile:
        """The same with further edits at the end."""
        return replace(self, edits=(*self.edits, *edits))


_Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class _Value(Table):
    """A parameter of an edit as it stands in a file."""

    value: Number
    unit: Text
    interval: Pair | None = None

    @model_validator(mode="after")
    def _inside(self) -> Self:
        low, high = self.interval or (self.value, self.value)
        if not low <= self.value <= high:
            raise ValueError(f"value {self.value:g} lies outside its interval")
        return self


class _Edit(Table):
    """An edit as it stands in a file."""

    effect: Annotated[Text, AfterValidator(lambda name: effect_named(name).name)]
    place: Annotated[Names, Field(min_length=1)]
    basis: Literal["identified", "assumed"] = "identified"
    level: Literal["confirmed", "approximate"] = "confirmed"
    source: Text
    parameters: dict[str, _Value]

    @model_validator(mode="after")
    def _of_the_effect(self) -> Self:
        """The effect's parameters, all and no others, in its units."""
        effect = effect_named(self.effect)
        effect.refuse_other_names(self.parameters)
        for known in effect.parameters:
            given = self.parameters.get(known.name)
            units = list(CHANNEL_UNITS.values()) if known.unit == "channel" else [known.unit]
            if given is not None and given.unit not in units:
                raise ValueError(
                    f"{known.name}: unit '{one_line(given.unit)}'; expected '{' or '.join(units)}'"
                )
        return self

    def edit(self) -> Edit:
        """The same, its parameters in the effect's order."""
        parameters = tuple(
            EditParameter(known.name, p.value, p.unit, p.interval or (p.value, p.value))
            for known in effect_named(self.effect).parameters
            if (p := self.parameters.get(known.name)) is not None
        )
        return Edit(self.effect, self.place, parameters, self.basis, self.source, self.level)


class _Robot(Table):
    file: Text
    sha256: _Sha256


class _Actuators(Table):
    alternative: str = ""
    sha256: dict[str, _Sha256] = Field(default_factory=dict)


class _Model(Table):
    """A model file as it stands."""

    schema_: Literal[1] = Field(alias="schema")
    robot: _Robot
    actuators: _Actuators = _Actuators()
    edit: Annotated[tuple[_Edit, ...], Strict(False)] = ()
    noise: dict[
        Literal["torque", "current", "voltage", "power"],
        dict[str, Annotated[Number, Field(ge=0.0)]],
    ] = Field(default_factory=dict)


def file_sha256(path: Path) -> str:
    """SHA-256 of a file.

    Raises:
        LegwattError: It cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise LegwattError(f"{one_line(path)}: cannot be read ({error.strerror})") from None


def new_model_file(robot: Path, alternative: str = "", catalog: Path = CATALOG) -> ModelFile:
    """A model file without edits.

    Args:
        robot: Robot file or bare URDF.
        alternative: Actuator of the catalogue; empty where there is none.
        catalog: Folder of the catalogue.

    Raises:
        LegwattError: A file cannot be read.
    """
    hashes = {}
    if alternative:
        hashes = {p.name: file_sha256(p) for p in sorted(catalog.glob("*.toml"))}
    return ModelFile(robot, file_sha256(robot), alternative, hashes)


def apply_edits(model: MachineModel, edits: Sequence[Edit]) -> MachineModel:
    """A machine with edits applied in order.

    Raises:
        LegwattError: An effect or parameter is unknown or out of bounds. A place does not exist in
            this machine.
    """
    for edit in edits:
        model = effect_named(edit.effect).apply(model, edit.place, edit.values)
    return model


def read_model_file(
    path: Path, catalog: Path | None = None, robot: Path | None = None
) -> ModelFile:
    """Read and check a model file.

    Args:
        path: The file.
        catalog: Folder of the actuator files, to compare their hashes; the robot file's or the
            project's by default.
        robot: Robot file or URDF in place of the one that the file names.

    Raises:
        LegwattError: It cannot be read, is no TOML, or a key or value is wrong; the message names
            it and offers the closest match.
    """
    where = one_line(path.name)
    model = checked(_Model, read_toml(path), where)
    file = ModelFile(
        robot=robot or path.parent / model.robot.file,
        robot_sha256=model.robot.sha256,
        alternative=model.actuators.alternative,
        actuators_sha256=model.actuators.sha256,
        edits=tuple(entry.edit() for entry in model.edit),
        noise={str(channel): joints for channel, joints in model.noise.items()},
    )
    out = []
    since = "is not the one its effects were found with (other SHA-256)"
    if file_sha256(file.robot) != file.robot_sha256:
        out.append(f"{where}: {one_line(file.robot.name)} {since}: they may not fit it any more")
    if catalog is None and file.actuators_sha256 and file.robot.suffix.lower() == ".toml":
        catalog = actuator_folder(load_robot_file(file.robot))
    for name, written in file.actuators_sha256.items():
        actuator = (catalog or CATALOG) / Path(name).name
        if not actuator.exists() or file_sha256(actuator) != written:
            out.append(f"{where}: actuator file {one_line(name)} {since}")
    return replace(file, changed=tuple(out))


def edits_in(text: str, where: str = "model.toml") -> tuple[Edit, ...]:
    """The edits of a model file's text.

    Raises:
        LegwattError: As for `read_model_file`.
    """
    try:
        table = parsed_toml(text)
    except LegwattError as error:
        raise LegwattError(f"{where}: {error}") from None
    return tuple(entry.edit() for entry in checked(_Model, table, where).edit)


def model_text(file: ModelFile, beside: Path) -> str:
    """A model file as TOML.

    Args:
        file: Its contents.
        beside: Folder it will lie in: the robot file is named relative to it.
    """
    robot = Path(os.path.relpath(file.robot, beside)).as_posix()
    hashes = dict(sorted(file.actuators_sha256.items()))
    edits = [
        {name: getattr(edit, name) for name in ("effect", "place", "basis", "level", "source")}
        | {
            "parameters": {
                p.name: {
                    "value": float(p.value),
                    "unit": p.unit,
                    "interval": [float(end) for end in p.interval],
                }
                for p in edit.parameters
            }
        }
        for edit in file.edits
    ]
    noise = {
        channel: {joint: float(f"{value:.6g}") for joint, value in joints.items()}
        for channel, joints in file.noise.items()
    }
    document = {
        "schema": SCHEMA,
        "robot": {"file": robot, "sha256": file.robot_sha256},
        "actuators": {"alternative": file.alternative, "sha256": hashes},
    }
    more = {key: value for key, value in (("edit", edits), ("noise", noise)) if value}
    comment = "# What the robot and actuator files lack, as found in a log.\n"
    return comment + tomlkit.dumps(document | more)
