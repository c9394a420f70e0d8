"""Machines from files: load, check, init and init-actuator, in Python and as verbs."""

import argparse
import hashlib
import logging
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np

from actuators.checked import parsed_toml, write_text
from actuators.errors import LegwattError, one_line
from actuators.loading.data_sheet import ENTRIES
from pipeline.commands.main import AddVerb, add_verbose_option, given_options, named_path
from pipeline.dynamics.joint_demand import check_gait
from pipeline.machine.own_actuators import Motors
from pipeline.robot.check import Finding, check_robot, check_second_reader, check_urdf, together
from pipeline.robot.guess import Guess, guesses, robot_text
from pipeline.robot.robot import Robot, load_robot
from pipeline.robot.robot_file import load_robot_file, loaders, robot_source, spec_of
from pipeline.robot.urdf import read_urdf
from pipeline.simulation.machine import Machine, read_machine
from pipeline.simulation.walk_stand import WalkOptions

logger = logging.getLogger("legwatt")


def load(
    robot: str | Path | None = None,
    *,
    model: str | Path | None = None,
    actuators: str | Path | None = None,
    changes: Mapping[str, object] | None = None,
    guess: bool = True,
) -> Machine:
    """Load a machine, and refuse what cannot be used.

    Args:
        robot: Robot file (.toml), a URDF, or the name of a robot in ``example-robot-data``, the
            last two with the legs, stance and gait that `init` guesses, on a fixed base without
            three legs. The model file's or the project's hexapod by default.
        model: Model file with effects that `gap` found.
        actuators: Folder of actuator files; the project's catalogue by default.
        changes: Numbers that differ from the files'; see `Machine.with_values`.
        guess: Whether a URDF's legs are guessed, or it stands on a fixed base.

    Raises:
        LegwattError: A file cannot be used; one line says which and what to do.
    """
    machine = read_machine(
        found_robot(robot, guess=guess),
        model=Path(model) if model else None,
        actuators=Path(actuators) if actuators else None,
        changes=changes,
    )
    _ = machine.edited  # refused here rather than at the first walk
    return machine


def found_robot(robot: str | Path | None, *, guess: bool = True) -> Path | None:
    """The robot file of a robot that is named by its file, its URDF or, if published, its name."""
    if robot is None:
        return None
    path = Path(robot)
    if not path.exists():
        return robot_file_of(str(robot)) if str(robot) in loaders() else path
    if path.suffix.lower() not in (".urdf", ".xml") or not guess:
        return path
    found = robot_file_of(str(robot))
    if found != path:
        words = "legs, stance and gait are guessed; `init` writes them to a file"
        logger.warning("%s: %s to be corrected, each with its reason", path, words)
    return found


def changes_of(texts: Iterable[str]) -> dict[str, str]:
    """Keys and values of ``--set KEY=VALUE``; the last counts where a key comes twice.

    Raises:
        LegwattError: One is something else.
    """
    changes = {}
    for text in texts:
        key, _, value = (part.strip() for part in text.partition("="))
        if not key or not value:
            raise LegwattError(f"--set {one_line(text)}: expected KEY=VALUE")
        changes[key] = value
    return changes


def machine_of(options: argparse.Namespace, *, guess: bool = True) -> Machine:
    """The machine that is asked for, loaded; `guess`: whether a URDF's legs are guessed."""
    files = {name: getattr(options, name) for name in ("robot", "model", "actuators")}
    return load(**files, changes=changes_of(options.set), guess=guess)


def walking_machine(options: argparse.Namespace) -> Machine:
    """The machine that is asked for, and how it walks."""
    return machine_of(options).walking(**given_options(options, WalkOptions))


class Checked(tuple[Finding, ...]):
    """What `check` found, printed as what fails or should be known, and how many passed."""

    def __str__(self) -> str:
        return self.told()

    def told(self, *, every: bool = False) -> str:
        """The same; with `every` finding a line each."""
        worth = [f for f in self if not f.passed or f.note]
        lines = []
        for subjects, finding in [(f.subject, f) for f in self] if every else together(worth):
            mark = "FAIL" if not finding.passed else "note" if finding.note else "ok  "
            lines.append(f"{mark} {subjects}: {finding.check}: {finding.detail}")
        passed = sum(finding.passed for finding in self)
        return "\n".join([*lines, f"{passed} of {len(self)} checks passed"])


