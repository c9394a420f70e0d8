"""The model file: a robot, its actuators, and an ordered list of edits with their evidence.

    schema = 1

    [robot]
    file = "hexapod.toml"            # relative to the model file
    sha256 = "..."

    [actuators]
    alternative = "rotor"            # of the catalogue; empty: torque is the actuator's own
    [actuators.sha256]
    "rotor_re40.toml" = "..."

    [[edit]]
    effect = "coulomb_friction"
    place = ["rm_joint_1"]
    basis = "identified"
    source = "log.csv, SHA-256 ..."
    [edit.parameters.torque]
    value = 0.108
    unit = "N*m"
    interval = [0.101, 0.114]

Edits are applied in order to what the files say; the files themselves are never changed.
"""

from __future__ import annotations

import hashlib
import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from actuators.errors import closest, one_line
from actuators.loading.build import CATALOG, load_catalog
from actuators.text_file import UnreadableTextError, read_toml_file
from pipeline.effects.base import CHANNEL_UNITS, Effect
from pipeline.effects.registry import effect_named
from pipeline.logs.errors import EffectError, ModelFileError
from pipeline.machine.machine import MachineModel, machine_of_robot, machine_of_urdf
from pipeline.machine.own_actuators import actuator_folder, own_actuators
from pipeline.robot.robot import load_robot
from pipeline.robot.robot_file import load_robot_file

SCHEMA: Final = 1
_TOP: Final = ("schema", "robot", "actuators", "edit")
_ROBOT: Final = ("file", "sha256")
_ACTUATORS: Final = ("alternative", "sha256")
_EDIT: Final = ("effect", "place", "basis", "source", "parameters")
_PARAMETER: Final = ("value", "unit", "interval")
_HASH: Final = re.compile(r"[0-9a-f]{64}")
_BASES: Final = ("identified", "doubtful", "assumed")


@dataclass(frozen=True)
class EditParameter:
    """One parameter of an edit.

    Attributes:
        name: Of the effect's parameter.
        value: In `unit`.
        unit: SI.
        interval: 95 % interval in `unit`.
    """

    name: str
    value: float
    unit: str
    interval: tuple[float, float]


@dataclass(frozen=True)
class Edit:
    """One effect at one place.

    Attributes:
        effect: Name in the catalogue of effects.
        place: Joints, link, ground or effort channels.
        parameters: In the effect's order.
        basis: ``"identified"``, ``"doubtful"`` (identified, but the name is not trusted) or
            ``"assumed"``.
        source: The log and its hash.
    """

    effect: str
    place: tuple[str, ...]
    parameters: tuple[EditParameter, ...]
    basis: str = "identified"
    source: str = ""

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return {p.name: p.value for p in self.parameters}


@dataclass(frozen=True)
class ModelFile:
    """A model file after loading.

    Attributes:
        robot: Path of the robot file or URDF.
        robot_sha256: Its hash as written.
        alternative: Actuator of the catalogue; empty for none.
        actuators_sha256: Catalogue file to its hash as written.
        edits: In order.
        changed: Files whose contents are no longer those of the hashes, in words.
    """

    robot: Path
    robot_sha256: str
    alternative: str
    actuators_sha256: Mapping[str, str] = field(default_factory=dict)
    edits: tuple[Edit, ...] = ()
    changed: tuple[str, ...] = ()

    def with_edits(self, edits: Sequence[Edit]) -> ModelFile:
        """The same with further edits at the end."""
        return ModelFile(
            self.robot,
            self.robot_sha256,
            self.alternative,
            self.actuators_sha256,
            (*self.edits, *edits),
            self.changed,
        )


