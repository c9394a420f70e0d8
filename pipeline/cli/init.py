"""The verb `init`: a robot file from a URDF, and what to look at in it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

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
    from pipeline.cli.findings import told

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
