"""The verbs twin, blind and calibrate: their options."""

from __future__ import annotations

import argparse

from pipeline.cli.options import OUT, AddVerb, folder_held, named_path


def add_verbs(add: AddVerb) -> None:
    """Declare the verbs."""
    twin = add("twin", "simulate a machine with hidden effects and write its log", _run_twin)
    twin.add_argument("--seed", type=int, default=1, help="of the random numbers")
    text = "effects to hide; none by default"
    twin.add_argument("--hide", nargs="*", default=[], metavar="EFFECT", help=text)
    twin.add_argument("--motion", default="leg", help="leg (on a stand; default) or walk (hexapod)")
    twin.add_argument("--noise", default="low", help="low (default) or high")
    twin.add_argument("--logs", type=int, default=1, help="number of logs of the machine; 1")
    twin.add_argument("--out", type=named_path, required=True, help="new folder for the trial")
    text = "file for the truth, outside of that folder"
    twin.add_argument("--sealed", type=named_path, help=text)

    text = "simulate machines with hidden effects and count how often gap finds them"
    blind = add("blind", text, _run_blind)
    text = "run only the first so many, a random sample of the matrix"
    blind.add_argument("--trials", type=int, help=text)
    blind.add_argument(
        "--matrix",
        choices=["bench", "standard"],
        default="bench",
        help="bench: the paper's leg and hexapod with their actuators; standard: bare URDFs with "
        "friction, wrong bodies and coloured noise beside what is hidden",
    )
    blind.add_argument("--seed", type=int, default=1, help="of the random numbers")
    blind.add_argument("--workers", type=int, default=2, help="number of processes; 2")
    blind.add_argument("--resume", action="store_true", help="go on where a run was stopped")
    text = "folder for everything written"
    blind.add_argument("--out", type=named_path, default=OUT / "blind", help=text)


def add_calibrate(add: AddVerb) -> None:
    """Declare the verb calibrate."""
    text = "fit the unpublished numbers to the paper's figures and store them"
    calibrate = add("calibrate", text, _run_calibrate)
    robot = named_path("urdf/hexapod.toml")
    calibrate.add_argument("--robot", type=named_path, default=robot, help="robot file")
    calibrate.add_argument("--workers", type=int, default=2, help="number of processes")
    calibrate.add_argument("--seed", type=int, default=1, help="of the random numbers")


def _run_twin(options: argparse.Namespace) -> int:
    with folder_held(options):
        from pipeline.cli.twin import run_twin

        return run_twin(options)


def _run_blind(options: argparse.Namespace) -> int:
    from reports.folder import output_errors

    with folder_held(options), output_errors(options.out):
        from pipeline.cli.blind import run_blind

        return run_blind(options)


def _run_calibrate(options: argparse.Namespace) -> int:
    from pipeline.cli.calibrate import WORK, run_calibrate
    from reports.folder import holding, output_errors

    with holding(WORK), output_errors(WORK):
        return run_calibrate(options)
