"""One trial of the standard matrix on disk: two logs, a URDF and a mapping; the truth elsewhere."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path
from typing import Any, Final

from pipeline.blind.make import seal_file, trial_folder
from pipeline.blind.twin.files import csv_bytes, sealed_bytes
from pipeline.blind.twin.fixed.trial import make_fixed_trial

ROBOT: Final = "machine.urdf"
#: What `gap` is given beside log and robot.
MORE: Final = ("--holdout", "test.csv", "--mapping", "mapping.toml")


def make_standard(
    out: str, number: int, seed: int, machine: str, effects: list[str], background: str
) -> dict[str, Any]:
    """Make a trial and seal its truth.

    Args:
        out: Folder of all trials.
        number: Of this one.
        seed: Of everything drawn.
        machine: Of the twin's fixed ones.
        effects: What to hide.
        background: What any machine has.

    Returns:
        Hash of the sealed truth.
    """
    folder, sealed = trial_folder(Path(out), number), seal_file(Path(out), number)
    if folder.exists():
        shutil.rmtree(folder)  # of a run that was cut short
    trial = make_fixed_trial(seed, machine, tuple(effects), background)
    truth = sealed_bytes(trial.truth)
    folder.mkdir(parents=True)
    sealed.parent.mkdir(parents=True, exist_ok=True)
    sealed.write_bytes(truth)
    (folder / ROBOT).write_text(trial.machine.urdf, encoding="utf-8")
    (folder / "mapping.toml").write_text(trial.mapping, encoding="utf-8")
    (folder / "log.csv").write_bytes(csv_bytes(trial.log))
    (folder / "test.csv").write_bytes(csv_bytes(trial.test))
    return {"sha256": hashlib.sha256(truth).hexdigest()}
