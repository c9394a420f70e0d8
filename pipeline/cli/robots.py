"""The verbs check, init and init-actuator: files of robots and actuators."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from actuators.errors import LegwattError
from actuators.loading.data_sheet import ENTRIES, idle, missing, option, read_entry
from pipeline.cli.options import AddVerb, add_verbose_option, named_path

if TYPE_CHECKING:
    from pipeline.robot.check import Finding


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
    init.add_argument("--base", metavar="LINK", help="the base's link; the root by default")

    sub = add("init-actuator", "write actuator files from a data sheet", run_init_actuator)
    sub.description = (
        "Write a folder of actuator files from a data sheet. Each number is given with its unit; "
        "'LOW to HIGH UNIT' says what no sheet prints. On a terminal, what is missing is asked for."
    )
    sub.add_argument("name", metavar="NAME", help="what tables call the actuator, e.g. ak80_9")
    sub.add_argument("--out", type=named_path, help="folder; NAME here by default")
    sub.add_argument("--source", metavar="TEXT", help="which data sheet, for every number")
    for name, entry in ENTRIES.items():
        words = f"{entry.kind} {entry.words}".strip()
        sub.add_argument(option(name), metavar=f"'{entry.example}'", help=words)


def run_init(options: argparse.Namespace) -> int:
    """Write the file and its picture; say what was found and what `check` says of it.

    Returns:
        The exit code: 1 where `check` fails or no stroke was found.
    """
    from pipeline.api.init import init
    from reports.page import plain
    from reports.pages.robot_page import motors_text

    done = init(options.source, options.out, feet=options.foot, base=options.base)
    guess, stance, pace = done.guess, done.guess.stance, done.guess.pace
    print(plain(motors_text(done.motors)))
    print(f"{done.path}: {len(guess.limbs)} legs, {guess.mass:.4g} kg, base '{guess.base_link}'")
    for limb, (x, y, z) in zip(guess.limbs, stance.feet, strict=True):
        side = "left" if y >= 0 else "right"
        print(
            f"  {limb.name}: {side}, {' - '.join(limb.joints)}, foot '{limb.foot}' at "
            f"({x:.3f}, {y:.3f}, {z:.3f}) m"
        )
    if guess.held:
        print(f"  held: {', '.join(f'{joint} at {at:g}' for joint, at, _ in guess.held)}")
    print(f"  stance: {stance.reason}; static margin {1e3 * stance.margin:.0f} mm")
    if pace is None:
        print(
            "  gait: no stroke along x, which is forward, is within reach and limits; change the "
            "stance, or turn the URDF's root if its x does not point forward"
        )
    else:
        print(
            f"  gait: stroke {1e3 * pace.stroke:.3g} mm, lift {1e3 * pace.lift:.3g} mm, period "
            f"{pace.period:.3g} s"
        )
    print(
        f"look at {done.picture}: left and right, front and rear, feet, the way the knees bend; "
        f"then at [assumed] in {done.path}, which says why each guess was made"
    )
    passed = sum(finding.passed for finding in done.findings)
    print(*_lines(done.findings, merged=False), sep="\n")
    print(f"check: {passed} of {len(done.findings)} passed")
    return int(passed < len(done.findings) or pace is None)


def run_check(options: argparse.Namespace) -> int:
    """Say what fails and what the reader should know; 1 where anything fails."""
    from pipeline.dynamics.joint_demand import check_with_gait

    findings = check_with_gait(options.file)
    passed = sum(finding.passed for finding in findings)
    for line in _lines(findings, every=options.verbose):
        print(line)
    print(f"{options.file}: {passed} of {len(findings)} checks passed")
    return int(passed < len(findings))


def _lines(
    findings: Sequence[Finding], *, every: bool = False, merged: bool = True
) -> Iterator[str]:
    """Lines for what failed and what the reader should know, or for every finding of `check`.

    `merged` says whether to report which links move as one.
    """
    from pipeline.robot.check import MERGED, together

    worth = [f for f in findings if not f.passed or (f.note and (merged or f.check != MERGED))]
    rows = [(f.subject, f) for f in findings] if every else together(worth)
    for subjects, finding in rows:
        mark = "FAIL" if not finding.passed else "note" if finding.note else "ok  "
        yield f"{mark} {subjects}: {finding.check}: {finding.detail}"


def run_init_actuator(options: argparse.Namespace) -> int:
    """Write the folder; say what stands in it and how it is used.

    Raises:
        LegwattError: Something is missing, unreadable or contradicts the rest.
    """
    from actuators.loading.own_folder import init_actuator

    words = {name: text for name in ENTRIES if (text := getattr(options, name)) is not None}
    source = options.source
    if sys.stdin.isatty() and (source is None or missing(words)):
        source = source or _answer("source: which data sheet")
        # Every entry that is not known is asked for, until none is missing.
        print("Number and unit each; 'LOW to HIGH UNIT' or nothing where none is printed.")
        names = [name for name in ENTRIES if name not in words]
        while names:
            for name in names:
                if not idle(name, words):
                    _ask_for(name, words)
            names = [name for group in missing(words) for name in group]
            if names:
                print("needed still:", ", ".join(" or ".join(group) for group in missing(words)))
        given = [f"{option(name)} {shlex.quote(text)}" for name, text in words.items()]
        print("the same without questions: python -m pipeline init-actuator", options.name, end="")
        print("", "--source", shlex.quote(source), *given)
    if source is None:
        lacking = [" or ".join(map(option, group)) for group in (("source",), *missing(words))]
        raise LegwattError(f"missing: {', '.join(lacking)}; --help says what each is")
    folder, parameters = init_actuator(options.name, options.out, source=source, **words)
    for key, p in parameters.items():
        why = f": {p.reason}" if p.reason else ""
        print(f"  {key} = {p.value_as_written:.6g} {p.unit} ({p.basis}{why})")
    print(f"{folder}: 4 files; python -m pipeline reports --robot ROBOT.toml --actuators {folder}")
    return 0


def _ask_for(name: str, words: dict[str, str]) -> None:

    entry = ENTRIES[name]
    while text := _answer(f"{name.replace('_', ' ')} ({entry.words}), as {entry.example}"):
        try:
            read_entry(name, text)
        except LegwattError as error:
            print(error)
        else:
            words[name] = text
            return


def _answer(question: str) -> str:

    try:
        return input(f"{question}: ").strip()
    except EOFError:
        raise LegwattError("the answers end here; nothing is written") from None
