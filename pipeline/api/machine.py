"""A loaded machine: robot, actuators, and the effects that a log showed it to have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from actuators.errors import LegwattError, closest
from actuators.loading.build import CATALOG, load_catalog
from pipeline.api.init import robot_file_of
from pipeline.atomic import write_text
from pipeline.effects.model_file import Edit, EditParameter, ModelFile, new_model_file
from pipeline.effects.registry import effect_named
from pipeline.machine.own_actuators import without_folder
from pipeline.robot.published import published_names
from pipeline.simulation.files import Files, read_files
from pipeline.simulation.settings import Settings, settings
from pipeline.simulation.walk_stand import IDEAL


@dataclass(frozen=True, eq=False)
class Machine:
    """What `load` returns and every other function takes; changes give a new one."""

    files: Files  #: What the files say.
    #: Numbers that differ from the files', by name.
    changes: Mapping[str, object] = field(default_factory=dict)
    #: Robot and actuators with the changes; None for the URDF of a robot on a fixed base, with
    #: which logs are compared and nothing else done.
    loaded: Settings | None = field(default=None, repr=False)

    @property
    def path(self) -> Path:
        """Robot file, or the URDF of a robot on a fixed base."""
        return self.files.robot

    @property
    def model(self) -> ModelFile | None:
        """Effects on top of the files; None without."""
        return self.files.model

    @property
    def ready(self) -> Settings:
        """Robot and actuators.

        Raises:
            LegwattError: Of a bare URDF, which has no actuators.
        """
        if self.loaded is None:
            raise LegwattError(f"{self.path}: a URDF alone has no actuators; give a robot file")
        return self.loaded

    def walking(self, **options: Any) -> Settings:
        """The machine ready to stand and walk; see `pipeline.simulation.settings.Settings.walking`.

        Raises:
            LegwattError: The robot stands on a fixed base, or an option is out of range.
        """
        if self.loaded is None:
            raise LegwattError(
                f"{self.path}: a URDF says nothing of legs and gait; give a robot file"
            )
        if options.get("motion") is None and not self.loaded.robot.floating:
            raise LegwattError(
                f"{self.path}: a robot on a stand neither stands nor walks; "
                "give one with a floating base"
            )
        return self.loaded.walking(**options)

    def with_values(self, values: Mapping[str, object]) -> Machine:
        """The same machine with other numbers; no file is read for an actuator's or the gait's.

        Args:
            values: Name of a number to its value, in the unit its file writes: ``hip_spacing``,
                ``harmonic_drive.load``; what ``[gait]`` states, ``gait.slope_forward``, with its
                unit in the text (``"5 deg"``); ``standing.feet``.

        Raises:
            LegwattError: No such number, or a value that cannot be.
        """
        return self._of(self.files, {**self.changes, **values})

    def with_actuators(self, folder: str | Path) -> Machine:
        """The same machine with the actuators of a folder.

        Raises:
            LegwattError: A file of the folder cannot be used.
        """
        path, spec = Path(folder), self.files.spec
        files = replace(self.files, catalog=load_catalog(path), actuators=path)
        return self._of(replace(files, spec=spec and without_folder(spec)))

    def with_effect(
        self,
        effect: str,
        place: str | Sequence[str],
        values: Mapping[str, float],
        *,
        alternative: str | None = None,
    ) -> Machine:
        """The same machine with one effect more, as a model file states it.

        Args:
            effect: Of the catalogue of effects, e.g. ``coulomb_friction``.
            place: Joint, joints, link or ground.
            values: The effect's parameters by name, in SI units.
            alternative: Actuator that it belongs to; by default the one of the effects that are
                there, the robot file's, or the first that is not ideal.

        Raises:
            LegwattError: No such effect, parameter or place, or a value out of bounds.
        """
        known = {p.name: p for p in effect_named(effect).parameters}
        for name in values:
            if name not in known:
                raise LegwattError(f"{effect} has no parameter '{name}': {closest(name, [*known])}")
        parameters = tuple(
            EditParameter(name, float(values[name]), p.unit, (float(values[name]),) * 2)
            for name, p in known.items()
            if name in values
        )
        places = (place,) if isinstance(place, str) else tuple(place)
        edit = Edit(effect, places, parameters, basis="assumed", source="set by with_effect")
        usual = self.loaded.own.usual if self.loaded else ""
        usual = usual or next((n for n in self.files.catalog.alternatives if n != IDEAL), "")
        file = self.model or ModelFile(self.path, "", usual)
        if alternative is not None:
            file = replace(file, alternative=alternative)
        return self.with_model(file.with_edits([edit]))

    def with_model(self, file: ModelFile) -> Machine:
        """The same machine with these effects in place of its own."""
        return self._of(replace(self.files, model=file, model_path=None))

    def _of(self, files: Files, changes: Mapping[str, object] | None = None) -> Machine:
        changes = self.changes if changes is None else changes
        if files.spec is None:
            return Machine(files, changes)
        return Machine(files, changes, settings(files, changes, self.loaded))

    def save(self, path: str | Path) -> Path:
        """Write the effects as a model file, which `load` and the command line's ``--model`` read.

        Changed numbers are not in it: `load` takes them again.

        Raises:
            LegwattError: The machine has no effects. The file cannot be written.
        """
        from pipeline.identification.workflow.written import model_text

        file, target = self.model, Path(path)
        if file is None:
            raise LegwattError(f"{self.path}: the machine has no effects to write")
        if not file.robot_sha256:  # made by `with_effect`
            folder = self.files.actuators or CATALOG
            file = new_model_file(self.path, file.alternative, folder).with_edits(file.edits)
        write_text(target, model_text(file, target.absolute().parent))
        return target


def load(
    robot: str | Path | None = None,
    *,
    model: str | Path | None = None,
    actuators: str | Path | None = None,
    gait: str | Path | None = None,
    changes: Mapping[str, object] | None = None,
) -> Machine:
    """Load a machine, and refuse what cannot be used.

    Args:
        robot: Robot file (.toml), the URDF of a robot on a fixed base, or the name of a robot in
            ``example-robot-data``, with the stance and gait that `init` guesses for it; the model
            file's or the project's hexapod by default.
        model: Model file with effects that `identify` found.
        actuators: Folder of actuator files; the project's catalogue by default.
        gait: File with a table ``[gait]`` to walk instead of the robot file's.
        changes: Numbers that differ from the files'; see `Machine.with_values`.

    Raises:
        LegwattError: Robot file or URDF cannot be used; one line says where and what to do. An
            actuator file cannot be used. The model file cannot be used.
    """
    path = Path(robot) if robot is not None else None
    if path is not None and not path.exists() and str(robot) in published_names():
        path = robot_file_of(str(robot))
    files = read_files(
        path,
        model=Path(model) if model else None,
        gait=Path(gait) if gait else None,
        actuators=Path(actuators) if actuators else None,
    )
    return Machine(files)._of(files, dict(changes or {}))
