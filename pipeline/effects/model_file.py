"""The model file: a robot, its actuators, and an ordered list of edits with their evidence.

The README of this package shows one. Edits are applied in order to what the files say; the files
themselves are never changed.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

import numpy as np
import tomlkit
from pydantic import AfterValidator, BeforeValidator, Field, Strict, model_validator

from actuators.checked import Names, Number, Pair, Table, Text, checked, read_toml
from actuators.errors import LegwattError, known, one_line
from actuators.loading.build import CATALOG
from pipeline.effects.base import CHANNEL_UNITS, effect_named
from pipeline.machine.machine import MachineModel
from pipeline.machine.own_actuators import actuator_folder
from pipeline.robot.robot_file import load_robot_file

#: Standard deviations in half of a 95 % interval.
_COVER: Final = 1.96


class EditParameter(Table):
    """One parameter of an edit."""

    name: Text  #: Of the effect's parameter.
    value: Number  #: In `unit`.
    unit: Text  #: SI.
    interval: Pair  #: 95 % interval in `unit`.

    @model_validator(mode="after")
    def _inside(self) -> Self:
        if not self.interval[0] <= self.value <= self.interval[1]:
            raise ValueError(f"value {self.value:g} lies outside its interval")
        return self


def _by_name(parameters: Any) -> Any:
    """Tables of a file by the parameter's name in a row; the interval is a point by default."""
    if isinstance(parameters, Mapping):
        tables = {k: v if isinstance(v, Mapping) else {"value": v} for k, v in parameters.items()}
        return [{"name": k, "interval": (v.get("value"),) * 2, **v} for k, v in tables.items()]
    return parameters


