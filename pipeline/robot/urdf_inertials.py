"""Inertial elements of a URDF replaced in its text; every other character stays as it is."""

from __future__ import annotations

import re
from collections.abc import Mapping
from xml.parsers import expat

import numpy as np
import pinocchio as pin

from pipeline.errors import UrdfError
from pipeline.robot.urdf_source import INERTIA_KEYS

#: A declared encoding that is not the one written.
_ENCODING = re.compile(r"""\s+encoding\s*=\s*(["'])(?!utf-8\1)[\w.:-]+\1(?=[^<>]*\?>)""", re.I)


def with_inertials(
    text: str, where: str, bodies: Mapping[str, pin.Inertia | None], why: str
) -> str:
    """A URDF with other bodies; comments, meshes and layout stay, but inside what is replaced.

    `text`: the URDF; its structure holds (`read_elements`). `bodies`: link to its body in the
    link's frame; None leaves a comment in place of the element. `why`: that comment, which stands
    beside every element that was replaced, too.

    Raises:
        UrdfError: A link that the text does not have.
    """
    # In UTF-8, in which it will be written and whose bytes the parser counts.
    content = _ENCODING.sub("", text, count=1).encode("utf-8")
    ends, elements = _places(content)
    edits: list[tuple[int, int, bytes]] = []
    for link, body in bodies.items():
        if link not in ends:
            raise UrdfError(f"{where}: no link '{link}'")
        for number, (start, stop) in enumerate(elements[link]):
            # A reader takes the first element; what stands behind it is not to take its place.
            new = b"" if number else _inertial(body, why, _margin(content, start))
            edits.append((start, stop, new))
        if body is not None and not elements[link]:
            edits.append(_inserted(content, ends[link], body, why))
    for start, stop, new in sorted(edits, reverse=True):
        content = content[:start] + new + content[stop:]
    return content.decode("utf-8")


def _places(content: bytes) -> tuple[dict[str, int], dict[str, list[tuple[int, int]]]]:
    """Of every link, where its end tag starts, and where its inertial elements stand [bytes]."""
    ends: dict[str, int] = {}
    elements: dict[str, list[tuple[int, int]]] = {}
    above: list[str] = []
    link, start = "", 0
    parser = expat.ParserCreate("utf-8")

    def opened(tag: str, attributes: dict[str, str]) -> None:
        nonlocal link, start
        above.append(tag)
        if above[1:] == ["link"]:
            link = attributes.get("name", "")
            elements[link] = []
        elif above[1:] == ["link", "inertial"]:
            start = parser.CurrentByteIndex

    def closed(tag: str) -> None:
        at = parser.CurrentByteIndex
        if above[1:] == ["link"]:
            ends[link] = at
        elif above[1:] == ["link", "inertial"]:
            # An element without content ends here, another with its end tag.
            full = content.startswith(b"</inertial", at)
            elements[link].append((start, content.index(b">", at) + 1 if full else at))
        above.pop()

    parser.StartElementHandler, parser.EndElementHandler = opened, closed
    parser.Parse(content, True)
    return ends, elements


def _margin(content: bytes, at: int) -> str:
    """The blanks in front of an element that begins its line."""
    before = content[content.rfind(b"\n", 0, at) + 1 : at].decode("utf-8", "replace")
    return before if not before.strip() else ""


def _inserted(content: bytes, end: int, body: pin.Inertia, why: str) -> tuple[int, int, bytes]:
    """An element more at the end of a link, which may be one without content."""
    if content.startswith(b"</link", end):
        outer = _margin(content, end)
        start, stop, before, after = len(content[:end].rstrip()), end, b"", b""
    else:
        start, stop = content.rindex(b"/", 0, end), end
        outer, before, after = _margin(content, content.rindex(b"<", 0, end)), b">", b"</link>"
    line = f"\n{outer}".encode()
    new = before + line + b"  " + _inertial(body, why, f"{outer}  ") + line + after
    return start, stop, new


def _inertial(body: pin.Inertia | None, why: str, margin: str) -> bytes:
    """The element, with digits that read back to the same numbers; a comment alone without body."""
    comment = f"<!-- {why} -->"
    if body is None:
        return comment.encode("utf-8")
    xyz = " ".join(repr(float(x)) for x in body.lever)
    upper = body.inertia[np.triu_indices(3)]  # in the order of the keys
    moments = " ".join(
        f'{key}="{float(value)!r}"' for key, value in zip(INERTIA_KEYS, upper, strict=True)
    )
    inner = (
        comment,
        f'<origin xyz="{xyz}" rpy="0 0 0"/>',
        f'<mass value="{float(body.mass)!r}"/>',
        f"<inertia {moments}/>",
    )
    lines = (*(f"{margin}  {line}" for line in inner), f"{margin}</inertial>")
    return "\n".join(("<inertial>", *lines)).encode("utf-8")
