"""Links as their URDF states them and as a model file's edits make them, and the URDF put right.

Mass m and centre of mass c stand for a body. Ends of their 95 % intervals: every parameter of the
edits by itself at the ends of its own interval, what it moves added up as squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import pinocchio as pin

from actuators.arrays import Array
from pipeline.columns import frame
from pipeline.effects.base import Values, effect_named
from pipeline.effects.model_file import Edit, apply_edits
from pipeline.machine.machine import MachineModel
from pipeline.robot.robot import link_name
from pipeline.robot.urdf_source import INERTIA_KEYS, parse_elements, parse_urdf

if TYPE_CHECKING:
    from pandas import DataFrame

#: Relative difference that comes of turning and adding alone.
ROUNDING: Final = 1e-9
_NAMES: Final = np.array(["mass", "x", "y", "z"])
#: Comment beside what was replaced.
FOUND: Final = "as found in a log, see model.toml"


def of_bodies(edits: Sequence[Edit]) -> list[Edit]:
    """The edits that a URDF's inertial elements can carry."""
    return [edit for edit in edits if effect_named(edit.effect).place_kind == "link"]


def found_bodies(bare: MachineModel, edits: Sequence[Edit]) -> DataFrame:
    """Every body that edits change: those that differ first, then by the change of mass.

    `bare`: the machine before the edits.
    """
    rigid = bare.rigid
    rows: list[tuple[Any, ...]] = []
    own = of_bodies(edits)
    for joint in dict.fromkeys(bare.carrier(edit.place[0]) for edit in own):
        k = rigid.getJointId(joint)
        here = [edit for edit in own if bare.carrier(edit.place[0]) == joint]
        body = rigid.inertias[k]
        urdf = np.array([body.mass, *body.lever])
        found, low, high = spread(body, here)
        if low[0] <= 0.0:  # of what may weigh nothing the centre may lie anywhere
            low[1:], high[1:] = -np.inf, np.inf
        slack = ROUNDING * np.maximum(np.abs(urdf), np.abs(found))
        apart = (urdf < low - slack) | (urdf > high + slack)
        numbers = np.stack([urdf, found, low, high], axis=1).ravel().tolist()
        cells = (x if np.isfinite(x) else None for x in numbers)
        rows.append((link_name(rigid, k), *cells, "+".join(_NAMES[apart])))
    rows.sort(key=lambda row: (not row[-1], -abs(row[2] - row[1])))
    return frame("bodies", rows)


def spread(
    body: pin.Inertia, edits: Sequence[Edit], *, moment: bool = False
) -> tuple[Array, Array, Array]:
    """What edits make of a body, and the ends of its 95 % intervals.

    Returns:
        Mass [kg] and centre of mass [m], or first moment [kg*m] where asked, each (4,).
    """

    def after(values: Sequence[Values]) -> Array:
        four = _after(body, values)
        return four if moment else np.array([four[0], *_centre(four[0], four[1:])])

    best = [edit.values for edit in edits]
    found, down, up = after(best), np.zeros(4), np.zeros(4)
    for n, edit in enumerate(edits):
        for p in edit.parameters:
            values = ([*best[:n], best[n] | {p.name: x}, *best[n + 1 :]] for x in p.interval)
            moved = np.array([after(each) - found for each in values])
            down, up = np.hypot(down, moved.min(axis=0)), np.hypot(up, moved.max(axis=0))
    return found, found - down, found + up


def _after(body: pin.Inertia, edits: Sequence[Values]) -> Array:
    """Mass and first moment, (4,), of a body after edits with these values."""
    mass, moment = body.mass, body.mass * body.lever
    for p in edits:
        if "mx" in p:  # of the whole body
            mass, moment = p["mass"], np.array([p[name] for name in ("mx", "my", "mz")])
        elif "mass" not in p:  # the centre of mass displaced
            moment = moment + mass * np.array([p[axis] for axis in "xyz"])
        else:  # a point mass, at the centre of mass where no place is stated
            stated = np.array([p.get(axis, 0.0) for axis in "xyz"])
            place = _centre(mass, moment) if len(p) == 1 else stated
            mass, moment = mass + p["mass"], moment + p["mass"] * place
    return np.array([mass, *moment])


def _centre(mass: float, moment: Array) -> Array:
    return moment / mass if mass > 0 else np.zeros(3)


def corrected_urdf(
    text: str, where: str, bare: MachineModel, edits: Sequence[Edit], *, merged: bool = False
) -> str:
    """The text of a URDF, read from a file `where`, with the inertial elements that were found.

    Of links that are fixed to each other a motion determines the sum: the link that the joint
    carries gets all of it, and those fixed to it have no inertial element any more.

    `bare`: the machine before the edits. `merged`: also bodies that no edit changes.
    """
    own = of_bodies(edits)
    parsed = parse_urdf(text, where, floating=bare.robot.floating)
    old, new = bare.rigid, apply_edits(bare, own).rigid
    root = parse_elements(text, where)
    elements = {element.get("name"): element for element in root.iter("link")}
    changed = dict.fromkeys(bare.carrier(edit.place[0]) for edit in own)
    for joint in [*parsed.names][1:] if merged else changed:
        k = parsed.getJointId(joint)
        ten, before, after = (
            np.asarray(m.inertias[m.getJointId(joint)].toDynamicParameters())
            for m in (parsed, old, new)
        )
        for one in parsed.frames:
            if one.parentJoint == k and one.type == pin.FrameType.BODY:
                link = elements[str(one.name)]
                for spare in link.findall("inertial"):
                    link.remove(spare)
        # A load that the robot file states is in no URDF.
        body = pin.Inertia.FromDynamicParameters(ten + (after - before))
        if body.mass <= 0.0:
            continue
        inertial = SubElement(elements[link_name(parsed, k)], "inertial")
        inertial.append(ElementTree.Comment(f" {FOUND} "))
        # Digits that read back to the same numbers.
        place = " ".join(map(repr, body.lever.tolist()))
        SubElement(inertial, "origin", xyz=place, rpy="0 0 0")
        SubElement(inertial, "mass", value=repr(float(body.mass)))
        upper = body.inertia[np.triu_indices(3)].tolist()  # in the order of the keys
        moments = dict(zip(INERTIA_KEYS, map(repr, upper), strict=True))
        SubElement(inertial, "inertia", moments)
    return urdf_text(root)


def urdf_text(root: Element) -> str:
    """A URDF's text."""
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
