"""Inertial elements of a URDF's text replaced; comments, meshes and the order of lines stay."""

from __future__ import annotations

from collections.abc import Mapping
from xml.dom import minidom

import numpy as np
import pinocchio as pin

from pipeline.errors import UrdfError
from pipeline.robot.urdf_source import INERTIA_KEYS


def with_inertials(
    text: str, where: str, bodies: Mapping[str, pin.Inertia | None], why: str
) -> str:
    """A URDF with other bodies, to be written in UTF-8.

    `text`: the URDF; its structure holds (`read_elements`). `bodies`: link to its body in the
    link's frame; None leaves a comment in place of the element. `why`: that comment, which stands
    beside every element that was replaced, too.

    Raises:
        UrdfError: A link that the text does not have.
    """
    document = minidom.parseString(text)
    links = {e.getAttribute("name"): e for e in document.getElementsByTagName("link")}
    for link, body in bodies.items():
        if link not in links:
            raise UrdfError(f"{where}: no link '{link}'")
        element = links[link]
        new = document.createComment(f" {why} ") if body is None else _inertial(body, why)
        old = [child for child in element.childNodes if child.nodeName == "inertial"]
        for spare in old[1:]:  # a reader takes the first; no other is to take its place
            element.removeChild(spare)
        if old:
            element.replaceChild(new, old[0])
        elif body is not None:
            for node in (document.createTextNode("\n    "), new, document.createTextNode("\n  ")):
                element.appendChild(node)
    return "\n".join(['<?xml version="1.0"?>', *(e.toxml() for e in document.childNodes), ""])


def _inertial(body: pin.Inertia, why: str) -> minidom.Element:
    """The element, with digits that read back to the same numbers."""
    xyz = " ".join(repr(float(x)) for x in body.lever)
    upper = body.inertia[np.triu_indices(3)]  # in the order of the keys
    moments = " ".join(
        f'{key}="{float(value)!r}"' for key, value in zip(INERTIA_KEYS, upper, strict=True)
    )
    lines = (
        f"<inertial>\n      <!-- {why} -->",
        f'<origin xyz="{xyz}" rpy="0 0 0"/>',
        f'<mass value="{float(body.mass)!r}"/>',
        f"<inertia {moments}/>\n    </inertial>",
    )
    made = minidom.parseString("\n      ".join(lines)).documentElement
    assert made is not None
    return made
