"""Bodies that a log showed, in words and as a table: by the URDF, as found."""

from __future__ import annotations

import numpy as np

from pipeline.identification.results import Estimate
from pipeline.simulation.found_bodies import FoundBodies, FoundBody
from reports.page import Block, Points, TableBlock, Text
from reports.pages import gap_words as words

#: Of the folder of results, beside the model file.
URDF_FILE = "model.urdf"


def bodies_words(found: FoundBodies) -> str:
    """A paragraph of the answer; empty where no body was found to be another."""
    if not found.bodies:
        return ""
    clear = [body_words(body) for body in found.bodies if body.differs_in]
    count = len(found.bodies)
    if clear:
        more = len(clear) - words.TOLD
        text = f"**Bodies:** {'; '.join(clear[: words.TOLD])}"
        text += f"; and {more} more" if more > 0 else ""
        text += f" ({len(clear)} of {count} changed links differ beyond their interval)."
    else:
        text = (
            f"**Bodies:** {count} link{' was' if count == 1 else 's were'} fitted anew, and of "
            "none is the mass or the centre of mass by itself known to differ from the URDF's: its "
            "value lies inside the interval."
        )
    if found.urdf:
        text += f" The robot with these bodies is [{URDF_FILE}]({URDF_FILE})"
        text += f"; without {', '.join(found.elsewhere)}." if found.elsewhere else "."
    return text


def body_words(body: FoundBody) -> str:
    """What differs in one link, e.g. ``forearm +0.5 kg``."""
    parts = []
    if body.differs[0]:
        sign = "+" if body.change[0] > 0 else ""
        parts.append(
            f"**{body.link} {sign}{words.number(body.change[0], 2)} kg** "
            f"({words.number(body.urdf[0])} kg by URDF, as found {_value(body, 0, 'kg')})"
        )
    moved = [k for k in (1, 2, 3) if body.differs[k]]
    if moved:
        axes = ", ".join(
            f"{'xyz'[k - 1]} {_value(body, k, 'mm')} instead of "
            f"{words.number(1e3 * body.urdf[k])} mm"
            for k in moved
        )
        parts.append(f"{'its' if parts else f'**{body.link}**,'} centre of mass: {axes}")
    return ", ".join(parts)


def _value(body: FoundBody, k: int, unit: str) -> str:
    """A value as found with its interval, where it has one."""
    scale = 1e3 if unit == "mm" else 1.0
    value, low, high = (float(scale * x[k]) for x in (body.found, body.low, body.high))
    if not (np.isfinite([low, high]).all() and low < high):
        return f"{words.number(value)} {unit}"
    return words.parameters_text([Estimate("", value, low, high, unit)]).strip()


def bodies_blocks(found: FoundBodies) -> tuple[Block, ...]:
    """The table, and what the corrected URDF holds; nothing without bodies."""
    if not found.bodies:
        return ()
    rows = tuple(
        (
            body.link,
            f"**{', '.join(body.differs_in)}**" if body.differs_in else "nothing",
            float(body.urdf[0]),
            float(body.found[0]),
            *(float(end[0]) if np.isfinite(end[0]) else None for end in (body.low, body.high)),
            *(_place(point) for point in (body.urdf, body.found)),
        )
        for body in found.bodies
    )
    table = TableBlock(
        ("link", "differs in", "mass by URDF [kg]", "as found [kg]", "95 % from", "to")
        + ("centre of mass by URDF [mm]", "as found [mm]"),
        rows,
        "Links with all that is fixed to them, largest change first; centre of mass in the link's "
        "frame. A link differs where the URDF's value lies outside the 95 % interval, that of the "
        "centre of mass as wide as those of mass and first moment allow. What one motion tells of "
        "a chain of links are combinations of their parameters, so that single masses may be open "
        "where the torque is not.",
        "bodies.csv",
        {"nothing": "quiet"},
        3,
    )
    if not found.urdf:
        return (table,)
    text = (
        f"[{URDF_FILE}]({URDF_FILE}) is the robot's URDF with these bodies in its inertial "
        "elements; comments, meshes' names and all else are those of the file given."
    )
    if not found.elsewhere:
        return table, Text(text)
    text += " A URDF's inertial elements cannot carry, so that they stand in model.toml alone:"
    return table, Text(text), Points(found.elsewhere)


def _place(point: np.ndarray) -> str:
    return ", ".join(words.number(1e3 * x, 3) for x in point[1:])
