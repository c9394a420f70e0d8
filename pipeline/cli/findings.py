"""What `check` found, as lines for a reader."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from pipeline.robot.urdf_check import MERGED, Finding

_SHOWN = 3  # of what one line says of several


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
    said: dict[tuple[str, str, str], list[str]] = {}
    for finding in findings:
        quiet = finding.passed and (
            not finding.note or (finding.check == MERGED and not merged)
        )
        if quiet and not all_of_them:
            continue
        mark = "FAIL" if not finding.passed else "note" if finding.note else "ok  "
        said.setdefault((mark, finding.check, finding.detail), []).append(finding.subject)
    for (mark, check, detail), subjects in said.items():
        shown = subjects if all_of_them or len(subjects) <= _SHOWN + 1 else subjects[:_SHOWN]
        more = f" and {len(subjects) - len(shown)} more" if len(shown) < len(subjects) else ""
        if all_of_them or len(shown) == 1:
            for subject in shown:
                yield f"{mark} {subject}: {check}: {detail}"
        else:
            yield f"{mark} {', '.join(shown)}{more}: {check}: {detail}"