class Edit(Table):
    """One effect at one place."""

    effect: Text  #: Name in the catalogue of effects.
    #: Joints, link, ground or effort channels.
    place: Annotated[Names, Field(min_length=1)]
    basis: Literal["identified", "assumed"] = "identified"
    #: Approximate: it closes a large part of the gap, though its law is not exactly the machine's
    #: or its size scatters.
    level: Literal["confirmed", "approximate"] = "confirmed"
    source: str = ""  #: The log and its hash.
    parameters: Annotated[tuple[EditParameter, ...], BeforeValidator(_by_name), Strict(False)] = ()
    #: Lists of numbers in SI units, of an effect that has no law.
    table: dict[str, Annotated[tuple[Number, ...], Strict(False)]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _of_the_effect(self) -> Self:
        """The effect's parameters, all and no others, in its units and order."""
        effect = effect_named(self.effect)
        given = {p.name: p for p in self.parameters}
        effect.refuse_other_names([*given, *self.table])
        for p in (p for p in effect.parameters if p.name in given):
            units = [*CHANNEL_UNITS.values()] if p.unit == "channel" else [p.unit]
            if (unit := given[p.name].unit) not in units:
                said = f"{p.name}: unit '{one_line(unit)}'"
                raise ValueError(f"{said}; expected '{' or '.join(units)}'")
        ordered = tuple(given[p.name] for p in effect.parameters if p.name in given)
        object.__setattr__(self, "parameters", ordered)
        return self

    @property
    def values(self) -> dict[str, Any]:
        """Parameters and lists by name."""
        return {**{p.name: p.value for p in self.parameters}, **self.table}


_Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
_Channel = Annotated[str, AfterValidator(lambda name: known("no channel", name, CHANNEL_UNITS))]


class _Robot(Table):
    file: Annotated[Path, Strict(False)]
    sha256: _Sha256


class _Actuators(Table):
    alternative: str = ""
    sha256: dict[str, _Sha256] = Field(default_factory=dict)


class ModelFile(Table):
    """A model file."""

    schema_: Literal[1] = Field(alias="schema")
    named: _Robot = Field(alias="robot")  #: Robot file or URDF, with its hash as written.
    #: Actuator of the catalogue, empty for none; catalogue files with their hashes as written.
    actuators: _Actuators = _Actuators()
    #: In order.
    edits: Annotated[tuple[Edit, ...], Strict(False)] = Field(default=(), alias="edit")
    #: Channel to joint to standard deviation of what no effect explains, in the channel's unit;
    #: empty where no log was compared.
    noise: dict[_Channel, dict[str, Annotated[Number, Field(ge=0.0)]]] = Field(default_factory=dict)
    #: Files whose contents are no longer those of the hashes, in words.
    changed: tuple[str, ...] = Field(default=(), exclude=True)

    @property
    def robot(self) -> Path:
        """Robot file or URDF."""
        return self.named.file

    @property
    def alternative(self) -> str:
        """Actuator of the catalogue; empty for none."""
        return self.actuators.alternative

    def with_edits(self, edits: Sequence[Edit]) -> ModelFile:
        """The same with further edits at the end."""
        return self.model_copy(update={"edits": (*self.edits, *edits)})

    def against(self, robot: Path, catalog: Path | None, where: str) -> ModelFile:
        """The same with its robot found and its hashes held against the files."""
        if catalog is None and self.actuators.sha256 and robot.suffix.lower() == ".toml":
            catalog = actuator_folder(load_robot_file(robot))
        files = {(catalog or CATALOG) / Path(n).name: s for n, s in self.actuators.sha256.items()}
        named = self.named.model_copy(update={"file": robot})
        changed = tuple(
            f"{where}: {one_line(path.name)} is not the one its effects were found with (other "
            "SHA-256): they may not fit it any more"
            for path, written in ({robot: self.named.sha256} | files).items()
            if not (path.exists() or path == robot) or file_sha256(path) != written
        )
        return self.model_copy(update={"named": named, "changed": changed})


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
    """A model file without edits, of a robot file or bare URDF.

    Raises:
        LegwattError: A file cannot be read.
    """
    used = sorted(catalog.glob("*.toml")) if alternative else []
    hashes = {p.name: file_sha256(p) for p in used}
    return ModelFile(
        schema=1,
        robot=_Robot(file=robot, sha256=file_sha256(robot)),
        actuators=_Actuators(alternative=alternative, sha256=hashes),
    )


def assumed(effect: str, place: Sequence[str], values: Mapping[str, float], source: str) -> Edit:
    """An edit at values that are not from a log, in SI units, known to the letter.

    Raises:
        LegwattError: No such effect or parameter, or one is missing.
    """
    effect_named(effect).refuse_other_names(values)
    units = {p.name: p.unit for p in effect_named(effect).parameters}
    rows = {name: {"value": float(x), "unit": units[name]} for name, x in values.items()}
    made = {"effect": effect, "place": tuple(place), "parameters": rows}
    return Edit.model_validate({**made, "basis": "assumed", "source": source})


def apply_edits(model: MachineModel, edits: Sequence[Edit]) -> MachineModel:
    """A machine with edits applied in order.

    Raises:
        LegwattError: A parameter is out of bounds. A place does not exist in this machine.
    """
    model = reduce(lambda m, e: effect_named(e.effect).apply(m, e.place, e.values), edits, model)
    return replace(model, known={**model.known, **_known(edits)})


def _known(edits: Sequence[Edit]) -> dict[str, float]:
    """Links and joints to how well logs have shown their bodies and friction [1]."""
    out: dict[str, float] = {}
    for edit in (edit for edit in edits if edit.basis == "identified"):
        ends = {p.name: float(np.ptp(p.interval)) / (2.0 * _COVER) for p in edit.parameters}
        own = effect_named(edit.effect).known(edit.values, ends)
        if own is not None:
            out[edit.place[0]] = max(own, out.get(edit.place[0], 0.0))
    return out


def read_model_file(
    path: Path, catalog: Path | None = None, robot: Path | None = None
) -> ModelFile:
    """Read and check a model file, its hashes held against robot and actuator files.

    `catalog` and `robot` stand in place of the folder and the file that it names.

    Raises:
        LegwattError: It cannot be read, is no TOML, or a key or value is wrong; the message names
            it and offers the closest match.
    """
    where = one_line(path.name)
    file = checked(ModelFile, read_toml(path), where)
    robot = robot or path.parent / file.robot
    if not robot.exists():
        said = "is not there; name the robot beside the model file, by its file or its name"
        raise LegwattError(f"{where}: robot.file '{one_line(file.robot)}' {said}")
    return file.against(robot, catalog, where)


def model_text(file: ModelFile, beside: Path) -> str:
    """A model file as TOML that names its robot relative to the folder in which it will lie."""
    document = file.model_dump(mode="json", by_alias=True)
    document["robot"]["file"] = Path(os.path.relpath(file.robot, beside)).as_posix()
    for edit in document["edit"]:
        rows = edit["parameters"]
        edit["parameters"] = {row.pop("name"): row for row in rows}
        for empty in [key for key in ("parameters", "table") if not edit[key]]:
            del edit[empty]
    for joints in document["noise"].values():
        joints.update({joint: float(f"{value:.6g}") for joint, value in joints.items()})
    kept = {key: value for key, value in document.items() if value}
    comment = "# What the robot and actuator files lack, as found in a log.\n"
    return comment + tomlkit.dumps(kept)
