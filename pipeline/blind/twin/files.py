"""A trial on disk: a folder for the workflow, and a sealed file for the truth elsewhere."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.machine import CATALOG
from pipeline.blind.twin.trial import Trial


@dataclass(frozen=True)
class TrialFiles:
    """Where a trial lies.

    Attributes:
        folder: All that the workflow gets to see.
        logs: CSV files in it.
        robot: Robot file in it.
        catalog: Folder of actuator files in it.
        sealed: The truth, outside of it.
        sha256: Of the sealed file.
    """

    folder: Path
    logs: tuple[Path, ...]
    robot: Path
    catalog: Path
    sealed: Path
    sha256: str

    def moved_to(self, folder: Path) -> TrialFiles:
        """The same files once their folder has another place."""
        here = self.folder
        return replace(
            self,
            folder=folder,
            logs=tuple(folder / log.relative_to(here) for log in self.logs),
            robot=folder / self.robot.relative_to(here),
            catalog=folder / self.catalog.relative_to(here),
        )


def sealed_bytes(truth: dict[str, Any]) -> bytes:
    """The truth as canonical JSON; not-a-number becomes null."""

    def clean(value: Any) -> Any:
        if isinstance(value, dict):
            return {str(key): clean(item) for key, item in value.items()}
        if isinstance(value, (list, tuple)):
            return [clean(item) for item in value]
        if isinstance(value, float) and value != value:
            return None
        return value

    text = json.dumps(clean(truth), sort_keys=True, indent=1, allow_nan=False, ensure_ascii=False)
    return (text + "\n").encode()


def write_trial(trial: Trial, folder: Path, sealed: Path) -> TrialFiles:
    """Write logs, robot and actuator files into a folder, and the truth elsewhere.

    Args:
        trial: What to write.
        folder: Made if missing; must not hold another trial's files.
        sealed: The truth's file, outside of the folder.

    Raises:
        TwinError: The seal would lie inside the folder, or the folder is not empty.
    """
    check_seal(folder, sealed)
    if folder.exists() and any(folder.iterdir()):
        raise TwinError(f"{folder}: not empty; give a new folder for the trial")
    truth = sealed_bytes(trial.truth)
    robot_folder, catalog = folder / "urdf", folder / "actuators"
    robot_folder.mkdir(parents=True, exist_ok=True)
    catalog.mkdir(parents=True, exist_ok=True)
    for source in (*trial.robot.sources, trial.robot.urdf):
        _write(robot_folder / source.name, source.read_bytes())
    for source in sorted(CATALOG.glob("*.toml")):
        _write(catalog / source.name, source.read_bytes())
    logs = []
    for name, columns in trial.logs.items():
        logs.append(folder / f"{name}.csv")
        _write(logs[-1], csv_bytes(columns))
    sealed.parent.mkdir(parents=True, exist_ok=True)
    _write(sealed, truth)
    return TrialFiles(
        folder=folder,
        logs=tuple(logs),
        robot=robot_folder / trial.robot.path.name,
        catalog=catalog,
        sealed=sealed,
        sha256=hashlib.sha256(truth).hexdigest(),
    )


def check_seal(folder: Path, sealed: Path) -> None:
    """Refuse a seal that whoever has the trial's folder could break.

    Raises:
        TwinError: The seal would lie inside the folder, or is one.
    """
    if sealed.resolve().is_relative_to(folder.resolve()):
        raise TwinError(f"{sealed.name} would lie in the trial's own folder; seal it elsewhere")
    if sealed.is_dir():
        raise TwinError(f"{sealed}: is a folder; name a file for the sealed truth")


def csv_bytes(columns: dict[str, Any]) -> bytes:
    """A log as CSV: one header row, full round trip, the same bytes for the same log."""
    import pyarrow as pa
    from pyarrow import csv

    sink = pa.BufferOutputStream()
    options = csv.WriteOptions(quoting_style="none")
    csv.write_csv(pa.table(columns), sink, options)
    header, _, body = sink.getvalue().to_pybytes().partition(b"\n")
    return bytes(header.replace(b'"', b"") + b"\n" + body)


def _write(path: Path, content: bytes) -> None:
    # Complete or absent: an interrupted run leaves no half file.
    part = path.with_name(path.name + ".part")
    try:
        part.write_bytes(content)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
