"""The verb twin: make one blind trial, a log with something hidden and its sealed truth."""

from __future__ import annotations

import argparse

from pipeline.gap.twin.files import write_trial
from pipeline.gap.twin.trial import make_trial


def run_twin(options: argparse.Namespace) -> int:
    """Make it; print the hash of the truth before anything else.

    Raises:
        TwinError: Unknown effect, motion or noise level, or a folder that is not empty.
    """
    trial = make_trial(options.seed, options.hide, options.motion, options.noise, logs=options.logs)
    sealed = options.sealed or options.out.with_name(options.out.name + ".sealed.json")
    files = write_trial(trial, options.out, sealed)
    print(f"{sealed} sha256 {files.sha256}")
    logs = " ".join(str(path) for path in files.logs)
    print(
        f"python -m pipeline gap {logs} --robot {files.robot} --actuators {files.catalog} "
        f"--out {options.out}.found"
    )
    return 0
