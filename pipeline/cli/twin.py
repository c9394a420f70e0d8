"""The verb twin: make one blind trial, a log with something hidden and its sealed truth."""

from __future__ import annotations

import argparse
import os
import shlex
from pathlib import Path

from pipeline.blind.twin.errors import TwinError
from pipeline.blind.twin.files import TrialFiles, check_seal, write_trial
from pipeline.blind.twin.trial import Trial, make_trial
from reports.folder import PREFIX, staged


def run_twin(options: argparse.Namespace) -> int:
    """Make it; print the hash of the truth before anything else.

    Raises:
        TwinError: Unknown effect, motion or noise level, or a folder that is not empty.
        ReportError: The folder or the seal cannot be written.
    """
    # A seal lies beside the folder, so the folder needs a name: "." has one, "/" has none.
    out = options.out if options.out.name else options.out.resolve()
    if not out.name and not options.sealed:
        raise TwinError(f"{out}: has no place beside it for the sealed truth; name one (--sealed)")
    sealed = options.sealed or out.with_name(out.name + ".sealed.json")
    check_seal(out, sealed)
    if [path for path in out.glob("*") if not path.name.startswith(PREFIX)]:
        raise TwinError(f"{out}: not empty; give a new folder for the trial")
    trial = make_trial(options.seed, options.hide, options.motion, options.noise, logs=options.logs)
    files = _write(trial, out, sealed)
    print(f"{sealed} sha256 {files.sha256}")
    command = ["python", "-m", "pipeline", "gap", *files.logs, "--robot", files.robot]
    command += ["--actuators", files.catalog, "--out", f"{out}.found"]
    print(shlex.join(map(str, command)))
    return 0


def _write(trial: Trial, out: Path, sealed: Path) -> TrialFiles:
    """Folder and seal, or neither.

    The files are the user's from then on: no later run takes them for results of its own.
    """
    there = os.path.lexists(sealed)
    try:
        with staged(out, "twin", remembered=False) as folder:
            files = write_trial(trial, folder, sealed)
    except BaseException:
        if not there:
            sealed.unlink(missing_ok=True)
        raise
    return files.moved_to(out)