def check(file: str | Path) -> Checked:
    """Judge a robot file, a URDF or a published robot for physical sense.

    Raises:
        LegwattError: It cannot be read.
    """
    path = Path(file)
    if path.suffix.lower() != ".toml":
        text = read_urdf(robot_source(str(path)).urdf)
        return Checked((*check_urdf(text, str(path)), check_second_reader(text, str(path))))
    robot = load_robot(load_robot_file(path))
    second = check_second_reader(robot.urdf, robot.spec.name)
    return Checked((*check_robot(robot), second, *check_gait(robot)))


@dataclass(frozen=True)
class Init:
    """A robot file that was written."""

    path: Path  #: The file.
    guess: Guess  #: What was found, with reasons.
    findings: Checked  #: What `check` says of it.
    #: Which drive its joints: the robot's own where they are known, else assumed ones.
    motors: Motors

    def __str__(self) -> str:
        """What was found, what to look at, and what `check` says of it."""
        from reports.page import plain
        from reports.pages.robot_page import motors_text

        guess, base = self.guess, "base" if self.guess.legs else "fixed base"
        legs = ", ".join(f"{leg.name} to '{leg.foot}'" for leg in guess.legs)
        gait = (
            f"stroke {1e3 * guess.stroke:.3g} mm, lift {1e3 * guess.lift:.3g} mm, "
            f"period {guess.period:.3g} s"
        )
        return "\n".join(
            [
                plain(motors_text(self.motors)),
                f"{self.path}: {len(guess.legs)} legs, {guess.mass:.4g} kg, {base} "
                f"'{guess.base_link}'; {len(guess.held)} joints held",
                *([f"  legs: {legs}"] if legs else []),
                f"  gait: {f'none: {guess.gaitless}' if guess.gaitless else gait}",
                f"look at {self.path.with_suffix('.svg')}: left and right, front and rear, feet, "
                f"knees; then at [assumed] in {self.path}, which says why each guess was made",
                str(self.findings),
            ]
        )


def init(source: str | Path, out: str | Path | None = None, *, feet: Sequence[str] = ()) -> Init:
    """Write a robot file for a URDF.

    Args:
        source: A URDF's path, or a robot's name in ``example-robot-data``.
        out: The robot file to write; ``NAME.toml`` in the current folder by default.
        feet: Frames at the feet, one for each leg; looked for where none is named.

    Raises:
        LegwattError: Something cannot be found or used; one line says which option names it. The
            file cannot be written.
    """
    from reports.figures.robot import robot_figure
    from reports.figures.style import save_figures

    path = Path(out) if out is not None else Path(f"{robot_source(str(source)).name}.toml")
    if path.suffix.lower() != ".toml":
        raise LegwattError(f"out {one_line(path)}: a robot file's name ends in .toml")
    if path.exists():
        raise LegwattError(f"{path}: there is such a file; give another name")
    guess, robot, walked = _walked(guesses(str(source), feet=feet), path)
    stance = robot.configuration(robot.joint_positions(robot.start_posture[None]), np.zeros((1, 3)))
    draw = partial(
        robot_figure,
        robot,
        stance[0],
        title=f"{robot.spec.name}: the stance guessed",
        subtitle="left and right, front and rear, feet and knees as they should be?",
    )
    save_figures({path.stem: draw}, path.absolute().parent)
    findings = Checked((*check_robot(robot), *walked))
    return Init(path, guess, findings, read_machine(path, tolerant=True).motors)


@cache
def robot_file_of(source: str) -> Path:
    """The robot file that `init` would write for a URDF's path or a published robot's name.

    It stays in the user's cache, so that a model file that names it can be read again. A robot
    without a gait is its URDF, on a fixed base.
    """
    urdf = robot_source(source)
    place = hashlib.sha256(str(urdf.urdf.absolute()).encode()).hexdigest()[:16]
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    guess, *_ = _walked(guesses(source), cache / "legwatt" / place / f"{urdf.name}.toml")
    if guess.gaitless:
        logger.warning("%s: taken for a robot on a fixed base: %s", source, guess.gaitless)
        return urdf.urdf
    return cache / "legwatt" / place / f"{urdf.name}.toml"


