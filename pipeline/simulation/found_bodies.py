"""Links as their URDF states them and as a model file's edits make them, and the URDF put right.

Mass m and centre of mass c stand for a body; an interval of c is the widest that those of m and of
the first moment m c allow, whatever their correlation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final
from xml.dom import minidom

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from actuators.arrays import Array
from actuators.errors import LegwattError
from pipeline.effects.base import Values, place_text
from pipeline.effects.bodies import physical
from pipeline.effects.model_file import Edit, apply_edits
from pipeline.effects.registry import effect_named
from pipeline.machine.machine import MachineModel, link_name
from pipeline.robot.urdf_source import INERTIA_KEYS, parse_urdf
from pipeline.simulation.rigid_bodies import changed_model

#: Relative difference that comes of turning and adding alone.
ROUNDING: Final = 1e-9
#: Parameters of edits on which mass and centre of mass depend.
_MASS: Final = ("mass", "mx", "my", "mz", "x", "y", "z")
#: Corners of intervals from which their box stands for them.
MANY: Final = 4096
#: Comment beside what was replaced.
FOUND: Final = "as found in a log, see model.toml"


@dataclass(frozen=True, eq=False)
class FoundBody:
    """A link, with all that is fixed to it, by the URDF and as found."""

    link: str  #: That its joint carries.
    urdf: Array  #: Mass [kg] and centre of mass in the link's frame [m], (4,).
    found: Array  #: The same with the edits.
    low: Array  #: Lower ends of the 95 % intervals, (4,); minus infinity where there is none.
    high: Array  #: Upper ends likewise.

    @property
    def change(self) -> Array:
        """Found less URDF, (4,) [kg, m]."""
        return self.found - self.urdf

    @property
    def differs(self) -> NDArray[np.bool_]:
        """Which of mass and coordinates the intervals distinguish from the URDF's, (4,)."""
        slack = ROUNDING * np.maximum(np.abs(self.urdf), np.abs(self.found))
        return (self.urdf < self.low - slack) | (self.urdf > self.high + slack)

    @property
    def differs_in(self) -> tuple[str, ...]:
        """The same in names."""
        pairs = zip(("mass", "x", "y", "z"), self.differs, strict=True)
        return tuple(name for name, differs in pairs if differs)


@dataclass(frozen=True, eq=False)
class FoundBodies:
    """What a model file says of bodies."""

    bodies: tuple[FoundBody, ...] = ()  #: That it changes, the largest change first.
    #: Its effects that a URDF's inertial elements cannot carry, with their places.
    elsewhere: tuple[str, ...] = ()
    urdf: str = ""  #: Text of the corrected URDF; empty where none is to be written.


def of_bodies(edits: Sequence[Edit]) -> list[Edit]:
    """The edits that a URDF's inertial elements can carry."""
    return [edit for edit in edits if effect_named(edit.effect).place_kind == "link"]


def not_in_urdf(edits: Sequence[Edit]) -> tuple[str, ...]:
    """Effects that inertial elements cannot carry, with their places, in words."""
    by: dict[str, list[str]] = {}
    for edit in edits:
        if effect_named(edit.effect).place_kind != "link":
            by.setdefault(edit.effect, []).append(place_text(edit.place))
    return tuple(f"{name} at {', '.join(places)}" for name, places in by.items())


def found_bodies(bare: MachineModel, edits: Sequence[Edit]) -> tuple[FoundBody, ...]:
    """Every body that edits change: those that differ first, then by the size of the change.

    Size is the change of mass and of the first moment over the robot's reach, |dm| + |d(m c)| / L.
    `bare`: the machine before the edits.
    """
    own = of_bodies(edits)
    old, new = (changed_model(m.rigid, m.bodies) for m in (bare, apply_edits(bare, own)))
    reach = np.zeros(old.njoints)
    for k in range(1, old.njoints):
        reach[k] = reach[old.parents[k]] + np.linalg.norm(old.jointPlacements[k].translation)
    out, size = [], {}
    for joint in dict.fromkeys(bare.carrier(edit.place[0]) for edit in own):
        k = old.getJointId(joint)
        here = [edit for edit in own if bare.carrier(edit.place[0]) == joint]
        before, after = (np.array([m.inertias[k].mass, *m.inertias[k].lever]) for m in (old, new))
        points = np.concatenate([before[:1], before[0] * before[1:]])[None]  # mass, first moments
        for edit in here:
            spans = {p.name: p.interval for p in edit.parameters if p.name in _MASS}
            corners = [dict(zip(spans, values, strict=True)) for values in product(*spans.values())]
            points = np.concatenate([_with(points, values) for values in corners])
            if len(points) > MANY:
                box = zip(points.min(axis=0), points.max(axis=0), strict=True)
                points = np.array(list(product(*box)))
        mass, moment = points[:, :1], points[:, 1:]
        # Of what may weigh nothing the centre may lie anywhere.
        far = np.where(moment == 0, 0.0, np.copysign(np.inf, moment))
        ends = np.hstack([mass, np.divide(moment, mass, out=far, where=mass > 0)])
        body = FoundBody(link_name(old, k), before, after, ends.min(axis=0), ends.max(axis=0))
        moments = after[0] * after[1:] - before[0] * before[1:]
        size[body.link] = abs(body.change[0]) + np.linalg.norm(moments) / (reach.max() or 1.0)
        out.append(body)
    return tuple(sorted(out, key=lambda body: (not body.differs.any(), -size[body.link])))


