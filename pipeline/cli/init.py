"""The verbs `init` and `check`: a robot file from a URDF, and what is to be said of one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipeline.robot.check import Finding

_OK, _NEGATIVE = 0, 1


def run_init(
    source: str, out: Path | None, *, feet: Sequence[str] = (), base: str | None = None
) -> int:
    """Write the file and its picture; say what was found and what `check` says of it.

    Args:
        source: A URDF's path, or a robot's name in ``example-robot-data``.
        out: The robot file; ``NAME.toml`` in the current folder by default.
        feet: Frames at the feet; looked for where none is named.
        base: The base's link; the root by default.

    Returns:
        The exit code: 1 where `check` fails or no stroke was found.
    """
    from pipeline.api.init import init

    done = init(source, out, feet=feet, base=base)
    guess, stance = done.guess, done.guess.stance
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
    if guess.pace is None:
        print(
            "  gait: no stroke along x, which is forward, is within reach and limits; change the "
            "stance, or turn the URDF's root if its x does not point forward"
        )
    else:
        pace = guess.pace
        print(
            f"  gait: stroke {1e3 * pace.stroke:.3g} mm, lift {1e3 * pace.lift:.3g} mm, period "
            f"{pace.period:.3g} s"
        )
    print(
        f"look at {done.picture}: left and right, front and rear, feet, the way the knees bend; "
        f"then at [assumed] in {done.path}, which says why each guess was made"
    )
    failed = [finding for finding in done.findings if not finding.passed]
    for line in told(done.findings, merged=False):
        print(line)
    passed = len(done.findings) - len(failed)
    print(f"check: {passed} of {len(done.findings)} passed")
    return _NEGATIVE if failed or guess.pace is None else _OK


def run_check(path: Path, *, verbose: bool = False) -> int:
    """Say what fails and what the reader should know; with `verbose` what passes, too.

    Returns:
        The exit code: 1 where anything fails.
    """
    from pipeline.dynamics.gait_check import check_with_gait

    findings = check_with_gait(path)
    failed = [finding for finding in findings if not finding.passed]
    for line in told(findings, all_of_them=verbose):
        print(line)
    print(f"{path}: {len(findings) - len(failed)} of {len(findings)} checks passed")
    return _NEGATIVE if failed else _OK


def told(
    findings: Sequence[Finding], *, all_of_them: bool = False, merged: bool = True
) -> Iterator[str]:
    """Lines for what failed and what the reader should know.

    Args:
        findings: Of `check`.
        all_of_them: What passed, too, and each in a line of its own.
        merged: Whether to tell which links move as one.

    Yields:
        One line for each, or for all of which the same is said.
    """
    from pipeline.robot.check import MERGED, together

    if all_of_them:
        rows = [(finding.subject, finding) for finding in findings]
    else:
        worth = [f for f in findings if not f.passed or (f.note and (merged or f.check != MERGED))]
        rows = list(together(worth))
    for subjects, finding in rows:
        mark = "FAIL" if not finding.passed else "note" if finding.note else "ok  "
        yield f"{mark} {subjects}: {finding.check}: {finding.detail}"