def _walked(candidates: Iterator[Guess], path: Path) -> tuple[Guess, Robot, list[Finding]]:
    """Write the file of the first guess whose gait can be walked, sway and all.

    Where none can, it is the first of all, and the finding says why.
    """
    tried = []
    path.parent.mkdir(parents=True, exist_ok=True)  # the URDF is named from there
    for guess in candidates:
        text = robot_text(guess, path)
        robot = load_robot(spec_of(parsed_toml(text), (path,), path))
        tried.append((text, guess, robot, check_gait(robot)))
        if all(finding.passed for finding in tried[-1][-1]):
            break
    else:
        del tried[1:]
    text, guess, robot, findings = tried[-1]
    write_text(path, text)
    return guess, robot, findings


def add_verbs(add: AddVerb) -> None:
    """Declare the verbs."""
    check = add("check", "judge a robot file or URDF for physical sense", run_check)
    text = "robot file (.toml), URDF, or a name as `init` takes it"
    check.add_argument("file", type=named_path, help=text)
    add_verbose_option(check, "list what passed, too")

    init = add("init", "write a robot file for a URDF or a robot's name", run_init)
    text = "URDF, or a robot that example-robot-data ships, e.g. solo12"
    init.add_argument("source", help=text)
    init.add_argument("--out", type=named_path, help="robot file; NAME.toml here by default")
    text = "a link at a foot, once for each leg; looked for by default"
    init.add_argument("--foot", action="append", default=[], metavar="LINK", help=text)

    sub = add("init-actuator", "write actuator files from a data sheet", run_init_actuator)
    sub.description = (
        "Write a folder of actuator files from a data sheet. Each number is given with its unit; "
        "'LOW to HIGH UNIT' says what no sheet prints. What is left out is derived from the rest, "
        "or a range of its class, and said."
    )
    sub.add_argument("name", metavar="NAME", help="what tables call the actuator, e.g. ak80_9")
    sub.add_argument("--out", type=named_path, help="folder, also one to add to; NAME here")
    text = "which data sheet, for every number"
    sub.add_argument("--source", metavar="TEXT", required=True, help=text)
    for name, entry in ENTRIES.items():
        words = f"{entry.kind} {entry.words}".strip()
        sub.add_argument(f"--{name.replace('_', '-')}", metavar=f"'{entry.example}'", help=words)


def run_init(options: argparse.Namespace) -> int:
    """Write the file and its picture, and say so; 1 where `check` fails."""
    done = init(options.source, options.out, feet=options.foot)
    print(done)
    return int(not all(finding.passed for finding in done.findings))


def run_check(options: argparse.Namespace) -> int:
    """Say what fails and what the reader should know; 1 where anything fails."""
    findings = check(options.file)
    print(f"{options.file}:", findings.told(every=options.verbose), sep="\n")
    return int(not all(finding.passed for finding in findings))


def run_init_actuator(options: argparse.Namespace) -> int:
    """Write the folder; say what stands in it and how it is used; entries are options."""
    from actuators.loading.own_folder import init_actuator

    stated = {name: getattr(options, name) for name in ENTRIES}
    words = {name: text for name, text in stated.items() if text is not None}
    try:
        made = init_actuator(options.name, options.out, source=options.source, **words)
    except LegwattError as error:  # which option says it
        known = "|".join(sorted(ENTRIES, key=len, reverse=True))
        named = re.sub(rf"\b({known})\b", lambda m: f"--{m[0].replace('_', '-')}", str(error))
        raise LegwattError(named) from None
    print(made, *(f"note: {note}" for note in made.notes), sep="\n")
    print(
        f"{made.folder}: written; python -m pipeline reports --robot ROBOT.toml "
        f"--actuators {made.folder}"
    )
    return 0