def file_sha256(path: Path) -> str:
    """SHA-256 of a file.

    Raises:
        ModelFileError: It cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise ModelFileError(f"{one_line(path)}: cannot be read ({error.strerror})") from None


def new_model_file(robot: Path, alternative: str = "", catalog: Path = CATALOG) -> ModelFile:
    """A model file without edits.

    Args:
        robot: Robot file or bare URDF.
        alternative: Actuator of the catalogue; empty where there is none.
        catalog: Folder of the catalogue.

    Raises:
        ModelFileError: A file cannot be read.
    """
    hashes = {}
    if alternative:
        hashes = {p.name: file_sha256(p) for p in sorted(catalog.glob("*.toml"))}
    return ModelFile(robot, file_sha256(robot), alternative, hashes)


def base_model(file: ModelFile) -> MachineModel:
    """The machine of a model file before its edits.

    Raises:
        pipeline.errors.PipelineError: The robot file or URDF cannot be used.
        actuators.errors.ActuatorError: The catalogue has no such alternative.
        ModelFileError: A bare URDF that is not there.
    """
    if file.robot.suffix == ".urdf":
        chain = load_catalog().chain(file.alternative) if file.alternative else None
        return machine_of_urdf(file.robot, actuators=chain)
    spec = load_robot_file(file.robot)
    catalog = load_catalog(actuator_folder(spec) or CATALOG)
    own = own_actuators(spec, catalog)
    name = file.alternative
    actuators = own.actuators(own.catalog(catalog), name) if name else None
    return machine_of_robot(load_robot(spec), actuators)


def apply_edits(model: MachineModel, edits: Sequence[Edit]) -> MachineModel:
    """A machine with edits applied in order.

    Raises:
        EffectError: An effect or parameter is unknown or out of bounds.
        ModelError: A place does not exist in this machine.
    """
    for edit in edits:
        model = effect_named(edit.effect).apply(model, edit.place, edit.values)
    return model


def load_model(path: Path) -> MachineModel:
    """The machine of a model file, edits included.

    Raises:
        ModelFileError: The file is malformed; one line.
        GapError: An edit does not fit the machine.
        pipeline.errors.PipelineError: The robot file cannot be used.
        actuators.errors.ActuatorError: The actuator cannot be used.
    """
    file = read_model_file(path)
    return apply_edits(base_model(file), file.edits)


def read_model_file(path: Path, catalog: Path | None = None) -> ModelFile:
    """Read and check a model file.

    Args:
        path: The file.
        catalog: Folder of the actuator files, to compare their hashes; the robot file's or the
            project's by default.

    Raises:
        ModelFileError: It cannot be read, is no TOML, or a key or value is wrong; the message names
            it and offers the closest match.
    """
    where = one_line(path.name)
    try:
        table = read_toml_file(path)
    except UnreadableTextError as error:
        raise ModelFileError(f"{one_line(path)}: {error}") from None
    _known(table, _TOP, where)
    if table.get("schema") != SCHEMA or isinstance(table["schema"], bool):
        raise ModelFileError(f"{where}: schema must be {SCHEMA}")
    robot = _table(table, "robot", where)
    _known(robot, _ROBOT, f"{where} [robot]")
    actuators = _table(table, "actuators", where) if "actuators" in table else {}
    _known(actuators, _ACTUATORS, f"{where} [actuators]")
    hashes = actuators.get("sha256", {})
    if not isinstance(hashes, dict) or not all(isinstance(v, str) for v in hashes.values()):
        raise ModelFileError(f"{where} [actuators.sha256]: expected file = hash")
    robot_path = path.parent / _text(robot, "file", f"{where} [robot]")
    robot_hash = _text(robot, "sha256", f"{where} [robot]")
    for name, value in {"robot": robot_hash, **hashes}.items():
        if not _HASH.fullmatch(value):
            raise ModelFileError(
                f"{where}: sha256 of {one_line(name)}: '{one_line(value)}' is no SHA-256; expected "
                "64 hexadecimal digits"
            )
    alternative = actuators.get("alternative", "")
    if not isinstance(alternative, str):
        raise ModelFileError(f"{where} [actuators]: alternative must be a text")
    return ModelFile(
        robot=robot_path,
        robot_sha256=robot_hash,
        alternative=alternative,
        actuators_sha256=hashes,
        edits=_edits(table, where),
        changed=_changed(where, robot_path, robot_hash, hashes, catalog),
    )


def edits_in(text: str, where: str = "model.toml") -> tuple[Edit, ...]:
    """The edits of a model file's text.

    Raises:
        ModelFileError: As for `read_model_file`.
    """
    return _edits(_parsed(text, where), where)


def _parsed(text: str, where: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise ModelFileError(f"{where}: malformed TOML: {one_line(error)}") from None


def _edits(table: Mapping[str, Any], where: str) -> tuple[Edit, ...]:
    edits = table.get("edit", [])
    if not isinstance(edits, list):
        raise ModelFileError(f"{where}: edits are written [[edit]]")
    return tuple(_edit(e, f"{where}: edit {k}") for k, e in enumerate(edits, start=1))


def _changed(
    where: str, robot: Path, robot_hash: str, hashes: Mapping[str, str], catalog: Path | None
) -> tuple[str, ...]:
    """Files that are not those of the hashes, in words."""
    out = []
    since = "is not the one its effects were found with (other SHA-256)"
    if file_sha256(robot) != robot_hash:
        out.append(f"{where}: {one_line(robot.name)} {since}: they may not fit it any more")
    if catalog is None and hashes and robot.suffix.lower() == ".toml":
        catalog = actuator_folder(load_robot_file(robot))
    for name, written in hashes.items():
        file = (catalog or CATALOG) / Path(name).name
        if not file.exists() or file_sha256(file) != written:
            out.append(f"{where}: actuator file {one_line(name)} {since}")
    return tuple(out)


def _edit(entry: object, where: str) -> Edit:
    if not isinstance(entry, dict):
        raise ModelFileError(f"{where}: expected a table with effect, place and parameters")
    _known(entry, _EDIT, where)
    name = _text(entry, "effect", where)
    try:
        effect = effect_named(name)
    except EffectError as error:
        raise ModelFileError(f"{where}: {error}") from None
    place = entry.get("place")
    if not isinstance(place, list) or not place or not all(isinstance(p, str) for p in place):
        raise ModelFileError(f"{where}: place must be a list of names")
    basis = entry.get("basis", "identified")
    if basis not in _BASES:
        raise ModelFileError(f"{where}: basis '{one_line(basis)}'; {closest(str(basis), _BASES)}")
    source = _text(entry, "source", where)
    table = _table(entry, "parameters", where)
    names = [p.name for p in effect.parameters]
    for key in table:
        if key not in names:
            raise ModelFileError(
                f"{where}: {name} has no parameter '{one_line(key)}'; {closest(key, names)}"
            )
    missing = [p.name for p in effect.parameters if p.name not in table and not p.optional]
    if missing:
        raise ModelFileError(f"{where}: {name} needs the parameter '{missing[0]}'")
    parameters = tuple(_parameter(n, table[n], effect, where) for n in names if n in table)
    return Edit(name, tuple(place), parameters, str(basis), source)


def _parameter(name: str, entry: object, effect: Effect, where: str) -> EditParameter:
    place = f"{where}: {name}"
    if not isinstance(entry, dict):
        raise ModelFileError(f"{place}: expected value, unit and interval")
    _known(entry, _PARAMETER, place)
    unit = _text(entry, "unit", place)
    own = next(p.unit for p in effect.parameters if p.name == name)
    allowed = tuple(CHANNEL_UNITS.values()) if own == "channel" else (own,)
    if unit not in allowed:
        raise ModelFileError(f"{place}: unit '{one_line(unit)}'; expected '{' or '.join(allowed)}'")
    value = _number(entry.get("value"), f"{place}: value")
    interval = entry.get("interval", [value, value])
    if not isinstance(interval, list) or len(interval) != 2:
        raise ModelFileError(f"{place}: interval must be [low, high]")
    low, high = (_number(v, f"{place}: interval") for v in interval)
    if not low <= value <= high:
        raise ModelFileError(f"{place}: value {value:g} lies outside its interval")
    return EditParameter(name, value, unit, (low, high))


def _number(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ModelFileError(f"{where} must be a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ModelFileError(f"{where} must be a finite number")
    return number


def _known(table: Mapping[str, Any], known: Sequence[str], where: str) -> None:
    for key in table:
        if key not in known:
            raise ModelFileError(f"{where}: unknown key '{one_line(key)}'; {closest(key, known)}")


def _table(table: Mapping[str, Any], key: str, where: str) -> dict[str, Any]:
    value = table.get(key)
    if not isinstance(value, dict):
        raise ModelFileError(f"{where}: the table [{key}] is missing")
    return value


def _text(table: Mapping[str, Any], key: str, where: str) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value or "\x00" in value:
        raise ModelFileError(f"{where}: '{key}' is missing or not a text")
    return value
