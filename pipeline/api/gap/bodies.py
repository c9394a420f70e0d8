"""What the workflow found of bodies: a table, and a corrected URDF beside the model file."""

from __future__ import annotations

from pathlib import Path

from pipeline.atomic import write_text
from pipeline.effects.model_file import edits_in
from pipeline.identification.workflow.setup import Setup
from pipeline.logs.errors import GapError
from pipeline.robot.urdf_source import read_urdf
from pipeline.simulation.found_bodies import (
    FoundBodies,
    corrected_urdf,
    found_bodies,
    not_in_urdf,
)
from reports.pages.gap_words import URDF_FILE


def bodies_of(given: Setup, text: str) -> FoundBodies:
    """Bodies by the URDF and by a model file, and the URDF with them.

    Args:
        given: Robot, and the model file that was given.
        text: Of the model file that is written; empty for none: then there is no URDF either.
    """
    edits = edits_in(text) if text else given.file.edits
    bodies = found_bodies(given.bare, edits)
    urdf = ""
    if text and bodies:
        source = given.robot.urdf if given.robot else read_urdf(given.path)
        urdf = corrected_urdf(source, str(given.path), given.bare, edits)
    return FoundBodies(bodies, not_in_urdf(edits), urdf)


def write_model(folder: Path, text: str, found: FoundBodies) -> None:
    """Write ``model.toml`` and ``model.urdf``, those that there are."""
    if text:
        write_text(folder / "model.toml", text)
    if found.urdf:
        write_text(folder / URDF_FILE, found.urdf)


def refuse_own_urdf(given: Setup, out: Path) -> None:
    """Refuse a robot whose URDF lies where the corrected one may be written.

    Raises:
        GapError: A model file that names it would put what was found into it twice.
    """
    if (out / URDF_FILE).resolve() in {source.resolve() for source in given.sources}:
        raise GapError(
            f"{out / URDF_FILE}: the robot's URDF lies where a corrected one is written; choose "
            "another folder with --out, or copy it elsewhere"
        )
