"""A robot file from a URDF or a robot's name, with a picture of the stance beside it."""

from __future__ import annotations

import atexit
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from actuators.errors import LegwattError, one_line
from actuators.loading.build import CATALOG, load_catalog
from pipeline.atomic import replacing
from pipeline.dynamics.joint_demand import check_gait
from pipeline.machine.own_actuators import Motors, actuator_folder, motors_of, own_actuators
from pipeline.motion.support import support_margin
from pipeline.robot.check import Finding, check_robot
from pipeline.robot.guess.guess import Guess, guess_robot, robot_text, shorter
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file


@dataclass(frozen=True)
class Init:
    """A robot file that was written."""

    path: Path  #: The file.
    picture: Path  #: Of the stance; its SVG lies beside it.
    guess: Guess  #: What was found, with reasons.
    findings: tuple[Finding, ...]  #: What `check` says of it.
    #: Which drive its joints: the robot's own where they are known, else assumed ones.
    motors: Motors


def init(
    source: str | Path,
    out: str | Path | None = None,
    *,
    feet: Sequence[str] = (),
    base: str | None = None,
) -> Init:
    """Write a robot file for a URDF.

    Args:
        source: A URDF's path, or a robot's name in ``example-robot-data``.
        out: The robot file to write; ``NAME.toml`` in the current folder by default.
        feet: Frames at the feet, one for each leg; looked for where none is named.
        base: The base's link; the root by default.

    Raises:
        LegwattError: Something cannot be found or used; one line says which option names it. The
            file cannot be written.
    """
    from pipeline.api.pictures.scene import Scene, mass_centre
    from reports.figures.robot import robot_figure
    from reports.figures.style import save_figures

    guess = guess_robot(str(source), support_margin, feet=feet, base=base)
    path = Path(out) if out is not None else Path(f"{guess.source.name}.toml")
    if path.suffix.lower() != ".toml":
        raise LegwattError(f"--out {one_line(path)}: a robot file's name ends in .toml")
    if path.exists():
        raise LegwattError(f"{path}: there is such a file; give another name with --out")
    with replacing(path) as temporary:
        try:
            guess, robot, walked = _walked(guess, path, temporary)
        except LegwattError as error:  # of the file that is to be, not of the one beside it
            raise type(error)(str(error).replace(str(temporary), str(path))) from None
        findings = (*check_robot(robot), *walked)
    stance = robot.configuration(robot.joint_positions(robot.start_posture[None]), np.zeros((1, 3)))
    draw = partial(
        robot_figure,
        *Scene(robot).at(stance[0]),
        title=f"{robot.spec.name}: the stance guessed",
        subtitle="left and right, front and rear, feet and knees as they should be?",
        mass_centre=mass_centre(robot, stance)[0],
    )
    save_figures({path.stem: draw}, path.absolute().parent)
    picture = path.with_suffix(".svg")
    spec = load_robot_file(path)
    catalog = load_catalog(actuator_folder(spec) or CATALOG)
    own = own_actuators(spec, catalog)
    return Init(
        path, picture, guess, findings, motors_of(own, spec.joints, guess.mass, stated=False)
    )


@cache
def robot_file_of(name: str) -> Path:
    """The robot file that `init` would write for a published robot, kept while Python runs.

    Args:
        name: Of a robot in ``example-robot-data``.
    """
    folder = _kept()
    path = folder / f"{name}.toml"
    _walked(guess_robot(name, support_margin), path, path)
    return path


@cache
def _kept() -> Path:
    folder = TemporaryDirectory(prefix="legwatt_")
    atexit.register(folder.cleanup)
    return Path(folder.name)


def _walked(guess: Guess, path: Path, temporary: Path) -> tuple[Guess, Robot, list[Finding]]:
    """Write the file with the longest stroke with which its gait can be walked, sway and all.

    Where none can, the first stays and the finding says why.
    """
    first = None
    for pace in [guess.pace, *shorter(guess.pace)]:
        tried = replace(guess, pace=pace)
        temporary.write_text(robot_text(tried, path), encoding="utf-8")
        robot = load_robot(load_robot_file(temporary))
        findings = [replace(f, subject=guess.source.name) for f in check_gait(robot)]
        if first is None:
            first = tried, robot, findings
        if all(finding.passed for finding in findings):
            return tried, robot, findings
    assert first is not None
    temporary.write_text(robot_text(first[0], path), encoding="utf-8")
    return first