def corrected_urdf(text: str, where: str, bare: MachineModel, edits: Sequence[Edit]) -> str:
    """A URDF whose inertial elements are those found.

    Of links that are fixed to each other a motion determines the sum. What was found goes
    into the link that the joint carries; where no body would be left of it by itself, it is the
    whole, and the links fixed to it have no inertial element any more. `where`: the file of the
    URDF's text. `bare`: the machine before the edits.

    Raises:
        LegwattError: The text is no URDF.
    """
    own = of_bodies(edits)
    parsed = parse_urdf(text, where, floating=bare.floating)
    old, new = (changed_model(m.rigid, m.bodies) for m in (bare, apply_edits(bare, own)))
    bodies: dict[str, pin.Inertia | None] = {}
    for joint in dict.fromkeys(bare.carrier(edit.place[0]) for edit in own):
        k = parsed.getJointId(joint)
        ten, before, after = (
            np.asarray(m.inertias[m.getJointId(joint)].toDynamicParameters())
            for m in (parsed, old, new)
        )
        ten = ten + (after - before)  # a load that the robot file states is in no URDF
        frames = [f for f in parsed.frames if f.parentJoint == k]
        held = [f for f in frames if f.type == pin.FrameType.FIXED_JOINT and f.inertia.mass]
        apart = ten - sum(
            (f.placement.act(f.inertia).toDynamicParameters() for f in held), np.zeros(10)
        )
        if held and not physical(apart):
            apart = ten
            links = [str(f.name) for f in frames if f.type == pin.FrameType.BODY]
            bodies |= dict.fromkeys(links, None)
        bodies[link_name(parsed, k)] = pin.Inertia.FromDynamicParameters(apart)
    # None leaves a comment in place of the element; comments and the order of lines stay.
    document = minidom.parseString(text)
    elements = {e.getAttribute("name"): e for e in document.getElementsByTagName("link")}
    for link, body in bodies.items():
        if link not in elements:
            raise LegwattError(f"{where}: no link '{link}'")
        element = elements[link]
        new = document.createComment(f" {FOUND} ") if body is None else _inertial(body)
        old = [child for child in element.childNodes if child.nodeName == "inertial"]
        for spare in old[1:]:  # a reader takes the first; no other is to take its place
            element.removeChild(spare)
        if old:
            element.replaceChild(new, old[0])
        elif body is not None:
            for node in (document.createTextNode("\n    "), new, document.createTextNode("\n  ")):
                element.appendChild(node)
    return "\n".join(['<?xml version="1.0"?>', *(e.toxml() for e in document.childNodes), ""])


def _with(points: Array, p: Values) -> Array:
    """Masses and first moments after one edit, (N, 4) or, of a whole body, (1, 4)."""
    mass, moment = points[:, :1], points[:, 1:]
    if "mx" in p:
        return np.array([[p[name] for name in ("mass", "mx", "my", "mz")]])
    if "mass" not in p:  # the centre of mass displaced
        return np.hstack([mass, moment + mass * [p[axis] for axis in "xyz"]])
    place = np.array([[p.get(axis, 0.0) for axis in "xyz"]])
    if len(p) == 1:  # a point mass at the centre of mass
        place = np.divide(moment, mass, out=np.zeros_like(moment), where=mass > 0)
    return np.hstack([mass + p["mass"], moment + p["mass"] * place])


def _inertial(body: pin.Inertia) -> minidom.Element:
    """The element, with digits that read back to the same numbers."""
    xyz = " ".join(repr(float(x)) for x in body.lever)
    upper = body.inertia[np.triu_indices(3)]  # in the order of the keys
    moments = " ".join(
        f'{key}="{float(value)!r}"' for key, value in zip(INERTIA_KEYS, upper, strict=True)
    )
    lines = (
        f"<inertial>\n      <!-- {FOUND} -->",
        f'<origin xyz="{xyz}" rpy="0 0 0"/>',
        f'<mass value="{float(body.mass)!r}"/>',
        f"<inertia {moments}/>\n    </inertial>",
    )
    made = minidom.parseString("\n      ".join(lines)).documentElement
    assert made is not None
    return made
