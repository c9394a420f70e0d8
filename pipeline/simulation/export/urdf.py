"""A URDF whose joints have the friction found, and whose bodies are those found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final
from xml.etree import ElementTree

from pipeline.effects.model_file import Edit
from pipeline.machine.machine import MachineModel
from pipeline.simulation.export.joints import JointNumbers
from pipeline.simulation.found_bodies import corrected_urdf

#: What no URDF holds.
LEFT: Final = (
    "inertia of rotors: a URDF has no number for it; put it into the simulator's armature",
    "springs beside the drive",
    "gravity of a tilted stand",
)


def urdf(
    text: str,
    where: str,
    bare: MachineModel,
    edits: Sequence[Edit],
    numbers: Sequence[JointNumbers],
    remarks: Sequence[str],
) -> str:
    """Write what was found into the text of a URDF, that of file `where`.

    `bare`: the machine before the edits. `numbers`: of the joints with them.

    Raises:
        UrdfError: The text is no URDF.
    """
    changed = corrected_urdf(text, where, bare, edits)
    builder = ElementTree.TreeBuilder(insert_comments=True)
    root = ElementTree.fromstring(changed, ElementTree.XMLParser(target=builder))
    own = {n.joint: n for n in numbers}
    for joint in root.iter("joint"):
        found = own.get(joint.get("name", ""))
        if found is None:
            continue
        dynamics = joint.find("dynamics")
        if dynamics is None:
            dynamics = ElementTree.SubElement(joint, "dynamics")
        dynamics.set("friction", f"{found.friction:.9g}")
        dynamics.set("damping", f"{found.damping:.9g}")
    root.insert(
        0, ElementTree.Comment("\n" + "\n".join(r.replace("--", "- -") for r in remarks) + "\n")
    )
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
